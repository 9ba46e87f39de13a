//! refresh: what arrives at the probes of an asset with a grid, on surface and in free space.

use vlm_shaders::tables::GridHeader;
use vlm_shaders::wgsl;
use wgpu::{BindGroup, BindGroupLayout, Buffer, ComputePipeline, Device};

use crate::dependents::Dependents;
use crate::error::Error;
use crate::pass::{Compiled, Passes, Worklist, group, layout, some_workgroups, storage, workgroups};
use crate::upload::{GridBuffers, Uploaded};

/// The passes for an asset.
pub(crate) struct Refresh {
    surface: Pass,
    /// Of probes in free space, where there are any.
    free: Option<Pass>,
    free_probes: usize,
    /// Probes.
    pub work: Worklist,
    /// Which probes a change reaches.
    pub dependents: Dependents,
}

struct Pass {
    pipeline: ComputePipeline,
    group: BindGroup,
}

impl Refresh {
    pub(crate) fn new(
        (device, compiled): (&Device, &mut Compiled),
        common: &BindGroupLayout,
        uploaded: &Uploaded,
        grid: &GridBuffers,
        (header, dependents): (&GridHeader, Dependents),
    ) -> Result<Self, Error> {
        let probes = header.probe_count as usize;
        workgroups(device, "refresh", probes)?;
        let bound = [
            (0, &grid.probes),
            (1, &grid.rows),
            (2, &grid.near_form_factors),
            (3, &grid.sources),
            (4, &uploaded.source_radiosity),
            (5, &grid.far),
            (6, &grid.near_radiosities),
        ];
        let free = grid.free.as_ref().map(|free| {
            let bound = [bound[0], bound[1], bound[3], bound[4], (5, free)];
            Pass::new((device, &mut *compiled), common, ("refresh_free", &wgsl::refresh_free()), &bound)
        });
        Ok(Self {
            surface: Pass::new((device, compiled), common, ("refresh", &wgsl::refresh()), &bound),
            free,
            free_probes: probes - (header.surface_probes as usize).min(probes),
            work: Worklist::new(header.refreshed, probes),
            dependents,
        })
    }

    /// Does what was planned, if anything; how many probes that is.
    pub(crate) fn record(&mut self, passes: &mut Passes<'_>, common: &BindGroup) -> u32 {
        let probes = self.work.take();
        if probes == 0 {
            return 0;
        }
        self.surface.record(passes, "refresh", common, probes);
        if let Some(free) = &self.free {
            // Lists hold probes of both kinds.
            let probes = if self.work.is_all() { self.free_probes } else { probes };
            free.record(passes, "refresh_free", common, probes);
        }
        probes as u32
    }
}

impl Pass {
    /// The first five bindings are read, those after them written.
    fn new(
        (device, compiled): (&Device, &mut Compiled),
        common: &BindGroupLayout,
        (name, source): (&str, &str),
        bound: &[(u32, &Buffer)],
    ) -> Self {
        let bindings: Vec<_> = bound.iter().map(|&(binding, _)| (binding, storage(binding < 5))).collect();
        let layout = layout(device, name, &bindings);
        let pipeline = compiled.pipeline(device, name, source, &[common, &layout]);
        Self { group: group(device, name, &layout, bound), pipeline }
    }

    fn record(&self, passes: &mut Passes<'_>, name: &'static str, common: &BindGroup, probes: usize) {
        passes.add(name, &self.pipeline, &[common, &self.group], [some_workgroups(probes), 1]);
    }
}
