//! shadows: which real lights the points of the renderer see; whatever finds it fills [`crate::Frame::visibility`].

use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};

use glam::Vec3;
use rayon::prelude::*;
use vlm_bake::scene::Scene;
use vlm_bake::shade::TraceScene;

use super::arguments::ShadowsArg;
use super::error::ViewError;
use super::gpu::Gpu;
use super::shadow_maps::{DrawnMap, MapRenderer, frusta};
use crate::frame::{ShadowMap, Visibility};
use crate::{Point, PunctualLight};

/// What finds shadows. New kinds get a variant here and an arm in each method of [`Shadows`].
enum Source {
    /// Rays on the processor, on a thread of their own.
    Rays(Rays),
    /// Maps on the device.
    Maps(Maps),
}

/// Texels along each side of a shadow map. More of them err less, at four times the memory for twice as many.
const TEXELS: u32 = 2048;

/// The maps of the last lights.
struct Maps {
    renderer: MapRenderer,
    scene: Arc<Scene>,
    drawn: Vec<DrawnMap>,
    revision: u64,
}

/// The visibility of one renderer's points.
pub struct Shadows {
    source: Source,
    points: Vec<Point>,
    /// What is asked for, or was found.
    lights: Option<Vec<PunctualLight>>,
    pending: Option<Receiver<Vec<f32>>>,
    found: Option<Vec<f32>>,
}

impl Shadows {
    /// Shadows of a scene at the points of a renderer.
    #[must_use]
    pub fn new(kind: ShadowsArg, (gpu, scene, rays): (&Gpu, &Arc<Scene>, &Rays), points: &[Point]) -> Self {
        let source = match kind {
            ShadowsArg::Rays => Source::Rays(rays.clone()),
            ShadowsArg::Maps => Source::Maps(Maps {
                renderer: MapRenderer::new(&gpu.device, &gpu.queue, scene),
                scene: scene.clone(),
                drawn: Vec::new(),
                revision: 0,
            }),
        };
        Self { source, points: points.to_vec(), lights: None, pending: None, found: None }
    }

    /// Asks for the shadows of these lights, and takes what was found so far; waits for it if `must_wait`, or where there is nothing to show.
    ///
    /// # Errors
    /// If the thread ended.
    pub fn update(&mut self, lights: &[PunctualLight], must_wait: bool) -> Result<(), ViewError> {
        // Neither colour nor intensity moves a shadow.
        let white: Vec<PunctualLight> =
            lights.iter().map(|light| PunctualLight { intensity: Vec3::ONE, ..*light }).collect();
        loop {
            if self.pending.is_none() && self.lights.as_ref() != Some(&white) {
                match &mut self.source {
                    Source::Rays(rays) => {
                        self.pending = Some(rays.trace(white.clone(), self.points.clone())?);
                    }
                    Source::Maps(maps) => maps.draw(&white),
                }
                self.lights = Some(white.clone());
            }
            self.take(must_wait)?;
            if !must_wait || self.lights.as_ref() == Some(&white) {
                return Ok(());
            }
        }
    }

    fn take(&mut self, must_wait: bool) -> Result<(), ViewError> {
        let Some(pending) = &self.pending else { return Ok(()) };
        let found = if must_wait || self.found.is_none() {
            Some(pending.recv().map_err(|_| ENDED)?)
        } else {
            match pending.try_recv() {
                Ok(found) => Some(found),
                Err(TryRecvError::Empty) => None,
                Err(TryRecvError::Disconnected) => return Err(ENDED),
            }
        };
        if found.is_some() {
            (self.found, self.pending) = (found, None);
        }
        Ok(())
    }

    /// True while better shadows are on their way.
    #[must_use]
    pub fn is_pending(&self) -> bool {
        self.pending.is_some()
    }

    /// The maps that were drawn last, where shadows come from maps.
    #[must_use]
    pub fn maps(&self) -> Option<Vec<ShadowMap<'_>>> {
        match &self.source {
            Source::Rays(_) => None,
            Source::Maps(maps) => Some(maps.drawn.iter().map(|map| map.shadow_map(maps.revision)).collect()),
        }
    }

    /// What rays found last.
    #[must_use]
    pub fn visibility(&self) -> Visibility<'_> {
        self.found.as_deref().map_or(Visibility::Kept, Visibility::Given)
    }
}

impl Maps {
    fn draw(&mut self, lights: &[PunctualLight]) {
        self.drawn = self.renderer.draw(&frusta(&self.scene, lights), TEXELS);
        self.revision += 1;
    }
}

const ENDED: ViewError = ViewError::Ended("the thread that traces shadows");

/// Rays of a scene, traced on a thread that keeps the tree over it. Ends when no clone is left.
#[derive(Clone)]
pub struct Rays {
    questions: Sender<Question>,
}

struct Question {
    lights: Vec<PunctualLight>,
    points: Vec<Point>,
    answer: Sender<Vec<f32>>,
}

impl Rays {
    /// Starts the thread.
    #[must_use]
    pub fn new(scene: Arc<Scene>, alpha_masks: bool) -> Self {
        let (questions, asked) = channel::<Question>();
        std::thread::spawn(move || {
            let trace = TraceScene::new(&scene);
            let trace = if alpha_masks { trace.with_alpha_masks() } else { trace };
            for Question { lights, points, answer } in asked {
                // Nobody waits any more where the scene was replaced.
                let _ = answer.send(visibility(&trace, &lights, &points));
            }
        });
        Self { questions }
    }

    fn trace(&self, lights: Vec<PunctualLight>, points: Vec<Point>) -> Result<Receiver<Vec<f32>>, ViewError> {
        let (answer, answered) = channel();
        self.questions.send(Question { lights, points, answer }).map_err(|_| ENDED)?;
        Ok(answered)
    }
}

/// 1 where a point sees a light and faces it, whatever the light's colour, else 0: `light * points + point`.
#[must_use]
pub fn visibility(trace: &TraceScene<'_>, lights: &[PunctualLight], points: &[Point]) -> Vec<f32> {
    let sees = |light: &PunctualLight, point: &Point| {
        let white = PunctualLight { intensity: Vec3::ONE, ..*light };
        let irradiance = trace.irradiance_by(&[white], point.position, point.normal, point.normal);
        if irradiance == Vec3::ZERO { 0.0 } else { 1.0 }
    };
    lights
        .iter()
        .flat_map(|light| points.par_iter().map(|point| sees(light, point)).collect::<Vec<_>>())
        .collect()
}
