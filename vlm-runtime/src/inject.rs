//! inject: phase 1, from the direct light at the points to the radiosity of lights and of the grid's sources.

use vlm_shaders::wgsl;
use wgpu::{BindGroup, BindGroupLayout, ComputePipeline, Device};

use crate::error::Error;
use crate::pass::{self, Passes, group, layout, storage, workgroups};
use crate::upload::Uploaded;

/// The pass for any asset.
pub(crate) struct InjectPipeline {
    layout: BindGroupLayout,
    pipeline: ComputePipeline,
}

impl InjectPipeline {
    pub(crate) fn new(device: &Device, common: &BindGroupLayout) -> Self {
        let bindings = [0, 1, 2, 3, 4, 5, 6].map(|binding| (binding, storage(binding < 5)));
        let layout = layout(device, "inject", &bindings);
        Self { pipeline: pass::pipeline(device, "inject", &wgsl::inject(), &[common, &layout]), layout }
    }
}

/// The pass for an asset.
pub(crate) struct Inject {
    group: BindGroup,
    workgroups: u32,
}

impl Inject {
    /// `elements`: lights and pieces of surface without one.
    pub(crate) fn new(
        device: &Device,
        pipeline: &InjectPipeline,
        uploaded: &Uploaded,
        elements: usize,
    ) -> Result<Self, Error> {
        let bound = [
            (0, &uploaded.samples),
            (1, &uploaded.uncovered),
            (2, &uploaded.irradiance),
            (3, &uploaded.light_surfaces),
            (4, &uploaded.sample_shares),
            (5, &uploaded.light_radiosity),
            (6, &uploaded.source_radiosity),
        ];
        let group = group(device, "inject", &pipeline.layout, &bound);
        Ok(Self { group, workgroups: workgroups(device, "inject", elements)? })
    }

    pub(crate) fn record(&self, passes: &mut Passes<'_>, pipeline: &InjectPipeline, common: &BindGroup) {
        passes.add("inject", &pipeline.pipeline, &[common, &self.group], [self.workgroups, 1]);
    }
}
