//! No indirect light: what the others must beat.

use glam::Vec3;

use super::Entry;
use crate::method::{Cost, Method, MethodError, Picture, Prepared, Stage, View};

/// The method's line in the table.
pub const ENTRY: Entry =
    Entry { name: "direct", sweep: |_| vec![Box::new(Direct)], proof: || Box::new(Direct), tolerance: 0.0 };

struct Direct;

impl Method for Direct {
    fn name(&self) -> &'static str {
        ENTRY.name
    }

    fn knob(&self) -> String {
        String::new()
    }

    fn gives_indirect_light(&self) -> bool {
        false
    }

    fn prepare(&self, _stage: &Stage<'_>) -> Result<Box<dyn Prepared>, MethodError> {
        Ok(Box::new(Self))
    }
}

impl Prepared for Direct {
    fn render(&self, view: &View<'_>, _frame: u32) -> Result<Picture, MethodError> {
        Ok(Picture { indirect: vec![Vec3::ZERO; view.gbuffer.points.len()], ..Picture::default() })
    }

    fn cost(&self) -> Cost {
        Cost::default()
    }
}
