//! overlay: the virtual lights, the grid's cells and the tags, over the picture.

use std::f32::consts::PI;

use glam::{DMat4, Mat4, Vec2, Vec3, Vec4};
use vlm_bake::clearance::required_clearance;
use vlm_format::Grid;
use vlm_shaders::cpu::resolve::{encode_srgb, tone_map};
use vlm_shaders::cpu::upload::world_corners;
use vlm_shaders::tables::GridTables;
use wgpu::{
    BindGroup, BindGroupLayout, Buffer, BufferUsages, CommandEncoder, PrimitiveTopology, RenderPipeline,
    ShaderModule, ShaderStages, TextureFormat,
};

use super::bindings::{
    NUMBERS, READ, TEXELS, UNIFORM, attachment, filled, group, layout, pipeline_layout, target, view,
};
use super::controls::Controls;
use super::error::ViewError;
use super::eye::Eye;
use super::gpu::Gpu;
use super::resolve::{Screen, restrict};
use super::shaders::{OVERLAY_SHARED, Sources, guarded};
use super::targets::FrameTargets;
use crate::{View, VlmAsset};

/// As `Settings` in overlay_lights.wgsl. 112 bytes.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct LightSettings {
    pub(super) clip_from_world: Mat4,
    pub(super) eye: Vec3,
    pub(super) opacity: f32,
    pub(super) forward: Vec3,
    pub(super) is_perspective: u32,
    pub(super) origin: Vec2,
    pub(super) depth_scale: f32,
    pub(super) reach: f32,
}

/// As `Settings` in overlay_surface.wgsl. 96 bytes.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct SurfaceSettings {
    pub(super) view: View,
    pub(super) origin: Vec2,
    pub(super) shows_cells: u32,
    pub(super) most: f32,
}

/// A corner of a line or of a filled light. 36 bytes.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Corner {
    position: Vec3,
    normal: Vec3,
    color: Vec3,
}

/// The passes over the picture.
pub(crate) struct OverlayStage {
    format: TextureFormat,
    lights_layout: BindGroupLayout,
    grid_layout: BindGroupLayout,
    surface_layout: BindGroupLayout,
    pipelines: Pipelines,
    loaded: Option<Loaded>,
}

struct Pipelines {
    lines: RenderPipeline,
    filled: RenderPipeline,
    surface: RenderPipeline,
}

/// What an asset's overlays read.
pub(crate) struct Loaded {
    grid: BindGroup,
    /// Near lights of each leaf.
    counts: Buffer,
    most: f32,
    lights: Vec<Placed>,
    /// The lights farthest behind their surface lie so deep, metres.
    deepest: f32,
}

/// A light in world space.
struct Placed {
    corners: [Vec3; 3],
    normal: Vec3,
    tag: u32,
    /// Least distance of its samples in front of its plane, metres.
    clearance: f32,
}

impl OverlayStage {
    pub(crate) fn new(gpu: &Gpu, sources: &Sources, format: TextureFormat) -> Result<Self, ViewError> {
        let both = ShaderStages::VERTEX_FRAGMENT;
        let lights_layout = layout(gpu, "overlay lights", both, &[UNIFORM, TEXELS]);
        let grid_layout = layout(gpu, "overlay grid", ShaderStages::FRAGMENT, &[UNIFORM, READ]);
        let bindings = [UNIFORM, TEXELS, NUMBERS, READ];
        let surface_layout = layout(gpu, "overlay surface", ShaderStages::FRAGMENT, &bindings);
        let layouts = [&lights_layout, &grid_layout, &surface_layout];
        let pipelines = Pipelines::new(gpu, sources, layouts, format)?;
        Ok(Self { format, lights_layout, grid_layout, surface_layout, pipelines, loaded: None })
    }

    /// Compiles the shaders anew; where that fails, the last ones stay.
    pub(crate) fn recompile(&mut self, gpu: &Gpu, sources: &Sources) -> Result<(), ViewError> {
        let layouts = [&self.lights_layout, &self.grid_layout, &self.surface_layout];
        self.pipelines = Pipelines::new(gpu, sources, layouts, self.format)?;
        Ok(())
    }

    /// What the overlays of an asset read, for [`OverlayStage::take`].
    pub(crate) fn load(&self, gpu: &Gpu, asset: Option<&VlmAsset>) -> Result<Option<Loaded>, ViewError> {
        asset.map(|asset| Loaded::new(gpu, &self.grid_layout, asset)).transpose()
    }

    /// Shows another asset from now on.
    pub(crate) fn take(&mut self, loaded: Option<Loaded>) {
        self.loaded = loaded;
    }

    /// Adds what the controls ask for. `radiosity` is that of the lights, where it is asked for.
    pub(crate) fn record(
        &self,
        gpu: &Gpu,
        encoder: &mut CommandEncoder,
        (targets, eye, extent): (&FrameTargets, &Eye, f64),
        (screen, controls): (Screen<'_>, &Controls),
        radiosity: &[Vec4],
    ) -> Result<(), ViewError> {
        let Some(loaded) = &self.loaded else { return Ok(()) };
        let overlays = controls.overlays;
        let settings = self.light_settings(gpu, (targets, eye, extent), screen)?;
        let mut drawn: Vec<(&RenderPipeline, Vec<Corner>)> = Vec::new();
        if overlays.radiosity {
            drawn.push((&self.pipelines.filled, loaded.filled(radiosity, controls.exposure)));
        }
        if overlays.tags {
            drawn.push((&self.pipelines.lines, loaded.lines(|light| tag_color(light.tag), |l| l.tag != 0)));
        }
        if overlays.wireframe {
            let color = |light: &Placed| clearance_color(light.clearance, self.required(extent));
            drawn.push((&self.pipelines.lines, loaded.lines(color, |_| true)));
        }
        let buffers = drawn.iter().map(|(_, corners)| filled(gpu, "lights", corners, BufferUsages::VERTEX));
        let buffers: Vec<Buffer> = buffers.collect::<Result<_, _>>()?;
        let tags = self.surface_group(gpu, loaded, targets, (screen, eye, false))?;
        let cells = self.surface_group(gpu, loaded, targets, (screen, eye, true))?;

        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("overlay"),
            color_attachments: &[attachment(screen.view, None)],
            ..wgpu::RenderPassDescriptor::default()
        });
        restrict(&mut pass, screen, targets);
        for group in [overlays.cells.then_some(&cells), overlays.tags.then_some(&tags)].into_iter().flatten()
        {
            pass.set_pipeline(&self.pipelines.surface);
            pass.set_bind_group(0, &loaded.grid, &[]);
            pass.set_bind_group(1, group, &[]);
            pass.draw(0..3, 0..1);
        }
        for ((pipeline, corners), buffer) in drawn.iter().zip(&buffers) {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &settings, &[]);
            pass.set_vertex_buffer(0, buffer.slice(..));
            pass.draw(0..corners.len() as u32, 0..1);
        }
        Ok(())
    }

    /// Metres. The lights' own bounds stand for the scene's.
    fn required(&self, extent: f64) -> f32 {
        required_clearance([glam::DVec3::ZERO, glam::DVec3::splat(extent / 3.0_f64.sqrt())]) as f32
    }

    fn light_settings(
        &self,
        gpu: &Gpu,
        (targets, eye, extent): (&FrameTargets, &Eye, f64),
        screen: Screen<'_>,
    ) -> Result<BindGroup, ViewError> {
        let deepest = self.loaded.as_ref().map_or(0.0, |loaded| loaded.deepest);
        let settings = LightSettings {
            clip_from_world: eye.clip_from_world.as_mat4(),
            eye: eye.position,
            opacity: 0.9,
            forward: eye.forward,
            is_perspective: u32::from(eye.is_perspective),
            origin: Vec2::from(screen.origin.map(|pixel| pixel as f32)),
            depth_scale: eye.depth_scale,
            reach: 2.0 * deepest + 2e-3 * extent as f32,
        };
        let settings = filled(gpu, "overlay lights", &[settings], BufferUsages::UNIFORM)?;
        let resources = vec![settings.as_entire_binding(), view(&targets.depth.view)];
        Ok(group(gpu, "overlay lights", &self.lights_layout, resources))
    }

    fn surface_group(
        &self,
        gpu: &Gpu,
        loaded: &Loaded,
        targets: &FrameTargets,
        (screen, eye, shows_cells): (Screen<'_>, &Eye, bool),
    ) -> Result<BindGroup, ViewError> {
        let settings = SurfaceSettings {
            view: eye.view(),
            origin: Vec2::from(screen.origin.map(|pixel| pixel as f32)),
            shows_cells: u32::from(shows_cells),
            most: loaded.most,
        };
        let settings = filled(gpu, "overlay surface", &[settings], BufferUsages::UNIFORM)?;
        let resources = vec![
            settings.as_entire_binding(),
            view(&targets.depth.view),
            view(&targets.tag.view),
            loaded.counts.as_entire_binding(),
        ];
        Ok(group(gpu, "overlay surface", &self.surface_layout, resources))
    }
}

impl Loaded {
    fn new(gpu: &Gpu, layout: &BindGroupLayout, asset: &VlmAsset) -> Result<Self, ViewError> {
        let none = Grid::default();
        let grid = asset.data().grid.as_ref().unwrap_or(&none);
        let tables = GridTables::new(grid, asset.lights());
        let header = filled(gpu, "overlay header", &[tables.header], BufferUsages::UNIFORM)?;
        let indices = filled(gpu, "overlay indices", &tables.indices, BufferUsages::STORAGE)?;
        let resources = vec![header.as_entire_binding(), indices.as_entire_binding()];
        let counts = near_lights(grid);
        let lights = placed(asset);
        let deepest = lights.iter().map(|light| light.clearance).fold(0.0, f32::max);
        Ok(Self {
            grid: group(gpu, "overlay grid", layout, resources),
            most: counts.iter().copied().max().unwrap_or(0) as f32,
            counts: filled(gpu, "overlay counts", &counts, BufferUsages::STORAGE)?,
            lights,
            deepest,
        })
    }

    fn lines(&self, color: impl Fn(&Placed) -> Vec3, shows: impl Fn(&Placed) -> bool) -> Vec<Corner> {
        let edges = |light: &Placed| {
            let (normal, color, [a, b, c]) = (light.normal, color(light), light.corners);
            [a, b, b, c, c, a].map(|position| Corner { position, normal, color })
        };
        self.lights.iter().filter(|light| shows(light)).flat_map(edges).collect()
    }

    /// As the surface would show that emits as much.
    fn filled(&self, radiosity: &[Vec4], exposure: f32) -> Vec<Corner> {
        let of = |(light, radiosity): (&Placed, &Vec4)| {
            let shown = encode_srgb(tone_map(radiosity.truncate() / PI * exposure));
            let color = Vec3::from(shown.map(|byte| f32::from(byte) / 255.0));
            light.corners.map(|position| Corner { position, normal: light.normal, color })
        };
        self.lights.iter().zip(radiosity).flat_map(of).collect()
    }
}

/// Near lights of the probes of each leaf; a light that several of them list counts once.
fn near_lights(grid: &Grid) -> Vec<u32> {
    let of = |leaf: &[vlm_format::Leaf]| {
        let [this, next] = leaf else { return 0 };
        let range = this.probes as usize..this.free_probes as usize;
        let range = if range.end <= next.probes as usize { range } else { 0..0 };
        let probes = grid.leaf_probes.get(range).unwrap_or(&[]);
        let mut near: Vec<u32> =
            probes.iter().flat_map(|&probe| grid.near_of(probe as usize)).copied().collect();
        near.sort_unstable();
        near.dedup();
        near.len() as u32
    };
    grid.leaves.windows(2).map(of).collect()
}

fn placed(asset: &VlmAsset) -> Vec<Placed> {
    let data = asset.data();
    let mut world_from_light = vec![DMat4::IDENTITY; data.triangles.len()];
    for vlm in &data.vlms {
        let transform = asset.world_from_node.get(vlm.node as usize).copied().unwrap_or_default();
        let lights = vlm.lights[0] as usize..vlm.lights[0].saturating_add(vlm.lights[1]) as usize;
        if let Some(lights) = world_from_light.get_mut(lights) {
            lights.fill(transform);
        }
    }
    let of = |(light, transform): (usize, &DMat4)| {
        let corners = world_corners(data, light, *transform);
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
        let samples = asset.lights().samples_of(light);
        let before = samples.iter().map(|s| (s.position.as_dvec3() - corners[0]).dot(normal));
        let clearance = before.fold(f64::INFINITY, f64::min);
        Placed {
            corners: corners.map(|corner| corner.as_vec3()),
            normal: normal.as_vec3(),
            tag: asset.lights().tags.get(light).copied().unwrap_or(0),
            clearance: if clearance.is_finite() { clearance as f32 } else { 0.0 },
        }
    };
    world_from_light.iter().enumerate().map(of).collect()
}

/// Red where a light does not lie behind its surface as far as it must, yellow where it just does, green up to ten times that, then blue.
fn clearance_color(clearance: f32, required: f32) -> Vec3 {
    let (red, yellow) = (Vec3::new(1.0, 0.15, 0.1), Vec3::new(1.0, 0.9, 0.1));
    let (green, blue) = (Vec3::new(0.1, 0.9, 0.2), Vec3::new(0.2, 0.5, 1.0));
    let decades = (clearance / required.max(f32::MIN_POSITIVE)).log10();
    if clearance < 0.999 * required {
        red
    } else if decades < 1.0 {
        yellow.lerp(green, decades.clamp(0.0, 1.0))
    } else {
        green.lerp(blue, (decades - 1.0).clamp(0.0, 1.0))
    }
}

/// Mirror: `hue` in overlay_surface.wgsl.
fn tag_color(tag: u32) -> Vec3 {
    let mut bits = tag.wrapping_mul(0x9e37_79b1);
    bits = (bits ^ (bits >> 15)).wrapping_mul(0x85eb_ca77);
    bits ^= bits >> 13;
    let [red, green, blue, _] = bits.to_le_bytes();
    0.25 + 0.75 * Vec3::new(f32::from(red), f32::from(green), f32::from(blue)) / 255.0
}

impl Pipelines {
    fn new(
        gpu: &Gpu,
        sources: &Sources,
        [lights, grid, surface]: [&BindGroupLayout; 3],
        format: TextureFormat,
    ) -> Result<Self, ViewError> {
        let module = sources.module(gpu, "overlay_lights.wgsl", &[])?;
        let of_lights = |topology| (topology, Some(&CORNER), format);
        let [lines, filled] = guarded(gpu, "overlay_lights.wgsl", || {
            [PrimitiveTopology::LineList, PrimitiveTopology::TriangleList]
                .map(|topology| pipeline(gpu, &module, &[lights], of_lights(topology)))
        })?;
        let module = sources.module(gpu, "overlay_surface.wgsl", &OVERLAY_SHARED)?;
        let all = (PrimitiveTopology::TriangleList, None, format);
        let surface = guarded(gpu, "overlay_surface.wgsl", || pipeline(gpu, &module, &[grid, surface], all))?;
        Ok(Self { lines, filled, surface })
    }
}

const CORNER: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
    array_stride: size_of::<Corner>() as u64,
    step_mode: wgpu::VertexStepMode::Vertex,
    attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x3],
};

fn pipeline(
    gpu: &Gpu,
    module: &ShaderModule,
    groups: &[&BindGroupLayout],
    (topology, corner, format): (
        PrimitiveTopology,
        Option<&wgpu::VertexBufferLayout<'static>>,
        TextureFormat,
    ),
) -> RenderPipeline {
    let buffers: Vec<_> = corner.cloned().map(Some).into_iter().collect();
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("overlay"),
        layout: Some(&pipeline_layout(gpu, "overlay", groups)),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some("vertex"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &buffers,
        },
        primitive: wgpu::PrimitiveState { topology, ..wgpu::PrimitiveState::default() },
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some("fragment"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[target(format, true)],
        }),
        multiview_mask: None,
        cache: None,
    })
}
