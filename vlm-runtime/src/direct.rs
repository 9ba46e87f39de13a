//! direct: the real lights on the points that phase 1 lights, times the host's visibility.

use vlm_shaders::cpu::direct::{DirectHeader, PackedLight, Span};
use vlm_shaders::cpu::punctual::PunctualLight;
use vlm_shaders::wgsl;
use wgpu::{BindGroup, BindGroupLayout, Buffer, ComputePipeline, Device, Queue};

use crate::error::Error;
use crate::pass::{self, Buffers, Passes, group, layout, storage, uniform, workgroups};
use crate::upload::{MOST_REAL_LIGHTS, Uploaded};

/// The pass for any asset.
pub(crate) struct DirectPipeline {
    layout: BindGroupLayout,
    pipeline: ComputePipeline,
}

impl DirectPipeline {
    pub(crate) fn new(device: &Device) -> Self {
        let inputs = [1, 2, 3, 4].map(|binding| (binding, storage(true)));
        let bindings = [&[(0, uniform())], &inputs[..], &[(5, storage(false))]].concat();
        let layout = layout(device, "direct", &bindings);
        Self { pipeline: pass::pipeline(device, "direct", &wgsl::direct(), &[&layout]), layout }
    }
}

/// The pass for an asset.
pub(crate) struct Direct {
    header: Buffer,
    lights: Buffer,
    spans: Buffer,
    visibility: Buffer,
    points: Buffer,
    irradiance: Buffer,
    group: BindGroup,
    point_count: u32,
    workgroups: u32,
}

impl Direct {
    pub(crate) fn new(
        pipeline: &DirectPipeline,
        buffers: &mut Buffers,
        uploaded: &Uploaded,
        point_count: usize,
        span_count: usize,
    ) -> Result<Self, Error> {
        workgroups(buffers.device, "direct", span_count)?;
        let header = buffers.uniform("direct_header", bytemuck::bytes_of(&DirectHeader::default()))?;
        let lights =
            buffers.zeros("real_lights", u64::from(MOST_REAL_LIGHTS) * size_of::<PackedLight>() as u64)?;
        let spans = buffers.zeros("spans", (span_count * size_of::<Span>()) as u64)?;
        let visibility = buffers.zeros("visibility", 0)?;
        let (points, irradiance) = (uploaded.points.clone(), uploaded.irradiance.clone());
        let bound = [&header, &lights, &points, &visibility, &spans, &irradiance];
        let group = bind(buffers.device, pipeline, bound);
        let point_count = point_count as u32;
        Ok(Self { header, lights, spans, visibility, points, irradiance, group, point_count, workgroups: 0 })
    }

    /// Writes the real lights, no more than [`MOST_REAL_LIGHTS`]; bytes written.
    pub(crate) fn write_lights(&self, queue: &Queue, lights: &[PunctualLight]) -> u64 {
        let packed: Vec<PackedLight> = lights.iter().map(PackedLight::from).collect();
        write(queue, &self.lights, 0, &packed)
    }

    /// Makes the visibility as large as this, in bytes; true if it holds zeros now.
    pub(crate) fn make_room(
        &mut self,
        (buffers, pipeline): (&Buffers, &DirectPipeline),
        size: u64,
    ) -> Result<bool, Error> {
        if self.visibility.size() >= size {
            return Ok(false);
        }
        self.visibility = buffers.zeros("visibility", size)?;
        let bound =
            [&self.header, &self.lights, &self.points, &self.visibility, &self.spans, &self.irradiance];
        self.group = bind(buffers.device, pipeline, bound);
        Ok(true)
    }

    /// The points, and the share of each light that each of them sees.
    pub(crate) fn points_and_visibility(&self) -> (&Buffer, &Buffer) {
        (&self.points, &self.visibility)
    }

    /// Writes the visibility of the lights of these numbers; bytes written.
    pub(crate) fn write_visibility(
        &mut self,
        queue: &Queue,
        (buffers, pipeline): (&Buffers, &DirectPipeline),
        visibility: &[f32],
        changed: &[u32],
    ) -> Result<u64, Error> {
        if self.make_room((buffers, pipeline), size_of_val(visibility) as u64)? {
            return Ok(write(queue, &self.visibility, 0, visibility));
        }
        let points = self.point_count as usize;
        let row = |&light: &u32| {
            let start = light as usize * points;
            visibility.get(start..start + points).map(|row| write(queue, &self.visibility, start, row))
        };
        Ok(changed.iter().filter_map(row).sum())
    }

    /// Writes which spans are to be lit; bytes written.
    pub(crate) fn write_spans(
        &mut self,
        queue: &Queue,
        device: &Device,
        spans: &[Span],
        (light_count, has_visibility): (usize, bool),
    ) -> Result<u64, Error> {
        self.workgroups = workgroups(device, "direct", spans.len())?;
        if spans.is_empty() {
            return Ok(0);
        }
        let header = DirectHeader {
            light_count: light_count as u32,
            point_count: self.point_count,
            span_count: spans.len() as u32,
            has_visibility: u32::from(has_visibility),
        };
        Ok(write(queue, &self.header, 0, &[header]) + write(queue, &self.spans, 0, spans))
    }

    /// Lights the spans, if there are any.
    pub(crate) fn record(&mut self, passes: &mut Passes<'_>, pipeline: &DirectPipeline) {
        let workgroups = std::mem::take(&mut self.workgroups);
        if workgroups > 0 {
            passes.add("direct", &pipeline.pipeline, &[&self.group], [workgroups, 1]);
        }
    }
}

fn bind(device: &Device, pipeline: &DirectPipeline, bound: [&Buffer; 6]) -> BindGroup {
    let bound: Vec<(u32, &Buffer)> = (0..).zip(bound).collect();
    group(device, "direct", &pipeline.layout, &bound)
}

/// Writes elements from element `start` on; bytes written.
pub(crate) fn write<T: bytemuck::Pod>(queue: &Queue, buffer: &Buffer, start: usize, elements: &[T]) -> u64 {
    if elements.is_empty() {
        return 0;
    }
    queue.write_buffer(buffer, (start * size_of::<T>()) as u64, bytemuck::cast_slice(elements));
    size_of_val(elements) as u64
}
