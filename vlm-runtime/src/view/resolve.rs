//! resolve: light to the shown picture.

use glam::Vec2;
use wgpu::{
    BindGroupLayout, Buffer, BufferUsages, CommandEncoder, RenderPipeline, ShaderStages, TextureFormat,
};

use super::bindings::{
    READ, TEXELS, UNIFORM, attachment, filled, group, layout, pipeline_layout, target, view,
};
use super::controls::Controls;
use super::error::ViewError;
use super::gpu::Gpu;
use super::shaders::{Sources, guarded};
use super::targets::FrameTargets;

/// As `Settings` in the shader. 32 bytes.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct Packed {
    pub(super) origin: Vec2,
    pub(super) exposure: f32,
    pub(super) shows_difference: u32,
    pub(super) shares: Vec2,
    pub(super) gain: f32,
    pub(super) padding: f32,
}

/// Where the picture is shown: a texture, and the pixel of it where the picture begins.
#[derive(Clone, Copy, Debug)]
pub struct Screen<'a> {
    /// Drawn to; of the viewer's format.
    pub view: &'a wgpu::TextureView,
    /// Pixels from the left and the top.
    pub origin: [u32; 2],
}

/// The pass that shows light.
pub(crate) struct ResolveStage {
    layout: BindGroupLayout,
    settings: Buffer,
    format: TextureFormat,
    pipeline: RenderPipeline,
}

impl ResolveStage {
    pub(crate) fn new(gpu: &Gpu, sources: &Sources, format: TextureFormat) -> Result<Self, ViewError> {
        let bindings = [UNIFORM, TEXELS, TEXELS, READ, TEXELS, TEXELS];
        let layout = layout(gpu, "resolve", ShaderStages::FRAGMENT, &bindings);
        let settings = filled(gpu, "resolve", &[[0_u8; size_of::<Packed>()]], BufferUsages::UNIFORM)?;
        Ok(Self { pipeline: compile(gpu, sources, &layout, format)?, layout, settings, format })
    }

    /// Compiles the shader anew; where that fails, the last one stays.
    pub(crate) fn recompile(&mut self, gpu: &Gpu, sources: &Sources) -> Result<(), ViewError> {
        self.pipeline = compile(gpu, sources, &self.layout, self.format)?;
        Ok(())
    }

    pub(crate) fn record(
        &self,
        gpu: &Gpu,
        encoder: &mut CommandEncoder,
        targets: &FrameTargets,
        (screen, controls): (Screen<'_>, &Controls),
    ) {
        let packed = Packed {
            origin: Vec2::from(screen.origin.map(|pixel| pixel as f32)),
            exposure: controls.exposure,
            shows_difference: u32::from(controls.compared.is_some()),
            shares: Vec2::new(controls.direct_share, controls.indirect_share),
            gain: controls.difference_gain,
            padding: 0.0,
        };
        gpu.queue.write_buffer(&self.settings, 0, bytemuck::bytes_of(&packed));
        let resources = vec![
            self.settings.as_entire_binding(),
            view(&targets.albedo.view),
            view(&targets.emission.view),
            targets.direct.as_entire_binding(),
            view(&targets.indirect[0].view),
            view(&targets.indirect[1].view),
        ];
        let group = group(gpu, "resolve", &self.layout, resources);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("resolve"),
            color_attachments: &[attachment(screen.view, Some(wgpu::Color::BLACK))],
            ..wgpu::RenderPassDescriptor::default()
        });
        restrict(&mut pass, screen, targets);
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
    }
}

/// Draws only where the picture is.
pub(crate) fn restrict(pass: &mut wgpu::RenderPass<'_>, screen: Screen<'_>, targets: &FrameTargets) {
    let ([x, y], [width, height]) = (screen.origin, targets.size);
    pass.set_viewport(x as f32, y as f32, width as f32, height as f32, 0.0, 1.0);
    pass.set_scissor_rect(x, y, width, height);
}

fn compile(
    gpu: &Gpu,
    sources: &Sources,
    layout: &BindGroupLayout,
    format: TextureFormat,
) -> Result<RenderPipeline, ViewError> {
    let module = sources.module(gpu, "resolve.wgsl", &[])?;
    guarded(gpu, "resolve.wgsl", || {
        gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("resolve"),
            layout: Some(&pipeline_layout(gpu, "resolve", &[layout])),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vertex"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("fragment"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[target(format, false)],
            }),
            multiview_mask: None,
            cache: None,
        })
    })
}
