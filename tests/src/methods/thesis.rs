//! Aquotte 2017: active hemispheres, lists of fixed size, the textbook formula in single precision; see
//! [`crate::thesis`].

use std::sync::Arc;

use vlm_bake::options::Preset;
use vlm_bake::progress::Silent;
use vlm_bake::render::LitScene;

use super::Entry;
use super::area_lights::AreaLights;
use crate::method::{Baked, Cost, Method, MethodError, Picture, Prepared, Stage, View};
use crate::thesis::{ThesisGrid, ThesisOptions, gather};

/// The method's line in the table. The proof's range reaches everything, and its list holds everything.
pub const ENTRY: Entry = Entry { name: "thesis", sweep, proof: || Box::new(whole()), tolerance: 0.02 };

/// Cells along each axis, as the thesis' middle setting.
const GRID: u32 = 32;

fn sweep(stage: &Stage<'_>) -> Vec<Box<dyn Method>> {
    settings(stage).into_iter().map(|thesis| Box::new(thesis) as Box<dyn Method>).collect()
}

/// One list per cell that holds all lights.
pub(super) fn whole() -> Thesis {
    Thesis { lights: 4000, options: ThesisOptions { range: 1e4, list: 8192, grid: 1 } }
}

/// Two numbers of lights, three ranges, and two lengths of lists: the thesis' working point of about 30 lights a cell, and nothing dropped in
/// most scenes.
pub(super) fn settings(stage: &Stage<'_>) -> Vec<Thesis> {
    let mut methods = Vec::new();
    for preset in [Preset::Draft, Preset::Game] {
        for list in [32, 512] {
            for range in [1.5, 4.5, 8.0] {
                let options = ThesisOptions { range, list, grid: GRID };
                methods.push(Thesis { lights: stage.budget(preset), options });
            }
        }
    }
    methods
}

/// The method at one setting.
pub struct Thesis {
    /// Asked of the baker. More follow shape and shadow better, but each then reaches less far.
    pub lights: u32,
    /// The grid's knobs.
    pub options: ThesisOptions,
}

impl Method for Thesis {
    fn name(&self) -> &'static str {
        ENTRY.name
    }

    fn knob(&self) -> String {
        let ThesisOptions { range, list, grid } = self.options;
        format!("lights={} range={range} list={list} grid={grid}", self.lights)
    }

    fn prepare(&self, stage: &Stage<'_>) -> Result<Box<dyn Prepared>, MethodError> {
        let lights = AreaLights::new(stage, stage.baked(&stage.without_grid(Preset::Game, self.lights))?)?;
        let (low, high) = stage.bounds();
        let grid = ThesisGrid::build(&lights.world.geometry, low, high, &self.options);
        Ok(Box::new(PreparedThesis { lights, grid }))
    }
}

struct PreparedThesis {
    lights: AreaLights,
    grid: ThesisGrid,
}

impl Prepared for PreparedThesis {
    fn render(&self, view: &View<'_>, _frame: u32) -> Result<Picture, MethodError> {
        let lit = LitScene::new(view.trace, &self.lights.baked.asset)?;
        let gathered = lit.gather(&view.gbuffer, &Silent, |receiver| {
            gather(&lit, self.grid.lights_at(receiver.position), receiver)
        });
        Ok(self.lights.picture(gathered))
    }

    fn cost(&self) -> Cost {
        let prepare_seconds = self.lights.baked.lights_seconds + self.grid.build_seconds;
        Cost { prepare_seconds, bytes: self.lights.bytes() + self.grid.bytes() }
    }

    fn area_lights(&self) -> Option<Arc<Baked>> {
        Some(Arc::clone(&self.lights.baked))
    }
}
