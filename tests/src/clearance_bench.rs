//! How well lights hide: files baked at several budgets, each proven, as rows and a table.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use vlm_bake::bake::{BakeError, bake};
use vlm_bake::options::{BakeOptions, Preset};
use vlm_bake::progress::Silent;
use vlm_bake::report::Report;
use vlm_bake::scene::{LoadOptions, load};
use vlm_format::GltfFile;

use crate::text::table;

/// Why a file has no row.
#[derive(Debug, thiserror::Error)]
pub enum ClearanceError {
    /// It cannot be read, or not as a scene.
    #[error("{0}")]
    Read(#[from] vlm_bake::scene::Error),
    /// It is not glTF.
    #[error("{0}")]
    Open(#[from] vlm_format::Error),
    /// Nothing can be baked.
    #[error("{file}: {error}")]
    Bake {
        /// The file.
        file: String,
        /// Why.
        error: BakeError,
    },
}

/// One bake, and its proof. Shares are of 1.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The file, without folder and suffix.
    pub scene: String,
    /// Lights asked for.
    pub asked: u32,
    /// Lights made.
    pub lights: usize,
    /// Points of the proof.
    pub points: u64,
    /// What it finds that no tag mends.
    pub violations: u64,
    /// Self-light that 99.9 % of the points do not exceed, relative to the mean irradiance.
    pub self_light_p999: f64,
    /// Share of the lights' area that carries a tag.
    pub lights_tagged: f64,
    /// Share of the surface that ignores some light.
    pub surface_tagged: f64,
    /// Share of the surface for which no light stands.
    pub uncovered: f64,
    /// Mean depth of the lights, metres.
    pub mean_offset_m: f64,
    /// The simplifier's error, metres.
    pub decimation_error_m: f64,
    /// Required clearance, metres.
    pub clearance_m: f64,
    /// Objects whose light is not kept within 2 %.
    pub objects_off: usize,
    /// Wall time, seconds.
    pub seconds: f64,
}

/// Bakes and proves a file at each budget; 0 stands for the preset `game`'s own.
///
/// # Errors
/// If the file cannot be read or baked.
pub fn measure(file: &Path, budgets: &[u32]) -> Result<Vec<Row>, ClearanceError> {
    let scene = load(&GltfFile::open(file)?, &LoadOptions::default())?;
    let name = file.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let row = |&budget: &u32| {
        let preset = BakeOptions::preset(Preset::Game, scene.triangles.len());
        let lights = if budget == 0 { preset.lights } else { budget };
        let baked = bake(&scene, &BakeOptions { lights, ..preset }, &Silent)
            .map_err(|error| ClearanceError::Bake { file: file.display().to_string(), error })?;
        Ok(row(&name, &baked.report))
    };
    budgets.iter().map(row).collect()
}

fn row(scene: &str, report: &Report) -> Row {
    let share = |part: f64, whole: f64| if whole > 0.0 { (part / whole).max(0.0) } else { 0.0 };
    let area = &report.area;
    Row {
        scene: scene.to_owned(),
        asked: report.asked_lights,
        lights: report.lights,
        points: report.clearance.samples,
        violations: report.clearance.violations,
        self_light_p999: report.clearance.self_light.p999,
        lights_tagged: share(area.tagged_m2, area.lights_m2),
        surface_tagged: share(area.covered_by_tags_m2, area.visible_m2),
        uncovered: share(area.uncovered_m2, area.visible_m2),
        mean_offset_m: report.offset.mean_m,
        decimation_error_m: report.decimation.error_m,
        clearance_m: report.clearance.required_m,
        objects_off: report.flux.iter().filter(|object| !object.kept).count(),
        seconds: report.seconds.values().sum(),
    }
}

/// The rows in Markdown. `off` is the mean offset over 1.5 times the decimation's error and the clearance together.
#[must_use]
pub fn summary(rows: &[Row]) -> String {
    let heads = [
        "scene",
        "asked",
        "lights",
        "points",
        "violations",
        "self-light p99.9",
        "lights tagged",
        "surface tagged",
        "uncovered",
        "offset mm",
        "offset / 1.5 (error + clearance)",
        "objects off 2 %",
        "s",
    ];
    let percent = |share: f64| format!("{:.2} %", 100.0 * share);
    let cells = |row: &Row| {
        let limit = 1.5 * (row.decimation_error_m + row.clearance_m);
        vec![
            row.scene.clone(),
            row.asked.to_string(),
            row.lights.to_string(),
            row.points.to_string(),
            row.violations.to_string(),
            format!("{:.0e}", row.self_light_p999),
            percent(row.lights_tagged),
            percent(row.surface_tagged),
            percent(row.uncovered),
            format!("{:.3}", 1e3 * row.mean_offset_m),
            format!("{:.2}", row.mean_offset_m / limit),
            row.objects_off.to_string(),
            format!("{:.1}", row.seconds),
        ]
    };
    let rows: Vec<Vec<String>> = rows.iter().map(cells).collect();
    format!("# Lights behind their surface\n\n{}", table(&heads.map(str::to_owned), &rows))
}

/// The .glb files of a folder, or the file itself, in the order of their names.
#[must_use]
pub fn files(path: &Path) -> Vec<PathBuf> {
    let Ok(folder) = std::fs::read_dir(path) else { return vec![path.to_owned()] };
    let mut files: Vec<PathBuf> = folder.filter_map(|entry| Some(entry.ok()?.path())).collect();
    files.retain(|file| file.extension().is_some_and(|suffix| suffix == "glb"));
    files.sort();
    files
}
