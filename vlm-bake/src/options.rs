//! The knobs of a bake and their presets.

use serde::{Deserialize, Serialize};

use crate::flags::FlagError;
use crate::grid::{GridOptions, LEAST_PLACES};
use crate::ground::LEAST_POINTS;

/// What a bake costs and how fine it is. Start from [`BakeOptions::preset`] and change what you need.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeOptions {
    /// Name of the preset that these options started from, kept for the record.
    pub preset: Preset,
    /// Number of lights for the whole scene. More lights resolve shadows' borders and small colours better; every
    /// frame's injection, the grid and the file grow in proportion.
    pub lights: u32,
    /// Share of the budget (0 to 1) that the decimated surface may use; the rest divides large lights. Higher values follow
    /// curved surfaces more closely, lower values resolve light and shadow on large flat ones.
    pub surface_share: f64,
    /// Decimation goes on below the budget while its error stays under this share of the scene's extent. Higher values
    /// free lights for large surfaces, at the cost of silhouettes and of deeper offsets.
    pub free_error: f64,
    /// Points on the visible surface that phase 1 lights, per light. Higher values soften the aliasing of shadow borders; the
    /// cost of injection and about 36 bytes per sample grow in proportion.
    pub samples: u32,
    /// Points tested per light by `verify`, and the pool from which the samples are drawn. Higher values find smaller
    /// violations; bake time grows in proportion.
    pub tests_per_light: u32,
    /// At least so many points, spread evenly over the surface, by which lights are placed and the finished asset is proven, whatever the
    /// number of lights. Fewer of them bake small scenes faster, and miss small places where a light shows.
    pub least_points: u32,
    /// The static grid.
    pub grid: GridOptions,
}

/// Named sets of options.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Preset {
    /// A quick look: few lights, four samples each. The light of small objects blurs into that of their surroundings.
    Draft,
    /// For shipping: follows surfaces to about a thousandth of the scene, four samples a light.
    #[default]
    Game,
    /// For stills and references: four times the lights of `Game`, sixteen samples each; bakes and renders slower in proportion.
    Quality,
}

impl std::str::FromStr for Preset {
    type Err = FlagError;

    fn from_str(name: &str) -> Result<Self, FlagError> {
        Self::ALL.into_iter().find(|preset| preset.name() == name).ok_or(FlagError::Preset)
    }
}

impl Preset {
    /// All presets, cheapest first.
    pub const ALL: [Self; 3] = [Self::Draft, Self::Game, Self::Quality];

    /// The name used on the command line and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Draft => "draft",
            Self::Game => "game",
            Self::Quality => "quality",
        }
    }

    /// The budget of lights for a scene of that many visible triangles: a share of them, kept between the number that
    /// a plain room needs and the number that a large scene can afford.
    #[must_use]
    pub fn lights(self, visible_triangles: usize) -> u32 {
        let (share, least, most) = match self {
            Self::Draft => (0.05, 120.0, 4_000.0),
            Self::Game => (0.20, 460.0, 16_000.0),
            Self::Quality => (0.80, 1_840.0, 64_000.0),
        };
        (visible_triangles as f64 * share).clamp(least, most) as u32
    }
}

impl BakeOptions {
    /// The options of a preset for a scene of that many visible triangles.
    #[must_use]
    pub fn preset(preset: Preset, visible_triangles: usize) -> Self {
        let lights = preset.lights(visible_triangles);
        let (samples, probes_per_light, fewest_probes, rays, near) = match preset {
            Preset::Draft => (4, 1.5, 500, 256, 0),
            Preset::Game => (4, 3.25, 2_000, 512, 16),
            Preset::Quality => (16, 2.0, 4_000, 2048, 40),
        };
        let probes = ((f64::from(lights) * probes_per_light) as u32).max(fewest_probes);
        Self {
            preset,
            lights,
            surface_share: 0.6,
            free_error: 2e-4,
            samples,
            tests_per_light: 20,
            least_points: LEAST_POINTS,
            grid: GridOptions { probes, rays, near, cell_size: None, least_places: LEAST_PLACES },
        }
    }
}
