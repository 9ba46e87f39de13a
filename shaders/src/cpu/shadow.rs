//! Which share of a light the points of phase 1 see, by shadow maps: percentage-closer filtering (Reeves, Salesin and Cook, "Rendering
//! antialiased shadows with depth maps", 1987) with an offset along the normal (Holbert, "Saying goodbye to shadow acne", 2011).
//!
//! **The offset.** A tap `r` texels of `s` metres away from the point's place in the map shows a plane, inclined by `theta` against the direction
//! to the light, `r s tan(theta)` nearer to the light than the point. A point moved by `d` along the plane's normal lies `d / cos(theta)` before
//! the plane, as the light sees it. So the plane does not shadow itself from
//!
//! ```text
//! d = r s sin(theta)
//! ```
//!
//! on. The filter's taps reach two texels along an axis: an offset of 2 is enough for most planes, 2.8 for any.

use glam::{IVec2, Mat4, Vec2, Vec3, Vec3Swizzles as _, Vec4, Vec4Swizzles as _};

use super::direct::Point;

/// Half the width of a map in clip space, a little over 1 so that no point falls between the maps of a cube.
const EDGE: f32 = 1.0001;

/// A shadow map of a light, as the shader reads it. 112 bytes, a uniform buffer.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct ShadowHeader {
    /// To the map's clip space, as WebGPU has it: y up, depth 0 to 1.
    pub clip_from_world: Mat4,
    /// Place of the light, metres, and 1; or the direction to it and 0.
    pub light: Vec4,
    /// Texels by which points move along their normal.
    pub normal_offset: f32,
    /// Metres by which points move toward the light.
    pub depth_bias: f32,
    /// 1: what is nearer has more depth.
    pub is_reversed: u32,
    /// Where the light's row of the visibility begins.
    pub first: u32,
    /// Number of points.
    pub point_count: u32,
    /// 1: nothing stands in the row yet.
    pub is_first: u32,
    /// Not used.
    pub padding: u32,
    /// Not used.
    pub padding_2: u32,
}

/// Depths of a map, rows from the top.
#[derive(Clone, Copy, Debug)]
pub struct Depths<'a> {
    /// Texels along x and y.
    pub size: [u32; 2],
    /// `y * width + x`.
    pub depths: &'a [f32],
}

/// Writes the visibility that one map gives: of the points that it holds, and 1 for all others where the row is empty so far.
///
/// A light with several maps calls this for each, the last map first: where several hold a point, the first of them counts.
pub fn shadow(map: &ShadowHeader, points: &[Point], depths: Depths<'_>, visibility: &mut [f32]) {
    let row = visibility.iter_mut().skip(map.first as usize);
    for (point, visibility) in points.iter().take(map.point_count as usize).zip(row) {
        match seen(map, point.position, point.normal, depths) {
            Some(seen) => *visibility = seen,
            None if map.is_first != 0 => *visibility = 1.0,
            None => {}
        }
    }
}

/// The share of the light that a point sees, 0 to 1; `None` where the map does not hold it.
#[must_use]
pub fn seen(map: &ShadowHeader, position: Vec3, normal: Vec3, depths: Depths<'_>) -> Option<f32> {
    let to_light = direction_to_light(map, position);
    if to_light.dot(normal) <= 0.0 {
        return Some(0.0);
    }
    let size = Vec2::from(depths.size.map(|side| side as f32));
    let clip = map.clip_from_world * biased(map, position, normal, to_light, size).extend(1.0);
    if !is_covered(clip) {
        return None;
    }
    let place = clip.xyz() / clip.w;
    let texel = (Vec2::new(0.5, -0.5) * place.xy() + 0.5) * size - 0.5;
    Some(filtered(map, texel, place.z, depths))
}

fn direction_to_light(map: &ShadowHeader, position: Vec3) -> Vec3 {
    (map.light.xyz() - position * map.light.w).normalize_or_zero()
}

/// The point moved off its surface, so that the surface does not shadow itself.
fn biased(map: &ShadowHeader, position: Vec3, normal: Vec3, to_light: Vec3, size: Vec2) -> Vec3 {
    let cosine = to_light.dot(normal);
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    let offset = map.normal_offset * texel_size(map, position, size) * sine;
    position + normal * offset + to_light * map.depth_bias
}

/// Metres that a texel covers where the point is, across the direction to the light.
fn texel_size(map: &ShadowHeader, position: Vec3, size: Vec2) -> f32 {
    let m = map.clip_from_world;
    let w = m.row(3).dot(position.extend(1.0));
    let per_texel = 2.0 / (size * Vec2::new(m.row(0).xyz().length(), m.row(1).xyz().length()));
    w.max(0.0) * per_texel.max_element()
}

fn is_covered(clip: Vec4) -> bool {
    let edge = EDGE * clip.w;
    clip.w > 0.0 && clip.x.abs() <= edge && clip.y.abs() <= edge && clip.z >= 0.0 && clip.z <= clip.w
}

/// Three by three bilinear taps around a place in texels, whose centres are whole numbers: four by four texels, so that the share is
/// continuous.
fn filtered(map: &ShadowHeader, texel: Vec2, depth: f32, depths: Depths<'_>) -> f32 {
    let base = texel.floor();
    let part = texel - base;
    let last = IVec2::from(depths.size.map(|side| side as i32)) - 1;
    let mut sum = 0.0;
    for y in 0..4 {
        let mut row = 0.0;
        for x in 0..4 {
            let at = (base.as_ivec2() + IVec2::new(x, y) - 1).min(last).max(IVec2::ZERO);
            let stored = depths.depths.get((at.y * depths.size[0] as i32 + at.x) as usize);
            row += tap_weight(x, part.x) * lit(map, stored.copied().unwrap_or(0.0), depth);
        }
        sum += tap_weight(y, part.y) * row;
    }
    sum / 9.0
}

fn tap_weight(tap: i32, part: f32) -> f32 {
    match tap {
        0 => 1.0 - part,
        3 => part,
        _ => 1.0,
    }
}

/// 1 where nothing lies before this depth.
fn lit(map: &ShadowHeader, stored: f32, depth: f32) -> f32 {
    let is_lit = if map.is_reversed == 0 { depth <= stored } else { depth >= stored };
    f32::from(u8::from(is_lit))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: u32 = 64;

    /// A light straight above a floor of 2 x 2 metres around the origin, whose map sees from y = 2 down to y = 0; a roof at y = 1 over x > 0.
    fn sun() -> (ShadowHeader, Vec<f32>) {
        let clip_from_world = Mat4::from_cols(
            Vec4::new(1.0, 0.0, 0.0, 0.0),
            Vec4::new(0.0, 0.0, -0.5, 0.0),
            Vec4::new(0.0, -1.0, 0.0, 0.0),
            Vec4::new(0.0, 0.0, 1.0, 1.0),
        );
        let map = ShadowHeader {
            clip_from_world,
            light: Vec4::Y,
            normal_offset: 2.0,
            depth_bias: 1e-3,
            is_first: 1,
            ..ShadowHeader::default()
        };
        let depths = (0..SIZE * SIZE).map(|i| if i % SIZE >= SIZE / 2 { 0.5 } else { 1.0 });
        (map, depths.collect())
    }

    fn at(x: f32) -> Option<f32> {
        let (map, depths) = sun();
        let depths = Depths { size: [SIZE; 2], depths: &depths };
        seen(&map, Vec3::new(x, 0.01, 0.3), Vec3::Y, depths)
    }

    #[test]
    fn shadows_fall_where_the_roof_is_and_fade_over_three_texels() {
        let texel = 2.0 / SIZE as f32;
        assert_eq!(
            [at(-0.5), at(0.5), at(0.0), at(-2.0 * texel), at(2.0 * texel)].map(Option::unwrap_or_default),
            [1.0, 0.0, 0.5, 1.0, 0.0]
        );
        let steps: Vec<f32> = (-40..40).map(|i| at(i as f32 * 0.1 * texel).unwrap_or(f32::NAN)).collect();
        assert!(steps.windows(2).all(|w| w[0] >= w[1] && w[0] - w[1] < 0.04), "{steps:?}");
    }

    #[test]
    fn a_plane_does_not_shadow_itself_but_would_without_offset() {
        // Inclined by some 60 degrees; each texel holds the depth of its own centre.
        let (mut map, _) = sun();
        let normal = Vec3::new(0.87, 0.5, 0.0).normalize_or_zero();
        let height = |x: f32| 1.0 - 0.87 / 0.5 * x;
        let of = |i: u32| {
            let x = ((i % SIZE) as f32 + 0.5) * 2.0 / SIZE as f32 - 1.0;
            (1.0 - 0.5 * height(x)).clamp(0.0, 1.0)
        };
        let depths: Vec<f32> = (0..SIZE * SIZE).map(of).collect();
        let depths = Depths { size: [SIZE; 2], depths: &depths };
        let mut least = |offset: f32| {
            map.normal_offset = offset;
            let seen = |i: i32| {
                let x = i as f32 * 0.003;
                seen(&map, Vec3::new(x, height(x), 0.2), normal, depths).unwrap_or_default()
            };
            (-100..100).map(seen).fold(1.0, f32::min)
        };
        assert_eq!((least(2.0), least(0.0) < 0.7), (1.0, true));
    }

    #[test]
    fn reversed_depths_give_the_same() {
        let (mut map, depths) = sun();
        let reversed: Vec<f32> = depths.iter().map(|d| 1.0 - d).collect();
        let flip = Mat4::from_cols(Vec4::X, Vec4::Y, -Vec4::Z, Vec4::new(0.0, 0.0, 1.0, 1.0));
        map.clip_from_world = flip * map.clip_from_world;
        map.is_reversed = 1;
        for x in [-0.5, -0.01, 0.0, 0.02, 0.5] {
            let depths = Depths { size: [SIZE; 2], depths: &reversed };
            let found = seen(&map, Vec3::new(x, 0.01, 0.3), Vec3::Y, depths);
            assert_eq!(found, at(x), "{x}");
        }
    }

    #[test]
    fn the_first_of_several_maps_counts_and_points_outside_are_lit() {
        let (map, depths) = sun();
        let point = |x: f32| Point { position: Vec3::new(x, 0.01, 0.0), normal: Vec3::Y, ..Point::default() };
        let points = [point(-0.5), point(0.5), point(1.5), point(9.0)];
        let map = ShadowHeader { point_count: 4, first: 1, ..map };
        // A wider map where all is dark, called before.
        let wide = ShadowHeader {
            clip_from_world: Mat4::from_scale(Vec3::new(0.5, 0.5, 1.0)) * map.clip_from_world,
            ..map
        };
        let dark = vec![0.0; (SIZE * SIZE) as usize];
        let mut visibility = [7.0; 6];
        shadow(&wide, &points, Depths { size: [SIZE; 2], depths: &dark }, &mut visibility);
        let narrow = ShadowHeader { is_first: 0, ..map };
        shadow(&narrow, &points, Depths { size: [SIZE; 2], depths: &depths }, &mut visibility);
        assert_eq!(visibility, [7.0, 1.0, 0.0, 0.0, 1.0, 7.0]);
    }

    #[test]
    fn surface_that_faces_away_sees_nothing() {
        let (map, depths) = sun();
        let depths = Depths { size: [SIZE; 2], depths: &depths };
        assert_eq!(seen(&map, Vec3::new(-0.5, 0.5, 0.0), -Vec3::Y, depths), Some(0.0));
    }
}
