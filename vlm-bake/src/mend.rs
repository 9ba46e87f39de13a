//! Stage 6: hides the lights behind their surface, and refines where that fails.
//!
//! Each round offsets the mesh anew and looks which lights fail. A light that lies across a bend is cut there: its parts
//! follow the surface, and so need less depth. What still fails when the budget is spent sinks or shrinks by itself; a light of half
//! the size reaches half as high over its points' horizons, and a larger radiosity keeps its flux.

use glam::DVec3;
use rayon::prelude::*;

use crate::clearance::rise;
use crate::correspondence::{Correspondence, Light, points_of_lights};
use crate::decimate::LightMesh;
use crate::ground::Ground;
use crate::offset::{Surroundings, offset};
use crate::refine::Refiner;
use crate::scene::Scene;
use crate::slivers::MAX_ASPECT;
use crate::surface::SurfacePoint;
use crate::topology::aspect_ratio;
use crate::verify::judge::{Evidence, Violation, judge, verify};
use crate::write::as_stored;

/// Share of the budget that is kept for lights that fail. Higher values leave fewer of them, and larger lights everywhere else.
const MENDING_SHARE: f64 = 0.2;

/// Rounds of cutting lights that fail.
const ROUNDS: usize = 5;

/// Points per light by which failing lights are found while there is budget to cut them. Higher values find more of them, slowly.
const ROUGH_POINTS_PER_LIGHT: usize = 20;

/// The least number of these points.
const LEAST_ROUGH_POINTS: usize = 20_000;

/// The sizes to which a light may shrink, largest first. Below half, the rest of its surface would be lit from too small a place.
const SIZES: [f64; 4] = [1.0, 0.85, 0.7, 0.5];

/// A light sinks by itself by at most this share of its longest edge, for the reason that vertices move by no more.
const SINK_SHARE: f64 = 0.4;

/// A shrunk light lies this many times the required clearance behind its surface, so that rounding does not fail it.
const MARGIN: f64 = 1.05;

/// Lights that hide as far as they can.
#[derive(Clone, Debug, Default)]
pub struct Hidden {
    /// The lights in place.
    pub lights: Vec<Light>,
    /// The face of the decimated mesh of which each is a part.
    pub coarse: Vec<u32>,
    /// How far each lies from its place of rest along its normal, metres.
    pub depths: Vec<f64>,
    /// The area of each at rest, square metres.
    pub rest_areas: Vec<f64>,
}

/// Refines to the budget and hides the lights.
#[must_use]
pub fn mend(mut refiner: Refiner, budget: usize, around: &Surroundings) -> Hidden {
    refiner.to_budget((budget as f64 * (1.0 - MENDING_SHARE)) as usize);
    let fewer = thinned(around.points, budget);
    let roughly = Surroundings { points: &fewer, ..*around };
    for _ in 0..ROUNDS {
        let room = budget.saturating_sub(refiner.lights());
        if room == 0 {
            break;
        }
        let (mesh, emits) = in_place(&refiner, &roughly);
        let lights = mesh.lights();
        let failing = look(&lights, &emits, &roughly, |lights, evidence| {
            for f in (0..lights.len()).filter(|&f| evidence.own_points(f).next().is_none()) {
                refiner.density[f] = 0.0;
            }
            curable(lights, evidence)
        });
        if failing.is_empty() {
            break;
        }
        cut(&mut refiner, &lights, failing, room);
    }
    refiner.to_budget(budget);
    let (mesh, emits) = in_place(&refiner, around);
    let mut lights = mesh.lights();
    let mended = look(&lights, &emits, around, |lights, evidence| {
        let failing = curable(lights, evidence);
        let mended = |v: &Violation| Some((v.light, shrunk(v.light, lights, evidence, around.deepest)?));
        failing.par_iter().filter_map(mended).collect::<Vec<_>>()
    });
    for (l, light) in mended {
        lights[l as usize] = light;
    }
    collect(&refiner, lights, &emits)
}

/// Every n-th point, enough of them to see which lights fail badly.
fn thinned(points: &[SurfacePoint], budget: usize) -> Vec<SurfacePoint> {
    let enough = (ROUGH_POINTS_PER_LIGHT * budget).max(LEAST_ROUGH_POINTS);
    // An odd step, since the two sides of two-sided surfaces take turns.
    points.iter().step_by(points.len().div_ceil(enough) | 1).copied().collect()
}

/// The lights as the file will hold them, rounded to single precision in the space of their node, without those that would be too thin
/// or stand for no surface; and the light that stands for each point.
#[must_use]
pub fn kept(
    scene: &Scene,
    ground: &Ground,
    points: &[SurfacePoint],
    hidden: Hidden,
) -> (Hidden, Vec<Option<u32>>) {
    let Hidden { mut lights, coarse, depths, rest_areas } = hidden;
    lights.par_iter_mut().for_each(|light| {
        let object = &scene.objects[ground.objects[light.region as usize] as usize];
        light.corners = as_stored(object.world_from_node, light.corners);
    });
    let shaped: Vec<bool> = lights.iter().map(|l| aspect_ratio(l.corners) <= MAX_ASPECT).collect();
    let mut light_of_point = Correspondence::new(ground, &lights, |l| shaped[l]).of(points);
    let standing = points_of_lights(&light_of_point, lights.len());
    let chosen: Vec<usize> = (0..lights.len()).filter(|&l| !standing.of(l).is_empty()).collect();
    let mut number = vec![0; lights.len()];
    for (new, &old) in (0..).zip(&chosen) {
        number[old] = new;
    }
    light_of_point.iter_mut().flatten().for_each(|light| *light = number[*light as usize]);
    let hidden = Hidden {
        lights: chosen.iter().map(|&l| lights[l]).collect(),
        coarse: chosen.iter().map(|&l| coarse[l]).collect(),
        depths: chosen.iter().map(|&l| depths[l]).collect(),
        rest_areas: chosen.iter().map(|&l| rest_areas[l]).collect(),
    };
    (hidden, light_of_point)
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
    what: impl FnOnce(&[Light], &Evidence) -> T,
) -> T {
    let correspondence = Correspondence::new(around.ground, lights, |l| emits[l]);
    let standing = points_of_lights(&correspondence.of(around.points), lights.len());
    let evidence = Evidence { ground: around.ground, points: around.points, standing: &standing };
    what(lights, &evidence)
}

/// The lights that fail, but those of two-sided surfaces, behind which nothing can hide.
fn curable(lights: &[Light], evidence: &Evidence) -> Vec<Violation> {
    let mut failing = verify(lights, evidence);
    let one_sided =
        |v: &Violation| !evidence.ground.patches.regions[lights[v.light as usize].region as usize].two_sided;
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
    let target = MARGIN * evidence.ground.clearance;
    SIZES.iter().find_map(|&size| {
        let smaller = light.corners.map(|v| centre + (v - centre) * size);
        let needed = |point: &SurfacePoint| {
            (rise(&smaller, point.position, point.normal) + target) / point.normal.dot(normal)
        };
        let depth = evidence.own_points(number as usize).map(needed).fold(f64::NEG_INFINITY, f64::max);
        let sunk = Light { corners: smaller.map(|v| v - normal * depth), ..*light };
        let hides = depth.abs() <= deepest.min(SINK_SHARE * light.longest_edge())
            && judge(number as usize, &sunk, evidence).is_none();
        hides.then_some(sunk)
    })
}

/// The lights of the faces that emit.
fn collect(refiner: &Refiner, lights: Vec<Light>, emits: &[bool]) -> Hidden {
    let mut hidden = Hidden::default();
    for (f, light) in lights.into_iter().enumerate() {
        if !emits[f] {
            continue;
        }
        let centre = |corners: [DVec3; 3]| corners.iter().sum::<DVec3>() / 3.0;
        let moved = centre(refiner.mesh.corners(f)) - centre(light.corners);
        hidden.depths.push(moved.dot(light.normal()));
        hidden.rest_areas.push(refiner.mesh.area(f));
        hidden.coarse.push(refiner.mesh.faces[f].coarse);
        hidden.lights.push(light);
    }
    hidden
}
