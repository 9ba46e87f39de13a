//! Every virtual area light at every pixel, by its exact form factor and without occlusion.

use std::sync::Arc;

use vlm_bake::options::Preset;
use vlm_bake::progress::Silent;
use vlm_bake::render::gather_brute;

use super::Entry;
use super::area_lights::AreaLights;
use crate::method::{Baked, Cost, Method, MethodError, Picture, Prepared, Stage, View};

/// The method's line in the table. Decimation of a curved surface costs the most: flat facets for a sphere.
pub const ENTRY: Entry =
    Entry { name: "brute", sweep, proof: || Box::new(Brute { lights: 4000 }), tolerance: 0.02 };

fn sweep(stage: &Stage<'_>) -> Vec<Box<dyn Method>> {
    settings(stage).into_iter().map(|brute| Box::new(brute) as Box<dyn Method>).collect()
}

/// A quarter of the lights of `game`, as many, and four times as many.
pub(super) fn settings(stage: &Stage<'_>) -> Vec<Brute> {
    let game = stage.budget(Preset::Game);
    [game / 4, game, 4 * game].map(|lights| Brute { lights }).into()
}

/// The method at one setting.
pub struct Brute {
    /// Asked of the baker. More follow shape and shadow better; time grows in proportion.
    pub lights: u32,
}

impl Method for Brute {
    fn name(&self) -> &'static str {
        ENTRY.name
    }

    fn knob(&self) -> String {
        format!("lights={}", self.lights)
    }

    fn prepare(&self, stage: &Stage<'_>) -> Result<Box<dyn Prepared>, MethodError> {
        let lights = AreaLights::new(stage, stage.baked(&stage.without_grid(Preset::Game, self.lights))?)?;
        Ok(Box::new(PreparedBrute { lights }))
    }
}

struct PreparedBrute {
    lights: AreaLights,
}

impl Prepared for PreparedBrute {
    fn render(&self, view: &View<'_>, _frame: u32) -> Result<Picture, MethodError> {
        let asset = &self.lights.baked.asset;
        Ok(self.lights.picture(gather_brute(view.trace, asset, &view.gbuffer, &Silent)?))
    }

    fn cost(&self) -> Cost {
        Cost { prepare_seconds: self.lights.baked.lights_seconds, bytes: self.lights.bytes() }
    }

    fn area_lights(&self) -> Option<Arc<Baked>> {
        Some(Arc::clone(&self.lights.baked))
    }
}
