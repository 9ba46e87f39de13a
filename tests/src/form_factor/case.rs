//! One receiver and one light, as a file of cases holds them.

use glam::{DVec3, Vec3};
use vlm_shaders::cpu::form_factor::LightGeometry;

/// A light and a receiver: `v0 v1 v2 x n`, fifteen f32.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Case {
    /// Corners, counter-clockwise seen from the emitting side, metres.
    pub corners: [Vec3; 3],
    /// Receiver, metres.
    pub x: Vec3,
    /// Its normal; of unit length unless the case is about that.
    pub n: Vec3,
}

impl Case {
    /// The light's constants.
    #[must_use]
    pub fn light(&self) -> LightGeometry {
        LightGeometry::new(self.corners.map(|v| v.as_dvec3()))
    }

    /// Longest edge over height; infinite without area.
    #[must_use]
    pub fn aspect(&self) -> f64 {
        let [a, b, c] = self.corners.map(|v| v.as_dvec3());
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        longest * longest / (b - a).cross(c - a).length()
    }

    /// Longest edge, metres.
    #[must_use]
    pub fn size(&self) -> f64 {
        let [a, b, c] = self.corners.map(|v| v.as_dvec3());
        a.distance(b).max(b.distance(c)).max(c.distance(a))
    }

    /// Distance from the receiver to the nearest point of the light, metres.
    #[must_use]
    pub fn distance(&self) -> f64 {
        let [a, b, c] = self.corners.map(|v| v.as_dvec3() - self.x.as_dvec3());
        let normal = (b - a).cross(c - a);
        let inside = [(a, b), (b, c), (c, a)].iter().all(|&(p, q)| (q - p).cross(-p).dot(normal) >= 0.0);
        if inside && normal.length_squared() > 0.0 {
            return a.dot(normal).abs() / normal.length();
        }
        [(a, b), (b, c), (c, a)].iter().map(|&(p, q)| distance_to_edge(p, q)).fold(f64::INFINITY, f64::min)
    }

    /// How far the receiver lies in front of the light's plane, metres.
    #[must_use]
    pub fn height(&self) -> f64 {
        let [a, b, c] = self.corners.map(|v| v.as_dvec3());
        let normal = (b - a).cross(c - a);
        (self.x.as_dvec3() - a).dot(normal) / normal.length().max(f64::MIN_POSITIVE)
    }
}

fn distance_to_edge(p: DVec3, q: DVec3) -> f64 {
    let edge = q - p;
    let t = (-p.dot(edge) / edge.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    (p + t * edge).length()
}
