//! From a run's folder to what people read: `raw.csv` becomes `summary.md`, figures and contact sheets.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use glam::Vec3;
use vlm_bake::picture::read_irradiance;

use super::curves::{Spread, method_name, method_order, scene_curves};
use super::names::{file_name, picture_file, sheet_file};
use super::numbers::{short, time};
use super::row::Row;
use super::sheet::{Entry, Sheet};
use super::{figures, summary};
use crate::plot::PlotError;

/// Why a run has no report.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// `raw.csv` cannot be read.
    #[error("{path}: {source}; it should be the raw.csv that `vlm-bench pareto --out DIR` writes", path = path.display())]
    Csv {
        /// The file.
        path: PathBuf,
        /// The place in it and the reason.
        source: csv::Error,
    },
    /// `raw.csv` holds no samples.
    #[error("{path}: no samples: run `vlm-bench pareto` into this folder first", path = path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// A sample cannot be.
    #[error("{path}: line {line}: {reason}: run `vlm-bench pareto` into an empty folder", path = path.display())]
    Row {
        /// The file.
        path: PathBuf,
        /// From 1, the header.
        line: usize,
        /// What is wrong with it.
        reason: String,
    },
    /// A picture is missing, or is none.
    #[error("{path}: {source}: repeat the run, or remove its folder `images` to keep the contact sheets as they are", path = path.display())]
    Picture {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: image::ImageError,
    },
    /// A picture has another size than the truth.
    #[error("{path}: {found:?} pixels where the truth has {expected:?}: repeat the run", path = path.display())]
    PictureSize {
        /// The file.
        path: PathBuf,
        /// Its width and height.
        found: (u32, u32),
        /// The truth's.
        expected: (u32, u32),
    },
    /// A figure cannot be drawn or written.
    #[error(transparent)]
    Plot(#[from] PlotError),
    /// The summary cannot be written.
    #[error(transparent)]
    Write(#[from] vlm_format::Error),
}

/// Reads `raw.csv` and `images/` in a run's folder, and writes `summary.md`, `SCENE_pareto` and `SCENE_split` (SVG, PNG)
/// and `SCENE_CAMERA_sheet.png` beside them. A folder without `images` keeps the contact sheets that it has.
///
/// # Errors
/// [`ReportError`], which names the file and the remedy. What was written before stays.
pub fn report(dir: &Path) -> Result<(), ReportError> {
    let rows = read_rows(&dir.join("raw.csv"))?;
    let pictures = dir.join("images").is_dir();
    let mut sheets = BTreeSet::new();
    for scene in scene_curves(&rows) {
        figures::write(dir, &scene, &rows)?;
        for camera in &scene.cameras {
            let seen: Vec<&Row> =
                rows.iter().filter(|r| r.scene == scene.scene && r.camera == *camera).collect();
            let file = sheet_file(&scene.scene, camera);
            let path = dir.join(&file);
            if pictures {
                sheet(dir, &scene.scene, camera, &seen)?.write(&path)?;
            }
            if path.is_file() {
                sheets.insert(file);
            }
        }
    }
    vlm_format::write_file(&dir.join("summary.md"), summary::summary(&rows, &sheets).as_bytes())?;
    Ok(())
}

/// Reads and checks the samples of a run.
///
/// # Errors
/// [`ReportError`] if the file is missing, holds none, or holds one that cannot be.
pub fn read_rows(path: &Path) -> Result<Vec<Row>, ReportError> {
    let failed = |source| ReportError::Csv { path: path.to_owned(), source };
    let mut reader = csv::Reader::from_path(path).map_err(failed)?;
    let header = reader.headers().map_err(failed)?.clone();
    let rows: Vec<Row> =
        reader.deserialize().collect::<Result<_, _>>().map_err(|error| unreadable(path, &header, error))?;
    if rows.is_empty() {
        return Err(ReportError::Empty { path: path.to_owned() });
    }
    let mut lines = BTreeMap::new();
    for (i, row) in rows.iter().enumerate() {
        let wrong = |reason| Err(ReportError::Row { path: path.to_owned(), line: i + 2, reason });
        if let Some(reason) = nonsense(row) {
            return wrong(reason);
        }
        let key = (&row.scene, &row.camera, &row.method, &row.knob, &row.backend, row.repeat);
        if let Some(first) = lines.insert(key, i + 2) {
            return wrong(format!("the same sample as line {first}"));
        }
    }
    Ok(rows)
}

/// Names the column instead of its number, where the fault is in one.
fn unreadable(path: &Path, header: &csv::StringRecord, source: csv::Error) -> ReportError {
    if let csv::ErrorKind::Deserialize { pos: Some(pos), err } = source.kind() {
        let column = err.field().and_then(|field| header.get(usize::try_from(field).ok()?));
        if let (Some(column), Ok(line)) = (column, usize::try_from(pos.line())) {
            return ReportError::Row {
                path: path.to_owned(),
                line,
                reason: format!("{column}: {}", err.kind()),
            };
        }
    }
    ReportError::Csv { path: path.to_owned(), source }
}

/// What no measurement can be, among what figures and tables rest on.
fn nonsense(row: &Row) -> Option<String> {
    let numbers = [
        ("seconds_prepare", row.seconds_prepare),
        ("seconds_inject", row.seconds_inject),
        ("seconds_gather", row.seconds_gather),
        ("relative_rmse", row.relative_rmse),
        ("algorithm_rmse", row.algorithm_rmse.unwrap_or(0.0)),
        ("truth_noise", row.truth_noise),
    ];
    let bad = numbers.into_iter().find(|(_, value)| !value.is_finite() || *value < 0.0);
    bad.map(|(name, value)| format!("{name} is {value}"))
}

fn read_picture(path: &Path) -> Result<((u32, u32), Vec<Vec3>), ReportError> {
    let failed = |source| ReportError::Picture { path: path.to_owned(), source };
    let (width, height, pixels) = read_irradiance(path).map_err(failed)?;
    Ok(((width, height), pixels))
}

/// The truth, and each method at the setting that errs least.
fn sheet(dir: &Path, scene: &str, camera: &str, rows: &[&Row]) -> Result<Sheet, ReportError> {
    let folder = dir.join("images").join(file_name(scene)).join(file_name(camera));
    let (size, pixels) = read_picture(&folder.join("truth.exr"))?;
    let mut methods = Vec::new();
    for (name, best) in best_settings(rows) {
        let path = folder.join(picture_file(&best[0].method, &best[0].knob));
        let (found, pixels) = read_picture(&path)?;
        if found != size {
            return Err(ReportError::PictureSize { path, found, expected: size });
        }
        methods.push(Entry { name, notes: notes(&best), pixels });
    }
    let truth = rows
        .first()
        .map(|row| vec![format!("{} directions per pixel, noise {}", row.truth_spp, short(row.truth_noise))]);
    Ok(Sheet {
        title: format!("{scene}, {camera}: every method at its least error"),
        width: size.0,
        height: size.1,
        truth: Entry { name: "truth".to_owned(), notes: truth.unwrap_or_default(), pixels },
        methods,
    })
}

/// By method: the repeats of the setting with the least median error, the faster of equal ones.
fn best_settings<'a>(rows: &[&'a Row]) -> Vec<(String, Vec<&'a Row>)> {
    let mut methods: BTreeMap<(u8, String), BTreeMap<&str, Vec<&Row>>> = BTreeMap::new();
    for row in rows {
        let settings = methods.entry(method_order(&method_name(row))).or_default();
        settings.entry(&row.knob).or_default().push(row);
    }
    let median = |rows: &[&Row], value: fn(&Row) -> f64| {
        Spread::of(rows.iter().map(|row| value(row))).unwrap_or_default().median
    };
    let cost = |rows: &[&Row]| (median(rows, |row| row.relative_rmse), median(rows, Row::frame_seconds));
    let best = methods.into_iter().filter_map(|((_, name), settings)| {
        let least = settings.into_values().min_by(|a, b| {
            let (a, b) = (cost(a), cost(b));
            a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
        });
        Some((name, least?))
    });
    best.collect()
}

fn notes(rows: &[&Row]) -> Vec<String> {
    let median =
        |value: fn(&Row) -> f64| Spread::of(rows.iter().map(|row| value(row))).unwrap_or_default().median;
    let mark = if rows.iter().all(|row| row.truth_suffices) { "" } else { " (truth too noisy)" };
    let mut notes = vec![
        format!(
            "{} a frame, energy {:+.1} %",
            time(median(Row::frame_seconds)),
            100.0 * median(|row| row.signed_energy)
        ),
        format!(
            "RMSE {}, FLIP {}{mark}",
            short(median(|row| row.relative_rmse)),
            short(median(|row| row.flip))
        ),
    ];
    notes.extend(rows.first().map(|row| row.knob.clone()).filter(|knob| !knob.is_empty()));
    notes
}
