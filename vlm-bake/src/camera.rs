//! Camera rays.

use glam::{DVec3, Vec3};

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

/// There is no such camera.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no camera `{wanted}`: name one of {available}, or give its number from 0")]
pub struct UnknownCamera {
    wanted: String,
    available: String,
}

impl Scene {
    /// A camera by its name, else by its number; the first one if none is wanted.
    ///
    /// # Errors
    /// [`UnknownCamera`] lists those that there are.
    pub fn camera(&self, wanted: Option<&str>) -> Result<Camera, UnknownCamera> {
        let cameras = self.cameras_or_default();
        let by_name = |name: &str| cameras.iter().find(|camera| camera.name == name);
        let by_number = |number: &str| number.parse::<usize>().ok().and_then(|number| cameras.get(number));
        let found = match wanted {
            None => cameras.first(),
            Some(wanted) => by_name(wanted).or_else(|| by_number(wanted)),
        };
        found.cloned().ok_or_else(|| {
            let names: Vec<String> = cameras.iter().map(|camera| format!("`{}`", camera.name)).collect();
            let wanted = wanted.unwrap_or_default().to_owned();
            UnknownCamera { wanted, available: names.join(", ") }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat4;

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
    fn cameras_are_found_by_name_then_number() {
        let named = |name: &str| Camera { name: name.to_owned(), ..camera(Projection::Orthographic(1.0)) };
        let scene = Scene { cameras: vec![named("nave"), named("0"), named("court")], ..Scene::default() };
        let found = |wanted: &str| scene.camera(Some(wanted)).map(|camera| camera.name);
        assert_eq!(found("court").unwrap(), "court");
        assert_eq!(found("2").unwrap(), "court");
        assert_eq!(found("0").unwrap(), "0", "names come first");
        assert_eq!(scene.camera(None).unwrap().name, "nave");
        let message = found("roof").unwrap_err().to_string();
        assert!(message.contains("roof") && message.contains("`nave`"), "{message}");
    }
}
