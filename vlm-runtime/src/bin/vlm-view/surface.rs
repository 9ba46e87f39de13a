//! The window's surface, and the panel painted onto it.

use std::sync::Arc;

use egui_wgpu::{Renderer, RendererOptions, ScreenDescriptor};
use vlm_runtime::view::{Gpu, ViewError};
use wgpu::{CurrentSurfaceTexture, Instance, SurfaceConfiguration, TextureFormat};
use winit::event_loop::OwnedDisplayHandle;
use winit::window::Window;

/// A surface that pictures are shown on.
pub struct WindowSurface {
    pub gpu: Gpu,
    surface: wgpu::Surface<'static>,
    configuration: SurfaceConfiguration,
    painter: Renderer,
}

impl WindowSurface {
    /// The surface of a window, and a device that draws to it.
    pub fn new(window: &Arc<Window>, display: OwnedDisplayHandle) -> Result<Self, ViewError> {
        let failed = |error: &dyn std::fmt::Display| ViewError::Window(error.to_string());
        let instance = Instance::new(wgpu::InstanceDescriptor::new_with_display_handle(Box::new(display)));
        let surface = instance.create_surface(window.clone()).map_err(|error| failed(&error))?;
        let (gpu, adapter) = Gpu::for_surface(&instance, &surface)?;
        let size = window.inner_size();
        let mut configuration = surface
            .get_default_config(&adapter, size.width.max(1), size.height.max(1))
            .ok_or_else(|| failed(&"the adapter cannot draw to it"))?;
        // The viewer and the panel encode sRGB themselves.
        let formats = surface.get_capabilities(&adapter).formats;
        let plain = [TextureFormat::Bgra8Unorm, TextureFormat::Rgba8Unorm];
        let format = plain.into_iter().find(|format| formats.contains(format));
        configuration.format = format.ok_or_else(|| failed(&"it has no format of four plain bytes"))?;
        surface.configure(&gpu.device, &configuration);
        let painter = Renderer::new(&gpu.device, configuration.format, RendererOptions::default());
        Ok(Self { gpu, surface, configuration, painter })
    }

    /// What is drawn to.
    pub fn format(&self) -> TextureFormat {
        self.configuration.format
    }

    /// Pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.configuration.width, self.configuration.height]
    }

    /// Follows the window's size.
    pub fn resize(&mut self, width: u32, height: u32) {
        if width > 0 && height > 0 && self.size() != [width, height] {
            (self.configuration.width, self.configuration.height) = (width, height);
            self.surface.configure(&self.gpu.device, &self.configuration);
        }
    }

    /// The next picture to draw; `None` if there is none just now.
    pub fn next(&self) -> Option<wgpu::SurfaceTexture> {
        match self.surface.get_current_texture() {
            CurrentSurfaceTexture::Success(texture) | CurrentSurfaceTexture::Suboptimal(texture) => {
                Some(texture)
            }
            CurrentSurfaceTexture::Outdated | CurrentSurfaceTexture::Lost => {
                self.surface.configure(&self.gpu.device, &self.configuration);
                None
            }
            _ => None,
        }
    }

    /// Takes over the panel's textures; those to be freed once it is painted. To be called even where it is not.
    pub fn take_textures(&mut self, output: &mut egui::FullOutput) -> Vec<egui::TextureId> {
        let Gpu { device, queue, .. } = &self.gpu;
        let textures = std::mem::take(&mut output.textures_delta.set);
        for (id, deltas) in &textures {
            deltas.iter().for_each(|delta| self.painter.update_texture(device, queue, *id, delta));
        }
        std::mem::take(&mut output.textures_delta.free).into_iter().collect()
    }

    /// Frees textures of the panel.
    pub fn free_textures(&mut self, textures: &[egui::TextureId]) {
        textures.iter().for_each(|id| self.painter.free_texture(id));
    }

    /// Paints the panel over the picture; `clears` where there is none.
    pub fn paint(
        &mut self,
        view: &wgpu::TextureView,
        (context, output): (&egui::Context, egui::FullOutput),
        clears: bool,
    ) {
        let Gpu { device, queue, .. } = &self.gpu;
        let pixels_per_point = output.pixels_per_point;
        let screen = ScreenDescriptor { size_in_pixels: self.size(), pixels_per_point };
        let triangles = context.tessellate(output.shapes, pixels_per_point);
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let own = self.painter.update_buffers(device, queue, &mut encoder, &triangles, &screen);
        let load = if clears { wgpu::LoadOp::Clear(wgpu::Color::BLACK) } else { wgpu::LoadOp::Load };
        let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("panel"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
            })],
            ..wgpu::RenderPassDescriptor::default()
        });
        self.painter.render(&mut pass.forget_lifetime(), &triangles, &screen);
        queue.submit(own.into_iter().chain([encoder.finish()]));
    }
}
