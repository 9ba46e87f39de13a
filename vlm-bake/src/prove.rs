//! Stage 11: tags the lights, assembles the asset, and proves it by what the file will hold.

use vlm_format::VlmAsset;

use crate::correspondence::Light;
use crate::ground::Ground;
use crate::neighbours::SmoothNeighbours;
use crate::options::BakeOptions;
use crate::patches::Patches;
use crate::render::triangle_tags;
use crate::samples::BakedLight;
use crate::scene::Scene;
use crate::surface::SurfacePoint;
use crate::tag::{Accusation, TagReason, Tags, tag};
use crate::tag_cost::measure;
use crate::verify::judge::Violation;
use crate::verify::{FindingKind, Verification, check};
use crate::write::assemble;

/// The finished asset is proven at most so often: each time, what it finds is tagged.
const PROOFS: usize = 4;

/// What each light must not light.
#[must_use]
pub fn accusations(patches: &Patches, lights: &[Light], violations: &[Violation]) -> Vec<Option<Accusation>> {
    let mut accused: Vec<Option<Accusation>> = vec![None; lights.len()];
    let two_sided = |v: &Violation| patches.regions[lights[v.light as usize].region as usize].two_sided;
    let neighbours = violations.iter().any(two_sided).then(|| SmoothNeighbours::new(patches));
    for violation in violations {
        let two_sided = two_sided(violation);
        let mut accused_triangles = violation.triangles.clone();
        if let Some(neighbours) = neighbours.as_ref().filter(|_| two_sided) {
            neighbours.widen(&mut accused_triangles);
        }
        let triangles = accused_triangles.iter().flat_map(|&t| patches.scene_triangles(t)).collect();
        accused[violation.light as usize] =
            Some(Accusation { triangles, reason: reason(two_sided, violation.pokes_out) });
    }
    accused
}

fn reason(two_sided: bool, pokes_out: bool) -> TagReason {
    match (two_sided, pokes_out) {
        (true, _) => TagReason::TwoSided,
        (false, true) => TagReason::Thin,
        (false, false) => TagReason::Uncleared,
    }
}

/// Tags the lights, assembles the asset and proves it. Where the proof finds what the check of the stages before it did not, from no more
/// than the file holds, that is tagged too. `points` are the ground's.
pub fn prove(
    scene: &Scene,
    baked: &mut [BakedLight],
    options: &BakeOptions,
    ground: &Ground,
    points: Vec<SurfacePoint>,
) -> (VlmAsset, Tags, Verification) {
    let patches = ground.patches;
    let mut tags = tag(scene, patches, baked);
    let mut asset = assemble(scene, baked, &tags, options);
    let mut proof = check(scene, &asset, ground, points);
    // Tags move no light: what fails stays the same.
    for _ in 1..PROOFS {
        if proof.untagged().next().is_none() {
            break;
        }
        for finding in proof.untagged() {
            let light = &mut baked[finding.light as usize];
            let two_sided = finding.triangles.iter().any(|&t| patches.triangle_two_sided[t as usize]);
            let accused = light.accused.get_or_insert_with(|| Accusation {
                triangles: Vec::new(),
                reason: reason(two_sided, finding.kind == FindingKind::PokesOut),
            });
            accused.triangles.extend(finding.triangles.iter().flat_map(|&t| patches.scene_triangles(t)));
            accused.triangles.sort_unstable();
            accused.triangles.dedup();
        }
        tags = tag(scene, patches, baked);
        asset = assemble(scene, baked, &tags, options);
        proof.honour_tags(scene, &asset, patches);
    }
    measure(patches, baked, &triangle_tags(scene, &asset), &proof, &mut tags.reports);
    (asset, tags, proof)
}
