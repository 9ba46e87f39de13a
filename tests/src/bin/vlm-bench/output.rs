//! Where commands write.

use std::error::Error;
use std::path::Path;

use serde::Serialize;

/// Makes a folder, and those above it.
///
/// # Errors
/// The folder and the system's reason.
pub fn make_folder(folder: &Path) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(folder).map_err(|error| {
        let folder = folder.display();
        format!("cannot create the folder {folder}: {error}; name a folder that can be written").into()
    })
}

/// Writes the rows of a run as `raw.csv` and its table as `table.md` into a folder, which is made.
///
/// # Errors
/// If the folder or a file cannot be written.
pub fn write_run(folder: &Path, rows: &[impl Serialize], table: &str) -> Result<(), Box<dyn Error>> {
    make_folder(folder)?;
    let mut raw = csv::Writer::from_path(folder.join("raw.csv"))?;
    rows.iter().try_for_each(|row| raw.serialize(row))?;
    raw.flush()?;
    Ok(std::fs::write(folder.join("table.md"), table)?)
}
