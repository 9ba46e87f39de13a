//! Our method, as `vlm render` does it: by the static grid.

use std::sync::Arc;

use vlm_bake::options::{BakeOptions, Preset};
use vlm_bake::progress::Silent;
use vlm_bake::render::gather_by_grid;

use super::Entry;
use super::area_lights::AreaLights;
use crate::method::{Baked, Cost, Method, MethodError, Picture, Prepared, Stage, View};

/// The method's line in the table.
pub const ENTRY: Entry = Entry { name: "vlm", sweep, proof: || Box::new(whole()), tolerance: 0.02 };

fn sweep(stage: &Stage<'_>) -> Vec<Box<dyn Method>> {
    settings(stage).into_iter().map(|vlm| Box::new(vlm) as Box<dyn Method>).collect()
}

/// Lights enough for the proof.
pub(super) fn whole() -> Vlm {
    Vlm { preset: Preset::Game, lights: 4000, probes: 1.0 }
}

/// The three presets as they ship; then `game` with half and twice the probes, and with a quarter and four times of everything.
pub(super) fn settings(stage: &Stage<'_>) -> Vec<Vlm> {
    let as_shipped = |preset: Preset| Vlm { preset, lights: stage.budget(preset), probes: 1.0 };
    let game = || as_shipped(Preset::Game);
    let mut methods: Vec<Vlm> = Preset::ALL.map(as_shipped).into();
    methods.extend([0.5, 2.0].map(|probes| Vlm { probes, ..game() }));
    methods.push(Vlm { lights: game().lights / 4, probes: 0.25, ..game() });
    methods.push(Vlm { lights: game().lights * 4, probes: 4.0, ..game() });
    methods
}

/// The method at one setting.
pub struct Vlm {
    /// Decides the samples of each light, and the rays and near lights of each probe.
    pub preset: Preset,
    /// Asked of the baker.
    pub lights: u32,
    /// Probes over the number that the preset has.
    pub probes: f64,
}

impl Vlm {
    /// The options of the bake.
    pub(super) fn options(&self, stage: &Stage<'_>) -> BakeOptions {
        let mut options = stage.options(self.preset, self.lights);
        options.grid.probes = (f64::from(options.grid.probes) * self.probes) as u32;
        options
    }
}

impl Method for Vlm {
    fn name(&self) -> &'static str {
        ENTRY.name
    }

    fn knob(&self) -> String {
        let mut knob = format!("preset={} lights={}", self.preset.name(), self.lights);
        if self.probes != 1.0 {
            knob += &format!(" probes=x{}", self.probes);
        }
        knob
    }

    fn prepare(&self, stage: &Stage<'_>) -> Result<Box<dyn Prepared>, MethodError> {
        Ok(Box::new(PreparedVlm { lights: AreaLights::new(stage, stage.baked(&self.options(stage))?)? }))
    }
}

struct PreparedVlm {
    lights: AreaLights,
}

impl Prepared for PreparedVlm {
    fn render(&self, view: &View<'_>, _frame: u32) -> Result<Picture, MethodError> {
        Ok(self.lights.picture(gather_by_grid(view.trace, &self.lights.baked.asset, &view.gbuffer, &Silent)?))
    }

    fn cost(&self) -> Cost {
        cost(&self.lights)
    }

    fn area_lights(&self) -> Option<Arc<Baked>> {
        Some(Arc::clone(&self.lights.baked))
    }
}

/// What lights and grid take.
pub(super) fn cost(lights: &AreaLights) -> Cost {
    let baked = &lights.baked;
    let grid = baked.asset.grid.as_ref();
    Cost {
        prepare_seconds: baked.lights_seconds + baked.grid_seconds,
        bytes: lights.bytes() + grid.map_or(0, |grid| grid.byte_len() as u64),
    }
}
