//! [`crate::methods::vlm`] by the runtime.

use super::{OnGpu, Ready};
use crate::method::{MethodError, Prepared, Stage};
use crate::methods::area_lights::AreaLights;
use crate::methods::vlm::Vlm;
use crate::methods::{Entry, vlm};

/// The method's line in the table.
pub const ENTRY: Entry = Entry {
    sweep: |stage| vlm::settings(stage).into_iter().map(|vlm| OnGpu::boxed(vlm, prepare)).collect(),
    proof: || OnGpu::boxed(vlm::whole(), prepare),
    ..vlm::ENTRY
};

fn prepare(vlm: &Vlm, stage: &Stage<'_>) -> Result<Box<dyn Prepared>, MethodError> {
    let lights = AreaLights::new(stage, stage.baked(&vlm.options(stage))?)?;
    let cost = vlm::cost(&lights);
    Ready::boxed(stage, lights, cost)
}
