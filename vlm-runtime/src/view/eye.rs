//! eye: where the viewer looks from: matrices as the passes want them, and flying.

use glam::{DMat4, DQuat, DVec3, Mat4, Vec3};
use vlm_bake::scene::{Camera, Projection};

use crate::View;

/// A camera's picture of one size.
#[derive(Clone, Copy, Debug)]
pub struct Eye {
    /// With reversed depth.
    pub clip_from_world: DMat4,
    /// Metres.
    pub position: Vec3,
    /// Unit direction to the middle of the picture.
    pub forward: Vec3,
    /// It looks from one point, not along one direction.
    pub is_perspective: bool,
    /// Metres: where the reversed depth is 1 (perspective), or 0 (orthographic).
    pub depth_scale: f32,
}

impl Eye {
    /// `bounds` are those of the scene, metres: an orthographic picture is as deep as that takes.
    #[must_use]
    pub fn new(camera: &Camera, [width, height]: [u32; 2], bounds: [DVec3; 2]) -> Self {
        let aspect = f64::from(width) / f64::from(height).max(1.0);
        let view_from_world = camera.world_from_view.inverse();
        let extent = (bounds[1] - bounds[0]).length().max(f64::MIN_POSITIVE);
        let (clip_from_view, depth_scale, is_perspective) = match camera.projection {
            Projection::Perspective(angle) => {
                let near = (1e-4 * extent).min(0.01);
                (perspective(f64::from(angle), aspect, near), near, true)
            }
            Projection::Orthographic(half_height) => {
                let far = farthest(view_from_world, bounds).max(1e-3 * extent);
                (orthographic(f64::from(half_height), aspect, far), far, false)
            }
        };
        Self {
            clip_from_world: clip_from_view * view_from_world,
            position: camera.world_from_view.transform_point3(DVec3::ZERO).as_vec3(),
            forward: camera.world_from_view.transform_vector3(DVec3::NEG_Z).as_vec3(),
            is_perspective,
            depth_scale: depth_scale as f32,
        }
    }

    /// As the gather wants it.
    #[must_use]
    pub fn view(&self) -> View {
        let world_from_clip: Mat4 = self.clip_from_world.inverse().as_mat4();
        View { world_from_clip, exposure: 1.0, empty_depth: 0.0, ..View::default() }
    }
}

/// Reversed depth `near / distance`, without a far end: exact wherever single precision is.
fn perspective(angle: f64, aspect: f64, near: f64) -> DMat4 {
    let up = 1.0 / (0.5 * angle).tan();
    DMat4::from_cols_array_2d(&[
        [up / aspect, 0.0, 0.0, 0.0],
        [0.0, up, 0.0, 0.0],
        [0.0, 0.0, 0.0, -1.0],
        [0.0, 0.0, near, 0.0],
    ])
}

/// Reversed depth `1 - distance / far`.
fn orthographic(half_height: f64, aspect: f64, far: f64) -> DMat4 {
    DMat4::from_cols_array_2d(&[
        [1.0 / (half_height * aspect), 0.0, 0.0, 0.0],
        [0.0, 1.0 / half_height, 0.0, 0.0],
        [0.0, 0.0, 1.0 / far, 0.0],
        [0.0, 0.0, 1.0, 1.0],
    ])
}

/// Distance along the view to the farthest corner of a box, and a little more, metres.
fn farthest(view_from_world: DMat4, [least, most]: [DVec3; 2]) -> f64 {
    let corner = |i: u32| {
        let end = |bit: u32, a: f64, b: f64| if i >> bit & 1 == 0 { a } else { b };
        DVec3::new(end(0, least.x, most.x), end(1, least.y, most.y), end(2, least.z, most.z))
    };
    1.01 * (0..8).map(|i| -view_from_world.transform_point3(corner(i)).z).fold(0.0, f64::max)
}

/// Flying: a camera that moves and turns, y up.
#[derive(Clone, Debug, PartialEq)]
pub struct Flight {
    /// Where it is, metres.
    pub position: DVec3,
    /// Around the vertical, radians.
    pub yaw: f64,
    /// Up and down, radians.
    pub pitch: f64,
    /// As the camera's that it took off from.
    pub projection: Projection,
}

impl Flight {
    /// Takes off from a camera; what it was tilted sideways is lost.
    #[must_use]
    pub fn from_camera(camera: &Camera) -> Self {
        let forward = camera.world_from_view.transform_vector3(DVec3::NEG_Z);
        Self {
            position: camera.world_from_view.transform_point3(DVec3::ZERO),
            yaw: (-forward.x).atan2(-forward.z),
            pitch: forward.y.clamp(-1.0, 1.0).asin(),
            projection: camera.projection,
        }
    }

    /// Turns by radians; not over head.
    pub fn turn(&mut self, right: f64, up: f64) {
        const MOST: f64 = 1.55;
        self.yaw -= right;
        self.pitch = (self.pitch + up).clamp(-MOST, MOST);
    }

    /// Moves by metres to the right, up, and forward.
    pub fn move_by(&mut self, by: DVec3) {
        let rotation = self.rotation();
        self.position += rotation * DVec3::new(by.x, 0.0, -by.z) + DVec3::Y * by.y;
    }

    /// What it sees.
    #[must_use]
    pub fn camera(&self) -> Camera {
        Camera {
            name: "flying".to_owned(),
            world_from_view: DMat4::from_rotation_translation(self.rotation(), self.position),
            projection: self.projection,
        }
    }

    fn rotation(&self) -> DQuat {
        DQuat::from_rotation_y(self.yaw) * DQuat::from_rotation_x(self.pitch)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vlm_bake::scene::look;

    const BOUNDS: [DVec3; 2] = [DVec3::splat(-3.0), DVec3::splat(4.0)];

    fn camera(projection: Projection) -> Camera {
        let backward = DVec3::new(0.3, 0.4, 1.0).normalize_or_zero();
        let world_from_view = look(DVec3::new(1.0, 2.0, 9.0), backward);
        Camera { name: String::new(), world_from_view, projection }
    }

    #[test]
    fn pixels_go_back_to_where_they_came_from() {
        for projection in [Projection::Perspective(0.8), Projection::Orthographic(3.0)] {
            let eye = Eye::new(&camera(projection), [200, 100], BOUNDS);
            let place = DVec3::new(0.5, -1.0, 2.0);
            let clip = eye.clip_from_world * place.extend(1.0);
            let ndc = clip / clip.w;
            let back = eye.view().world_from_clip * ndc.as_vec4();
            assert!((back.truncate() / back.w - place.as_vec3()).length() < 1e-4, "{projection:?}");
            let distance = (place.as_vec3() - eye.position).dot(eye.forward);
            let shown = if eye.is_perspective {
                eye.depth_scale / ndc.z as f32
            } else {
                (1.0 - ndc.z as f32) * eye.depth_scale
            };
            assert!((shown / distance - 1.0).abs() < 1e-4, "{projection:?}: {shown} {distance}");
        }
    }

    #[test]
    fn flights_begin_where_the_camera_stands_and_go_where_it_looks() {
        let camera = camera(Projection::Perspective(0.8));
        let mut flight = Flight::from_camera(&camera);
        let difference = flight.camera().world_from_view - camera.world_from_view;
        assert!(difference.abs_diff_eq(DMat4::ZERO, 1e-6), "{difference}");
        flight.move_by(DVec3::new(0.0, 0.0, 2.0));
        let forward = camera.world_from_view.transform_vector3(DVec3::NEG_Z);
        assert!((flight.position - DVec3::new(1.0, 2.0, 9.0) - 2.0 * forward).length() < 1e-6);
        flight.turn(0.0, 9.0);
        assert!(flight.pitch < 1.6);
    }
}
