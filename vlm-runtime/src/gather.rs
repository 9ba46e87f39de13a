//! gather: phase 2, the indirect irradiance of every pixel.

use vlm_shaders::cpu::view::View;
use vlm_shaders::wgsl::Gathering;
use wgpu::{
    BindGroup, BindGroupLayout, BindingType, Buffer, ComputePipeline, Device, Queue, TextureFormat,
    TextureView,
};

use crate::direct::write;
use crate::error::{Error, within};
use crate::frame::{IrradianceFormat, Settings, Targets};
use crate::pass::{Buffers, Compiled, Passes, group, layout, storage, uniform};
use crate::upload::Uploaded;

/// Pixels of a workgroup along x and y, as in the shader.
const TILE: u32 = 8;

/// The pass for an asset, and what a forward shader binds in its place.
pub(crate) struct Gather {
    pub gathering: Gathering,
    pub scene_layout: BindGroupLayout,
    pub scene_group: BindGroup,
    target_layout: BindGroupLayout,
    format: TextureFormat,
    pipeline: ComputePipeline,
    view: Buffer,
    written_view: Option<View>,
    /// Reads as 0 everywhere: no tag, nothing that moves.
    zero: TextureView,
    /// Where pairs are counted.
    pub pair_count: Option<Buffer>,
}

impl Gather {
    pub(crate) fn new(
        (buffers, compiled): (&mut Buffers, &mut Compiled),
        common: &BindGroupLayout,
        uploaded: &Uploaded,
        gathering: Gathering,
        settings: &Settings,
    ) -> Result<Self, Error> {
        let (device, counted) = (buffers.device, settings.count_pairs);
        let format = settings.format.texture_format();
        let source = gathering.deferred(counted, settings.format == IrradianceFormat::Float);
        let (scene_layout, scene_group) = scene(device, uploaded, gathering);
        let target_layout = layout(device, "targets", &target_bindings(gathering, counted, format));
        let groups = [common, &scene_layout, &target_layout];
        Ok(Self {
            gathering,
            pipeline: compiled.pipeline(device, "gather", &source, &groups),
            scene_layout,
            scene_group,
            target_layout,
            format,
            view: buffers.uniform("view", bytemuck::bytes_of(&View::default()))?,
            written_view: None,
            zero: zero(device),
            pair_count: counted.then(|| buffers.zeros("pair_count", 8)).transpose()?,
        })
    }

    /// Writes the camera, if it changed; bytes written.
    pub(crate) fn write_view(&mut self, queue: &Queue, view: View) -> u64 {
        if self.written_view.replace(view) == Some(view) { 0 } else { write(queue, &self.view, 0, &[view]) }
    }

    pub(crate) fn record(
        &self,
        passes: &mut Passes<'_>,
        device: &Device,
        common: &BindGroup,
        targets: &Targets<'_>,
    ) {
        let [width, height] = size(targets.irradiance);
        if let Some(pairs) = &self.pair_count {
            passes.clear(pairs);
        }
        let group = self.bind(device, targets);
        let tiles = [width.div_ceil(TILE), height.div_ceil(TILE)];
        passes.add("gather", &self.pipeline, &[common, &self.scene_group, &group], tiles);
    }

    /// Every texture has the size of the irradiance and a format that can be read.
    pub(crate) fn check(&self, targets: &Targets<'_>, device: &Device) -> Result<(), Error> {
        check(targets, self.format, device)
    }

    fn bind(&self, device: &Device, targets: &Targets<'_>) -> BindGroup {
        let texture = |binding, view| wgpu::BindGroupEntry {
            binding,
            resource: wgpu::BindingResource::TextureView(view),
        };
        let mut entries = vec![
            wgpu::BindGroupEntry { binding: 0, resource: self.view.as_entire_binding() },
            texture(1, targets.depth),
            texture(2, targets.normal),
            texture(3, targets.geometric_normal.unwrap_or(targets.normal)),
            texture(4, targets.irradiance),
        ];
        if self.gathering.tags {
            entries.push(texture(5, targets.tag.unwrap_or(&self.zero)));
        }
        if self.gathering.free {
            entries.push(texture(7, targets.moving.unwrap_or(&self.zero)));
        }
        if let Some(pairs) = &self.pair_count {
            entries.push(wgpu::BindGroupEntry { binding: 6, resource: pairs.as_entire_binding() });
        }
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("targets"),
            layout: &self.target_layout,
            entries: &entries,
        })
    }
}

/// What phase 2 reads of an asset: nothing that it lacks.
fn scene(device: &Device, uploaded: &Uploaded, gathering: Gathering) -> (BindGroupLayout, BindGroup) {
    let mut bound = vec![(1, &uploaded.geometry)];
    if let Some(grid) = uploaded.grid.as_ref().filter(|_| gathering.grid) {
        bound.extend([(0, &grid.probes), (2, &grid.far), (3, &grid.near_radiosities)]);
        bound.extend(grid.free.as_ref().filter(|_| gathering.free).map(|free| (6, free)));
    }
    if gathering.listed {
        bound.push((4, &uploaded.light_radiosity));
    }
    let bindings: Vec<(u32, BindingType)> =
        bound.iter().map(|(binding, _)| (*binding, storage(true))).collect();
    let layout = layout(device, "scene", &bindings);
    let group = group(device, "scene", &layout, &bound);
    (layout, group)
}

fn target_bindings(gathering: Gathering, counted: bool, format: TextureFormat) -> Vec<(u32, BindingType)> {
    let float = float_texture();
    let written = BindingType::StorageTexture {
        access: wgpu::StorageTextureAccess::WriteOnly,
        format,
        view_dimension: wgpu::TextureViewDimension::D2,
    };
    let mut bindings = vec![(0, uniform()), (1, float), (2, float), (3, float), (4, written)];
    if gathering.tags {
        bindings.push((5, texture(wgpu::TextureSampleType::Uint)));
    }
    if counted {
        bindings.push((6, storage(false)));
    }
    if gathering.free {
        bindings.push((7, texture(wgpu::TextureSampleType::Uint)));
    }
    bindings
}

/// A texture of numbers that is not filtered: depth formats too.
pub(crate) fn float_texture() -> BindingType {
    texture(wgpu::TextureSampleType::Float { filterable: false })
}

fn texture(sample_type: wgpu::TextureSampleType) -> BindingType {
    BindingType::Texture { sample_type, view_dimension: wgpu::TextureViewDimension::D2, multisampled: false }
}

/// Reads as 0 everywhere.
fn zero(device: &Device) -> TextureView {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("zero"),
        size: wgpu::Extent3d { width: 1, height: 1, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: TextureFormat::R8Uint,
        usage: wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

fn check(targets: &Targets<'_>, written: TextureFormat, device: &Device) -> Result<(), Error> {
    let expected = size(targets.irradiance);
    let format = targets.irradiance.texture().format();
    if format != written {
        let (found, expected) = (format!("{format:?}"), format!("{written:?}"));
        return Err(Error::Target { what: "irradiance", found, expected });
    }
    let inputs = [
        ("depth", Some(targets.depth)),
        ("normal", Some(targets.normal)),
        ("geometric normal", targets.geometric_normal),
        ("tag", targets.tag),
        ("moving", targets.moving),
    ];
    for (what, view) in inputs.into_iter().filter_map(|(what, view)| Some((what, view?))) {
        let [width, height] = size(view);
        if [width, height] != expected {
            let expected = format!("{} x {} pixels, as the irradiance", expected[0], expected[1]);
            return Err(Error::Target { what, found: format!("{width} x {height} pixels"), expected });
        }
        check_format(what, view)?;
    }
    let limit = u64::from(device.limits().max_compute_workgroups_per_dimension) * u64::from(TILE);
    let longest = u64::from(expected[0].max(expected[1]));
    within("the picture (pixels of a side)", "max_compute_workgroups_per_dimension", longest, limit)
}

fn size(view: &TextureView) -> [u32; 2] {
    [view.texture().width(), view.texture().height()]
}

pub(crate) fn check_format(what: &'static str, view: &TextureView) -> Result<(), Error> {
    let format = view.texture().format();
    let sampled = format.sample_type(Some(wgpu::TextureAspect::All), None);
    let sampled = sampled.or_else(|| format.sample_type(Some(wgpu::TextureAspect::DepthOnly), None));
    let is_integer = matches!(what, "tag" | "moving");
    let (fits, expected) = match sampled {
        Some(wgpu::TextureSampleType::Uint) => (is_integer, "a float or depth format"),
        Some(wgpu::TextureSampleType::Sint) => (false, "an unsigned integer, float or depth format"),
        _ => (!is_integer, "an unsigned integer format"),
    };
    if fits {
        Ok(())
    } else {
        Err(Error::Target { what, found: format!("{format:?}"), expected: expected.to_owned() })
    }
}
