//! What a game has already: triangles, a camera, lights, a device, and a way to show a picture.

use std::error::Error;
use std::path::Path;

use glam::{DMat4, Mat4, Vec3};
use gltf::khr_lights_punctual::Kind;
use vlm_format::GltfFile;
use vlm_runtime::{PunctualLight, VlmAsset};
use vlm_shaders::cpu::resolve::{auto_exposure, encode_srgb, tone_map};
use wgpu::util::DeviceExt as _;
use wgpu::{BufferUsages, Device, Queue, Texture, TextureFormat, TextureUsages};

/// Pixels along x and y.
pub const SIZE: u32 = 512;

/// What is shown.
pub struct Game {
    pub device: Device,
    pub queue: Queue,
    pub asset: VlmAsset,
    /// Position and normal of each corner, world space.
    pub corners: Vec<[Vec3; 2]>,
    pub clip_from_world: Mat4,
    pub lights: Vec<PunctualLight>,
}

impl Game {
    /// The scene of a baked file by its first camera.
    pub fn open(path: &Path) -> Result<Self, Box<dyn Error>> {
        let (device, queue) = vlm_runtime::request_device(wgpu::Backends::all())?;
        let file = GltfFile::open(path)?;
        let asset = VlmAsset::from_file(&file)?;
        let world_from_nodes = file.world_from_nodes();
        let (mut corners, mut lights, mut camera) = (Vec::new(), Vec::new(), None);
        for node in file.document().nodes() {
            let world_from_node = world_from_nodes[node.index()];
            if let Some(mesh) = node.mesh() {
                for primitive in mesh.primitives() {
                    corners.extend(triangles(&file, &primitive, world_from_node)?);
                }
            }
            lights.extend(node.light().map(|light| punctual(&light, world_from_node)));
            camera = camera.or_else(|| node.camera().map(|camera| clip_from_world(&camera, world_from_node)));
        }
        let clip_from_world = camera.ok_or("the file has no camera")?;
        Ok(Self { device, queue, asset, corners, clip_from_world, lights })
    }

    /// A picture that passes draw into and shaders read.
    pub fn texture(&self, format: TextureFormat, usage: TextureUsages) -> Texture {
        self.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: SIZE, height: SIZE, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage,
            view_formats: &[],
        })
    }

    /// Adds a pass that draws all triangles by `pipeline` into `color`; groups are bound from 0 on.
    pub fn draw(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        pipeline: &wgpu::RenderPipeline,
        [color, depth]: [&wgpu::TextureView; 2],
        groups: &[&wgpu::BindGroup],
    ) {
        let (label, usage) = (Some("corners"), BufferUsages::VERTEX);
        let contents = bytemuck::cast_slice(&self.corners);
        let corners =
            self.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label, contents, usage });
        let ops = wgpu::Operations {
            load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
            store: wgpu::StoreOp::Store,
        };
        let attachment =
            wgpu::RenderPassColorAttachment { view: color, depth_slice: None, resolve_target: None, ops };
        let depth_ops = wgpu::Operations { load: wgpu::LoadOp::Clear(1.0), store: wgpu::StoreOp::Store };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("draw"),
            color_attachments: &[Some(attachment)],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: depth,
                depth_ops: Some(depth_ops),
                stencil_ops: None,
            }),
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(pipeline);
        (0..).zip(groups).for_each(|(number, group)| pass.set_bind_group(number, *group, &[]));
        pass.set_vertex_buffer(0, corners.slice(..));
        pass.draw(0..self.corners.len() as u32, 0..1);
    }

    /// The camera as bind group 0 of the drawing shaders, with its layout.
    pub fn camera(&self) -> (wgpu::BindGroupLayout, wgpu::BindGroup) {
        let layout = self.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("camera"),
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: wgpu::ShaderStages::VERTEX,
                ty: wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Uniform,
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            }],
        });
        let (label, usage) = (Some("camera"), BufferUsages::UNIFORM);
        let contents = bytemuck::bytes_of(&self.clip_from_world);
        let buffer =
            self.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label, contents, usage });
        let entries = [wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }];
        let group = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label,
            layout: &layout,
            entries: &entries,
        });
        (layout, group)
    }

    /// A pipeline that draws the corners with the entry points `vertex` and `fragment`.
    pub fn pipeline(&self, source: &str, groups: &[Option<&wgpu::BindGroupLayout>]) -> wgpu::RenderPipeline {
        let module = self.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("draw"),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        });
        let layout = self.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("draw"),
            bind_group_layouts: groups,
            immediate_size: 0,
        });
        let attributes = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3];
        let corner = wgpu::VertexBufferLayout {
            array_stride: size_of::<[Vec3; 2]>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &attributes,
        };
        self.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("draw"),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vertex"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[Some(corner)],
            },
            primitive: wgpu::PrimitiveState {
                cull_mode: Some(wgpu::Face::Back),
                ..wgpu::PrimitiveState::default()
            },
            depth_stencil: Some(wgpu::DepthStencilState {
                format: TextureFormat::Depth32Float,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Less),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("fragment"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(TextureFormat::Rgba16Float.into())],
            }),
            multiview_mask: None,
            cache: None,
        })
    }

    /// Shows a picture of halves: writes it as PNG, exposed and tone mapped.
    pub fn save(&self, picture: &Texture, path: &Path) -> Result<(), Box<dyn Error>> {
        let row = 8 * SIZE;
        let back = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("picture"),
            size: u64::from(row * SIZE),
            usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
        let to = wgpu::TexelCopyBufferInfo { buffer: &back, layout };
        encoder.copy_texture_to_buffer(picture.as_image_copy(), to, picture.size());
        self.queue.submit([encoder.finish()]);
        back.map_async(wgpu::MapMode::Read, .., |_| {});
        self.device.poll(wgpu::PollType::Wait { submission_index: None, timeout: None })?;
        let mapped = back.get_mapped_range(..)?;
        let halves: Vec<f32> =
            mapped.chunks_exact(2).map(|b| half::f16::from_le_bytes([b[0], b[1]]).to_f32()).collect();
        let pixels: Vec<Vec3> = halves.chunks_exact(4).map(|p| Vec3::new(p[0], p[1], p[2])).collect();
        let exposure = auto_exposure(&pixels);
        let bytes = pixels.iter().flat_map(|p| encode_srgb(tone_map(*p * exposure))).collect();
        image::RgbImage::from_raw(SIZE, SIZE, bytes).ok_or("a picture of another size")?.save(path)?;
        Ok(())
    }
}

/// The vertex shader of both examples.
pub const VERTEX: &str = "
struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
}
@group(0) @binding(0) var<uniform> clip_from_world: mat4x4f;
@vertex
fn vertex(@location(0) position: vec3f, @location(1) normal: vec3f) -> Corner {
    return Corner(clip_from_world * vec4f(position, 1.0), position, normal);
}
";

/// Flat triangles in world space.
fn triangles(
    file: &GltfFile,
    primitive: &gltf::Primitive<'_>,
    world_from_node: DMat4,
) -> Result<Vec<[Vec3; 2]>, Box<dyn Error>> {
    let positions = primitive.get(&gltf::Semantic::Positions).ok_or("a primitive without positions")?;
    let positions = file.read_vec3(positions.index())?;
    let indices = match primitive.indices() {
        Some(indices) => file.read_u32(indices.index())?,
        None => (0..positions.len() as u32).collect(),
    };
    let world = |i: u32| {
        let position = positions.get(i as usize).copied().unwrap_or_default();
        world_from_node.transform_point3(position.as_dvec3()).as_vec3()
    };
    let of_triangle = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(world);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        [a, b, c].map(|position| [position, normal])
    };
    Ok(indices.as_chunks().0.iter().flat_map(of_triangle).collect())
}

fn punctual(light: &gltf::khr_lights_punctual::Light<'_>, world_from_node: DMat4) -> PunctualLight {
    let position = world_from_node.w_axis.truncate().as_vec3();
    let direction = -world_from_node.z_axis.truncate().normalize_or_zero().as_vec3();
    let intensity = Vec3::from(light.color()) * light.intensity();
    let range = light.range().unwrap_or(f32::INFINITY);
    let point = PunctualLight { direction, range, ..PunctualLight::point(position, intensity) };
    match light.kind() {
        Kind::Point => point,
        Kind::Directional => PunctualLight::directional(direction, intensity),
        Kind::Spot { inner_cone_angle, outer_cone_angle } => {
            point.with_cone(inner_cone_angle.cos(), outer_cone_angle.cos())
        }
    }
}

/// Perspective with depth 0 to 1 between 0.05 m and infinity.
fn clip_from_world(camera: &gltf::Camera<'_>, world_from_view: DMat4) -> Mat4 {
    let angle = match camera.projection() {
        gltf::camera::Projection::Perspective(perspective) => f64::from(perspective.yfov()),
        gltf::camera::Projection::Orthographic(_) => 1.0,
    };
    let up = 1.0 / (0.5 * angle).tan();
    let clip_from_view = DMat4::from_cols_array_2d(&[
        [up, 0.0, 0.0, 0.0],
        [0.0, up, 0.0, 0.0],
        [0.0, 0.0, -1.0, -1.0],
        [0.0, 0.0, -0.05, 0.0],
    ]);
    (clip_from_view * world_from_view.inverse()).as_mat4()
}
