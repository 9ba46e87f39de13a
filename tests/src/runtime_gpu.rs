//! A host for `vlm-runtime` without a window: a G-buffer traced on the processor, shadows by its rays, and the picture read back.

use glam::{DMat4, DVec3, Vec3, Vec4};
use vlm_bake::gbuffer::GBuffer;
use vlm_bake::scene::Camera;
use vlm_bake::shade::{SurfacePoint, TraceScene};
use vlm_runtime::view::Eye;
use vlm_runtime::{
    Error, Frame, FrameStats, Point, Settings, Targets, View, VlmAsset, VlmRenderer, request_device_with,
};
use wgpu::{Device, Queue, Texture, TextureFormat, TextureUsages, TextureView};

/// A device with an asset loaded.
pub struct Host {
    /// The device.
    pub device: Device,
    /// Its queue.
    pub queue: Queue,
    /// The renderer.
    pub renderer: VlmRenderer,
    format: TextureFormat,
}

/// A G-buffer on the device.
pub struct Pictures {
    depth: TextureView,
    normal: TextureView,
    geometric_normal: TextureView,
    tag: TextureView,
    /// Not 0 where the surface moves; none by default.
    pub moving: Option<TextureView>,
    /// What the deferred gather writes.
    pub irradiance: Texture,
}

impl Host {
    /// The first Vulkan adapter, with timestamps where it has them.
    ///
    /// # Errors
    /// Where there is none, or the asset does not fit it.
    pub fn new(asset: &VlmAsset, settings: Settings) -> Result<Self, Error> {
        let (device, queue) = request_device_with(wgpu::Backends::VULKAN, wgpu::Features::TIMESTAMP_QUERY)?;
        let mut renderer = VlmRenderer::new(&device, settings)?;
        renderer.load(asset)?;
        Ok(Self { device, queue, renderer, format: settings.format.texture_format() })
    }

    /// Puts a G-buffer on the device; tags by scene triangle.
    #[must_use]
    pub fn upload(&self, gbuffer: &GBuffer, camera: &Camera, tag_of: impl Fn(u32) -> u32) -> Pictures {
        let clip_from_world = eye(camera, gbuffer).clip_from_world;
        let size = [gbuffer.width, gbuffer.height];
        let of = |value: &dyn Fn(&SurfacePoint) -> Vec4| -> Vec<Vec4> {
            gbuffer.points.iter().map(|point| point.as_ref().map_or(Vec4::ZERO, value)).collect()
        };
        let depth: Vec<f32> = of(&|p| Vec4::splat(depth(clip_from_world, p))).iter().map(|v| v.x).collect();
        let tag = |point: &Option<SurfacePoint>| point.as_ref().map_or(0, |point| tag_of(point.triangle));
        let tags: Vec<u32> = gbuffer.points.iter().map(tag).collect();
        let normal = of(&|p| p.normal.extend(0.0));
        let geometric_normal = of(&|p| p.geometric_normal.extend(0.0));
        Pictures {
            depth: self.texture(size, TextureFormat::R32Float, bytemuck::cast_slice(&depth)),
            normal: self.texture(size, TextureFormat::Rgba32Float, bytemuck::cast_slice(&normal)),
            geometric_normal: self.texture(
                size,
                TextureFormat::Rgba32Float,
                bytemuck::cast_slice(&geometric_normal),
            ),
            tag: self.texture(size, TextureFormat::R32Uint, bytemuck::cast_slice(&tags)),
            moving: None,
            irradiance: self.target(size, self.format),
        }
    }

    /// A texture that shaders read.
    #[must_use]
    pub fn texture(&self, size: [u32; 2], format: TextureFormat, contents: &[u8]) -> TextureView {
        let texture =
            create(&self.device, size, format, TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST);
        let rows = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(contents.len() as u32 / size[1]),
            rows_per_image: None,
        };
        self.queue.write_texture(texture.as_image_copy(), contents, rows, texture.size());
        texture.create_view(&wgpu::TextureViewDescriptor::default())
    }

    /// A texture that shaders write.
    #[must_use]
    pub fn target(&self, size: [u32; 2], format: TextureFormat) -> Texture {
        create(&self.device, size, format, TextureUsages::STORAGE_BINDING | TextureUsages::COPY_SRC)
    }

    /// One frame by the deferred gather: irradiance of every pixel, lx, and what it took.
    ///
    /// # Errors
    /// Those of the renderer.
    pub fn frame(&mut self, frame: &Frame, pictures: &Pictures) -> Result<(Vec<Vec3>, FrameStats), Error> {
        let mut stats = self.draw(frame, pictures)?;
        stats.pairs_evaluated = self.renderer.pairs_evaluated(&self.queue).ok();
        let exposed = self.read(&pictures.irradiance)?;
        Ok((exposed.iter().map(|e| *e / frame.view.exposure).collect(), stats))
    }

    /// Submits one frame by the deferred gather, and waits for nothing.
    ///
    /// # Errors
    /// Those of the renderer.
    pub fn draw(&mut self, frame: &Frame, pictures: &Pictures) -> Result<FrameStats, Error> {
        self.renderer.prepare(&self.queue, frame)?;
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let irradiance = pictures.irradiance.create_view(&wgpu::TextureViewDescriptor::default());
        let stats = self.renderer.record(&mut encoder, &pictures.targets(&irradiance))?;
        self.queue.submit([encoder.finish()]);
        Ok(stats)
    }

    /// Waits until all that was submitted is done.
    ///
    /// # Errors
    /// If the device is lost.
    pub fn wait(&self) -> Result<(), Error> {
        let wait = wgpu::PollType::Wait { submission_index: None, timeout: None };
        self.device.poll(wait).map(|_| ()).map_err(|error| Error::Device(error.to_string()))
    }

    /// What a texture of four halves or floats a pixel holds.
    ///
    /// # Errors
    /// If the device is lost.
    pub fn read(&self, texture: &Texture) -> Result<Vec<Vec3>, Error> {
        let failed = |error: &dyn std::fmt::Display| Error::Device(error.to_string());
        let (width, height) = (texture.width(), texture.height());
        let pixel = texture.format().block_copy_size(None).unwrap_or(8);
        let row = (pixel * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let back = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("picture"),
            size: u64::from(row) * u64::from(height),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
        let to = wgpu::TexelCopyBufferInfo { buffer: &back, layout };
        encoder.copy_texture_to_buffer(texture.as_image_copy(), to, texture.size());
        self.queue.submit([encoder.finish()]);
        back.map_async(wgpu::MapMode::Read, .., |_| {});
        let wait = wgpu::PollType::Wait { submission_index: None, timeout: None };
        self.device.poll(wait).map_err(|error| failed(&error))?;
        let mapped = back.get_mapped_range(..).map_err(|error| failed(&error))?;
        let numbers: Vec<f32> = if pixel == 8 {
            mapped.chunks_exact(2).map(|b| half::f16::from_le_bytes([b[0], b[1]]).to_f32()).collect()
        } else {
            bytemuck::pod_collect_to_vec(&mapped)
        };
        let rows = numbers.chunks_exact((4 * row / pixel) as usize);
        let pixels = rows.flat_map(|row| row[..4 * width as usize].chunks_exact(4));
        Ok(pixels.map(|p| Vec3::new(p[0], p[1], p[2])).collect())
    }
}

impl Pictures {
    /// What the deferred gather reads, with `irradiance` to write.
    #[must_use]
    pub fn targets<'a>(&'a self, irradiance: &'a TextureView) -> Targets<'a> {
        Targets {
            depth: &self.depth,
            normal: &self.normal,
            geometric_normal: Some(&self.geometric_normal),
            tag: Some(&self.tag),
            moving: self.moving.as_ref(),
            irradiance,
        }
    }
}

fn create(
    device: &Device,
    [width, height]: [u32; 2],
    format: TextureFormat,
    usage: TextureUsages,
) -> Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}

/// The viewer's camera, for what the picture shows.
fn eye(camera: &Camera, gbuffer: &GBuffer) -> Eye {
    let shown = || gbuffer.points.iter().flatten().map(|point| point.position.as_dvec3());
    let bounds = [shown().reduce(DVec3::min), shown().reduce(DVec3::max)].map(Option::unwrap_or_default);
    Eye::new(camera, [gbuffer.width, gbuffer.height], bounds)
}

fn depth(clip_from_world: DMat4, point: &SurfacePoint) -> f32 {
    let clip = clip_from_world * point.position.as_dvec3().extend(1.0);
    (clip.z / clip.w) as f32
}

/// The camera as the runtime wants it.
#[must_use]
pub fn view(camera: &Camera, gbuffer: &GBuffer, exposure: f32) -> View {
    View { exposure, ..eye(camera, gbuffer).view() }
}

/// Which of the scene's lights each point sees, by rays: 0 or 1.
#[must_use]
pub fn visibility(trace: &TraceScene<'_>, points: &[Point]) -> Vec<f32> {
    vlm_runtime::view::visibility(trace, trace.lights(), points)
}
