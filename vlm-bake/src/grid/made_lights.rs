//! Lights that artists made: no surface stands for them, so probes look for them themselves.

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use vlm_shaders::cpu::form_factor::{LightGeometry, form_factor, is_behind};

use super::GridInput;
use super::pool::Place;
use super::transport::Row;
use crate::bvh::Hit;
use crate::surface::spread_over;

/// Places of a light to which a probe looks. Higher values smooth the border of its shadow, and take a ray each.
const LOOKS: u32 = 8;

/// Lights whose form factor is below this are too faint to be looked for.
const LEAST_FORM_FACTOR: f32 = 1e-5;

/// Surface hides nothing of a light up to this many times as far from it as the light lies behind it: seen aslant or across a bend it may
/// be farther.
const DEPTH: f32 = 1.5;

/// A light lies behind a sheet, which has no inside, where that is nearer than this share of the light's longest edge.
const SHEET: f32 = 0.1;

/// Faces whose distances differ by less than this share lie in one place.
const SAME_PLACE: f32 = 1e-4;

/// Light that arrives at less than this cosine to the light's normal counts as this.
const LEAST_COSINE: f32 = 0.1;

/// A light with the places to which probes look.
pub struct MadeLight {
    /// Its number.
    light: u32,
    geometry: LightGeometry,
    /// Unit normal.
    normal: Vec3,
    looks: Vec<Look>,
}

/// A place of a light.
struct Look {
    at: Vec3,
    /// How far it lies behind the surface for which it stands, metres; 0 where it stands free.
    depth: f32,
}

/// The lights that artists made, with how deep they lie.
#[must_use]
pub fn made_lights(input: &GridInput) -> Vec<MadeLight> {
    let make = |&light: &u32| {
        let geometry = *input.lights.geometry.get(light as usize)?;
        let look = |at: DVec3| Look { at: at.as_vec3(), depth: depth(input, &geometry, at.as_vec3()) };
        let looks = spread_over(geometry.corners().map(Vec3::as_dvec3), LOOKS).map(look).collect();
        Some(MadeLight { light, normal: geometry.normal.normalize_or_zero(), geometry, looks })
    };
    input.made.par_iter().filter_map(make).collect()
}

/// How far a place of a light lies behind surface. From within an object the first thing before the light is a back; from free space it is
/// a front; a sheet, of one two-sided face or of two faces in one place, is both.
fn depth(input: &GridInput, geometry: &LightGeometry, at: Vec3) -> f32 {
    let (trace, most) = (input.trace, geometry.longest_edge());
    let ahead = geometry.normal.normalize_or_zero();
    let Some(first) = trace.path_hit_within(at, ahead, most) else { return 0.0 };
    let there = first.distance * (1.0 + SAME_PLACE) + trace.bvh.leave_distance();
    let shows = |side: &dyn Fn(&Hit) -> bool| trace.bvh.hit_where(at, ahead, there, side).is_some();
    let shows_front = shows(&|hit| trace.is_lit_side(hit));
    let is_sheet = trace.lit_sides(first.triangle) == [true, true]
        || (shows_front && shows(&|hit| trace.lit_sides(hit.triangle)[0] && !trace.is_lit_side(hit)));
    let lies_behind = if is_sheet { first.distance < SHEET * most } else { !shows_front };
    if lies_behind { DEPTH * first.distance + trace.bvh.leave_distance() } else { 0.0 }
}

/// Adds what a place gets of these lights to its row; they count as whole lights.
pub fn add(input: &GridInput, made: &[MadeLight], place: &Place, row: &mut Row) {
    let samples = input.light_of_sample.len() as u32;
    row.extend(made.iter().filter_map(|light| Some((samples + light.light, seen(input, light, place)?))));
    row.sort_unstable_by_key(|(source, _)| *source);
}

/// Adds the share of all directions around a place of free space in which these lights lie.
pub fn add_around(input: &GridInput, made: &[MadeLight], place: Vec3, row: &mut Row) {
    let samples = input.light_of_sample.len() as u32;
    let share = |light: &MadeLight| {
        let whole = share_of_directions(&light.geometry, place);
        let seen = if whole < LEAST_FORM_FACTOR { 0.0 } else { whole * seen_share(input, light, place) };
        (seen > 0.0).then_some((samples + light.light, seen))
    };
    row.extend(made.iter().filter_map(share));
    row.sort_unstable_by_key(|(source, _)| *source);
}

/// The share of all directions in which the front of a light lies (van Oosterom and Strackee, "The solid angle of a plane triangle", 1983);
/// 0 or less behind it.
fn share_of_directions(light: &LightGeometry, place: Vec3) -> f32 {
    let [a, b, c] = light.corners().map(|corner| corner - place);
    let [la, lb, lc] = [a, b, c].map(Vec3::length);
    let numerator = -a.dot(b.cross(c));
    let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    numerator.atan2(denominator) / std::f32::consts::TAU
}

/// The form factor of a light at a place times the share of it that the place sees; `None` where that is nothing.
fn seen(input: &GridInput, light: &MadeLight, place: &Place) -> Option<f32> {
    let surface = &place.surface;
    if is_behind(&light.geometry, surface.position, surface.geometric_normal) {
        return None;
    }
    let whole = form_factor(&light.geometry, surface.position, surface.normal);
    if whole < LEAST_FORM_FACTOR {
        return None;
    }
    let origin = input.trace.bvh.leave(surface.position, surface.geometric_normal);
    Some(whole * seen_share(input, light, origin)).filter(|&seen| seen > 0.0)
}

/// The share of a light that is seen from `origin`.
fn seen_share(input: &GridInput, light: &MadeLight, origin: Vec3) -> f32 {
    let is_seen = |look: &&Look| {
        let way = look.at - origin;
        let distance = way.length();
        let cosine = -way.dot(light.normal) / distance;
        let most = 1.0 - look.depth / (distance * cosine.max(LEAST_COSINE));
        most <= 0.0 || !input.trace.is_occluded(origin, way, most)
    };
    light.looks.iter().filter(is_seen).count() as f32 / light.looks.len().max(1) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_face_of_an_octahedron_fills_an_eighth_of_the_directions_before_it() {
        // Its front looks at the origin.
        let light = LightGeometry::new([DVec3::X, DVec3::Z, DVec3::Y]);
        let share = share_of_directions(&light, Vec3::ZERO);
        assert!((share - 0.125).abs() < 1e-5, "{share}");
        assert!(share_of_directions(&light, Vec3::splat(2.0)) < 0.0);
    }
}
