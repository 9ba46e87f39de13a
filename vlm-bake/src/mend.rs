//! Stage 6: hides the lights behind their surface, and refines where that fails.
//!
//! Each round offsets the mesh anew and looks which lights fail. A light that lies across a bend is cut there: its parts
//! follow the surface, and so need less depth. What still fails when the budget is spent sinks or shrinks by itself; a light of half
//! the size reaches half as high over its points' horizons, and a larger radiosity keeps its flux.

use glam::DVec3;
use rayon::prelude::*;

use crate::clearance::rise;
use crate::correspondence::Light;
use crate::decimate::LightMesh;
use crate::offset::{Offset, Surroundings};
use crate::refine::Refiner;
use crate::scene::Scene;
use crate::slivers::MAX_ASPECT;
use crate::standing::Standing;
use crate::surface::SurfacePoint;
use crate::topology::aspect_ratio;
use crate::verify::judge::{Evidence, Violation, judge};
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
    /// The lights in place, as the file will hold them: rounded to single precision in the space of their node.
    pub lights: Vec<Light>,
    /// The face of the decimated mesh of which each is a part.
    pub coarse: Vec<u32>,
    /// How far each lies from its place of rest along its normal, metres.
    pub depths: Vec<f64>,
    /// The area of each at rest, square metres.
    pub rest_areas: Vec<f64>,
    /// The light that stands for each point.
    pub light_of_point: Vec<Option<u32>>,
    /// The lights that fail all the same, ascending.
    pub violations: Vec<Violation>,
}

/// Refines to the budget and hides the lights from `points`.
#[must_use]
pub fn mend(
    scene: &Scene,
    mut refiner: Refiner,
    budget: usize,
    around: &Surroundings,
    points: &[SurfacePoint],
) -> Hidden {
    let ground = around.ground;
    refiner.to_budget((budget as f64 * (1.0 - MENDING_SHARE)) as usize);
    let mut offset = Offset::default();
    let fewer = thinned(points, budget);
    let mut roughly = Standing::new(&fewer);
    let mut judged = Vec::new();
    for _ in 0..ROUNDS {
        let room = budget.saturating_sub(refiner.lights());
        if room == 0 {
            break;
        }
        place(&refiner, around, &mut offset, &mut roughly);
        let standing = roughly.lists();
        for f in (0..refiner.density.len()).filter(|&f| standing.of(f).is_empty()) {
            refiner.density[f] = 0.0;
        }
        let lights = offset.mesh.lights();
        let evidence = Evidence { ground, points: &fewer, standing: &standing };
        let failing = curable(&lights, &evidence, |l| judged.get(l) != Some(&lights[l]));
        if failing.is_empty() {
            break;
        }
        cut(&mut refiner, &lights, failing, room);
        judged = lights;
    }
    refiner.to_budget(budget);
    let mut standing = Standing::new(points);
    let emits = place(&refiner, around, &mut offset, &mut standing);
    finish(scene, &refiner, &offset.mesh, &emits, around, standing)
}

/// Every n-th point, enough of them to see which lights fail badly.
#[must_use]
pub fn thinned(points: &[SurfacePoint], lights: usize) -> Vec<SurfacePoint> {
    let enough = (ROUGH_POINTS_PER_LIGHT * lights).max(LEAST_ROUGH_POINTS);
    // An odd step, since the two sides of two-sided surfaces take turns.
    points.iter().step_by(points.len().div_ceil(enough) | 1).copied().collect()
}

/// Puts the vertices where they hide best; returns which faces make lights there.
fn place(refiner: &Refiner, around: &Surroundings, offset: &mut Offset, standing: &mut Standing) -> Vec<bool> {
    let emits: Vec<bool> = refiner.density.iter().map(|&density| density > 0.0).collect();
    offset.place(&refiner.mesh, &emits, around, standing);
    let mesh = &offset.mesh;
    let emits: Vec<bool> =
        (0..mesh.faces.len()).map(|f| emits[f] && aspect_ratio(mesh.corners(f)) <= MAX_ASPECT).collect();
    standing.update(around.ground, &mesh.lights(), &emits);
    emits
}

/// The failing ones among some lights, but for those of two-sided surfaces, behind which nothing can hide.
fn curable(lights: &[Light], evidence: &Evidence, some: impl Fn(usize) -> bool + Sync) -> Vec<Violation> {
    let regions = &evidence.ground.patches.regions;
    let one_sided = |l: usize| !regions[lights[l].region as usize].two_sided;
    (0..lights.len())
        .into_par_iter()
        .filter(|&l| one_sided(l) && some(l))
        .filter_map(|l| judge(l, &lights[l], evidence))
        .collect()
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

/// The lights as the file will hold them, sunk or shrunk where they fail by themselves; without those that would be too thin or stand for
/// no surface.
fn finish(
    scene: &Scene,
    refiner: &Refiner,
    mesh: &LightMesh,
    emits: &[bool],
    around: &Surroundings,
    mut standing: Standing,
) -> Hidden {
    let ground = around.ground;
    let stored = |light: &mut Light| {
        let object = &scene.objects[ground.objects[light.region as usize] as usize];
        light.corners = as_stored(object.world_from_node, light.corners);
    };
    let placed = mesh.lights();
    let mut lights = placed.clone();
    lights.par_iter_mut().for_each(stored);
    let lists = standing.lists();
    let evidence = Evidence { ground, points: standing.points, standing: &lists };
    let mut verdicts: Vec<Option<Violation>> =
        lights.par_iter().enumerate().map(|(l, light)| judge(l, light, &evidence)).collect();
    let shrink = |l: usize| {
        verdicts[l].as_ref().filter(|_| !ground.patches.regions[lights[l].region as usize].two_sided)?;
        let mut light = shrunk(l as u32, &lights, &evidence, around.deepest)?;
        stored(&mut light);
        Some((l, light))
    };
    let mended: Vec<(usize, Light)> = (0..lights.len()).into_par_iter().filter_map(shrink).collect();
    let mut moved = placed;
    for (l, light) in mended {
        (moved[l], lights[l]) = (light, light);
        verdicts[l] = None;
    }
    let emits: Vec<bool> =
        emits.iter().zip(&lights).map(|(&emits, l)| emits && aspect_ratio(l.corners) <= MAX_ASPECT).collect();
    let before = standing.light_of_point.clone();
    standing.update(ground, &moved, &emits);
    let lists = standing.lists();
    let evidence = Evidence { ground, points: standing.points, standing: &lists };
    for l in differing(&before, &standing.light_of_point) {
        verdicts[l as usize] = judge(l as usize, &lights[l as usize], &evidence);
    }
    let depth = |l: usize| {
        let centre = |corners: [DVec3; 3]| corners.iter().sum::<DVec3>() / 3.0;
        (centre(refiner.mesh.corners(l)) - centre(lights[l].corners)).dot(lights[l].normal())
    };
    let chosen: Vec<usize> = (0..lights.len()).filter(|&l| !lists.of(l).is_empty()).collect();
    let mut number = vec![0; lights.len()];
    for (new, &old) in (0..).zip(&chosen) {
        number[old] = new;
    }
    let renumbered = |l: usize| Some(Violation { light: number[l], ..verdicts[l].clone()? });
    Hidden {
        lights: chosen.iter().map(|&l| lights[l]).collect(),
        coarse: chosen.iter().map(|&l| refiner.mesh.faces[l].coarse).collect(),
        depths: chosen.iter().map(|&l| depth(l)).collect(),
        rest_areas: chosen.iter().map(|&l| refiner.mesh.area(l)).collect(),
        light_of_point: standing.light_of_point.iter().map(|l| Some(number[(*l)? as usize])).collect(),
        violations: chosen.iter().filter_map(|&l| renumbered(l)).collect(),
    }
}

/// The lights that gained or lost a point, ascending.
fn differing(before: &[Option<u32>], after: &[Option<u32>]) -> Vec<u32> {
    let pairs = before.iter().zip(after).filter(|(before, after)| before != after);
    let mut lights: Vec<u32> = pairs.flat_map(|(before, after)| [*before, *after]).flatten().collect();
    lights.sort_unstable();
    lights.dedup();
    lights
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
