//! From where the page looks at the scene.

use glam::DVec3;

use super::facts::Evidence;
use crate::scene::{Camera, Projection, Scene, look};

/// Cameras of the file that are shown. More make a longer page.
const MOST_CAMERAS: usize = 3;

/// Vertical field of view of close-ups, radians, where nothing stands in the way.
const CLOSE_VIEW: f64 = 0.7;

/// The widest field of view of close-ups, radians: in narrow places the camera stands near and looks wide.
const WIDEST_VIEW: f64 = 1.9;

/// The first cameras of the scene, and one from outside where all are inside it. `aspect` is the pictures' width over their height.
pub fn cameras(scene: &Scene, aspect: f64) -> Vec<Camera> {
    let overview = scene.overview(aspect);
    let mut cameras: Vec<Camera> = scene.cameras_or_default().iter().take(MOST_CAMERAS).cloned().collect();
    // The default camera leaves room for square pictures.
    if scene.cameras.is_empty()
        && cameras.iter().all(|c| c.world_from_view.z_axis == overview.world_from_view.z_axis)
    {
        return vec![overview];
    }
    let [low, high] = scene.bounds().unwrap_or_default();
    let is_inside = |camera: &Camera| {
        let eye = camera.world_from_view.w_axis.truncate();
        eye.cmpgt(low).all() && eye.cmplt(high).all()
    };
    if cameras.iter().all(is_inside) {
        cameras.push(overview);
    }
    cameras
}

/// A camera in front of a place, that looks at it against the normal and shows `span` metres of it from bottom to top. It stands
/// nearer, and looks wider, where something would come between.
pub fn close_up(evidence: &Evidence, place: DVec3, normal: DVec3, span: f64) -> Camera {
    let wanted = 0.5 * span / (0.5 * CLOSE_VIEW).tan();
    let (origin, direction) = (evidence.trace.bvh.leave(place.as_vec3(), normal.as_vec3()), normal.as_vec3());
    let free = evidence.trace.bvh.hit(origin, direction, wanted as f32);
    let distance = free.map_or(wanted, |hit| 0.9 * f64::from(hit.distance));
    let angle = (2.0 * (0.5 * span / distance.max(f64::MIN_POSITIVE)).atan()).min(WIDEST_VIEW);
    Camera {
        name: String::from("close-up"),
        world_from_view: look(place + distance * normal, normal),
        projection: Projection::Perspective(angle as f32),
    }
}

/// Where a point appears, in shares of the picture's width and height from the top left; `None` behind the camera.
pub fn project(camera: &Camera, aspect: f64, point: DVec3) -> Option<[f64; 2]> {
    let seen = camera.world_from_view.inverse().transform_point3(point);
    let half_height = match camera.projection {
        Projection::Perspective(angle) => (0.5 * f64::from(angle)).tan() * -seen.z,
        Projection::Orthographic(half_height) => f64::from(half_height),
    };
    let ahead = seen.z < 0.0 && half_height > 0.0;
    let (x, y) = (seen.x / (half_height * aspect), seen.y / half_height);
    (ahead && x.is_finite() && y.is_finite()).then_some([0.5 + 0.5 * x, 0.5 - 0.5 * y])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box from the origin to (3, 2, 1), with cameras at these places.
    fn scene(eyes: &[DVec3]) -> Scene {
        let corner = |i: u32| glam::Vec3::new(3.0 * (i & 1) as f32, (i & 2) as f32, (i >> 2) as f32);
        let camera = |eye: &DVec3| Camera {
            name: "own".to_owned(),
            world_from_view: look(*eye, DVec3::Z),
            projection: Projection::Perspective(1.0),
        };
        Scene {
            positions: (0..8).map(corner).collect(),
            triangles: vec![[0, 1, 3], [4, 5, 7], [2, 6, 3]],
            cameras: eyes.iter().map(camera).collect(),
            ..Scene::default()
        }
    }

    #[test]
    fn an_overview_comes_where_all_cameras_are_inside() {
        let (inside, outside) = (DVec3::new(1.0, 1.0, 0.5), DVec3::new(1.0, 1.0, 5.0));
        let names =
            |eyes: &[DVec3]| cameras(&scene(eyes), 1.5).into_iter().map(|c| c.name).collect::<Vec<_>>();
        assert_eq!(names(&[inside]), ["own", "overview"]);
        assert_eq!(names(&[inside, outside]), ["own", "own"]);
    }

    #[test]
    fn the_overview_frames_every_vertex_tightly() {
        let scene = scene(&[]);
        for aspect in [0.5, 1.0, 3.0] {
            let camera = scene.overview(aspect);
            let seen = scene.positions.iter().map(|p| project(&camera, aspect, p.as_dvec3()).unwrap());
            let away = seen.map(|[x, y]| (x - 0.5).abs().max((y - 0.5).abs())).fold(0.0, f64::max);
            assert!((0.4..0.5).contains(&away), "{away} of the picture at {aspect}");
        }
    }

    #[test]
    fn a_close_ups_place_is_in_its_middle() {
        let camera = Camera {
            name: String::new(),
            world_from_view: look(DVec3::new(1.0, 2.0, 8.0), DVec3::Z),
            projection: Projection::Perspective(0.7),
        };
        let middle = project(&camera, 1.5, DVec3::new(1.0, 2.0, 3.0)).unwrap();
        assert!((middle[0] - 0.5).abs() + (middle[1] - 0.5).abs() < 1e-12, "{middle:?}");
        let half = 5.0 * 0.35_f64.tan();
        let corner = project(&camera, 1.5, DVec3::new(1.0 + 1.5 * half, 2.0 - half, 3.0)).unwrap();
        assert!((corner[0] - 1.0).abs() + (corner[1] - 1.0).abs() < 1e-6, "{corner:?}");
        assert_eq!(project(&camera, 1.5, DVec3::new(1.0, 2.0, 9.0)), None, "behind the camera");
    }
}
