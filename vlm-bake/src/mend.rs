//! Stage 6: hides the lights behind their surface, and refines where that fails.
//!
//! Each round offsets the mesh anew and looks which lights fail. A light that lies across a bend is cut there: its parts
//! follow the surface, and so need less depth. What still fails when the budget is spent sinks or shrinks by itself; a light of half
//! the size reaches half as high over its points' horizons, and a larger radiosity keeps its flux.

use glam::DVec3;
use rayon::prelude::*;

use crate::clearance::rise;
use crate::correspondence::{Correspondence, Light, Standing};
use crate::decimate::LightMesh;
use crate::offset::{Surroundings, offset};
use crate::refine::Refiner;
use crate::signed_distance::IslandDistance;
use crate::slivers::MAX_ASPECT;
use crate::topology::aspect_ratio;
use crate::verify::{Evidence, Violation, judge, verify};

/// Share of the budget that is kept for lights that fail. Higher values leave fewer of them, and larger lights everywhere else.
const MENDING_SHARE: f64 = 0.15;

/// Rounds of cutting lights that fail.
const ROUNDS: usize = 4;

/// The sizes to which a light may shrink, largest first. Below half, the rest of its surface would be lit from too small a place.
const SIZES: [f64; 4] = [1.0, 0.85, 0.7, 0.5];

/// A shrunk light lies this many times the required clearance behind its surface, so that rounding does not fail it.
const MARGIN: f64 = 1.05;

/// Lights that hide as far as they can.
pub struct Hidden {
    /// The lights in place.
    pub lights: Vec<Light>,
    /// The face of the decimated mesh of which each is a part.
    pub coarse: Vec<u32>,
    /// How far each lies from its place of rest along its normal, metres.
    pub depths: Vec<f64>,
}

/// Refines to the budget and hides the lights.
#[must_use]
pub fn mend(mut refiner: Refiner, budget: usize, around: &Surroundings, distance: &IslandDistance) -> Hidden {
    refiner.to_budget((budget as f64 * (1.0 - MENDING_SHARE)) as usize);
    for _ in 0..ROUNDS {
        let room = budget.saturating_sub(refiner.lights());
        if room == 0 {
            break;
        }
        let (mesh, emits) = in_place(&refiner, around);
        let lights = mesh.lights();
        let failing = look(&lights, &emits, around, distance, curable);
        if failing.is_empty() {
            break;
        }
        cut(&mut refiner, &lights, failing, room);
    }
    refiner.to_budget(budget);
    let (mesh, emits) = in_place(&refiner, around);
    let mut lights = mesh.lights();
    let mended = look(&lights, &emits, around, distance, |lights, evidence| {
        let failing = curable(lights, evidence);
        let mended = |v: &Violation| Some((v.light, shrunk(v.light, lights, evidence, around.deepest)?));
        failing.par_iter().filter_map(mended).collect::<Vec<_>>()
    });
    for (l, light) in mended {
        lights[l as usize] = light;
    }
    collect(&refiner, lights, &emits)
}

/// The mesh with its vertices where they hide best, and which faces make lights there.
fn in_place(refiner: &Refiner, around: &Surroundings) -> (LightMesh, Vec<bool>) {
    let mut mesh = refiner.mesh.clone();
    let emits: Vec<bool> = refiner.density.iter().map(|&density| density > 0.0).collect();
    offset(&mut mesh, &refiner.mesh.positions, &emits, around);
    let shaped = |f: usize| emits[f] && aspect_ratio(mesh.corners(f)) <= MAX_ASPECT;
    let emits = (0..mesh.faces.len()).map(shaped).collect();
    (mesh, emits)
}

/// Shows the lights and what they stand for to `what`.
fn look<T>(
    lights: &[Light],
    emits: &[bool],
    around: &Surroundings,
    distance: &IslandDistance,
    what: impl Fn(&[Light], &Evidence) -> T,
) -> T {
    let correspondence = Correspondence::new(around.patches, lights, around.reach, |l| emits[l]);
    let standing = Standing::new(&correspondence.of(around.points), lights.len());
    let evidence = Evidence {
        patches: around.patches,
        points: around.points,
        standing: &standing,
        distance,
        way_out: around.way_out,
        clearance: around.clearance,
    };
    what(lights, &evidence)
}

/// The lights that fail, but those of two-sided surfaces, behind which nothing can hide.
fn curable(lights: &[Light], evidence: &Evidence) -> Vec<Violation> {
    let mut failing = verify(lights, evidence);
    let one_sided =
        |v: &Violation| !evidence.patches.regions[lights[v.light as usize].region as usize].two_sided;
    failing.retain(one_sided);
    failing
}

/// Cuts the largest of the failing lights.
fn cut(refiner: &mut Refiner, lights: &[Light], mut failing: Vec<Violation>, room: usize) {
    let area = |v: &Violation| lights[v.light as usize].area();
    failing.sort_by(|a, b| area(b).total_cmp(&area(a)).then(a.light.cmp(&b.light)));
    let goal = refiner.lights() + room;
    for violation in failing {
        if refiner.lights() >= goal {
            break;
        }
        refiner.cut_face(violation.light);
    }
}

/// A failing light sunk along its normal, or as large as it can be without failing; `None` if no size helps.
fn shrunk(number: u32, lights: &[Light], evidence: &Evidence, deepest: f64) -> Option<Light> {
    let light = &lights[number as usize];
    let (normal, centre) = (light.normal(), light.corners.iter().sum::<DVec3>() / 3.0);
    let target = MARGIN * evidence.clearance;
    SIZES.iter().find_map(|&size| {
        let smaller = light.corners.map(|v| centre + (v - centre) * size);
        let needed = |point| (rise(&smaller, point) + target) / point.normal.dot(normal);
        let depth = evidence.own_points(number as usize).map(needed).fold(f64::NEG_INFINITY, f64::max);
        let sunk = Light { corners: smaller.map(|v| v - normal * depth), ..*light };
        let hides = depth.abs() <= deepest && judge(number as usize, &sunk, evidence).is_none();
        hides.then_some(sunk)
    })
}

/// The lights of the faces that emit.
fn collect(refiner: &Refiner, lights: Vec<Light>, emits: &[bool]) -> Hidden {
    let mut hidden = Hidden { lights: Vec::new(), coarse: Vec::new(), depths: Vec::new() };
    for (f, light) in lights.into_iter().enumerate() {
        if !emits[f] {
            continue;
        }
        let centre = |corners: [DVec3; 3]| corners.iter().sum::<DVec3>() / 3.0;
        let moved = centre(refiner.mesh.corners(f)) - centre(light.corners);
        hidden.depths.push(moved.dot(light.normal()));
        hidden.coarse.push(refiner.mesh.faces[f].coarse);
        hidden.lights.push(light);
    }
    hidden
}
