//! [`crate::methods::brute`] by the runtime, without a grid.

use std::sync::Arc;

use vlm_bake::options::Preset;
use vlm_runtime::MOST_LISTED;

use super::Renderer;
use crate::method::{Backend, Baked, Cost, Method, MethodError, Picture, Prepared, Stage, View};
use crate::methods::area_lights::AreaLights;
use crate::methods::{Entry, brute};

/// The method's line in the table.
pub const ENTRY: Entry = Entry {
    name: brute::ENTRY.name,
    sweep,
    proof: || Box::new(GpuBrute(brute::Brute { lights: 4000 })),
    tolerance: brute::ENTRY.tolerance,
};

/// As on the processor, as far as the runtime sums them.
fn sweep(stage: &Stage<'_>) -> Vec<Box<dyn Method>> {
    let fits = brute::settings(stage).into_iter().filter(|brute| brute.lights <= MOST_LISTED);
    fits.map(|brute| Box::new(GpuBrute(brute)) as Box<dyn Method>).collect()
}

/// The method at one setting.
pub struct GpuBrute(brute::Brute);

impl Method for GpuBrute {
    fn name(&self) -> &'static str {
        self.0.name()
    }

    fn knob(&self) -> String {
        self.0.knob()
    }

    fn backends(&self) -> &'static [Backend] {
        &[Backend::Gpu]
    }

    fn prepare(&self, stage: &Stage<'_>) -> Result<Box<dyn Prepared>, MethodError> {
        let baked = stage.baked(&stage.without_grid(Preset::Game, self.0.lights))?;
        let lights = AreaLights::new(stage, baked)?;
        Ok(Box::new(Ready { renderer: Renderer::new(stage, &lights)?, lights }))
    }
}

struct Ready {
    lights: AreaLights,
    renderer: Renderer,
}

impl Prepared for Ready {
    fn render(&self, view: &View<'_>, _frame: u32) -> Result<Picture, MethodError> {
        self.renderer.render(view)
    }

    fn cost(&self) -> Cost {
        Cost { prepare_seconds: self.lights.baked.lights_seconds, bytes: self.lights.bytes() }
    }

    fn area_lights(&self) -> Option<Arc<Baked>> {
        Some(Arc::clone(&self.lights.baked))
    }

    fn device(&self) -> String {
        self.renderer.device()
    }
}
