//! [`crate::methods::brute`] by the runtime, without a grid.

use vlm_bake::options::Preset;
use vlm_runtime::MOST_LISTED;

use super::{OnGpu, Ready};
use crate::method::{Cost, Method, MethodError, Prepared, Stage};
use crate::methods::area_lights::AreaLights;
use crate::methods::brute::Brute;
use crate::methods::{Entry, brute};

/// The method's line in the table.
pub const ENTRY: Entry =
    Entry { sweep, proof: || OnGpu::boxed(Brute { lights: 4000 }, prepare), ..brute::ENTRY };

/// As on the processor, as far as the runtime sums them.
fn sweep(stage: &Stage<'_>) -> Vec<Box<dyn Method>> {
    let fits = brute::settings(stage).into_iter().filter(|brute| brute.lights <= MOST_LISTED);
    fits.map(|brute| OnGpu::boxed(brute, prepare)).collect()
}

fn prepare(brute: &Brute, stage: &Stage<'_>) -> Result<Box<dyn Prepared>, MethodError> {
    let lights = AreaLights::new(stage, stage.baked(&stage.without_grid(Preset::Game, brute.lights))?)?;
    let cost = Cost { prepare_seconds: lights.baked.lights_seconds, bytes: lights.bytes() };
    Ready::boxed(stage, lights, cost)
}
