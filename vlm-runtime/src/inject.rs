//! inject: phase 1, from the direct light at the points to the radiosity of lights and of the grid's sources.

use vlm_shaders::tables::GridHeader;
use vlm_shaders::wgsl;
use wgpu::{BindGroup, BindGroupLayout, ComputePipeline, Device};

use crate::error::Error;
use crate::pass::{self, Passes, Worklist, group, layout, some_workgroups, storage, workgroups};
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
    /// Lights, then pieces of surface without one.
    pub work: Worklist,
}

impl Inject {
    pub(crate) fn new(
        device: &Device,
        pipeline: &InjectPipeline,
        uploaded: &Uploaded,
        header: &GridHeader,
    ) -> Result<Self, Error> {
        let elements = (header.light_count + header.uncovered_count) as usize;
        workgroups(device, "inject", elements)?;
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
        Ok(Self { group, work: Worklist::new(header.injected, elements) })
    }

    /// Does what was planned, if anything.
    pub(crate) fn record(&mut self, passes: &mut Passes<'_>, pipeline: &InjectPipeline, common: &BindGroup) {
        let workgroups = some_workgroups(self.work.take());
        if workgroups > 0 {
            passes.add("inject", &pipeline.pipeline, &[common, &self.group], [workgroups, 1]);
        }
    }
}
