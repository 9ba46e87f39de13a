//! Writes outputs to disk so that a reader sees all of a file or nothing of it.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::error::Error;
use crate::package::{OutputFile, is_data_of};

/// Writes the files of an output below `folder`, which must exist; folders inside it are made.
///
/// Each is written beside its place under a temporary name, synchronised, and then renamed, the main file last, so that
/// it never refers to what is not there yet. Then data that an output of the same name left before is removed. Files that already have the
/// content are left alone. On failure no temporary
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
    pending.into_iter().try_for_each(Pending::rename)?;
    remove_outdated(outputs, folder);
    Ok(())
}

/// Removes the data that a former output of the same name left: its name tells its content, so it is another now.
fn remove_outdated(outputs: &[OutputFile], folder: &Path) {
    let Some(main) = outputs.first().map(|main| &main.path) else { return };
    let is_gltf = main.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("gltf"));
    let (true, Some(stem)) = (is_gltf, main.file_stem().and_then(OsStr::to_str)) else { return };
    let home = main.parent().unwrap_or(Path::new(""));
    for entry in fs::read_dir(folder.join(home)).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let of = abandoned(&entry);
        let is_data = of.as_deref().or(name.to_str()).is_some_and(|name| is_data_of(stem, name));
        if is_data && outputs.iter().all(|output| output.path != home.join(&name)) {
            // Nothing refers to it, so it does no harm where it cannot be removed.
            let _ = fs::remove_file(entry.path());
        }
    }
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
        remove_abandoned(path);
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

/// A temporary file older than this belongs to nobody: writing one takes seconds.
const ABANDONED: Duration = Duration::from_secs(3600);

/// Removes temporary files that programs left which were killed while they wrote this one.
fn remove_abandoned(path: &Path) {
    let name = path.file_name().unwrap_or_default();
    let Some(folder) = path.parent() else { return };
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if abandoned(&entry).is_some_and(|of| OsStr::new(&of) == name) {
            // Somebody else may have been faster.
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// The name of the file that a temporary one was to become, if nobody writes it any more.
fn abandoned(entry: &fs::DirEntry) -> Option<String> {
    let name = entry.file_name();
    let (of, writer) = name.to_str()?.strip_prefix('.')?.strip_suffix(".tmp")?.rsplit_once('.')?;
    let process: u32 = writer.split_once('-')?.0.parse().ok()?;
    let age = || entry.metadata().ok()?.modified().ok()?.elapsed().ok();
    let is_abandoned = is_gone(process) || age().is_some_and(|age| age > ABANDONED);
    is_abandoned.then(|| of.to_owned())
}

/// True if this machine tells which processes run, and the one of this id does not.
fn is_gone(process: u32) -> bool {
    let processes = Path::new("/proc");
    processes.join("self").exists() && !processes.join(process.to_string()).exists()
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
