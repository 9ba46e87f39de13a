//! Stage 7: ids for the lights that cannot hide behind their surface. A receiver is never lit by a light of its own tag.
//!
//! Automatic tags go to primitives: a primitive with two-sided surface, or one whose lights `verify` could not clear, gets an
//! id; only the lights that need it carry it. An artist's tag (`extras.vlm.tag`) holds for all lights and primitives of its object, and
//! wins.

use std::collections::BTreeMap;

use glam::DVec3;
use serde::Serialize;

use crate::correspondence::Light;
use crate::patches::Patches;
use crate::scene::Scene;
use crate::topology::cross_of;
use crate::verify::Violation;

/// Why a tag was given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum TagReason {
    /// The artist asked for it.
    Authored,
    /// Both sides of the surface reflect.
    TwoSided,
    /// The check found lights that light their own surface or come out of it.
    Uncleared,
}

/// One tag, as the report shows it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TagReport {
    /// The id.
    pub tag: u32,
    /// Node path of its object.
    pub object: String,
    /// glTF mesh and primitive.
    pub mesh: u32,
    /// Index of the primitive within the mesh.
    pub primitive: u32,
    /// Why.
    pub reason: TagReason,
    /// Lights that carry it.
    pub lights: usize,
    /// Their area in square metres.
    pub area_m2: f64,
}

/// The tags of a scene.
#[derive(Clone, Debug, Default)]
pub struct Tags {
    /// Per light, 0 for none.
    pub lights: Vec<u32>,
    /// By glTF mesh and primitive: instances of a mesh share the primitive, and so its tag.
    by_primitive: BTreeMap<(u32, u32), TagReport>,
    last: u32,
}

impl Tags {
    /// `(mesh, primitive, tag)`, ascending.
    #[must_use]
    pub fn primitives(&self) -> Vec<(u32, u32, u32)> {
        self.by_primitive.iter().map(|(&(mesh, primitive), entry)| (mesh, primitive, entry.tag)).collect()
    }

    /// One entry per tagged primitive.
    #[must_use]
    pub fn report(&self) -> Vec<TagReport> {
        self.by_primitive.values().cloned().collect()
    }

    /// The tag of a scene primitive, 0 for none.
    #[must_use]
    pub fn of_primitive(&self, scene: &Scene, primitive: u32) -> u32 {
        let primitive = &scene.primitives[primitive as usize];
        self.by_primitive.get(&(primitive.mesh, primitive.primitive)).map_or(0, |entry| entry.tag)
    }

    /// Tags an authored light that lights the scene primitive for which it stands; returns the tag.
    pub fn add_uncleared(&mut self, scene: &Scene, primitive: u32, corners: [DVec3; 3]) -> u32 {
        self.add(scene, primitive, TagReason::Uncleared, 0.5 * cross_of(corners).length())
    }

    fn add(&mut self, scene: &Scene, primitive: u32, reason: TagReason, area_m2: f64) -> u32 {
        let primitive = &scene.primitives[primitive as usize];
        let object = &scene.objects[primitive.object as usize];
        let (mesh, primitive) = (primitive.mesh, primitive.primitive);
        let last = &mut self.last;
        let entry = self.by_primitive.entry((mesh, primitive)).or_insert_with(|| {
            let tag = object.steering.tag.unwrap_or_else(|| {
                *last += 1;
                *last
            });
            TagReport { tag, object: object.path.clone(), mesh, primitive, reason, lights: 0, area_m2: 0.0 }
        });
        entry.reason = entry.reason.min(reason);
        entry.lights += 1;
        entry.area_m2 += area_m2;
        entry.tag
    }
}

/// Gives tags to the failing lights, to the lights of two-sided surfaces, and to all that the artist tagged.
#[must_use]
pub fn tag(
    scene: &Scene,
    patches: &Patches,
    lights: &[Light],
    violations: &[Violation],
) -> Tags {
    let mut failing = vec![false; lights.len()];
    for violation in violations {
        failing[violation.light as usize] = true;
    }
    // Automatic ids follow the authored ones, so that the two never meet.
    let last = scene.objects.iter().filter_map(|o| o.steering.tag).max().unwrap_or(0);
    let mut tags = Tags { lights: vec![0; lights.len()], last, ..Tags::default() };
    for (l, light) in lights.iter().enumerate() {
        let region = &patches.regions[light.region as usize];
        let object = &scene.objects[scene.primitives[region.primitive as usize].object as usize];
        let reason = match object.steering.tag {
            Some(_) => TagReason::Authored,
            None if region.two_sided => TagReason::TwoSided,
            None if failing[l] => TagReason::Uncleared,
            None => continue,
        };
        tags.lights[l] = tags.add(scene, region.primitive, reason, light.area());
    }
    tags
}
