//! controls: what the user chose: methods, exposure, lights, the colours of the bounce, overlays.

use glam::Vec3;
use vlm_bake::render::Method;
use vlm_bake::scene::Scene;
use vlm_bake::shade::punctual_light;

use super::arguments::OverlayArg;
use super::open::LightGroup;
use crate::PunctualLight;

/// Darker channels are not brightened beyond what this would need.
const LEAST_ALBEDO: f32 = 0.01;

/// What the user chose.
#[derive(Clone, Debug, PartialEq)]
pub struct Controls {
    /// Where the indirect light comes from.
    pub method: Method,
    /// Show the difference to this method instead of light.
    pub compared: Option<Method>,
    /// What radiance in nt is multiplied by.
    pub exposure: f32,
    /// Factor of direct light.
    pub direct_share: f32,
    /// Factor of indirect light.
    pub indirect_share: f32,
    /// Factor of a difference.
    pub difference_gain: f32,
    /// The real lights, in the order of the file.
    pub lights: Vec<LightControl>,
    /// The virtual lights, group by group.
    pub bounces: Vec<BounceControl>,
    /// What is drawn over the picture.
    pub overlays: Overlays,
    /// Alpha masks cut holes.
    pub alpha_masks: bool,
}

/// A real light and what the user made of it.
#[derive(Clone, Debug, PartialEq)]
pub struct LightControl {
    /// As in the file.
    pub original: PunctualLight,
    /// As it shines now, at full intensity.
    pub light: PunctualLight,
    /// Factor of its intensity.
    pub intensity: f32,
}

/// The light that one group of virtual lights sends on.
#[derive(Clone, Debug, PartialEq)]
pub struct BounceControl {
    /// Which lights.
    pub group: LightGroup,
    /// Factor of its light.
    pub intensity: f32,
    /// Factor of its light by channel, linear.
    pub tint: Vec3,
}

/// What is drawn over the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Overlays {
    /// Edges of the virtual lights by clearance.
    pub wireframe: bool,
    /// Surface and lights with tags.
    pub tags: bool,
    /// Cells of the grid by near lights.
    pub cells: bool,
    /// Virtual lights with the radiosity that was injected.
    pub radiosity: bool,
}

impl Default for Controls {
    fn default() -> Self {
        Self {
            method: Method::Vlm,
            compared: None,
            exposure: 1.0,
            direct_share: 1.0,
            indirect_share: 1.0,
            difference_gain: 1.0,
            lights: Vec::new(),
            bounces: Vec::new(),
            overlays: Overlays::default(),
            alpha_masks: false,
        }
    }
}

impl Controls {
    /// Takes over a scene that was opened, or opened anew: what the user made of its lights stays, where they are still as they were.
    pub fn adopt(&mut self, scene: &Scene, groups: Vec<LightGroup>) {
        let lights = std::mem::take(&mut self.lights);
        let before = |i: usize, original: &PunctualLight| {
            lights.get(i).filter(|light| light.original == *original).cloned()
        };
        let originals = scene.lights_or_default();
        let adopted = originals.iter().map(punctual_light).enumerate().map(|(i, original)| {
            before(i, &original).unwrap_or(LightControl { original, light: original, intensity: 1.0 })
        });
        self.lights = adopted.collect();
        let known = std::mem::take(&mut self.bounces);
        let adopt = |group: LightGroup| {
            let before = known.iter().find(|known| known.group.id == group.id);
            let (intensity, tint) = before.map_or((1.0, Vec3::ONE), |before| (before.intensity, before.tint));
            BounceControl { group, intensity, tint }
        };
        self.bounces = groups.into_iter().map(adopt).collect();
    }

    /// The real lights as they shine.
    #[must_use]
    pub fn real_lights(&self) -> Vec<PunctualLight> {
        self.lights.iter().map(LightControl::shining).collect()
    }

    /// The factor of each virtual light; empty where all are 1.
    #[must_use]
    pub fn tints(&self) -> Vec<Vec3> {
        let mut tints = Vec::new();
        for bounce in self.bounces.iter().filter(|bounce| !bounce.is_neutral()) {
            for &light in &bounce.group.lights {
                let light = light as usize;
                if tints.len() <= light {
                    tints.resize(light + 1, Vec3::ONE);
                }
                tints[light] = bounce.tint * bounce.intensity;
            }
        }
        tints
    }

    /// The methods whose light is shown.
    #[must_use]
    pub fn methods(&self) -> Vec<Method> {
        [Some(self.method), self.compared].into_iter().flatten().collect()
    }
}

impl LightControl {
    /// As it shines.
    #[must_use]
    pub fn shining(&self) -> PunctualLight {
        PunctualLight { intensity: self.light.intensity * self.intensity, ..self.light }
    }
}

impl BounceControl {
    /// What the file would have to say for the same light, to be copied into the node's extras; for groups that are whole.
    #[must_use]
    pub fn as_extras(&self) -> String {
        let Vec3 { x, y, z } = self.tint;
        format!(r#""vlm": {{ "intensity": {:.3}, "tint": [{x:.3}, {y:.3}, {z:.3}] }}"#, self.intensity)
    }

    /// The colour that the surface seems to have, from the light that it sends on; linear, 0 to 1.
    #[must_use]
    pub fn color(&self) -> Vec3 {
        (self.group.albedo * self.tint).clamp(Vec3::ZERO, Vec3::ONE)
    }

    /// Makes the light as if the surface had this colour. A channel that it does not reflect stays weak.
    pub fn set_color(&mut self, color: Vec3) {
        self.tint = color / self.group.albedo.max(Vec3::splat(LEAST_ALBEDO));
    }

    /// The file's own light.
    #[must_use]
    pub fn is_neutral(&self) -> bool {
        self.tint * self.intensity == Vec3::ONE
    }
}

impl Overlays {
    /// Any of them.
    #[must_use]
    pub fn any(&self) -> bool {
        *self != Self::default()
    }
}

impl From<&[OverlayArg]> for Overlays {
    fn from(chosen: &[OverlayArg]) -> Self {
        Self {
            wireframe: chosen.contains(&OverlayArg::Wireframe),
            tags: chosen.contains(&OverlayArg::Tags),
            cells: chosen.contains(&OverlayArg::Cells),
            radiosity: chosen.contains(&OverlayArg::Radiosity),
        }
    }
}
