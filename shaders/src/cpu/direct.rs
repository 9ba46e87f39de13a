//! The direct light at the points that phase 1 lights: each light's share that the host says a point sees, times what it gives there.

use glam::{Vec3, Vec4};
use vlm_format::Uncovered;

use super::punctual::PunctualLight;
use super::upload::LightSet;

/// A point on the visible surface, world space. 32 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Point {
    /// Metres.
    pub position: Vec3,
    /// Not used.
    pub padding: f32,
    /// Unit normal.
    pub normal: Vec3,
    /// Not used.
    pub padding_2: f32,
}

/// Points `first` to `first + count`, without the latter. 8 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Span {
    /// The first point.
    pub first: u32,
    /// How many.
    pub count: u32,
}

/// Counts of a frame, as the shader reads them. 16 bytes, a uniform buffer.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct DirectHeader {
    /// Number of real lights.
    pub light_count: u32,
    /// Number of points.
    pub point_count: u32,
    /// Number of spans whose light changed.
    pub span_count: u32,
    /// 0: every point sees every light.
    pub has_visibility: u32,
}

/// A punctual light as the shader reads it. 64 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct PackedLight {
    /// [`PunctualLight::position`].
    pub position: Vec3,
    /// 1 over [`PunctualLight::range`], per metre.
    pub inverse_range: f32,
    /// [`PunctualLight::direction`].
    pub direction: Vec3,
    /// 1 where [`PunctualLight::directional`], else 0.
    pub directional: u32,
    /// [`PunctualLight::intensity`].
    pub intensity: Vec3,
    /// [`PunctualLight::cone_scale`].
    pub cone_scale: f32,
    /// [`PunctualLight::cone_offset`].
    pub cone_offset: f32,
    /// Not used.
    pub padding: f32,
    /// Not used.
    pub padding_2: f32,
    /// Not used.
    pub padding_3: f32,
}

impl From<&PunctualLight> for PackedLight {
    fn from(light: &PunctualLight) -> Self {
        Self {
            position: light.position,
            inverse_range: 1.0 / light.range,
            direction: light.direction,
            directional: u32::from(light.directional),
            intensity: light.intensity,
            cone_scale: light.cone_scale,
            cone_offset: light.cone_offset,
            ..Self::default()
        }
    }
}

/// All points that phase 1 lights: the samples, then the pieces of surface without a light.
#[must_use]
pub fn points(lights: &LightSet, uncovered: &[Uncovered]) -> Vec<Point> {
    let of_samples = lights.samples.iter().map(|sample| (sample.position, sample.normal));
    let of_pieces = uncovered.iter().map(|piece| (piece.position, piece.normal));
    of_samples
        .chain(of_pieces)
        .map(|(position, normal)| Point { position, normal, ..Point::default() })
        .collect()
}

/// Writes the direct irradiance of the points of the spans, lx, and leaves that of others as it is.
///
/// `visibility` is the share of a light that a point sees, `light * points.len() + point`; every point sees every light where there is
/// none.
pub fn direct(
    points: &[Point],
    lights: &[PunctualLight],
    visibility: Option<&[f32]>,
    spans: &[Span],
    irradiance: &mut [Vec4],
) {
    for span in spans {
        let range = span.first as usize..span.first.saturating_add(span.count) as usize;
        for point in range.start..range.end.min(points.len()).min(irradiance.len()) {
            let visibility_of = |light| visibility_of(visibility, light, points.len(), point);
            irradiance[point] = direct_irradiance(&points[point], lights, visibility_of).extend(0.0);
        }
    }
}

fn direct_irradiance(point: &Point, lights: &[PunctualLight], visibility_of: impl Fn(usize) -> f32) -> Vec3 {
    let mut sum = Vec3::ZERO;
    for (number, light) in lights.iter().enumerate() {
        let seen = visibility_of(number);
        if seen > 0.0 {
            sum += light.irradiance(point.position, point.normal) * seen;
        }
    }
    sum
}

fn visibility_of(visibility: Option<&[f32]>, light: usize, point_count: usize, point: usize) -> f32 {
    visibility.map_or(1.0, |all| all.get(light * point_count + point).copied().unwrap_or(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_spans_are_lit_and_visibility_counts() {
        let at = |x| Point { position: Vec3::X * x, normal: Vec3::Z, ..Point::default() };
        let points = [at(0.0), at(1.0), at(2.0)];
        let sun = PunctualLight::directional(-Vec3::Z, Vec3::ONE);
        let lights = [sun, PunctualLight { intensity: Vec3::splat(10.0), ..sun }];
        let visibility = [1.0, 0.5, 1.0, 0.0, 1.0, 1.0];
        let mut irradiance = [Vec4::splat(-1.0); 3];
        let spans = [Span { first: 0, count: 2 }];
        direct(&points, &lights, Some(&visibility), &spans, &mut irradiance);
        assert_eq!(irradiance.map(|e| e.x), [1.0, 10.5, -1.0]);
        direct(&points, &lights, None, &[Span { first: 2, count: 9 }], &mut irradiance);
        assert_eq!(irradiance[2].x, 11.0);
    }

    #[test]
    fn lights_without_range_reach_everywhere() {
        let packed = PackedLight::from(&PunctualLight::point(Vec3::ZERO, Vec3::ONE));
        assert_eq!((packed.inverse_range, packed.directional), (0.0, 0));
    }
}
