//! Unshadowed irradiance from the lights of KHR_lights_punctual.

use glam::Vec3;

/// A punctual light in world space, as a GPU holds it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PunctualLight {
    /// Metres; unused where `directional`.
    pub position: Vec3,
    /// Unit vector in which the light shines; unused for point lights.
    pub direction: Vec3,
    /// cd for point and spot lights, lx for directional ones.
    pub intensity: Vec3,
    /// Metres beyond which there is no light; infinite for none.
    pub range: f32,
    /// Shines along `direction` from infinitely far away.
    pub directional: bool,
    /// Factor of the cone's falloff; see [`PunctualLight::with_cone`].
    pub cone_scale: f32,
    /// Offset of the cone's falloff; 1 with a scale of 0 for lights without cone.
    pub cone_offset: f32,
}

/// Light that arrives at a point, shadows aside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Incident {
    /// Unit vector from the point to the light.
    pub direction: Vec3,
    /// Metres to the light; infinite for directional lights.
    pub distance: f32,
    /// Irradiance of a surface that faces the light, lx.
    pub facing_irradiance: Vec3,
}

impl PunctualLight {
    /// A light that shines from `position` into all directions, `intensity` in cd.
    #[must_use]
    pub fn point(position: Vec3, intensity: Vec3) -> Self {
        Self {
            position,
            direction: -Vec3::Z,
            intensity,
            range: f32::INFINITY,
            directional: false,
            cone_scale: 0.0,
            cone_offset: 1.0,
        }
    }

    /// A light that shines along `direction` (unit) everywhere, `intensity` in lx.
    #[must_use]
    pub fn directional(direction: Vec3, intensity: Vec3) -> Self {
        Self { direction, directional: true, ..Self::point(Vec3::ZERO, intensity) }
    }

    /// The same light, limited to a cone around its direction; cosines of the inner and outer half angles.
    ///
    /// The scale's floor keeps it finite for cones without a soft edge, as in the extension's reference code.
    #[must_use]
    pub fn with_cone(self, cos_inner: f32, cos_outer: f32) -> Self {
        let cone_scale = 1.0 / (cos_inner - cos_outer).max(0.001);
        Self { cone_scale, cone_offset: -cos_outer * cone_scale, ..self }
    }

    /// What arrives at `x`, or `None` where the light does not reach.
    #[must_use]
    pub fn incident(&self, x: Vec3) -> Option<Incident> {
        if self.directional {
            let (direction, distance) = (-self.direction, f32::INFINITY);
            return Some(Incident { direction, distance, facing_irradiance: self.intensity });
        }
        let to_light = self.position - x;
        let squared = to_light.length_squared();
        let distance = squared.sqrt();
        let direction = to_light.try_normalize()?;
        let falloff = range_window(distance, self.range) * self.cone(direction) / squared;
        let facing_irradiance = self.intensity * falloff;
        (falloff > 0.0).then_some(Incident { direction, distance, facing_irradiance })
    }

    /// Irradiance at `x` on a surface of unit normal `n`, lx, shadows aside.
    #[must_use]
    pub fn irradiance(&self, x: Vec3, n: Vec3) -> Vec3 {
        self.incident(x).map_or(Vec3::ZERO, |i| i.facing_irradiance * n.dot(i.direction).max(0.0))
    }

    /// Linear in the cosine between the cone's angles, then squared.
    fn cone(&self, to_light: Vec3) -> f32 {
        let cosine = -self.direction.dot(to_light);
        let linear = (cosine * self.cone_scale + self.cone_offset).clamp(0.0, 1.0);
        linear * linear
    }
}

/// The extension's recommended window: `clamp(1 - (distance / range)^4, 0, 1)`.
fn range_window(distance: f32, range: f32) -> f32 {
    let squared = (distance / range) * (distance / range);
    (1.0 - squared * squared).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn point_light_falls_off_with_the_square() {
        let light = PunctualLight::point(Vec3::new(0.0, 0.0, 2.0), Vec3::splat(8.0));
        assert_eq!(light.irradiance(Vec3::ZERO, Vec3::Z), Vec3::splat(2.0));
        assert_eq!(light.irradiance(Vec3::ZERO, -Vec3::Z), Vec3::ZERO);
        assert_eq!(light.irradiance(light.position, Vec3::Z), Vec3::ZERO, "at the light itself");
        let slanted = light.irradiance(Vec3::ZERO, Vec3::new(0.0, 0.6, 0.8));
        assert!((slanted.x - 1.6).abs() < 1e-6);
    }

    #[test]
    fn range_ends_the_light_smoothly() {
        let at = |z: f32| {
            let light = PunctualLight { range: 2.0, ..PunctualLight::point(Vec3::ZERO, Vec3::ONE) };
            light.irradiance(Vec3::new(0.0, 0.0, z), -Vec3::Z).x
        };
        assert!((at(1.0) - (1.0 - 1.0 / 16.0)).abs() < 1e-6);
        assert_eq!(at(2.0), 0.0);
        assert_eq!(at(3.0), 0.0);
    }

    #[test]
    fn spot_is_full_inside_and_squared_between_the_cones() {
        let (inner, outer) = (0.9_f32, 0.7_f32);
        let light = PunctualLight::point(Vec3::ZERO, Vec3::ONE).with_cone(inner, outer);
        let at = |cosine: f32| {
            let direction = Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, -cosine);
            light.irradiance(direction, -direction).x
        };
        assert!((at(0.95) - 1.0).abs() < 1e-5);
        assert!((at(0.8) - 0.25).abs() < 1e-4);
        assert_eq!(at(0.69), 0.0);
    }

    #[test]
    fn sun_is_the_same_everywhere() {
        let light = PunctualLight::directional(-Vec3::Z, Vec3::splat(3.0));
        assert_eq!(light.irradiance(Vec3::splat(1e6), Vec3::Z), Vec3::splat(3.0));
        assert_eq!(light.irradiance(Vec3::ZERO, -Vec3::Z), Vec3::ZERO);
    }
}
