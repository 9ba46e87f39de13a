//! [`crate::methods::vlm`] by the runtime.

use std::sync::Arc;

use super::Renderer;
use crate::method::{Backend, Baked, Cost, Method, MethodError, Picture, Prepared, Stage, View};
use crate::methods::area_lights::AreaLights;
use crate::methods::{Entry, vlm};

/// The method's line in the table.
pub const ENTRY: Entry = Entry {
    name: vlm::ENTRY.name,
    sweep: |stage| {
        vlm::settings(stage).into_iter().map(|vlm| Box::new(GpuVlm(vlm)) as Box<dyn Method>).collect()
    },
    proof: || Box::new(GpuVlm(vlm::whole())),
    tolerance: vlm::ENTRY.tolerance,
};

/// The method at one setting.
pub struct GpuVlm(vlm::Vlm);

impl Method for GpuVlm {
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
        let lights = AreaLights::new(stage, stage.baked(&self.0.options(stage))?)?;
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
        vlm::cost(&self.lights)
    }

    fn area_lights(&self) -> Option<Arc<Baked>> {
        Some(Arc::clone(&self.lights.baked))
    }

    fn device(&self) -> String {
        self.renderer.device()
    }
}
