//! Run time against error: every method over its knob, on the same machine in one interleaved run.

pub mod row;
pub mod scene;
pub mod run;
mod judge;

pub use judge::file_name;

use std::path::Path;

use row::Row;

/// The rows of a run's folder, for the report.
///
/// # Errors
/// If `raw.csv` is missing or holds something else.
pub fn report(folder: &Path) -> Result<Vec<Row>, csv::Error> {
    csv::Reader::from_path(folder.join("raw.csv"))?.deserialize().collect()
}
