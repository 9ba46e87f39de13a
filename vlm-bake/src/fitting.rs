//! Fits the lights that fail, until none does or none can be helped.
//!
//! What one light gives up may be too much for its neighbour, so that is judged anew, and fitted in turn: rounds, each with about half as
//! many lights as the one before.

use rayon::prelude::*;

use crate::correspondence::Light;
use crate::fit::fitted;
use crate::offset::Surroundings;
use crate::scene::Scene;
use crate::slivers::MAX_ASPECT;
use crate::standing::Standing;
use crate::surface::SurfacePoint;
use crate::topology::{Lists, aspect_ratio};
use crate::verify::judge::{Evidence, Violation, judge};
use crate::write::as_stored;

/// Rounds of fitting.
const ROUNDS: usize = 16;

/// In this round at the latest, every point looks for its light anew.
const LATEST_REFRESH: usize = ROUNDS - 4;

/// Lights that are being fitted.
pub struct Fitting<'a> {
    scene: &'a Scene,
    around: &'a Surroundings<'a>,
    standing: Standing<'a>,
    /// As points find them.
    placed: Vec<Light>,
    emits: Vec<bool>,
    /// As the file will hold them: rounded to single precision in the space of their node.
    pub lights: Vec<Light>,
    /// What is wrong with each.
    pub verdicts: Vec<Option<Violation>>,
    /// The points of each.
    pub lists: Lists,
}

impl<'a> Fitting<'a> {
    /// Takes the lights in place, those that `emits` names.
    #[must_use]
    pub fn new(
        scene: &'a Scene,
        around: &'a Surroundings,
        placed: Vec<Light>,
        emits: Vec<bool>,
        standing: Standing<'a>,
    ) -> Self {
        let (lists, verdicts) = (standing.lists(), vec![None; placed.len()]);
        let lights = placed.par_iter().map(|light| stored(scene, around, light)).collect();
        Self { scene, around, standing, placed, emits, lights, verdicts, lists }
    }

    /// Fits what fails; returns the light of each point.
    pub fn run(&mut self) -> Vec<Option<u32>> {
        let mut doubtful: Vec<usize> = (0..self.lights.len()).collect();
        let mut refreshed = false;
        for round in 0..ROUNDS {
            if self.around.progress.is_cancelled() {
                break;
            }
            self.judge(&doubtful);
            let fits = self.fits(&doubtful);
            for &(l, light) in &fits {
                (self.placed[l], self.lights[l]) = (light, stored(self.scene, self.around, &light));
            }
            for &l in &doubtful {
                self.emits[l] &= aspect_ratio(self.lights[l].corners) <= MAX_ASPECT;
            }
            // Where none was fitted to begin with, none moved far enough to take another's points.
            let refresh = !refreshed && round > 0 && (fits.is_empty() || round == LATEST_REFRESH);
            refreshed |= refresh;
            doubtful = self.follow(refresh);
            doubtful.extend(fits.iter().map(|(l, _)| *l));
            doubtful.sort_unstable();
            doubtful.dedup();
            if doubtful.is_empty() {
                break;
            }
        }
        self.judge(&doubtful);
        std::mem::take(&mut self.standing.light_of_point)
    }

    /// The points.
    #[must_use]
    pub fn points(&self) -> &'a [SurfacePoint] {
        self.standing.points
    }

    /// True if a light's surface cannot hide it, whatever its place.
    #[must_use]
    pub fn is_two_sided(&self, light: usize) -> bool {
        self.around.ground.patches.regions[self.lights[light].region as usize].two_sided
    }

    fn evidence(&self) -> Evidence<'_> {
        Evidence { ground: self.around.ground, points: self.standing.points, standing: &self.lists }
    }

    fn judge(&mut self, some: &[usize]) {
        let evidence = self.evidence();
        let verdicts: Vec<_> = some.par_iter().map(|&l| judge(l, &self.lights[l], &evidence)).collect();
        for (&l, verdict) in some.iter().zip(verdicts) {
            self.verdicts[l] = verdict;
        }
    }

    /// Better places for those of some lights that fail.
    fn fits(&self, some: &[usize]) -> Vec<(usize, Light)> {
        let evidence = self.evidence();
        let fit = |&l: &usize| {
            if self.around.progress.is_cancelled() {
                return None;
            }
            let own = evidence.own_points(l);
            let curable = self.verdicts[l].is_some() && !own.is_empty() && !self.is_two_sided(l);
            let fitted = || fitted(&self.lights[l], &own, &evidence, self.around.deepest);
            Some((l, curable.then(fitted)??))
        };
        some.par_iter().filter_map(fit).collect()
    }

    /// Lets points find their lights, all of them where `refresh` says so; returns the lights that gained or lost some.
    fn follow(&mut self, refresh: bool) -> Vec<usize> {
        let before = self.standing.light_of_point.clone();
        self.standing.update(self.around.ground, &self.placed, &self.emits);
        if refresh {
            self.standing.refresh(self.around.ground, &self.placed);
        }
        self.lists = self.standing.lists();
        let pairs =
            before.iter().zip(&self.standing.light_of_point).filter(|(before, after)| before != after);
        pairs.flat_map(|(before, after)| [*before, *after]).flatten().map(|l| l as usize).collect()
    }
}

/// A light as the file will hold it.
fn stored(scene: &Scene, around: &Surroundings, light: &Light) -> Light {
    let object = &scene.objects[around.ground.objects[light.region as usize] as usize];
    Light { corners: as_stored(object.world_from_node, light.corners), ..*light }
}
