//! shadow_maps: shadow maps of a scene as a game draws them: depth alone, all triangles that rays meet, a map or six for each light.

use glam::{DMat4, DVec3, Mat4, Vec3};
use vlm_bake::scene::Scene;
use wgpu::util::DeviceExt as _;
use wgpu::{
    BufferUsages, CommandEncoder, Device, Queue, RenderPipeline, Texture, TextureFormat, TextureUsages,
    TextureView,
};

use crate::{PunctualLight, ShadowMap};

/// Distance of the near plane of points and spots over the scene's extent.
const NEAR: f64 = 1e-4;

const DRAW: &str = "
@group(0) @binding(0) var<uniform> clip_from_world: mat4x4f;
@vertex
fn vertex(@location(0) position: vec3f) -> @builtin(position) vec4f {
    return clip_from_world * vec4f(position, 1.0);
}
";

/// What a light's maps show: their matrices, and whether depth is reversed.
#[derive(Clone, Copy, Debug)]
pub struct Frustum {
    /// The light's number.
    pub light: u32,
    /// To the map's clip space.
    pub clip_from_world: DMat4,
    /// What is nearer has more depth.
    pub is_reversed: bool,
}

/// A map of a light.
pub struct DrawnMap {
    /// What it shows.
    pub frustum: Frustum,
    /// `Depth32Float`.
    pub texture: Texture,
    view: TextureView,
}

impl DrawnMap {
    /// As the runtime wants it.
    #[must_use]
    pub fn shadow_map(&self, revision: u64) -> ShadowMap<'_> {
        let clip_from_world: Mat4 = self.frustum.clip_from_world.as_mat4();
        let is_reversed = self.frustum.is_reversed;
        let map = ShadowMap::new(self.frustum.light, &self.view, clip_from_world);
        ShadowMap { is_reversed, revision, ..map }
    }
}

/// The maps that a scene's lights need: one for a directional light, around the whole scene; one for a spot light; six for a point light.
/// Perspective ones have reversed depth.
#[must_use]
pub fn frusta(scene: &Scene, lights: &[PunctualLight]) -> Vec<Frustum> {
    let bounds = scene.bounds().unwrap_or([DVec3::ZERO, DVec3::ONE]);
    let of = |(number, light): (usize, &PunctualLight)| -> Vec<Frustum> {
        let frustum =
            |clip_from_world, is_reversed| Frustum { light: number as u32, clip_from_world, is_reversed };
        if light.directional {
            return vec![frustum(around(bounds, light.direction), false)];
        }
        let near = NEAR * bounds[0].distance(bounds[1]);
        let toward = |direction: Vec3, angle: f64| frustum(perspective(light, direction, angle, near), true);
        if light.cone_scale > 0.0 {
            let cosine = f64::from(-light.cone_offset / light.cone_scale).clamp(-1.0, 1.0);
            return vec![toward(light.direction, 2.0 * cosine.acos())];
        }
        let sides = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
        sides.map(|side| toward(side, std::f64::consts::FRAC_PI_2)).to_vec()
    };
    lights.iter().enumerate().flat_map(of).collect()
}

fn view_from_world(eye: DVec3, direction: Vec3) -> DMat4 {
    let back = -direction.as_dvec3();
    let up = if back.y.abs() > 0.9 { DVec3::X } else { DVec3::Y };
    let right = up.cross(back).normalize_or_zero();
    let up = back.cross(right);
    DMat4::from_cols(right.extend(0.0), up.extend(0.0), back.extend(0.0), eye.extend(1.0)).inverse()
}

/// Reversed depth that ends at infinity.
fn perspective(light: &PunctualLight, direction: Vec3, angle: f64, near: f64) -> DMat4 {
    let scale = 1.0 / (0.5 * angle).tan();
    let clip_from_view = DMat4::from_cols_array_2d(&[
        [scale, 0.0, 0.0, 0.0],
        [0.0, scale, 0.0, 0.0],
        [0.0, 0.0, 0.0, -1.0],
        [0.0, 0.0, near, 0.0],
    ]);
    clip_from_view * view_from_world(light.position.as_dvec3(), direction)
}

/// A box along `direction` that holds the bounds.
fn around([low, high]: [DVec3; 2], direction: Vec3) -> DMat4 {
    let view_from_world = view_from_world(0.5 * (low + high), direction);
    let corner = |i: u32| {
        let pick = |axis: usize| if i >> axis & 1 == 0 { low[axis] } else { high[axis] };
        view_from_world.transform_point3(DVec3::new(pick(0), pick(1), pick(2)))
    };
    let least = (0..8).map(corner).fold(DVec3::INFINITY, DVec3::min);
    let most = (0..8).map(corner).fold(DVec3::NEG_INFINITY, DVec3::max);
    // A little room, so that what lies on the border is inside.
    let half = (0.5 * 1.01 * (most - least)).max(DVec3::splat(1e-6));
    let middle = 0.5 * (least + most);
    let clip_from_view = DMat4::from_translation(DVec3::new(0.0, 0.0, 0.5))
        * DMat4::from_scale(DVec3::new(1.0 / half.x, 1.0 / half.y, -0.5 / half.z))
        * DMat4::from_translation(-middle);
    clip_from_view * view_from_world
}

/// Draws the maps of a scene.
pub struct MapRenderer {
    device: Device,
    queue: Queue,
    corners: wgpu::Buffer,
    corner_count: u32,
    pipelines: [RenderPipeline; 2],
}

impl MapRenderer {
    /// All triangles of the scene that rays meet.
    #[must_use]
    pub fn new(device: &Device, queue: &Queue, scene: &Scene) -> Self {
        let corners = corners(scene);
        let buffer = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("corners"),
            contents: bytemuck::cast_slice(&corners),
            usage: BufferUsages::VERTEX,
        });
        Self {
            device: device.clone(),
            queue: queue.clone(),
            corners: buffer,
            corner_count: corners.len() as u32,
            pipelines: [false, true].map(|is_reversed| pipeline(device, is_reversed)),
        }
    }

    /// Draws a map for each frustum, `size` texels wide and high.
    #[must_use]
    pub fn draw(&self, frusta: &[Frustum], size: u32) -> Vec<DrawnMap> {
        frusta.iter().map(|frustum| self.draw_one(*frustum, size)).collect()
    }

    fn draw_one(&self, frustum: Frustum, size: u32) -> DrawnMap {
        let texture = self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("shadow map"),
            size: wgpu::Extent3d { width: size, height: size, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: TextureFormat::Depth32Float,
            usage: TextureUsages::RENDER_ATTACHMENT
                | TextureUsages::TEXTURE_BINDING
                | TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        self.record(&mut encoder, &frustum, &view);
        self.queue.submit([encoder.finish()]);
        DrawnMap { frustum, texture, view }
    }

    fn record(&self, encoder: &mut CommandEncoder, frustum: &Frustum, view: &TextureView) {
        let clip_from_world: Mat4 = frustum.clip_from_world.as_mat4();
        let matrix = self.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("clip_from_world"),
            contents: bytemuck::bytes_of(&clip_from_world),
            usage: BufferUsages::UNIFORM,
        });
        let pipeline = &self.pipelines[usize::from(frustum.is_reversed)];
        let group = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("clip_from_world"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: matrix.as_entire_binding() }],
        });
        let farthest = if frustum.is_reversed { 0.0 } else { 1.0 };
        let depth_ops = wgpu::Operations { load: wgpu::LoadOp::Clear(farthest), store: wgpu::StoreOp::Store };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("shadow map"),
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view,
                depth_ops: Some(depth_ops),
                stencil_ops: None,
            }),
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.set_vertex_buffer(0, self.corners.slice(..));
        pass.draw(0..self.corner_count, 0..1);
    }
}

/// The corners of all triangles that rays meet.
fn corners(scene: &Scene) -> Vec<Vec3> {
    let stops_light = |primitive: u32| {
        let material = scene.primitives.get(primitive as usize).map(|p| p.material as usize);
        material.and_then(|material| scene.materials.get(material)).is_none_or(|material| material.reflects)
    };
    let solid = scene.triangles.iter().zip(&scene.triangle_primitive).filter(|(_, p)| stops_light(**p));
    solid.flat_map(|(triangle, _)| triangle.map(|i| scene.positions[i as usize])).collect()
}

fn pipeline(device: &Device, is_reversed: bool) -> RenderPipeline {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("shadow map"),
        source: wgpu::ShaderSource::Wgsl(DRAW.into()),
    });
    let attributes = wgpu::vertex_attr_array![0 => Float32x3];
    let corner = wgpu::VertexBufferLayout {
        array_stride: size_of::<Vec3>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &attributes,
    };
    let compare = if is_reversed { wgpu::CompareFunction::Greater } else { wgpu::CompareFunction::Less };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("shadow map"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[Some(corner)],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: TextureFormat::Depth32Float,
            depth_write_enabled: Some(true),
            depth_compare: Some(compare),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: None,
        multiview_mask: None,
        cache: None,
    })
}
