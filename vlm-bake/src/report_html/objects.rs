//! Whether each object's lights return what its surface does: albedo, area, and flux under uniform light.

use glam::{DVec3, Vec3};

use super::facts::Evidence;
use crate::flux::TOLERANCE;
use crate::scene::{Scene, Surface};

/// One object that makes lights, in figures.
#[derive(Clone, Debug, Default)]
pub struct ObjectFigures {
    /// Node path, for parts with material, mesh and primitive.
    pub path: String,
    /// Lights derived from it.
    pub lights: usize,
    /// Lights that artists made for it.
    pub authored: usize,
    /// Area of the surface that reflects or emits, square metres; both sides of a two-sided one.
    pub visible_m2: f64,
    /// Part of it for which no light stands.
    pub uncovered_m2: f64,
    /// Area of the derived lights.
    pub lights_m2: f64,
    /// Mean albedo of the surface, weighted by area.
    pub albedo: Vec3,
    /// Mean albedo of the derived lights, weighted by area.
    pub light_albedo: Vec3,
    /// Flux that the derived lights return under an irradiance of 1 lx everywhere, over that of the surface; 1 where the surface
    /// reflects nothing.
    pub flux_ratio: f64,
}

impl ObjectFigures {
    /// Greatest difference of albedo over the channels, as a share of the surface's brightest one.
    #[must_use]
    pub fn albedo_error(&self) -> f64 {
        let brightest = self.albedo.max_element();
        let difference = (self.light_albedo - self.albedo).abs().max_element();
        if brightest > 0.0 { f64::from(difference / brightest) } else { 0.0 }
    }

    /// Why the object misses the rule of 2 %; empty if it keeps it.
    #[must_use]
    pub fn why_missed(&self) -> String {
        let (albedo, flux) = (self.albedo_error(), self.flux_ratio - 1.0);
        if albedo <= TOLERANCE && flux.abs() <= TOLERANCE {
            return String::new();
        }
        let uncovered = self.uncovered_m2 / self.visible_m2.max(f64::MIN_POSITIVE);
        if self.lights == 0 && self.authored == 0 {
            return "has no light at all: too small for the budget".to_owned();
        }
        if self.authored > 0 {
            return "an artist's lights add to its own or replace some of them".to_owned();
        }
        if flux < -TOLERANCE && uncovered > 0.5 * -flux {
            return format!(
                "{} of its surface has no light: parts too small for the budget",
                percent(uncovered)
            );
        }
        if flux < -TOLERANCE {
            return "its lights are much smaller than the surface that they stand for: small or thin parts"
                .to_owned();
        }
        if flux > TOLERANCE {
            return "its lights return more than its surface: some stand for the same surface twice"
                .to_owned();
        }
        "lights of different albedo shrank or grew unevenly: colours on small parts".to_owned()
    }
}

/// A share in percent, with as many digits as it needs.
#[must_use]
pub fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    if percent.abs() < 5e-3 {
        return if percent == 0.0 { "0 %" } else { "< 0.01 %" }.to_owned();
    }
    if percent.abs() >= 10.0 {
        format!("{percent:.0} %")
    } else if percent.abs() >= 0.095 {
        format!("{percent:.1} %")
    } else {
        format!("{percent:.2} %")
    }
}

/// What a row of figures is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grouping {
    /// An object: a node with a mesh.
    Object,
    /// A part of an object that has one material.
    Part,
}

impl Grouping {
    fn count(self, scene: &Scene) -> usize {
        match self {
            Self::Object => scene.objects.len(),
            Self::Part => scene.primitives.len(),
        }
    }

    fn of(self, scene: &Scene, primitive: u32) -> usize {
        match self {
            Self::Object => scene.primitives[primitive as usize].object as usize,
            Self::Part => primitive as usize,
        }
    }

    fn name(self, evidence: &Evidence, group: usize) -> String {
        let scene = evidence.scene;
        match self {
            Self::Object => {
                let (path, node) = (&scene.objects[group].path, scene.objects[group].node);
                let is_alone = scene.objects.iter().filter(|o| o.path == *path).count() == 1;
                if is_alone { path.clone() } else { format!("{path} (node {node})") }
            }
            Self::Part => {
                let primitive = &scene.primitives[group];
                let path = &scene.objects[primitive.object as usize].path;
                let material = evidence.material_name(group as u32);
                format!("{path}: {material} ({}/{})", primitive.mesh, primitive.primitive)
            }
        }
    }
}

/// Sums over a group.
#[derive(Clone, Copy, Default)]
struct Sums {
    albedo: DVec3,
    light_albedo: DVec3,
    flux: f64,
    light_flux: f64,
}

/// The objects or parts that make lights, in the order of the scene. `surfaces` holds the mean surface of each scene triangle.
pub fn figures(evidence: &Evidence, surfaces: &[Surface], grouping: Grouping) -> Vec<ObjectFigures> {
    let count = grouping.count(evidence.scene);
    let mut figures = vec![ObjectFigures::default(); count];
    let mut sums = vec![Sums::default(); count];
    add_surface(evidence, surfaces, grouping, &mut figures, &mut sums);
    add_lights(evidence, grouping, &mut figures, &mut sums);
    for (group, (f, sums)) in figures.iter_mut().zip(sums).enumerate() {
        f.path = grouping.name(evidence, group);
        f.albedo = (sums.albedo / f.visible_m2.max(f64::MIN_POSITIVE)).as_vec3();
        f.light_albedo = (sums.light_albedo / f.lights_m2.max(f64::MIN_POSITIVE)).as_vec3();
        f.flux_ratio = if sums.flux > 0.0 { sums.light_flux / sums.flux } else { 1.0 };
    }
    figures.retain(|f| f.visible_m2 > 0.0 || f.lights + f.authored > 0);
    figures
}

fn add_surface(
    evidence: &Evidence,
    surfaces: &[Surface],
    grouping: Grouping,
    figures: &mut [ObjectFigures],
    sums: &mut [Sums],
) {
    let (patches, scene) = (evidence.patches, evidence.scene);
    let verification = evidence.verification;
    // By the check's points: surface that is buried in something solid has none, and is not seen.
    for (point, light) in verification.points.iter().zip(&verification.light_of_point) {
        let t = point.triangle as usize;
        let primitive = patches.region(t).primitive;
        let group = grouping.of(scene, primitive);
        let reflectance = surfaces[patches.triangle_source[t] as usize].reflectance();
        let steering = &scene.objects[scene.primitives[primitive as usize].object as usize].steering;
        let strength = steering.tint * steering.intensity;
        figures[group].visible_m2 += point.area;
        figures[group].uncovered_m2 += if light.is_none() { point.area } else { 0.0 };
        sums[group].albedo += reflectance.as_dvec3() * point.area;
        sums[group].flux += (reflectance * strength).as_dvec3().element_sum() * point.area;
    }
}

fn add_lights(evidence: &Evidence, grouping: Grouping, figures: &mut [ObjectFigures], sums: &mut [Sums]) {
    let (lights, asset) = (evidence.lights, evidence.asset);
    for l in 0..lights.corners.len() {
        let group = match (grouping, lights.objects[l]) {
            (Grouping::Object, Some(object)) => object as usize,
            (Grouping::Object, None) => continue,
            (Grouping::Part, _) => {
                let Some(primitive) = evidence.primitive_of_light(l) else { continue };
                primitive as usize
            }
        };
        if lights.authored[l] {
            figures[group].authored += 1;
            continue;
        }
        let area = lights.area(l);
        let samples = asset.sample_starts[l] as usize..asset.sample_starts[l + 1] as usize;
        let reflectance: DVec3 = asset.samples[samples].iter().map(|s| s.reflectance.as_dvec3()).sum();
        figures[group].lights += 1;
        figures[group].lights_m2 += area;
        sums[group].light_albedo += asset.albedo[l].as_dvec3() * area;
        sums[group].light_flux += reflectance.element_sum() * area;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept() -> ObjectFigures {
        ObjectFigures {
            lights: 10,
            visible_m2: 10.0,
            albedo: Vec3::new(0.5, 0.2, 0.1),
            light_albedo: Vec3::new(0.505, 0.2, 0.1),
            flux_ratio: 0.99,
            ..ObjectFigures::default()
        }
    }

    #[test]
    fn two_percent_are_allowed_and_no_more() {
        assert_eq!(kept().why_missed(), "");
        assert!(ObjectFigures { flux_ratio: 0.97, ..kept() }.why_missed().contains("smaller"));
        assert!(ObjectFigures { flux_ratio: 1.03, ..kept() }.why_missed().contains("twice"));
        let uncovered = ObjectFigures { flux_ratio: 0.9, uncovered_m2: 1.0, ..kept() };
        assert!(uncovered.why_missed().contains("10 % of its surface"), "{}", uncovered.why_missed());
        let tinted = ObjectFigures { light_albedo: Vec3::new(0.5, 0.22, 0.1), ..kept() };
        assert!(tinted.why_missed().contains("albedo"), "a small channel counts against the brightest");
    }

    #[test]
    fn percentages_keep_the_digits_that_matter() {
        assert_eq!(
            [-0.0, 1e-6, 0.0004, 0.0123, 0.25].map(percent),
            ["0 %", "< 0.01 %", "0.04 %", "1.2 %", "25 %"]
        );
    }
}
