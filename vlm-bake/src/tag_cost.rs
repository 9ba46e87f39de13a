//! What tags cost: light that tagged surface no longer receives though nothing was wrong with it.
//!
//! A tag keeps its lights off all of its surface. Only where a light stands for that surface must it be kept off; the rest, such as the far
//! side of a hollow, it would rightly light.

use std::collections::BTreeMap;

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use rustc_hash::FxHashSet;
use vlm_shaders::cpu::form_factor::{LightGeometry, form_factor};

use crate::patches::Patches;
use crate::samples::BakedLight;
use crate::surface::SurfacePoint;
use crate::tag::TagReport;
use crate::topology;
use crate::verify::Verification;

/// Surface points per tag. Higher values are less noisy and slower, each by the number of lights.
const POINTS: usize = 256;

/// Lights per tag, likewise.
const LIGHTS: usize = 256;

/// Fills [`TagReport::covers_m2`], the area of the surface of a tag, each side of a two-sided surface counted, and
/// [`TagReport::light_lost`]: the share of the flux of a tag's lights that would fall on the tag's surface other than the triangles
/// for which each stands, with every light at unit radiosity and nothing between.
///
/// Large tags are measured at every n-th point and light, so that the result depends on nothing but the bake.
///
/// * `patches`: the visible surface, which `proof` counts.
/// * `lights`: in the asset's order.
/// * `receiver_tags`: the tag of each triangle of the scene, 0 for none ([`crate::render::triangle_tags`]).
/// * `proof`: which light stands for which point.
pub fn measure(
    patches: &Patches,
    lights: &[BakedLight],
    receiver_tags: &[u32],
    proof: &Verification,
    reports: &mut [TagReport],
) {
    let receivers = receivers(patches, receiver_tags, &proof.points);
    let own = own_triangles(lights, proof);
    let mut carriers: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (l, light) in lights.iter().enumerate().filter(|(_, light)| light.tag != 0) {
        carriers.entry(light.tag).or_default().push(l as u32);
    }
    reports.par_iter_mut().for_each(|report| {
        report.covers_m2 = receivers.get(&report.tag).map_or(0.0, |points| area(points));
        if let (Some(points), Some(numbers)) = (receivers.get(&report.tag), carriers.get(&report.tag)) {
            let surface = Surface::new(points);
            let pairs = numbers.iter().step_by(numbers.len().div_ceil(LIGHTS).max(1));
            let [flux, lost] = pairs.fold([0.0, 0.0], |[flux, lost], &l| {
                let corners = lights[l as usize].corners;
                let area = topology::area(corners);
                [flux + area, lost + surface.received(corners, |triangle| own.contains(&(l, triangle)))]
            });
            // Surface may hide surface, and then more than all arrives.
            report.light_lost = if flux > 0.0 { (lost / flux).min(1.0) } else { 0.0 };
        }
    });
}

/// By tag, the points of its surface that stand for area.
fn receivers<'a>(
    patches: &Patches,
    receiver_tags: &[u32],
    points: &'a [SurfacePoint],
) -> BTreeMap<u32, Vec<&'a SurfacePoint>> {
    let mut receivers: BTreeMap<u32, Vec<&SurfacePoint>> = BTreeMap::new();
    for point in points.iter().filter(|point| point.area > 0.0) {
        let tag = receiver_tags[patches.triangle_source[point.triangle as usize] as usize];
        if tag != 0 {
            receivers.entry(tag).or_default().push(point);
        }
    }
    receivers
}

/// Which tagged light stands for which triangle of the patches, on either side.
fn own_triangles(lights: &[BakedLight], proof: &Verification) -> FxHashSet<(u32, u32)> {
    let pairs = proof.points.iter().zip(&proof.light_of_point);
    let own = pairs.filter_map(|(point, light)| Some(((*light)?, point.triangle)));
    own.filter(|&(light, _)| lights[light as usize].tag != 0).collect()
}

fn area(points: &[&SurfacePoint]) -> f64 {
    points.iter().map(|point| point.area).sum()
}

/// The surface of a tag, by some of its points.
struct Surface<'a> {
    points: Vec<&'a SurfacePoint>,
    /// Single precision keeps its digits near this place.
    origin: DVec3,
    /// Area of the tag's surface over that of the chosen points.
    scale: f64,
}

impl<'a> Surface<'a> {
    fn new(all: &[&'a SurfacePoint]) -> Self {
        let points: Vec<&SurfacePoint> =
            all.iter().step_by(all.len().div_ceil(POINTS).max(1)).copied().collect();
        let origin = points.first().map_or(DVec3::ZERO, |p| p.position);
        let scale = area(all) / area(&points).max(f64::MIN_POSITIVE);
        Self { points, origin, scale }
    }

    /// The flux that arrives from a light of unit radiosity, square metres, but for that on its own triangles.
    fn received(&self, corners: [DVec3; 3], is_own: impl Fn(u32) -> bool) -> f64 {
        let light = LightGeometry::new(corners.map(|p| p - self.origin));
        let others = self.points.iter().filter(|point| !is_own(point.triangle));
        let flux = |point: &&SurfacePoint| {
            let (x, n): (Vec3, Vec3) = ((point.position - self.origin).as_vec3(), point.normal.as_vec3());
            point.area * f64::from(form_factor(&light, x, n))
        };
        self.scale * others.map(flux).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::patches::Region;

    /// Two unit squares, of two triangles each, at heights 0 and 1, which look at each other; one light just below the lower one.
    struct Plates {
        patches: Patches,
        lights: Vec<BakedLight>,
        proof: Verification,
    }

    impl Plates {
        fn new() -> Self {
            let square = |height: f64| {
                [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y].map(|p| p + DVec3::Z * height)
            };
            let patches = Patches {
                positions: [square(0.0), square(1.0)].concat(),
                triangles: vec![[0, 1, 2], [0, 2, 3], [4, 6, 5], [4, 7, 6]],
                triangle_region: vec![0; 4],
                triangle_source: vec![0, 1, 2, 3],
                regions: vec![Region { primitive: 0, island: 0, two_sided: false }],
                ..Patches::default()
            };
            let points = crate::surface::spread_points(&patches, 4000);
            let light_of_point = points.iter().map(|p| (p.triangle < 2).then_some(p.triangle)).collect();
            let light = |t: usize| BakedLight {
                corners: patches.corners(t).map(|p| p - DVec3::Z * 1e-4),
                tag: 7,
                ..BakedLight::default()
            };
            let lights = vec![light(0), light(1)];
            Self {
                patches,
                lights,
                proof: Verification { points, light_of_point, ..Verification::default() },
            }
        }

        fn lost(&self, tags: [u32; 4]) -> f64 {
            self.measured(tags).light_lost
        }

        fn measured(&self, tags: [u32; 4]) -> TagReport {
            let mut reports = [TagReport { tag: 7, light_lost: f64::NAN, ..TagReport::default() }];
            measure(&self.patches, &self.lights, &tags, &self.proof, &mut reports);
            let [report] = reports;
            report
        }
    }

    /// Between the faces of a unit cube that lie opposite each other (Howell, A Catalog of Radiation Heat Transfer Configuration
    /// Factors, C-11).
    const OPPOSITE: f64 = 0.199_825;

    #[test]
    fn opposite_squares_lose_their_form_factor() {
        let plates = Plates::new();
        let both = plates.lost([7; 4]);
        assert!((both - OPPOSITE).abs() < 0.01, "{both}");
        let half = plates.lost([7, 7, 7, 0]);
        assert!((half - 0.5 * OPPOSITE).abs() < 0.02, "half the plate, {half}");
        let covers = [[7; 4], [7, 7, 7, 0], [0; 4]].map(|tags| plates.measured(tags).covers_m2);
        assert!(
            (covers[0] - 2.0).abs() < 1e-3 && (covers[1] - 1.5).abs() < 1e-3 && covers[2] == 0.0,
            "{covers:?}"
        );
    }

    #[test]
    fn a_tag_on_its_own_triangles_alone_costs_nothing() {
        let plates = Plates::new();
        assert!(plates.lost([7, 7, 0, 0]) < 1e-3);
        assert!(plates.lost([0, 0, 9, 9]).is_nan(), "a tag without surface is left as it is");
    }

    #[test]
    fn surface_for_which_a_light_stands_is_no_loss() {
        let mut plates = Plates::new();
        let pairs = plates.proof.points.iter().zip(&mut plates.proof.light_of_point);
        pairs.for_each(|(point, light)| *light = Some(point.triangle % 2));
        let lost = plates.lost([7; 4]);
        assert!((lost - 0.5 * OPPOSITE).abs() < 0.03, "each stands for half of the plate above, {lost}");
    }
}
