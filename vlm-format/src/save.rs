//! Writes outputs to disk so that a reader sees all of a file or nothing of it.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::error::Error;
use crate::package::OutputFile;

/// Writes the files of an output below `folder`, which must exist; folders inside it are made.
///
/// Each is written beside its place under a temporary name, synchronised, and then renamed, the main file last, so that
/// it never refers to what is not there yet. Files that already have the content are left alone. On failure no temporary
/// file is left, and files not yet renamed are as they were.
///
/// # Errors
/// [`Error::Io`] with the path and the operating system's reason.
pub fn write_atomic(outputs: &[OutputFile], folder: &Path) -> Result<(), Error> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let mut pending = Vec::new();
    for output in outputs.iter().rev() {
        let path = folder.join(&output.path);
        if !has_content(&path, &output.bytes) {
            pending.push(Pending::write(&path, &output.bytes, folder)?);
        }
    }
    pending.into_iter().try_for_each(Pending::rename)
}

/// Writes one file as [`write_atomic`] does.
///
/// # Errors
/// [`Error::Io`] with the path and the operating system's reason.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if has_content(path, bytes) { Ok(()) } else { Pending::write(path, bytes, folder)?.rename() }
}

fn has_content(path: &Path, bytes: &[u8]) -> bool {
    let same_size = fs::metadata(path).is_ok_and(|data| data.is_file() && data.len() == bytes.len() as u64);
    same_size && fs::read(path).is_ok_and(|found| found == bytes)
}

/// A file that is complete, but not yet in its place. Removes itself unless it gets there.
struct Pending {
    temporary: PathBuf,
    path: PathBuf,
    renamed: bool,
}

impl Pending {
    fn write(path: &Path, bytes: &[u8], folder: &Path) -> Result<Self, Error> {
        let io = |source| Error::Io { path: path.to_owned(), action: "write", source };
        if !folder.is_dir() {
            let kind = if folder.exists() { io::ErrorKind::NotADirectory } else { io::ErrorKind::NotFound };
            let source = io::Error::new(kind, "the output folder does not exist or is a file");
            return Err(Error::Io { path: folder.to_owned(), action: "write into", source });
        }
        if path.is_dir() {
            return Err(io(io::ErrorKind::IsADirectory.into()));
        }
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent).map_err(io)?;
        }
        let (temporary, mut file) = create_beside(path).map_err(io)?;
        let pending = Self { temporary, path: path.to_owned(), renamed: false };
        file.write_all(bytes).and_then(|()| file.sync_all()).map_err(io)?;
        Ok(pending)
    }

    fn rename(mut self) -> Result<(), Error> {
        fs::rename(&self.temporary, &self.path).map_err(|source| Error::Io {
            path: self.path.clone(),
            action: "replace",
            source,
        })?;
        self.renamed = true;
        Ok(())
    }
}

impl Drop for Pending {
    fn drop(&mut self) {
        if !self.renamed {
            // Nothing can be done about a failure here, and the first error is already on its way to the user.
            let _ = fs::remove_file(&self.temporary);
        }
    }
}

/// A new file in the same folder, so that renaming cannot cross file systems.
fn create_beside(path: &Path) -> io::Result<(PathBuf, File)> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let mut attempt = 0_u32;
    loop {
        let temporary = path.with_file_name(format!(".{name}.{}-{attempt}.tmp", std::process::id()));
        match File::create_new(&temporary) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists && attempt < 1000 => attempt += 1,
            result => return result.map(|file| (temporary, file)),
        }
    }
}
