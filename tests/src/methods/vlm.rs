//! Our method, as `vlm render` does it: the lights of each point's grid cell.

use std::sync::Arc;
use std::time::Instant;

use vlm_bake::grid::grid;
use vlm_bake::options::{BakeOptions, Preset};
use vlm_bake::progress::Silent;
use vlm_bake::render::gather_by_grid;
use vlm_format::VlmAsset;

use super::Entry;
use super::area_lights::{AreaLights, grid_bytes};
use crate::method::{Baked, Cost, Method, MethodError, Picture, Prepared, Stage, View};

/// The method's line in the table. The proof's range reaches everything.
pub const ENTRY: Entry = Entry {
    name: "vlm",
    sweep,
    proof: || Box::new(Vlm { preset: Preset::Game, lights: 4000, cell: None, range: Some(1e4) }),
    tolerance: 0.02,
};

/// The three presets as they ship; then `game` with half and twice the cells, and with half and twice the lights.
fn sweep(stage: &Stage<'_>) -> Vec<Box<dyn Method>> {
    let as_shipped = |preset: Preset| Vlm { preset, lights: stage.budget(preset), cell: None, range: None };
    let game = || as_shipped(Preset::Game);
    let cell =
        stage.baked(Preset::Game, game().lights).ok().and_then(|b| Some(b.asset.grid.as_ref()?.cell_size));
    let with_cell = |factor: f32| Vlm { cell: cell.map(|cell| cell * factor), ..game() };
    let mut methods: Vec<Box<dyn Method>> =
        Preset::ALL.map(|preset| Box::new(as_shipped(preset)) as Box<dyn Method>).into();
    methods.extend([2.0, 0.5].map(|factor| Box::new(with_cell(factor)) as Box<dyn Method>));
    let lights = [game().lights / 4, game().lights * 4];
    methods.extend(lights.map(|lights| Box::new(Vlm { lights, ..game() }) as Box<dyn Method>));
    methods
}

/// The method at one setting.
pub struct Vlm {
    /// Decides the samples of each light, and its reach.
    pub preset: Preset,
    /// Asked of the baker.
    pub lights: u32,
    /// Edge of a grid cell, metres; `None` for the baker's choice.
    pub cell: Option<f32>,
    /// Reach of a light in the grid, in multiples of its radius; `None` for the preset's.
    pub range: Option<f32>,
}

impl Method for Vlm {
    fn name(&self) -> &'static str {
        ENTRY.name
    }

    fn knob(&self) -> String {
        let mut knob = format!("preset={} lights={}", self.preset.name(), self.lights);
        if let Some(cell) = self.cell {
            knob += &format!(" cell={cell:.4}");
        }
        if let Some(range) = self.range {
            knob += &format!(" range={range}");
        }
        knob
    }

    fn prepare(&self, stage: &Stage<'_>) -> Result<Box<dyn Prepared>, MethodError> {
        let lights = AreaLights::new(stage, stage.baked(self.preset, self.lights)?)?;
        let mut asset = lights.baked.asset.clone();
        let mut grid_seconds = lights.baked.grid_seconds;
        if self.cell.is_some() || self.range.is_some() {
            let scene = stage.trace.scene;
            let range = self.range.unwrap_or(BakeOptions::preset(self.preset, scene.triangles.len()).range);
            let corners: Vec<_> =
                lights.world.geometry.iter().map(|light| light.corners().map(|p| p.as_dvec3())).collect();
            let start = Instant::now();
            asset.grid = grid(scene, &corners, self.cell, range);
            grid_seconds = start.elapsed().as_secs_f64();
        }
        Ok(Box::new(PreparedVlm { lights, asset, grid_seconds }))
    }
}

struct PreparedVlm {
    lights: AreaLights,
    /// With the grid of this setting.
    asset: VlmAsset,
    grid_seconds: f64,
}

impl Prepared for PreparedVlm {
    fn render(&self, view: &View<'_>, _frame: u32) -> Result<Picture, MethodError> {
        Ok(self.lights.picture(gather_by_grid(view.trace, &self.asset, &view.gbuffer, &Silent)?))
    }

    fn cost(&self) -> Cost {
        let prepare_seconds = self.lights.baked.lights_seconds + self.grid_seconds;
        Cost { prepare_seconds, bytes: self.lights.bytes() + grid_bytes(&self.asset) }
    }

    fn area_lights(&self) -> Option<Arc<Baked>> {
        Some(Arc::clone(&self.lights.baked))
    }
}
