//! Whether each object's lights return what its surface does: albedo, area, and flux under uniform light.

use glam::Vec3;

use super::facts::Evidence;
use crate::scene::Surface;

/// Albedo and flux of an object's lights may differ from its surface's by this share.
pub const ALLOWED: f64 = 0.02;

/// One object that makes lights, in figures.
#[derive(Clone, Debug, Default)]
pub struct ObjectFigures {
    /// Node path.
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
        if albedo <= ALLOWED && flux.abs() <= ALLOWED {
            return String::new();
        }
        let uncovered = self.uncovered_m2 / self.visible_m2.max(f64::MIN_POSITIVE);
        if self.lights == 0 && self.authored == 0 {
            return "has no light at all: too small for the budget".to_owned();
        }
        if self.authored > 0 {
            return "an artist's lights add to its own or replace some of them".to_owned();
        }
        if flux < -ALLOWED && uncovered > 0.5 * -flux {
            return format!(
                "{} of its surface has no light: parts too small for the budget",
                percent(uncovered)
            );
        }
        if flux < -ALLOWED {
            return "its lights are much smaller than the surface that they stand for: small or thin parts"
                .to_owned();
        }
        if flux > ALLOWED {
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
    if percent == 0.0 || percent.abs() >= 10.0 {
        format!("{percent:.0} %")
    } else if percent.abs() >= 0.095 {
        format!("{percent:.1} %")
    } else {
        format!("{percent:.2} %")
    }
}

/// The objects that make lights, in the order of the scene. `surfaces` holds the mean surface of each scene triangle.
pub fn objects(evidence: &Evidence, surfaces: &[Surface]) -> Vec<ObjectFigures> {
    let count = evidence.scene.objects.len();
    let mut figures = vec![ObjectFigures::default(); count];
    let mut flux = vec![[0.0_f64; 2]; count];
    add_surface(evidence, surfaces, &mut figures, &mut flux);
    add_lights(evidence, &mut figures, &mut flux);
    for (object, [of_surface, of_lights]) in flux.into_iter().enumerate() {
        let f = &mut figures[object];
        f.path.clone_from(&evidence.scene.objects[object].path);
        f.albedo /= f.visible_m2.max(f64::MIN_POSITIVE) as f32;
        f.light_albedo /= f.lights_m2.max(f64::MIN_POSITIVE) as f32;
        f.flux_ratio = if of_surface > 0.0 { of_lights / of_surface } else { 1.0 };
    }
    figures.retain(|f| f.visible_m2 > 0.0 || f.lights + f.authored > 0);
    figures
}

fn add_surface(
    evidence: &Evidence,
    surfaces: &[Surface],
    figures: &mut [ObjectFigures],
    flux: &mut [[f64; 2]],
) {
    let patches = &evidence.verification.patches;
    let object_of =
        |t: usize| evidence.scene.primitives[patches.region(t).primitive as usize].object as usize;
    for t in 0..patches.triangles.len() {
        let object = object_of(t);
        let sides = if patches.region(t).two_sided { 2.0 } else { 1.0 };
        let area = sides * patches.area(t);
        let reflectance = surfaces[patches.triangle_source[t] as usize].reflectance();
        let steering = &evidence.scene.objects[object].steering;
        figures[object].visible_m2 += area;
        figures[object].albedo += reflectance * area as f32;
        flux[object][0] += area * f64::from((reflectance * steering.tint * steering.intensity).element_sum());
    }
    let verification = evidence.verification;
    for (point, light) in verification.points.iter().zip(&verification.light_of_point) {
        if light.is_none() {
            figures[object_of(point.triangle as usize)].uncovered_m2 += point.area;
        }
    }
}

fn add_lights(evidence: &Evidence, figures: &mut [ObjectFigures], flux: &mut [[f64; 2]]) {
    let (lights, asset) = (evidence.lights, evidence.asset);
    for (l, object) in lights.objects.iter().enumerate() {
        let Some(object) = object.map(|o| o as usize) else { continue };
        if lights.authored[l] {
            figures[object].authored += 1;
            continue;
        }
        let area = lights.area(l);
        let samples = asset.sample_starts[l] as usize..asset.sample_starts[l + 1] as usize;
        let reflectance: Vec3 = asset.samples[samples].iter().map(|s| s.reflectance).sum();
        figures[object].lights += 1;
        figures[object].lights_m2 += area;
        figures[object].light_albedo += asset.albedo[l] * area as f32;
        flux[object][1] += area * f64::from(reflectance.element_sum());
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
        assert_eq!([0.0, 0.0004, 0.0123, 0.25].map(percent), ["0 %", "0.04 %", "1.2 %", "25 %"]);
    }
}
