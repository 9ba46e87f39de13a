//! The flags that say how to bake, and the project's file behind them.

use std::path::{Path, PathBuf};

use bytesize::ByteSize;
use clap::{Args, ValueEnum};
use vlm_bake::cache::{Cache, DEFAULT_SIZE};
use vlm_bake::flags::positive;
use vlm_bake::options::Preset;
use vlm_bake::project::{FILE_NAME, Project};
use vlm_bake::settings::BakeSettings;

use crate::error::CliError;

/// How to bake.
#[derive(Args)]
pub struct SettingsArgs {
    /// What the bake costs and gives [default: game]
    #[arg(long, value_enum)]
    preset: Option<PresetArg>,
    /// Number of lights for the whole scene [default: by preset and number of triangles]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    lights: Option<u32>,
    /// Edge of the grid's coarsest cells in metres [default: a 16th of the scene]
    #[arg(long, value_name = "METRES", value_parser = positive)]
    cell: Option<f32>,
    /// About how many probes the grid has, within limits of their spacing; 0 for no grid [default: by preset and lights]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=1_000_000))]
    probes: Option<u32>,
    /// Directions traced from each probe; more have less noise [default: by preset]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65_536))]
    rays: Option<u32>,
    /// Most near lights of a probe, whose form factor every pixel evaluates; 0 for the fastest frame [default: by preset]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=4096))]
    near: Option<u32>,
    /// Refuse scenes with more vertices, every instance counted; a bake takes about half a kilobyte for each, several times that where
    /// triangles share none [default: 33554432]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    max_vertices: Option<u32>,
    /// Compress the lights and the grid, without loss: a third smaller, and only readers that know this compression read them
    #[arg(long, overrides_with = "no_compress")]
    compress: bool,
    /// Do not, whatever the project's file says
    #[arg(long, overrides_with = "compress")]
    no_compress: bool,
    /// The project's file [default: the nearest vlm.toml in the input's folder or above it]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Use no project's file
    #[arg(long, conflicts_with = "config")]
    no_config: bool,
}

/// Where finished bakes are kept.
#[derive(Args)]
pub struct CacheArgs {
    /// Folder of finished bakes [default: that of vlm.toml, else the user's folder for caches]
    #[arg(long, value_name = "DIR", env = "VLM_CACHE_DIR")]
    cache_dir: Option<PathBuf>,
    /// Most bytes of it, such as 500MB or 2GiB; what was not used for longest goes first [default: 4GiB]
    #[arg(long, value_name = "SIZE")]
    cache_size: Option<ByteSize>,
    /// Bake everything, and keep nothing
    #[arg(long, conflicts_with_all = ["cache_dir", "cache_size"])]
    no_cache: bool,
}

/// Presets by name.
#[derive(Clone, Copy, ValueEnum)]
enum PresetArg {
    /// A quick look: 5 % of the triangles as lights (120 to 4,000), 4 samples each
    Draft,
    /// For shipping: 20 % of the triangles (460 to 16,000), 4 samples each
    Game,
    /// For stills: 80 % of the triangles (1,840 to 64,000), 16 samples each
    Quality,
}

impl From<PresetArg> for Preset {
    fn from(preset: PresetArg) -> Self {
        match preset {
            PresetArg::Draft => Self::Draft,
            PresetArg::Game => Self::Game,
            PresetArg::Quality => Self::Quality,
        }
    }
}

/// What flags and project together ask for.
pub struct Wishes {
    flags: BakeSettings,
    /// `None` where there is none.
    pub project: Option<Project>,
}

impl SettingsArgs {
    /// Reads the project's file for inputs in a folder.
    ///
    /// # Errors
    /// If there is one, but it cannot be used.
    pub fn wishes(&self, folder: &Path) -> Result<Wishes, CliError> {
        let found = || if self.no_config { None } else { Project::find(folder) };
        let path = self.config.clone().or_else(found);
        let project = path.map(|path| Project::read(&path)).transpose();
        let project = project.map_err(|error| CliError::usage(error.to_string()))?;
        Ok(Wishes { flags: self.flags(), project })
    }

    /// Where a project's file may come while there is none: in the inputs' folder, and in those above it that the user works in.
    pub fn places_of_project(&self, folder: &Path) -> Vec<PathBuf> {
        if self.no_config || self.config.is_some() {
            return self.config.iter().cloned().collect();
        }
        let Ok(folder) = std::path::absolute(folder) else { return Vec::new() };
        let here = std::env::current_dir().unwrap_or_default();
        let above = folder.ancestors().skip(1).take_while(|above| above.starts_with(&here));
        [folder.as_path()].into_iter().chain(above).map(|folder| folder.join(FILE_NAME)).collect()
    }

    fn flags(&self) -> BakeSettings {
        let compress = match (self.compress, self.no_compress) {
            (true, _) => Some(true),
            (_, true) => Some(false),
            _ => None,
        };
        BakeSettings {
            preset: self.preset.map(Into::into),
            lights: self.lights,
            cell: self.cell,
            probes: self.probes,
            rays: self.rays,
            near: self.near,
            max_vertices: self.max_vertices,
            compress,
            skip: None,
        }
    }
}

impl Wishes {
    /// What is asked of a file: flags win over the project.
    pub fn of(&self, file: &Path) -> BakeSettings {
        let of_project = self.project.as_ref().map(|project| project.settings_of(file));
        self.flags.over(of_project.unwrap_or_default())
    }
}

impl CacheArgs {
    /// Opens the cache, unless it is not wanted.
    ///
    /// # Errors
    /// If it cannot be used.
    pub fn open(&self, project: Option<&Project>) -> Result<Option<Cache>, CliError> {
        if self.no_cache {
            return Ok(None);
        }
        let of_project = || project.and_then(Project::cache_folder);
        let Some(folder) = self.cache_dir.clone().or_else(of_project).or_else(Cache::default_folder) else {
            return Err(CliError::usage(
                "this system has no folder for caches; name one with --cache-dir, or use --no-cache",
            ));
        };
        let size = self.cache_size.or_else(|| project.and_then(|project| project.cache.size));
        let limit = size.map_or(DEFAULT_SIZE, |size| size.as_u64());
        Ok(Some(Cache::open(&folder, limit).map_err(|error| CliError::usage(error.to_string()))?))
    }
}
