//! refresh: what arrives at the probes of an asset with a grid.

use vlm_shaders::wgsl;
use wgpu::{BindGroup, BindGroupLayout, CommandEncoder, ComputePipeline, Device};

use crate::error::Error;
use crate::pass::{Compiled, dispatch, group, layout, storage, workgroups};
use crate::upload::{GridBuffers, Uploaded};

/// The pass for an asset.
pub(crate) struct Refresh {
    pipeline: ComputePipeline,
    group: BindGroup,
    workgroups: u32,
}

impl Refresh {
    pub(crate) fn new(
        (device, compiled): (&Device, &mut Compiled),
        common: &BindGroupLayout,
        uploaded: &Uploaded,
        grid: &GridBuffers,
        probes: usize,
    ) -> Result<Self, Error> {
        let bindings = [0, 1, 2, 3, 4, 5, 6].map(|binding| (binding, storage(binding < 5)));
        let layout = layout(device, "refresh", &bindings);
        let bound = [
            (0, &grid.probes),
            (1, &grid.rows),
            (2, &grid.near_form_factors),
            (3, &grid.sources),
            (4, &uploaded.source_radiosity),
            (5, &grid.far),
            (6, &grid.near_radiosities),
        ];
        Ok(Self {
            group: group(device, "refresh", &layout, &bound),
            pipeline: compiled.pipeline(device, "refresh", &wgsl::refresh(), &[common, &layout]),
            workgroups: workgroups(device, "refresh", probes)?,
        })
    }

    pub(crate) fn record(&self, encoder: &mut CommandEncoder, common: &BindGroup) {
        dispatch(encoder, "refresh", &self.pipeline, &[common, &self.group], [self.workgroups, 1]);
    }
}
