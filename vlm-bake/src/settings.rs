//! What a user asks of a bake, on the command line or in a project's file: the rest is left to the preset.

use serde::{Deserialize, Serialize};

use crate::grid::GridOptions;
use crate::options::{BakeOptions, Preset};
use crate::scene::LoadOptions;

/// Wishes about a bake; `None` leaves a value to the preset. [`BakeSettings::options`] makes them whole for a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BakeSettings {
    /// What the bake costs and gives.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub preset: Option<Preset>,
    /// Lights for the whole scene, 1 to 1,000,000. See [`BakeOptions::lights`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lights: Option<u32>,
    /// Edge of the grid's coarsest cells, metres, above 0. See [`GridOptions::cell_size`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cell: Option<f32>,
    /// Probes on surface, at most 1,000,000; 0 for no grid. See [`GridOptions::probes`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub probes: Option<u32>,
    /// Directions traced from each probe, 1 to 65,536. See [`GridOptions::rays`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rays: Option<u32>,
    /// The most near lights of a probe, at most 4,096. See [`GridOptions::near`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub near: Option<u32>,
    /// Scenes with more vertices are refused, 1 at least. See [`LoadOptions::max_vertices`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_vertices: Option<u32>,
    /// Compress what is added to the file, without loss.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compress: Option<bool>,
    /// Leave the file out of a batch.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub skip: Option<bool>,
}

/// A value outside of its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{key} is {value}, but must be {range}")]
pub struct OutOfRange {
    /// Name of the setting.
    pub key: &'static str,
    /// What was asked for.
    pub value: f64,
    /// What may be asked for.
    pub range: &'static str,
}

impl BakeSettings {
    /// These wishes, and those of `base` where these have none.
    #[must_use]
    pub fn over(self, base: Self) -> Self {
        Self {
            preset: self.preset.or(base.preset),
            lights: self.lights.or(base.lights),
            cell: self.cell.or(base.cell),
            probes: self.probes.or(base.probes),
            rays: self.rays.or(base.rays),
            near: self.near.or(base.near),
            max_vertices: self.max_vertices.or(base.max_vertices),
            compress: self.compress.or(base.compress),
            skip: self.skip.or(base.skip),
        }
    }

    /// Checks the ranges that the fields name.
    ///
    /// # Errors
    /// The first value that is out of its range.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let whole = |key, value: Option<u32>, least: u32, most: u32, range| match value {
            Some(value) if !(least..=most).contains(&value) => {
                Err(OutOfRange { key, value: f64::from(value), range })
            }
            _ => Ok(()),
        };
        whole("lights", self.lights, 1, 1_000_000, "a whole number from 1 to 1000000")?;
        whole("probes", self.probes, 0, 1_000_000, "a whole number from 0 to 1000000")?;
        whole("rays", self.rays, 1, 65_536, "a whole number from 1 to 65536")?;
        whole("near", self.near, 0, 4_096, "a whole number from 0 to 4096")?;
        whole("max_vertices", self.max_vertices, 1, u32::MAX, "a whole number above 0")?;
        match self.cell {
            Some(cell) if !(cell.is_finite() && cell > 0.0) => {
                Err(OutOfRange { key: "cell", value: f64::from(cell), range: "a number of metres above 0" })
            }
            _ => Ok(()),
        }
    }

    /// The options of a bake of so many visible triangles.
    #[must_use]
    pub fn options(&self, visible_triangles: usize) -> BakeOptions {
        let preset = BakeOptions::preset(self.preset.unwrap_or_default(), visible_triangles);
        BakeOptions {
            lights: self.lights.unwrap_or(preset.lights),
            grid: GridOptions {
                probes: self.probes.unwrap_or(preset.grid.probes),
                rays: self.rays.unwrap_or(preset.grid.rays),
                near: self.near.unwrap_or(preset.grid.near),
                cell_size: self.cell,
                ..preset.grid
            },
            ..preset
        }
    }

    /// How the scene is read for it.
    #[must_use]
    pub fn load_options(&self) -> LoadOptions<'static> {
        let usual = LoadOptions::default();
        LoadOptions {
            max_vertices: self.max_vertices.map_or(usual.max_vertices, |most| most as usize),
            ..usual
        }
    }

    /// Each wish as `key value`, for people to read: what changed, say.
    #[must_use]
    pub fn wishes(&self) -> Vec<(String, String)> {
        let Ok(serde_json::Value::Object(wishes)) = serde_json::to_value(self) else { return Vec::new() };
        let plain = |value: serde_json::Value| value.as_str().map_or(value.to_string(), str::to_owned);
        wishes.into_iter().map(|(key, value)| (key, plain(value))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_win_over_files() {
        let file = BakeSettings { lights: Some(5), probes: Some(9), ..BakeSettings::default() };
        let flags = BakeSettings { lights: Some(7), compress: Some(false), ..BakeSettings::default() };
        let both = flags.over(file);
        assert_eq!((both.lights, both.probes, both.compress), (Some(7), Some(9), Some(false)));
        let options = both.options(100);
        assert_eq!((options.lights, options.grid.probes), (7, 9));
        assert_eq!(options.grid.rays, BakeOptions::preset(Preset::Game, 100).grid.rays);
    }

    #[test]
    fn ranges_are_kept() {
        let ok =
            BakeSettings { lights: Some(1), cell: Some(0.5), probes: Some(0), ..BakeSettings::default() };
        assert_eq!(ok.check(), Ok(()));
        for (wrong, key) in [
            (BakeSettings { lights: Some(0), ..ok }, "lights"),
            (BakeSettings { rays: Some(65_537), ..ok }, "rays"),
            (BakeSettings { cell: Some(f32::NAN), ..ok }, "cell"),
        ] {
            assert_eq!(wrong.check().unwrap_err().key, key);
        }
    }
}
