//! surface: the G-buffer: depth, normals, albedo, emission and tag of every pixel.

use glam::{Mat4, Vec3};
use wgpu::{
    BindGroupLayout, Buffer, BufferUsages, Color, CommandEncoder, RenderPipeline, ShaderModule, ShaderStages,
};

use super::bindings::{
    READ, SAMPLED, SAMPLER, UNIFORM, attachment, filled, group, layout, pipeline_layout, target,
};
use super::error::ViewError;
use super::eye::Eye;
use super::gpu::Gpu;
use super::scene_buffers::SceneBuffers;
use super::shaders::{Sources, guarded};
use super::targets::{ALBEDO, DEPTH, FLOATS, FrameTargets, TAG};

/// As `Camera` in the shader. 96 bytes.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct Packed {
    pub(super) clip_from_world: Mat4,
    pub(super) eye: Vec3,
    pub(super) cuts_holes: u32,
    pub(super) forward: Vec3,
    pub(super) is_perspective: u32,
}

/// The passes that draw the visible surface.
pub(crate) struct SurfaceStage {
    scene_layout: BindGroupLayout,
    pub material_layout: BindGroupLayout,
    camera: Buffer,
    pipelines: Pipelines,
}

/// One-sided, then two-sided.
struct Pipelines {
    normals: [RenderPipeline; 2],
    materials: [RenderPipeline; 2],
}

impl SurfaceStage {
    pub(crate) fn new(gpu: &Gpu, sources: &Sources) -> Result<Self, ViewError> {
        let both = ShaderStages::VERTEX_FRAGMENT;
        let scene_layout = layout(gpu, "scene", both, &[UNIFORM, READ, READ]);
        let bindings = [UNIFORM, SAMPLED, SAMPLER, SAMPLED, SAMPLER];
        let material_layout = layout(gpu, "material", ShaderStages::FRAGMENT, &bindings);
        let camera = filled(gpu, "camera", &[[0_u8; size_of::<Packed>()]], BufferUsages::UNIFORM)?;
        let pipelines = Pipelines::new(gpu, sources, &[&scene_layout, &material_layout])?;
        Ok(Self { scene_layout, material_layout, camera, pipelines })
    }

    /// Compiles the shaders anew; where that fails, the last ones stay.
    pub(crate) fn recompile(&mut self, gpu: &Gpu, sources: &Sources) -> Result<(), ViewError> {
        self.pipelines = Pipelines::new(gpu, sources, &[&self.scene_layout, &self.material_layout])?;
        Ok(())
    }

    pub(crate) fn record(
        &self,
        gpu: &Gpu,
        encoder: &mut CommandEncoder,
        scene: &SceneBuffers,
        targets: &FrameTargets,
        (eye, cuts_holes): (&Eye, bool),
    ) {
        let packed = Packed {
            clip_from_world: eye.clip_from_world.as_mat4(),
            eye: eye.position,
            cuts_holes: u32::from(cuts_holes),
            forward: eye.forward,
            is_perspective: u32::from(eye.is_perspective),
        };
        gpu.queue.write_buffer(&self.camera, 0, bytemuck::bytes_of(&packed));
        let normals = [&targets.normal, &targets.geometric_normal]
            .map(|plane| attachment(&plane.view, Some(Color::TRANSPARENT)));
        let materials = [&targets.albedo, &targets.emission, &targets.tag]
            .map(|plane| attachment(&plane.view, Some(Color::TRANSPARENT)));
        self.draw(gpu, encoder, scene, targets, ("normals", &normals, &self.pipelines.normals));
        // Depth is found again in the same way, so that both passes agree about which of coincident surfaces shows.
        self.draw(gpu, encoder, scene, targets, ("materials", &materials, &self.pipelines.materials));
    }

    fn draw(
        &self,
        gpu: &Gpu,
        encoder: &mut CommandEncoder,
        scene: &SceneBuffers,
        targets: &FrameTargets,
        (label, attachments, pipelines): (
            &str,
            &[Option<wgpu::RenderPassColorAttachment<'_>>],
            &[RenderPipeline; 2],
        ),
    ) {
        let buffers = [&self.camera, &scene.vertices, &scene.triangles];
        let resources = buffers.map(Buffer::as_entire_binding).to_vec();
        let scene_group = group(gpu, "scene", &self.scene_layout, resources);
        let depth_ops = wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(label),
            color_attachments: attachments,
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &targets.depth.view,
                depth_ops: Some(depth_ops),
                stencil_ops: None,
            }),
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_bind_group(0, &scene_group, &[]);
        for draw in &scene.draws {
            let Some(material) = scene.materials.get(draw.material) else { continue };
            pass.set_pipeline(&pipelines[usize::from(draw.is_two_sided)]);
            pass.set_bind_group(1, material, &[]);
            pass.draw(draw.corners.clone(), 0..1);
        }
    }
}

impl Pipelines {
    fn new(gpu: &Gpu, sources: &Sources, groups: &[&BindGroupLayout]) -> Result<Self, ViewError> {
        let module = sources.module(gpu, "surface.wgsl", &[])?;
        let normals = [FLOATS, FLOATS].map(|format| target(format, false));
        let materials = [ALBEDO, FLOATS, TAG].map(|format| target(format, false));
        let make = |entry, targets: &[_]| {
            [Some(wgpu::Face::Back), None].map(|cull| pipeline(gpu, &module, groups, (entry, targets, cull)))
        };
        guarded(gpu, "surface.wgsl", || Self {
            normals: make("normals", &normals),
            materials: make("materials", &materials),
        })
    }
}

fn pipeline(
    gpu: &Gpu,
    module: &ShaderModule,
    groups: &[&BindGroupLayout],
    (entry_point, targets, cull_mode): (&str, &[Option<wgpu::ColorTargetState>], Option<wgpu::Face>),
) -> RenderPipeline {
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(entry_point),
        layout: Some(&pipeline_layout(gpu, entry_point, groups)),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some("vertex"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState { cull_mode, ..wgpu::PrimitiveState::default() },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(entry_point),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}
