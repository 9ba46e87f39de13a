//! pixel_light: direct light of every pixel, by shadow rays on the device.

use vlm_shaders::cpu::direct::PackedLight;
use wgpu::{BindGroupLayout, Buffer, BufferUsages, CommandEncoder, ComputePipeline, ShaderStages};

use super::bindings::{READ, TEXELS, WRITE, filled, group, layout, pipeline_layout, view, zeros};
use super::error::ViewError;
use super::eye::Eye;
use super::gpu::Gpu;
use super::scene_buffers::SceneBuffers;
use super::shaders::{PIXEL_LIGHT_SHARED, Sources, guarded};
use super::targets::FrameTargets;
use crate::upload::check_real_lights;
use crate::{MOST_REAL_LIGHTS, PunctualLight, View};

/// Lights of a dispatch: software devices stop after 65,535 rounds of all loops of an invocation.
const LIGHTS_TOGETHER: usize = 16;

/// Pixels of a workgroup along x and y, as in the shader.
const TILE: u32 = 8;

/// As `Settings` in the shader. 96 bytes.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct Packed {
    pub(super) view: View,
    pub(super) first_light: u32,
    pub(super) end_light: u32,
    pub(super) leave_distance: f32,
    pub(super) node_count: u32,
}

/// The pass over all pixels.
pub(crate) struct PixelLightStage {
    layout: BindGroupLayout,
    lights: Buffer,
    pipeline: ComputePipeline,
}

impl PixelLightStage {
    pub(crate) fn new(gpu: &Gpu, sources: &Sources) -> Result<Self, ViewError> {
        let bindings = [READ, READ, READ, READ, TEXELS, TEXELS, TEXELS, WRITE];
        let layout = layout(gpu, "pixel light", ShaderStages::COMPUTE, &bindings);
        let size = u64::from(MOST_REAL_LIGHTS) * size_of::<PackedLight>() as u64;
        let lights = zeros(gpu, "lights", size, BufferUsages::STORAGE | BufferUsages::COPY_DST)?;
        Ok(Self { pipeline: compile(gpu, sources, &layout)?, layout, lights })
    }

    /// Compiles the shader anew; where that fails, the last one stays.
    pub(crate) fn recompile(&mut self, gpu: &Gpu, sources: &Sources) -> Result<(), ViewError> {
        self.pipeline = compile(gpu, sources, &self.layout)?;
        Ok(())
    }

    pub(crate) fn record(
        &self,
        gpu: &Gpu,
        encoder: &mut CommandEncoder,
        (scene, targets): (&SceneBuffers, &FrameTargets),
        (eye, lights): (&Eye, &[PunctualLight]),
    ) -> Result<(), ViewError> {
        check_real_lights(lights.len())?;
        if lights.is_empty() {
            encoder.clear_buffer(&targets.direct, 0, None);
            return Ok(());
        }
        let packed: Vec<PackedLight> = lights.iter().map(PackedLight::from).collect();
        gpu.queue.write_buffer(&self.lights, 0, bytemuck::cast_slice(&packed));
        for first in (0..lights.len()).step_by(LIGHTS_TOGETHER) {
            let settings = Packed {
                view: eye.view(),
                first_light: first as u32,
                end_light: (first + LIGHTS_TOGETHER).min(lights.len()) as u32,
                leave_distance: scene.leave_distance,
                node_count: scene.node_count,
            };
            let settings = filled(gpu, "pixel light", &[settings], BufferUsages::STORAGE)?;
            let resources = vec![
                settings.as_entire_binding(),
                self.lights.as_entire_binding(),
                scene.nodes.as_entire_binding(),
                scene.corners.as_entire_binding(),
                view(&targets.depth.view),
                view(&targets.normal.view),
                view(&targets.geometric_normal.view),
                targets.direct.as_entire_binding(),
            ];
            let group = group(gpu, "pixel light", &self.layout, resources);
            let descriptor =
                wgpu::ComputePassDescriptor { label: Some("pixel light"), timestamp_writes: None };
            let mut pass = encoder.begin_compute_pass(&descriptor);
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &group, &[]);
            let [width, height] = targets.size.map(|side| side.div_ceil(TILE));
            pass.dispatch_workgroups(width, height, 1);
        }
        Ok(())
    }
}

fn compile(gpu: &Gpu, sources: &Sources, layout: &BindGroupLayout) -> Result<ComputePipeline, ViewError> {
    let module = sources.module(gpu, "pixel_light.wgsl", &PIXEL_LIGHT_SHARED)?;
    guarded(gpu, "pixel_light.wgsl", || {
        gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("pixel light"),
            layout: Some(&pipeline_layout(gpu, "pixel light", &[layout])),
            module: &module,
            entry_point: Some("pixel_light"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        })
    })
}
