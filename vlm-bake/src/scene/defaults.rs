//! A camera and a light for scenes without: only for pictures, never written into a file.
//!
//! Rays cast from a few points tell a room (all see fronts of walls) from a box open to one side (some escape, all in
//! about one direction) and from anything seen best from outside.

use super::{Camera, Projection, PunctualKind, PunctualLight, Scene};
use crate::bvh::Bvh;
use glam::{DMat4, DQuat, DVec3, Vec3};
use std::borrow::Cow;
use std::f64::consts::PI;

/// Rays cast from each point of the survey.
const RAYS: usize = 128;

/// Places along each axis of the box around the scene that the survey casts rays from.
const PLACES: [f32; 3] = [0.25, 0.5, 0.75];

/// A place is inside a room if at least this share of its rays meets fronts; some windows stay possible. A scene is a
/// room if most of its places are that are not inside something solid.
const ROOM_SHARE: f32 = 0.95;

/// A box is open to one side if escaping rays average to a vector at least this long. Half a sphere of them has 0.5.
const ONE_SIDED: f32 = 0.5;

/// Vertical field of view from outside, radians.
const OUTSIDE_VIEW: f32 = 0.7;

/// Vertical field of view inside rooms, radians.
const INSIDE_VIEW: f32 = 1.1;

/// Irradiance by the default sun on what faces it, lx: a clear day's.
const SUN: f32 = 100_000.0;

/// Irradiance by the default lamp at its room's mean distance, lx: a well-lit office's.
const LAMP: f32 = 500.0;

/// How a scene without camera or light is best looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Setting {
    /// Closed: looked at from the inside.
    Room {
        /// The place with the longest mean sight.
        centre: Vec3,
        /// Horizontal unit vector with the longest sight.
        sight: Vec3,
        /// Mean distance to the walls, metres.
        radius: f32,
    },
    /// Open toward this horizontal unit vector: looked into.
    Box(Vec3),
    /// Looked at from the front right and above.
    Object,
}

impl Scene {
    /// The file's cameras; without any, one named `default` from which most of the scene can be seen.
    #[must_use]
    pub fn cameras_or_default(&self) -> Cow<'_, [Camera]> {
        if self.cameras.is_empty() {
            vec![self.default_camera(self.setting())].into()
        } else {
            (&self.cameras).into()
        }
    }

    /// The file's lights; without any, and if no surface emits either, one that lights what the default camera sees.
    #[must_use]
    pub fn lights_or_default(&self) -> Cow<'_, [PunctualLight]> {
        if self.is_lit() { (&self.lights).into() } else { vec![self.default_light(self.setting())].into() }
    }

    /// Adds a default camera and a default light where the scene lacks them, and returns what was added and why, for
    /// the user to read.
    pub fn add_defaults_for_view(&mut self) -> Vec<String> {
        if self.is_lit() && !self.cameras.is_empty() {
            return Vec::new();
        }
        let setting = self.setting();
        let mut notes = Vec::new();
        if !self.is_lit() {
            self.lights = vec![self.default_light(setting)];
            notes.push(match setting {
                Setting::Room { .. } => {
                    format!("no light in the file: shown with a lamp of {:.0} cd", self.lights[0].intensity.x)
                }
                _ => format!("no light in the file: shown with a sun of {SUN:.0} lx"),
            });
        }
        if self.cameras.is_empty() {
            self.cameras = vec![self.default_camera(setting)];
            notes.push(String::from(match setting {
                Setting::Room { .. } => "no camera in the file: shown from inside",
                Setting::Box(_) => "no camera in the file: shown through its open side",
                Setting::Object => "no camera in the file: shown from the front right and above",
            }));
        }
        notes
    }

    /// A camera outside that frames the scene's vertices along a diagonal, from the front right and above, in a picture of this
    /// width over height.
    pub(crate) fn overview(&self, aspect: f64) -> Camera {
        let [minimum, maximum] = self.framed_box();
        let (centre, backward) = (0.5 * (minimum + maximum).as_dvec3(), view_direction(Setting::Object));
        let view = look(centre, backward);
        let (right, up) = (view.x_axis.truncate(), view.y_axis.truncate());
        let inside = |p: &&Vec3| p.cmpge(minimum).all() && p.cmple(maximum).all();
        let middle = |axis: DVec3| {
            let along = self.positions.iter().filter(inside).map(|p| (p.as_dvec3() - centre).dot(axis));
            let [low, high] = along.fold([0.0_f64, 0.0_f64], |[low, high], x| [low.min(x), high.max(x)]);
            0.5 * (low + high) * axis
        };
        let centre = centre + middle(right) + middle(up);
        let needed = |p: &Vec3| {
            let q = p.as_dvec3() - centre;
            let across = (q.dot(right).abs() / aspect).max(q.dot(up).abs());
            q.dot(backward) + across / (0.5 * f64::from(OUTSIDE_VIEW)).tan()
        };
        let distance = 1.05 * self.positions.iter().filter(inside).map(needed).fold(0.0, f64::max);
        Camera {
            name: String::from("overview"),
            world_from_view: look(centre + distance * backward, backward),
            projection: Projection::Perspective(OUTSIDE_VIEW),
        }
    }

    /// A light shines or a surface glows.
    fn is_lit(&self) -> bool {
        let glows =
            |material: u32| self.materials.get(material as usize).is_some_and(|m| m.emission != Vec3::ZERO);
        !self.lights.is_empty() || self.primitives.iter().any(|p| p.triangles[1] > 0 && glows(p.material))
    }

    fn setting(&self) -> Setting {
        let bvh = Bvh::new(&self.positions, &self.triangles);
        let [minimum, maximum] = self.framed_box();
        let place = |x: f32, y: f32, z: f32| minimum + Vec3::new(x, y, z) * (maximum - minimum);
        let survey = |origin| Survey::from(&bvh, origin, (maximum - minimum).length());
        let places = PLACES
            .iter()
            .flat_map(|&x| PLACES.iter().flat_map(move |&y| PLACES.iter().map(move |&z| (x, y, z))));
        let free: Vec<Survey> =
            places.map(|(x, y, z)| survey(place(x, y, z))).filter(|s| s.backs < 0.5).collect();
        let rooms = || free.iter().filter(|s| s.fronts >= ROOM_SHARE);
        let best = rooms().reduce(|a, b| if b.distance > a.distance { b } else { a });
        if let (Some(best), true) = (best, 2 * rooms().count() > free.len()) {
            return Setting::Room { centre: best.origin, sight: best.sight, radius: best.distance };
        }
        let middle = survey(place(0.5, 0.5, 0.5));
        let opening = Vec3::new(middle.escape.x, 0.0, middle.escape.z);
        // Most rays must meet fronts, and those that escape must not go up: that would be a yard without roof.
        let open_box = middle.fronts > 0.5
            && middle.escape.length() > ONE_SIDED
            && opening.length() > middle.escape.y.abs();
        match opening.try_normalize() {
            Some(opening) if open_box => Setting::Box(opening),
            _ => Setting::Object,
        }
    }

    fn default_camera(&self, setting: Setting) -> Camera {
        let [minimum, maximum] = self.framed_box().map(|p| p.as_dvec3());
        let (world_from_view, angle) = match setting {
            Setting::Room { centre, sight, radius } => {
                let eye = centre - 0.5 * radius * sight;
                (look(eye.as_dvec3(), -sight.as_dvec3()), INSIDE_VIEW)
            }
            Setting::Box(_) | Setting::Object => {
                let backward = view_direction(setting);
                (frame(minimum, maximum, backward, f64::from(OUTSIDE_VIEW)), OUTSIDE_VIEW)
            }
        };
        Camera { name: String::from("default"), world_from_view, projection: Projection::Perspective(angle) }
    }

    fn default_light(&self, setting: Setting) -> PunctualLight {
        if let Setting::Room { centre, radius, .. } = setting {
            return PunctualLight {
                kind: PunctualKind::Point,
                position: centre + 0.3 * radius * Vec3::Y,
                direction: Vec3::NEG_Y,
                intensity: Vec3::splat(LAMP * radius * radius),
                range: f32::INFINITY,
            };
        }
        // Over the viewer's left shoulder: lit sides and shaded sides both show. Low enough to shine into a box.
        let height = if setting == Setting::Object { 1.2 } else { 0.6 };
        let level = view_direction(setting).with_y(0.0).normalize_or(DVec3::Z);
        let toward_sun = DQuat::from_rotation_y(-PI / 5.0) * level + height * DVec3::Y;
        PunctualLight {
            kind: PunctualKind::Directional,
            position: Vec3::ZERO,
            direction: -toward_sun.normalize_or(DVec3::Y).as_vec3(),
            intensity: Vec3::splat(SUN),
            range: f32::INFINITY,
        }
    }

    /// Corners of the box to look at: around all triangles, or around all but the outermost hundredth at either end of
    /// each axis where that is far smaller, as in a tree on an endless sea.
    fn framed_box(&self) -> [Vec3; 2] {
        let corners: Vec<Vec3> = self
            .triangles
            .iter()
            .flatten()
            .filter_map(|&v| self.positions.get(v as usize))
            .copied()
            .collect();
        let along = |axis: usize| -> [[f32; 2]; 2] {
            let mut values: Vec<f32> = corners.iter().map(|corner| corner[axis]).collect();
            values.sort_unstable_by(f32::total_cmp);
            let at = |i: usize| values.get(i).copied().unwrap_or(0.0);
            let (last, cut) = (values.len().saturating_sub(1), values.len() / 100);
            [[at(0), at(last)], [at(cut), at(last - cut)]]
        };
        let axes = [0, 1, 2].map(along);
        let corner = |kind: usize, end: usize| Vec3::from_array(axes.map(|axis| axis[kind][end]));
        let [all, most] = [0, 1].map(|kind| [corner(kind, 0), corner(kind, 1)]);
        let size = |[minimum, maximum]: [Vec3; 2]| minimum.distance(maximum);
        if size(most) < 0.25 * size(all) { most } else { all }
    }
}

/// What can be seen from one point.
struct Survey {
    origin: Vec3,
    /// Share of the rays that meet the front of something.
    fronts: f32,
    /// Share of the rays that meet the back of something.
    backs: f32,
    /// Mean distance to what is met, metres.
    distance: f32,
    /// Mean direction of the rays that meet nothing.
    escape: Vec3,
    /// Horizontal unit vector with the longest sight.
    sight: Vec3,
}

impl Survey {
    fn from(bvh: &Bvh, origin: Vec3, reach: f32) -> Self {
        let (mut fronts, mut hits, mut distance) = (0.0_f32, 0.0_f32, 0.0);
        let (mut escape, mut sight, mut escaped) = (Vec3::ZERO, Vec3::ZERO, 0.0_f32);
        for direction in directions() {
            let hit = bvh.hit(origin, direction, f32::INFINITY);
            match hit {
                Some(hit) => {
                    fronts += if hit.front { 1.0 } else { 0.0 };
                    hits += 1.0;
                    distance += hit.distance;
                }
                None => {
                    escape += direction;
                    escaped += 1.0;
                }
            }
            // Squared, so that one long view counts more than two short ones; near the horizon only.
            if direction.y.abs() < 0.3 {
                sight += direction * hit.map_or(reach, |hit| hit.distance).powi(2);
            }
        }
        Self {
            origin,
            fronts: fronts / RAYS as f32,
            backs: (hits - fronts) / RAYS as f32,
            distance: distance / hits.max(1.0),
            escape: escape / escaped.max(1.0),
            sight: sight.with_y(0.0).normalize_or(Vec3::NEG_Z),
        }
    }
}

/// Even over the sphere: a Fibonacci spiral (Swinbank and Purser, 2006).
fn directions() -> impl Iterator<Item = Vec3> {
    let golden_angle = PI * (3.0 - 5.0_f64.sqrt());
    (0..RAYS).map(move |i| {
        let y = 1.0 - (2 * i + 1) as f64 / RAYS as f64;
        let (sin, cos) = (golden_angle * i as f64).sin_cos();
        let radius = (1.0 - y * y).sqrt();
        DVec3::new(radius * cos, y, radius * sin).as_vec3()
    })
}

/// Unit vector from what is looked at toward the eye.
fn view_direction(setting: Setting) -> DVec3 {
    match setting {
        Setting::Room { sight, .. } => -sight.as_dvec3(),
        Setting::Box(opening) => opening.as_dvec3(),
        Setting::Object => DVec3::new(0.55, 0.5, 1.0).normalize_or(DVec3::Z),
    }
}

/// The view from `eye` along `-backward` (a unit vector), upright: `world_from_view`.
#[must_use]
pub fn look(eye: DVec3, backward: DVec3) -> DMat4 {
    let right = DVec3::Y.cross(backward).try_normalize().unwrap_or(DVec3::X);
    let up = backward.cross(right);
    DMat4::from_cols(right.extend(0.0), up.extend(0.0), backward.extend(0.0), eye.extend(1.0))
}

/// Looks along `-backward` at a box, from as near as a square picture of this field of view allows.
///
/// A corner at q from the box's centre is in the picture if `max(|q.right|, |q.up|) <= tan(angle / 2) (distance - q.backward)`.
fn frame(minimum: DVec3, maximum: DVec3, backward: DVec3, angle: f64) -> DMat4 {
    let centre = 0.5 * (minimum + maximum);
    let view = look(centre, backward);
    let (right, up) = (view.x_axis.truncate(), view.y_axis.truncate());
    let needed = |i: u32| {
        let end = |bit: u32| f64::from(i >> bit & 1) - 0.5;
        let q = DVec3::new(end(0), end(1), end(2)) * (maximum - minimum);
        q.dot(backward) + q.dot(right).abs().max(q.dot(up).abs()) / (0.5 * angle).tan()
    };
    let distance = 1.05 * (0..8).map(needed).fold(0.0, f64::max);
    look(centre + distance * backward, backward)
}
