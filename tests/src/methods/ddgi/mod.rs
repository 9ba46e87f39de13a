//! A probe grid after DDGI: Majercik, Guertin, Nowrouzezahrai, McGuire, "Dynamic Diffuse Global Illumination with
//! Ray-Traced Irradiance Fields", JCGT 2019.
//!
//! Probes at the corners of the grid that our cells would have hold irradiance by direction and the first two moments of the
//! distance to what they see, both octahedral. What differs from the paper: every frame stands alone (no blending
//! with earlier frames, so rays per probe are all the rays that count), one bounce, linear storage in f32, the bias along
//! the normal alone, and probes moved or switched off after RTXGI's classification (Majercik et al. 2021, "Scaling
//! Probe-Based Real-Time Dynamic Global Illumination for Production").

mod octahedral;
mod probes;
mod update;
mod shade;

use std::time::Instant;

use glam::Vec3;
use rayon::prelude::*;
use vlm_bake::render::PhaseSeconds;

use super::Entry;
use crate::method::{Cost, Method, MethodError, Picture, Prepared, Stage, View};
use probes::ProbeGrid;
use update::{ProbeLight, RaySet};

/// The method's line in the table. Probes interpolate what varies between them: that is the tolerance.
pub const ENTRY: Entry =
    Entry { name: "ddgi", sweep, proof: || Box::new(Ddgi { cells: 12.0, rays: 512 }), tolerance: 0.05 };

/// Cells along the longest axis in the middle of the sweep.
const DEFAULT_CELLS: f32 = 24.0;

fn sweep(_stage: &Stage<'_>) -> Vec<Box<dyn Method>> {
    let mut methods: Vec<Box<dyn Method>> = Vec::new();
    // The last has its probes where the baker's grid has its corners.
    let ours = DEFAULT_CELLS;
    for cells in [ours / 4.0, ours / 2.0, ours] {
        for rays in [64, 256] {
            methods.push(Box::new(Ddgi { cells, rays }));
        }
    }
    methods
}

/// The method at one setting.
pub struct Ddgi {
    /// Probe spacings along the scene's longest axis. More resolve shadows better; cost grows with the cube.
    pub cells: f32,
    /// Rays per probe and frame. More make it less noisy; the update's time grows in proportion.
    pub rays: u32,
}

impl Method for Ddgi {
    fn name(&self) -> &'static str {
        ENTRY.name
    }

    fn knob(&self) -> String {
        format!("cells={} rays={}", self.cells, self.rays)
    }

    fn prepare(&self, stage: &Stage<'_>) -> Result<Box<dyn Prepared>, MethodError> {
        let start = Instant::now();
        let grid = ProbeGrid::place(stage.trace, stage.bounds(), stage.extent() / self.cells);
        let prepare_seconds = start.elapsed().as_secs_f64();
        Ok(Box::new(PreparedDdgi { grid, rays: self.rays, prepare_seconds }))
    }
}

struct PreparedDdgi {
    grid: ProbeGrid,
    rays: u32,
    prepare_seconds: f64,
}

impl Prepared for PreparedDdgi {
    fn render(&self, view: &View<'_>, frame: u32) -> Result<Picture, MethodError> {
        let start = Instant::now();
        let rays = RaySet::new(self.rays, frame);
        let updated = update::update(view.trace, &self.grid, &rays);
        let inject = start.elapsed().as_secs_f64();

        let start = Instant::now();
        let shaded: Vec<(Vec3, u64)> = view
            .gbuffer
            .points
            .par_iter()
            .map(|p| p.as_ref().map_or((Vec3::ZERO, 0), |p| shade::shade(&self.grid, &updated.probes, p)))
            .collect();
        Ok(Picture {
            seconds: PhaseSeconds { inject, gather: start.elapsed().as_secs_f64() },
            lights: self.grid.active() as u32,
            pairs: shaded.iter().map(|(_, pairs)| pairs).sum(),
            rays: updated.rays,
            indirect: shaded.into_iter().map(|(irradiance, _)| irradiance).collect(),
        })
    }

    fn cost(&self) -> Cost {
        let bytes = self.grid.positions.len() * (size_of::<ProbeLight>() + size_of::<Option<Vec3>>());
        Cost { prepare_seconds: self.prepare_seconds, bytes: bytes as u64 }
    }
}
