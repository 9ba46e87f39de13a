//! shadow: the host's shadow maps at the points that phase 1 lights.

use glam::{Vec3, Vec4};
use vlm_shaders::cpu::punctual::PunctualLight;
use vlm_shaders::cpu::shadow::ShadowHeader;
use vlm_shaders::wgsl;
use wgpu::{BindGroup, BindGroupLayout, Buffer, ComputePipeline, Device, Queue, TextureView};

use crate::direct::write;
use crate::error::Error;
use crate::frame::ShadowMap;
use crate::gather::{check_format, float_texture};
use crate::pass::{self, Buffers, Passes, layout, storage, uniform, workgroups};

/// Distance of the maps' headers in their buffer: WebGPU's least alignment, bytes.
const STRIDE: usize = 256;

/// The pass for any asset.
pub(crate) struct ShadowPipeline {
    layout: BindGroupLayout,
    pipeline: ComputePipeline,
}

impl ShadowPipeline {
    pub(crate) fn new(device: &Device) -> Self {
        let bindings = [(0, uniform()), (1, storage(true)), (2, float_texture()), (3, storage(false))];
        let layout = layout(device, "shadow", &bindings);
        Self { pipeline: pass::pipeline(device, "shadow", &wgsl::shadow(), &[&layout]), layout }
    }
}

/// What a light's row of the visibility holds.
#[derive(Clone, Debug, Default, PartialEq)]
enum Row {
    /// What was not written here.
    #[default]
    Unknown,
    /// Every point sees the light.
    Open,
    /// What these maps showed.
    Maps(Vec<Shown>),
}

/// A map as it was when it was read.
#[derive(Clone, Debug, PartialEq)]
struct Shown {
    header: ShadowHeader,
    depth: TextureView,
    revision: u64,
}

/// The pass for an asset: what stands in the rows of the visibility, and which maps are to be read.
#[derive(Default)]
pub(crate) struct Shadow {
    rows: Vec<Row>,
    /// A map each, in the order in which they run.
    pending: Vec<BindGroup>,
    workgroups: u32,
}

impl Shadow {
    /// The rows hold something else now, and nothing is to be read.
    pub(crate) fn forget(&mut self) {
        self.rows.clear();
        self.pending.clear();
    }

    /// The points moved: what the maps showed is no longer so.
    pub(crate) fn points_moved(&mut self) {
        let is_mapped = |row: &&mut Row| matches!(row, Row::Maps(_));
        self.rows.iter_mut().filter(is_mapped).for_each(|row| *row = Row::Unknown);
    }

    /// Takes a frame's maps: which of them are to be read, and the rows of lights without any. The numbers of the lights whose visibility
    /// changes, and the bytes written.
    pub(crate) fn take(
        &mut self,
        queue: &Queue,
        (buffers, pipeline): (&Buffers, &ShadowPipeline),
        (points, visibility): (&Buffer, &Buffer),
        frame: (&[PunctualLight], &[ShadowMap<'_>]),
        point_count: usize,
    ) -> Result<(Vec<u32>, u64), Error> {
        self.workgroups = workgroups(buffers.device, "shadow", point_count)?;
        let (mut changed, mut headers, mut views, mut bytes) = (Vec::new(), Vec::new(), Vec::new(), 0);
        let rows = rows(frame, point_count);
        self.rows.resize(rows.len(), Row::Unknown);
        for (light, (old, new)) in self.rows.iter_mut().zip(rows).enumerate() {
            if *old == new {
                continue;
            }
            changed.push(light as u32);
            if let Row::Maps(maps) = &new {
                // The last map first, so that the first of those that hold a point has the last word.
                for (order, map) in maps.iter().rev().enumerate() {
                    headers.push(ShadowHeader { is_first: u32::from(order == 0), ..map.header });
                    views.push(map.depth.clone());
                }
            } else {
                bytes += write(queue, visibility, light * point_count, &vec![1.0_f32; point_count]);
            }
            *old = new;
        }
        let groups = bind(buffers, pipeline, (points, visibility), &headers, &views)?;
        bytes += (groups.len() * STRIDE) as u64;
        self.pending.extend(groups);
        Ok((changed, bytes))
    }

    /// Reads the maps that changed; how many.
    pub(crate) fn record(&mut self, passes: &mut Passes<'_>, pipeline: &ShadowPipeline) -> u32 {
        let pending = std::mem::take(&mut self.pending);
        if !pending.is_empty() {
            let groups: Vec<[&BindGroup; 1]> = pending.iter().map(|group| [group]).collect();
            let groups: Vec<&[&BindGroup]> = groups.iter().map(<[_; 1]>::as_slice).collect();
            passes.add_each("shadow", &pipeline.pipeline, &groups, [self.workgroups, 1]);
        }
        pending.len() as u32
    }
}

/// What the rows of the lights are to hold.
fn rows((lights, maps): (&[PunctualLight], &[ShadowMap<'_>]), point_count: usize) -> Vec<Row> {
    let row = |(number, light): (usize, &PunctualLight)| {
        let own = maps.iter().filter(|map| map.light as usize == number);
        let shown: Vec<Shown> = own.map(|map| shown(light, map, (number, point_count))).collect();
        if shown.is_empty() { Row::Open } else { Row::Maps(shown) }
    };
    lights.iter().enumerate().map(row).collect()
}

fn shown(light: &PunctualLight, map: &ShadowMap<'_>, (number, point_count): (usize, usize)) -> Shown {
    let place = if light.directional { (-light.direction).extend(0.0) } else { light.position.extend(1.0) };
    let header = ShadowHeader {
        clip_from_world: map.clip_from_world,
        light: place,
        normal_offset: map.normal_offset,
        depth_bias: map.depth_bias,
        is_reversed: u32::from(map.is_reversed),
        first: (number * point_count) as u32,
        point_count: point_count as u32,
        ..ShadowHeader::default()
    };
    Shown { header, depth: map.depth.clone(), revision: map.revision }
}

fn bind(
    buffers: &Buffers,
    pipeline: &ShadowPipeline,
    (points, visibility): (&Buffer, &Buffer),
    headers: &[ShadowHeader],
    views: &[TextureView],
) -> Result<Vec<BindGroup>, Error> {
    if headers.is_empty() {
        return Ok(Vec::new());
    }
    let mut contents = vec![0; headers.len() * STRIDE];
    for (header, to) in headers.iter().zip(contents.chunks_exact_mut(STRIDE)) {
        to.iter_mut().zip(bytemuck::bytes_of(header)).for_each(|(to, from)| *to = *from);
    }
    let uploaded = buffers.contents("shadow_headers", &contents, wgpu::BufferUsages::UNIFORM)?;
    let group = |(number, depth): (usize, &TextureView)| {
        let header = wgpu::BufferBinding {
            buffer: &uploaded,
            offset: (number * STRIDE) as u64,
            size: std::num::NonZeroU64::new(size_of::<ShadowHeader>() as u64),
        };
        let resources = [
            wgpu::BindingResource::Buffer(header),
            points.as_entire_binding(),
            wgpu::BindingResource::TextureView(depth),
            visibility.as_entire_binding(),
        ];
        let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
        let entries: Vec<_> = (0..).zip(resources).map(entry).collect();
        buffers.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("shadow"),
            layout: &pipeline.layout,
            entries: &entries,
        })
    };
    Ok(views.iter().enumerate().map(group).collect())
}

/// Every map belongs to a light, has finite numbers and can be read.
pub(crate) fn check(maps: &[ShadowMap<'_>], lights: usize) -> Result<(), Error> {
    for (number, map) in maps.iter().enumerate() {
        if map.light as usize >= lights {
            let (light, lights) = (map.light, lights as u32);
            return Err(Error::UnknownLight { map: number as u32, light, lights });
        }
        let numbers = Vec4::from((Vec3::new(map.normal_offset, map.depth_bias, 0.0), 0.0));
        if !map.clip_from_world.is_finite() || !numbers.is_finite() {
            return Err(Error::NotFinite { what: format!("shadow map {number}") });
        }
        check_format("shadow map", map.depth)?;
        let samples = map.depth.texture().sample_count();
        if samples > 1 {
            let (found, expected) = (format!("of {samples} samples"), "of one sample".to_owned());
            return Err(Error::Target { what: "shadow map", found, expected });
        }
    }
    Ok(())
}
