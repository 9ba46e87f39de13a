//! Stage 6: hides the lights behind their surface, and refines where that fails.
//!
//! Each round offsets the mesh anew and looks which lights fail. A light that lies across a bend is cut there: its parts
//! follow the surface, and so need less depth. What still fails when the budget is spent is fitted by itself ([`mod@crate::fit`]).

use glam::DVec3;
use rayon::prelude::*;

use crate::correspondence::Light;
use crate::decimate::LightMesh;
use crate::fitting::Fitting;
use crate::offset::{Offset, Surroundings};
use crate::refine::Refiner;
use crate::scene::Scene;
use crate::slivers::MAX_ASPECT;
use crate::standing::Standing;
use crate::surface::SurfacePoint;
use crate::topology::aspect_ratio;
use crate::verify::judge::{Evidence, Violation, judge};

/// Share of the budget that is kept for lights that fail. Higher values leave fewer of them, and larger lights everywhere else.
const MENDING_SHARE: f64 = 0.2;

/// Rounds of cutting lights that fail.
const ROUNDS: usize = 5;

/// Points per light by which failing lights are found while there is budget to cut them. Higher values find more of them, slowly.
const ROUGH_POINTS_PER_LIGHT: usize = 20;

/// The least number of these points.
const LEAST_ROUGH_POINTS: usize = 20_000;

/// A light that fails all the same is left out where it stands for less surface than this share of its own area: a tag would be all that it
/// adds. Higher values leave more of the surface without a light instead of tagging it.
const LEAST_SHARE: f64 = 0.05;

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

/// Refines to the budget and hides the lights from `points`. What is left where it was cancelled is not whole.
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
        if room == 0 || around.progress.is_cancelled() {
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
    if around.progress.is_cancelled() {
        return Hidden::default();
    }
    refiner.to_budget(budget);
    let mut standing = Standing::new(points);
    let emits = place(&refiner, around, &mut offset, &mut standing);
    collect(&refiner, &offset.mesh, Fitting::new(scene, around, offset.mesh.lights(), emits, standing))
}

/// Every n-th point, enough of them to see which lights fail badly.
#[must_use]
pub fn thinned(points: &[SurfacePoint], lights: usize) -> Vec<SurfacePoint> {
    let enough = (ROUGH_POINTS_PER_LIGHT * lights).max(LEAST_ROUGH_POINTS);
    // An odd step, since the two sides of two-sided surfaces take turns.
    points.iter().step_by(points.len().div_ceil(enough) | 1).copied().collect()
}

/// Puts the vertices where they hide best; returns which faces make lights there.
fn place(
    refiner: &Refiner,
    around: &Surroundings,
    offset: &mut Offset,
    standing: &mut Standing,
) -> Vec<bool> {
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

/// The lights that are worth it once all are fitted: without those that would be too thin or stand for no surface.
fn collect(refiner: &Refiner, placed: &LightMesh, mut fitting: Fitting) -> Hidden {
    let light_of_point = fitting.run();
    let Fitting { lights, lists, verdicts, .. } = &fitting;
    let depth = |l: usize| {
        let centre = |corners: [DVec3; 3]| corners.iter().sum::<DVec3>() / 3.0;
        (centre(refiner.mesh.corners(l)) - centre(lights[l].corners)).dot(lights[l].normal())
    };
    // A fitted light counts for the part of its rest that it kept: how much lights grew is the offset's doing alone.
    let rest_area = |l: usize| {
        let area = placed.area(l);
        refiner.mesh.area(l) * if area > 0.0 { lights[l].area() / area } else { 1.0 }
    };
    let worth = |l: usize| {
        let own: f64 = lists.of(l).iter().map(|&p| fitting.points()[p as usize].area).sum();
        fitting.is_two_sided(l) || verdicts[l].is_none() || own > LEAST_SHARE * lights[l].area()
    };
    let chosen: Vec<usize> = (0..lights.len()).filter(|&l| !lists.of(l).is_empty() && worth(l)).collect();
    let mut number = vec![None; lights.len()];
    for (new, &old) in (0..).zip(&chosen) {
        number[old] = Some(new);
    }
    let renumbered = |l: usize| Some(Violation { light: number[l]?, ..verdicts[l].clone()? });
    Hidden {
        lights: chosen.iter().map(|&l| lights[l]).collect(),
        coarse: chosen.iter().map(|&l| refiner.mesh.faces[l].coarse).collect(),
        depths: chosen.iter().map(|&l| depth(l)).collect(),
        rest_areas: chosen.iter().map(|&l| rest_area(l)).collect(),
        light_of_point: light_of_point.iter().map(|l| number[(*l)? as usize]).collect(),
        violations: chosen.iter().filter_map(|&l| renumbered(l)).collect(),
    }
}
