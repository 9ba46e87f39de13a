//! Emissive surfaces as a distribution, so that the reference finds small bright ones.

use glam::Vec3;
use vlm_shaders::cpu::resolve::luminance;

use crate::scene::Scene;

/// Every triangle that emits, drawn in proportion to its area times its mean emitted luminance.
#[derive(Clone, Debug, Default)]
pub struct Emitters {
    /// Ascending by triangle.
    emitters: Vec<Emitter>,
}

#[derive(Clone, Copy, Debug)]
struct Emitter {
    triangle: u32,
    corners: [Vec3; 3],
    /// Probability density on the triangle, per square metre.
    density: f32,
    /// Probability of this triangle and all before it.
    cumulative: f32,
}

/// A point drawn on an emitter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmitterPoint {
    /// Index into [`Scene::triangles`].
    pub triangle: u32,
    /// Metres, world space.
    pub position: Vec3,
}

impl Emitters {
    /// Collects the emissive triangles of a scene.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let powers: Vec<_> = (0..scene.triangles.len()).filter_map(|t| emitted_power(scene, t)).collect();
        let total: f32 = powers.iter().map(|(.., power)| power).sum();
        let mut cumulative = 0.0;
        let emitters = powers.into_iter().map(|(triangle, corners, area, power)| {
            cumulative += power / total;
            Emitter { triangle: triangle as u32, corners, density: power / total / area, cumulative }
        });
        Self { emitters: emitters.collect() }
    }

    /// True if nothing emits.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.emitters.is_empty()
    }

    /// The density with which [`Emitters::draw`] finds points of a triangle, per square metre; 0 for others.
    #[must_use]
    pub fn density(&self, triangle: u32) -> f32 {
        let found = self.emitters.binary_search_by_key(&triangle, |emitter| emitter.triangle);
        found.ok().and_then(|i| self.emitters.get(i)).map_or(0.0, |emitter| emitter.density)
    }

    /// The point for two numbers in 0..1; the first also chooses the triangle. `None` if nothing emits.
    #[must_use]
    pub fn draw(&self, (u, v): (f32, f32)) -> Option<EmitterPoint> {
        let index = self.emitters.partition_point(|emitter| emitter.cumulative <= u);
        let emitter = self.emitters.get(index).or(self.emitters.last())?;
        let before = index.checked_sub(1).and_then(|i| self.emitters.get(i)).map_or(0.0, |e| e.cumulative);
        let u = ((u - before) / (emitter.cumulative - before)).clamp(0.0, 1.0);
        // Uniform on the triangle (Turk 1990).
        let root = u.sqrt();
        let [a, b, c] = emitter.corners;
        let position = a * (1.0 - root) + b * (root * (1.0 - v)) + c * (root * v);
        Some(EmitterPoint { triangle: emitter.triangle, position })
    }
}

/// Index, corners, area and power (up to a factor) of a triangle, if it emits.
fn emitted_power(scene: &Scene, triangle: usize) -> Option<(usize, [Vec3; 3], f32, f32)> {
    scene.material_of(triangle).filter(|m| m.emission != Vec3::ZERO)?;
    let corners = scene.corners(triangle)?;
    let area = 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).length();
    let power = area * luminance(scene.mean_surface(triangle).emission);
    (power > 0.0 && power.is_finite()).then_some((triangle, corners, area, power))
}
