//! Which light stands for each point, kept up to date while lights move.
//!
//! A search of every point's light costs more than all else that hides lights. So only points whose own light changed look
//! again, and those that have none look among the lights that changed. A point whose light stayed keeps it, though another may have come
//! nearer by a clearance or so; the proof of the finished file looks for every point anew.

use rayon::prelude::*;

use crate::correspondence::{Correspondence, Light, points_of_lights};
use crate::ground::Ground;
use crate::surface::SurfacePoint;
use crate::topology::Lists;

/// Points and their lights.
pub struct Standing<'a> {
    /// The points.
    pub points: &'a [SurfacePoint],
    /// The light of each, of those last given.
    pub light_of_point: Vec<Option<u32>>,
    lights: Vec<Option<Light>>,
}

impl<'a> Standing<'a> {
    /// No light stands for these points yet.
    #[must_use]
    pub fn new(points: &'a [SurfacePoint]) -> Self {
        Self { points, light_of_point: vec![None; points.len()], lights: Vec::new() }
    }

    /// Takes the lights as they are now, of which those that `emits` names count; numbers stay, and new ones come last.
    pub fn update(&mut self, ground: &Ground, lights: &[Light], emits: &[bool]) {
        let now: Vec<Option<Light>> =
            lights.iter().zip(emits).map(|(l, &emits)| emits.then_some(*l)).collect();
        let changed: Vec<bool> =
            now.iter().enumerate().map(|(l, light)| self.lights.get(l) != Some(light)).collect();
        self.lights = now;
        if !changed.contains(&true) {
            return;
        }
        let all = Correspondence::new(ground, lights, |l| emits[l]);
        let moved = Correspondence::new(ground, lights, |l| emits[l] && changed[l]);
        self.light_of_point.par_iter_mut().zip(self.points).for_each(|(light, point)| match *light {
            None => *light = moved.light_of(point),
            Some(old) if changed[old as usize] => *light = all.light_of(point),
            Some(_) => {}
        });
    }

    /// Looks for the light of every point anew among the same lights.
    pub fn refresh(&mut self, ground: &Ground, lights: &[Light]) {
        let search = Correspondence::new(ground, lights, |l| self.lights[l].is_some());
        self.light_of_point = search.of(self.points);
    }

    /// The points of each light.
    #[must_use]
    pub fn lists(&self) -> Lists {
        points_of_lights(&self.light_of_point, self.lights.len())
    }
}
