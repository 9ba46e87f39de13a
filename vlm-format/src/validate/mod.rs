//! The invariants of a [`VlmAsset`], checked before it is written and after it is read.

mod grid;
mod tags;

use std::collections::HashSet;

use glam::{DVec3, Vec3};

use crate::asset::VlmAsset;
use crate::check::array;
use crate::container::GltfFile;
use crate::error::{Code, Issue};

/// Longest edge over height that a light may have: beyond it, single precision cannot hold its form factor.
pub const MAX_ASPECT_RATIO: f64 = 100.0;

/// How far the aspect ratio may exceed its limit, through rounding of the vertices to single precision: the height of a
/// light of 0.1 mm, 10 m from the origin, is only known to 1 %. Higher values admit worse form factors; lower ones refuse
/// a bake that kept the rule in double precision.
const ASPECT_SLACK: f64 = 1.05;

/// How far the length of a sample's normal may be from 1.
const NORMAL_SLACK: f32 = 1e-3;

/// All rules that the asset breaks by itself; empty for a valid one. Pointers name fields of [`VlmAsset`], such as
/// `/vlms/0/lights`.
pub fn validate(asset: &VlmAsset) -> Vec<Issue> {
    let mut issues = Issues::default();
    lengths(asset, &mut issues);
    if issues.0.is_empty() {
        vlms(asset, &mut issues);
        lights(asset, &mut issues);
        samples(asset, &mut issues);
        tags::tags(asset, &mut issues);
        settings(asset, &mut issues);
        if let Some(grid) = &asset.grid {
            grid::grid(grid, asset.triangles.len(), &asset.sample_starts, &mut issues);
        }
    }
    issues.0
}

/// The rules of [`validate`], and those that concern the file around the asset: nodes and primitives exist, every triangle of
/// a primitive has its tag, and lights are well shaped in world space, where their form factors are computed.
pub(crate) fn validate_in(file: &GltfFile, asset: &VlmAsset) -> Vec<Issue> {
    let mut issues = Issues(validate(asset));
    if issues.0.is_empty() {
        bearers(file, asset, &mut issues);
        tags::in_file(file, asset, &mut issues);
        aspect_ratios(file, asset, &mut issues);
    }
    issues.0
}

fn bearers(file: &GltfFile, asset: &VlmAsset, issues: &mut Issues) {
    let nodes = array(file.json(), "/nodes").len();
    issues.check_all(&asset.vlms, Code::VlmNode, "/vlms", "there is no such node", |vlm| {
        (vlm.node as usize) < nodes
    });
}

fn aspect_ratios(file: &GltfFile, asset: &VlmAsset, issues: &mut Issues) {
    let world_from_nodes = file.world_from_nodes();
    for vlm in &asset.vlms {
        let world_from_node = world_from_nodes.get(vlm.node as usize).copied().unwrap_or_default();
        let corner = |&vertex: &u32| {
            let position = asset.positions.get(vertex as usize).copied().unwrap_or_default();
            world_from_node.transform_point3(position.as_dvec3())
        };
        let triangles = slice(&asset.triangles, vlm.lights).unwrap_or_default();
        let ratios = triangles.iter().map(|triangle| aspect_ratio(triangle.each_ref().map(corner)));
        for (i, ratio) in ratios.enumerate().filter(|(_, ratio)| *ratio > MAX_ASPECT_RATIO * ASPECT_SLACK) {
            let pointer = format!("/triangles/{}", vlm.lights[0] as usize + i);
            issues.check(false, Code::VlmAspect, &pointer, || {
                format!("the longest edge is {ratio:.0} times the height, more than {MAX_ASPECT_RATIO}")
            });
        }
    }
}

/// Longest edge over the height on it; infinite for a degenerate triangle.
///
/// `height = 2 area / longest`, so `longest / height = longest^2 / (2 area)`, where `2 area = |(b - a) x (c - a)|`.
fn aspect_ratio([a, b, c]: [DVec3; 3]) -> f64 {
    let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
    let ratio = longest / (b - a).cross(c - a).length();
    if ratio.is_nan() { f64::INFINITY } else { ratio }
}

#[derive(Default)]
struct Issues(Vec<Issue>);

impl Issues {
    fn check(&mut self, holds: bool, code: Code, pointer: &str, message: impl FnOnce() -> String) {
        if !holds {
            self.0.push(Issue::error(code, pointer, message()));
        }
    }

    /// Reports the first element that breaks a rule: the rest seldom says more.
    fn check_all<T>(
        &mut self,
        list: &[T],
        code: Code,
        pointer: &str,
        rule: &str,
        holds: impl Fn(&T) -> bool,
    ) {
        if let Some(at) = list.iter().position(|element| !holds(element)) {
            self.0.push(Issue::error(code, format!("{pointer}/{at}"), rule));
        }
    }
}

/// Arrays that run alongside each other have the same length; the rest relies on it.
fn lengths(asset: &VlmAsset, issues: &mut Issues) {
    let lights = asset.triangles.len();
    let optional = |length: usize| length == 0 || length == lights;
    let mut check = |holds: bool, name: &str, length: usize| {
        issues.check(holds, Code::VlmLength, &format!("/{name}"), || {
            format!("{length} values for {lights} lights")
        });
    };
    check(asset.albedo.len() == lights, "albedo", asset.albedo.len());
    check(optional(asset.emission.len()), "emission", asset.emission.len());
    check(optional(asset.tags.len()), "tags", asset.tags.len());
    check(asset.sample_starts.len() == lights + 1, "sample_starts", asset.sample_starts.len());
}

/// Ids are unique, ranges follow each other without gaps, and triangles stay within their VLM's vertices.
fn vlms(asset: &VlmAsset, issues: &mut Issues) {
    let mut ends = [0_u64; 2];
    let mut ids = HashSet::new();
    for (i, vlm) in asset.vlms.iter().enumerate() {
        let pointer = format!("/vlms/{i}");
        for (end, (range, name)) in ends.iter_mut().zip([(vlm.lights, "lights"), (vlm.vertices, "vertices")])
        {
            issues.check(u64::from(range[0]) == *end, Code::VlmRange, &format!("{pointer}/{name}"), || {
                format!("begins at {}, the one before ends at {end}", range[0])
            });
            *end += u64::from(range[1]);
        }
        issues.check(ids.insert(&vlm.id) && !vlm.id.is_empty(), Code::VlmId, &pointer, || {
            format!("the id `{}` is empty or not unique", vlm.id)
        });
        triangles_within(asset, i, issues);
    }
    let lengths = [asset.triangles.len() as u64, asset.positions.len() as u64];
    issues.check(ends == lengths, Code::VlmRange, "/vlms", || {
        format!("cover {} lights and {} vertices of {} and {}", ends[0], ends[1], lengths[0], lengths[1])
    });
}

fn triangles_within(asset: &VlmAsset, vlm: usize, issues: &mut Issues) {
    let [first, count] = asset.vlms[vlm].vertices;
    let lights = asset.vlms[vlm].lights;
    let Some(triangles) = slice(&asset.triangles, lights) else { return };
    let inside = |&vertex: &u32| vertex >= first && vertex - first < count;
    if let Some(at) = triangles.iter().position(|triangle| !triangle.iter().all(inside)) {
        let pointer = format!("/triangles/{}", lights[0] as usize + at);
        issues.check(false, Code::VlmIndex, &pointer, || {
            String::from("a vertex lies outside of the VLM's range")
        });
    }
}

fn slice<T>(list: &[T], range: [u32; 2]) -> Option<&[T]> {
    let start = range[0] as usize;
    list.get(start..start.checked_add(range[1] as usize)?)
}

fn lights(asset: &VlmAsset, issues: &mut Issues) {
    let finite = |vector: &Vec3| vector.is_finite();
    issues.check_all(&asset.positions, Code::VlmNumber, "/positions", "not finite", finite);
    issues.check_all(&asset.albedo, Code::VlmNumber, "/albedo", "not finite", finite);
    issues.check_all(&asset.emission, Code::VlmNumber, "/emission", "not finite", finite);
}

fn samples(asset: &VlmAsset, issues: &mut Issues) {
    check_starts(&asset.sample_starts, asset.samples.len(), "/sample_starts", issues);
    issues.check_all(
        &asset.samples,
        Code::VlmNumber,
        "/samples",
        "not finite, or the normal's length is not 1",
        |sample| {
            sample.position.is_finite()
                && sample.reflectance.is_finite()
                && (sample.normal.length() - 1.0).abs() <= NORMAL_SLACK
        },
    );
}

/// Offsets begin at 0, never fall, and end at the length of what they point into.
fn check_starts(starts: &[u32], length: usize, pointer: &str, issues: &mut Issues) {
    let ends_fit = starts.first() == Some(&0) && starts.last().is_some_and(|&last| last as usize == length);
    let monotone = starts.is_sorted();
    issues.check(ends_fit && monotone, Code::VlmOrder, pointer, || {
        format!("the offsets do not rise from 0 to {length}")
    });
}

fn settings(asset: &VlmAsset, issues: &mut Issues) {
    let settings = &asset.settings;
    let finite = settings.cell_size.is_finite();
    issues.check(finite, Code::VlmNumber, "/settings", || String::from("a number is not finite"));
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::asset::{Sample, Vlm};
    use crate::tags::TriangleTags;

    /// Breaks one rule.
    pub type Break = fn(&mut VlmAsset);

    /// Two lights of one node, one sample each, in a grid of one cell.
    fn valid() -> VlmAsset {
        let sample = Sample { position: Vec3::ZERO, normal: Vec3::Y, reflectance: Vec3::ONE };
        VlmAsset {
            vlms: vec![Vlm {
                id: String::from("floor"),
                node: 0,
                lights: [0, 2],
                vertices: [0, 4],
                authored: false,
            }],
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Z, Vec3::Z],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            albedo: vec![Vec3::ONE; 2],
            sample_starts: vec![0, 1, 2],
            samples: vec![sample; 2],
            grid: Some(grid::tests::two_lights()),
            ..VlmAsset::default()
        }
    }

    /// Of a primitive with two triangles, the second tagged.
    fn triangles(mesh: u32, tag: u32) -> TriangleTags {
        TriangleTags { mesh, primitive: 0, tags: vec![0, tag] }
    }

    #[test]
    fn a_valid_asset_has_no_issues() {
        assert_eq!(validate(&valid()), []);
    }

    #[test]
    fn the_aspect_ratio_is_longest_edge_over_height() {
        let triangle = |height: f64| [DVec3::ZERO, DVec3::X, DVec3::new(0.3, height, 0.0)];
        assert!((aspect_ratio(triangle(0.01)) - 100.0).abs() < 1e-9);
        assert_eq!(aspect_ratio(triangle(0.0)), f64::INFINITY);
        assert_eq!(aspect_ratio([DVec3::ZERO; 3]), f64::INFINITY);
    }

    #[test]
    fn every_broken_rule_is_seen() {
        let cases: &[(Code, &str, Break)] = &[
            (Code::VlmLength, "/albedo", |a| a.albedo.truncate(1)),
            (Code::VlmLength, "/emission", |a| a.emission.push(Vec3::ONE)),
            (Code::VlmLength, "/tags", |a| a.tags.push(1)),
            (Code::VlmLength, "/sample_starts", |a| a.sample_starts.push(2)),
            (Code::VlmRange, "/vlms", |a| a.positions.push(Vec3::ZERO)),
            (Code::VlmRange, "/vlms/0/lights", |a| a.vlms[0].lights = [1, 1]),
            (Code::VlmId, "/vlms/0", |a| a.vlms[0].id.clear()),
            (Code::VlmIndex, "/triangles/1", |a| a.triangles[1][2] = 4),
            (Code::VlmNumber, "/positions/3", |a| a.positions[3].x = f32::NAN),
            (Code::VlmNumber, "/albedo/0", |a| a.albedo[0].y = f32::INFINITY),
            (Code::VlmNumber, "/samples/1", |a| a.samples[1].normal = Vec3::ZERO),
            (Code::VlmOrder, "/sample_starts", |a| a.sample_starts = vec![0, 2, 1]),
            (Code::VlmOrder, "/primitive_tags", |a| a.primitive_tags = vec![(0, 1, 1), (0, 0, 1)]),
            (Code::VlmNumber, "/primitive_tags/0", |a| a.primitive_tags = vec![(0, 0, 0)]),
            (Code::VlmOrder, "/triangle_tags", |a| a.triangle_tags = vec![triangles(1, 1), triangles(0, 1)]),
            (Code::VlmOrder, "/triangle_tags", |a| a.triangle_tags = vec![triangles(1, 1), triangles(1, 2)]),
            (Code::VlmNumber, "/triangle_tags/1", |a| {
                a.triangle_tags = vec![triangles(0, 1), triangles(1, 0)];
            }),
            (Code::VlmNumber, "/triangle_tags/0", |a| a.triangle_tags = vec![TriangleTags::default()]),
            (Code::VlmOrder, "/triangle_tags/0", |a| {
                (a.primitive_tags, a.triangle_tags) = (vec![(0, 0, 1), (1, 0, 1)], vec![triangles(1, 1)]);
            }),
            (Code::VlmOrder, "/node_tags", |a| a.node_tags = vec![(2, 1), (1, 1)]),
            (Code::VlmOrder, "/node_tags", |a| a.node_tags = vec![(2, 1), (2, 3)]),
            (Code::VlmNumber, "/node_tags/1", |a| a.node_tags = vec![(1, 1), (2, 0)]),
            (Code::VlmNumber, "/settings", |a| a.settings.cell_size = f32::NAN),
        ];
        for (code, pointer, spoil) in cases.iter().chain(grid::tests::CASES) {
            let mut asset = valid();
            spoil(&mut asset);
            let issues = validate(&asset);
            assert!(
                issues.iter().any(|issue| issue.code == *code && issue.pointer == *pointer),
                "{} at {pointer} was not seen: {issues:?}",
                code.as_str()
            );
        }
    }
}
