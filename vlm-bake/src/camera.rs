//! Camera rays.

use glam::{DMat4, DVec3, Vec3};

use crate::scene::{Camera, Projection, Scene};

/// The rays of one picture: through pixel centres, row 0 at the top.
#[derive(Clone, Copy, Debug)]
pub struct CameraRays {
    origin: DVec3,
    forward: DVec3,
    /// From the picture's centre to its right edge, and to its top edge, one metre ahead (perspective) or anywhere.
    right: DVec3,
    up: DVec3,
    perspective: bool,
    width: u32,
    height: u32,
}

/// One ray, world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraRay {
    /// Metres.
    pub origin: Vec3,
    /// Unit vector.
    pub direction: Vec3,
}

impl CameraRays {
    /// The vertical extent is the camera's; the horizontal one follows from the picture's size (square pixels).
    #[must_use]
    pub fn new(camera: &Camera, width: u32, height: u32) -> Self {
        let world_from_view = camera.world_from_view;
        let (half_height, perspective) = match camera.projection {
            Projection::Perspective(vertical_angle) => ((0.5 * f64::from(vertical_angle)).tan(), true),
            Projection::Orthographic(half_height) => (f64::from(half_height), false),
        };
        let half_width = half_height * f64::from(width) / f64::from(height);
        Self {
            origin: world_from_view.transform_point3(DVec3::ZERO),
            forward: world_from_view.transform_vector3(DVec3::NEG_Z),
            right: world_from_view.transform_vector3(DVec3::X) * half_width,
            up: world_from_view.transform_vector3(DVec3::Y) * half_height,
            perspective,
            width,
            height,
        }
    }

    /// The ray through the centre of pixel `(x, y)`.
    #[must_use]
    pub fn through(&self, x: u32, y: u32) -> CameraRay {
        let u = (2.0 * f64::from(x) + 1.0) / f64::from(self.width) - 1.0;
        let v = 1.0 - (2.0 * f64::from(y) + 1.0) / f64::from(self.height);
        let offset = u * self.right + v * self.up;
        let (origin, direction) = if self.perspective {
            (self.origin, self.forward + offset)
        } else {
            (self.origin + offset, self.forward)
        };
        CameraRay { origin: origin.as_vec3(), direction: direction.normalize_or_zero().as_vec3() }
    }

    /// Area that a pixel covers on a surface across the ray at `distance` (metres), square metres.
    #[must_use]
    pub fn pixel_area(&self, distance: f32) -> f32 {
        let pixel = 2.0 * self.up.length() / f64::from(self.height);
        let size = if self.perspective { pixel * f64::from(distance) } else { pixel };
        (size * size) as f32
    }
}

/// A camera that sees the whole scene from its front, a little from above: for files that bring none.
#[must_use]
pub fn framing_camera(scene: &Scene) -> Camera {
    const VERTICAL_ANGLE: f64 = 0.8;
    let finite = scene.positions.iter().filter(|p| p.is_finite()).map(|p| p.as_dvec3());
    let (low, high) = finite.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
    let (low, high) = if low.x <= high.x { (low, high) } else { (DVec3::NEG_ONE, DVec3::ONE) };
    let centre = 0.5 * (low + high);
    let radius = (0.5 * (high - low).length()).max(1e-3);
    let away = DVec3::new(0.35, 0.35, 1.0).normalize_or_zero();
    let eye = centre + away * (radius / (0.5 * VERTICAL_ANGLE).sin());
    Camera {
        name: "framing camera".to_owned(),
        world_from_view: looking_from(eye, away),
        projection: Projection::Perspective(VERTICAL_ANGLE as f32),
    }
}

/// A view at `eye` whose z axis, away from what it looks at, is the unit vector `back` (not straight up or down).
fn looking_from(eye: DVec3, back: DVec3) -> DMat4 {
    let right = DVec3::Y.cross(back).normalize_or_zero();
    let up = back.cross(right);
    DMat4::from_cols(right.extend(0.0), up.extend(0.0), back.extend(0.0), eye.extend(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(projection: Projection) -> Camera {
        let world_from_view = DMat4::from_translation(DVec3::new(0.0, 0.0, 5.0));
        Camera { name: String::new(), world_from_view, projection }
    }

    #[test]
    fn perspective_rays_span_the_vertical_angle() {
        let rays = CameraRays::new(&camera(Projection::Perspective(std::f32::consts::FRAC_PI_2)), 4, 2);
        let first = rays.through(0, 0);
        assert_eq!(first.origin, Vec3::new(0.0, 0.0, 5.0));
        let plane = first.direction / -first.direction.z;
        assert!((plane - Vec3::new(-1.5, 0.5, -1.0)).length() < 1e-6, "{plane}");
        let last = rays.through(3, 1).direction;
        assert!((last + first.direction - Vec3::Z * 2.0 * first.direction.z).length() < 1e-6);
        assert!((rays.pixel_area(2.0) - 4.0).abs() < 1e-6);
    }

    #[test]
    fn orthographic_rays_are_parallel() {
        let rays = CameraRays::new(&camera(Projection::Orthographic(1.0)), 2, 2);
        let ray = rays.through(1, 1);
        assert_eq!(ray.origin, Vec3::new(0.5, -0.5, 5.0));
        assert_eq!(ray.direction, -Vec3::Z);
        assert_eq!(rays.pixel_area(9.0), 1.0);
    }

    #[test]
    fn framing_camera_sees_every_corner() {
        let positions =
            (0..8).map(|i| Vec3::new((i & 1) as f32 * 9.0, (i & 2) as f32, (i & 4) as f32)).collect();
        let scene = Scene { positions, ..Scene::default() };
        let camera = framing_camera(&scene);
        let view_from_world = camera.world_from_view.inverse();
        let Projection::Perspective(angle) = camera.projection else { panic!() };
        for p in &scene.positions {
            let p = view_from_world.transform_point3(p.as_dvec3());
            assert!(p.z < 0.0 && p.x.abs().max(p.y.abs()) <= -p.z * f64::from(0.5 * angle).tan());
        }
    }
}
