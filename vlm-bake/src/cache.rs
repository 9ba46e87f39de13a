//! Finished bakes by what went into them, in a folder that any number of programs may use at once.
//!
//! ```text
//! entries/KEY/manifest.json, 0, 1, ..   the files of an output, each with its hash
//! entries/KEY/used                      its time tells when the entry was last of use
//! outputs/HASH.json                     what last went into the output of that path: tells why it must be made anew
//! locks/KEY                             held while somebody makes that entry
//! lock                                  shared by all who use the cache, exclusive for those who clear it
//! ```
//! An entry is written elsewhere and then renamed into place, so it is there as a whole or not at all; what is read is compared with its
//! hash, and an entry that does not hold what it should is removed. So nothing that is killed, or filled up, can poison the cache.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use serde::{Deserialize, Serialize};
use serde_json::Value;
use tempfile::TempDir;
use vlm_format::{OutputFile, write_file};

use crate::recipe::Recipe;

/// So many bytes are kept unless somebody says otherwise.
pub const DEFAULT_SIZE: u64 = 4 << 30;

/// A folder of finished bakes.
pub struct Cache {
    folder: PathBuf,
    limit: u64,
    /// Held as long as the cache is used.
    shared: File,
}

/// Why a cache cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("{}: cannot {action}: {source}; name another folder with --cache-dir, or use --no-cache", path.display())]
pub struct CacheError {
    /// The file or folder.
    pub path: PathBuf,
    /// What was tried.
    pub action: &'static str,
    /// The operating system's answer.
    pub source: io::Error,
}

/// A finished bake.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// The files of the output, the main one first.
    pub files: Vec<StoredFile>,
    /// The bake's report, as JSON.
    pub report: Value,
}

/// One file of an entry.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StoredFile {
    /// Relative to the output's folder.
    pub path: PathBuf,
    /// BLAKE3 of its bytes, in hexadecimal.
    pub hash: String,
    /// Number of bytes.
    pub length: u64,
    /// It is a file beside the source, passed on as it is, of which the cache keeps no copy.
    pub is_beside_source: bool,
}

#[derive(Serialize, Deserialize)]
struct Manifest {
    files: Vec<StoredFile>,
    report: Value,
}

/// The right to make an entry, until it is dropped.
pub struct Claim(#[expect(dead_code, reason = "held, not read")] File);

/// What [`Cache::prune`] did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pruned {
    /// Entries that went.
    pub entries: usize,
    /// Bytes that went.
    pub bytes: u64,
}

impl Cache {
    /// Where the cache is if nobody says otherwise: in the user's folder for caches; `None` where the system has none.
    #[must_use]
    pub fn default_folder() -> Option<PathBuf> {
        dirs::cache_dir().map(|folder| folder.join("vlm"))
    }

    /// Opens a cache, makes it if it is not there, and keeps others from clearing it as long as it is open. `limit` is the most bytes that
    /// [`Cache::prune`] leaves.
    ///
    /// # Errors
    /// If the folder cannot be made or locked.
    pub fn open(folder: &Path, limit: u64) -> Result<Self, CacheError> {
        for part in ["entries", "outputs", "locks", "tmp"] {
            let path = folder.join(part);
            fs::create_dir_all(&path).map_err(|source| CacheError {
                path,
                action: "make the cache",
                source,
            })?;
        }
        let path = folder.join("lock");
        let shared = lock_file(&path).and_then(|file| file.lock_shared().map(|()| file));
        let shared = shared.map_err(|source| CacheError { path, action: "lock the cache", source })?;
        Ok(Self { folder: folder.to_owned(), limit, shared })
    }

    /// Waits until nobody else makes this entry.
    ///
    /// # Errors
    /// If the lock cannot be had.
    pub fn claim(&self, key: &str) -> Result<Claim, CacheError> {
        let path = self.folder.join("locks").join(key);
        let locked = lock_file(&path).and_then(|file| file.lock().map(|()| file));
        locked.map(Claim).map_err(|source| CacheError { path, action: "lock an entry", source })
    }

    /// An entry that is whole as far as its list of files tells; one without a list is removed.
    #[must_use]
    pub fn entry(&self, key: &str) -> Option<Entry> {
        let folder = self.entry_folder(key);
        let list = fs::read(folder.join("manifest.json"));
        let Some(manifest) = list.ok().and_then(|list| serde_json::from_slice::<Manifest>(&list).ok()) else {
            // Mostly it is not there.
            let _ = fs::remove_dir_all(&folder);
            return None;
        };
        // Without its time the entry goes sooner than it should: no reason to fail.
        let _ = File::options()
            .write(true)
            .open(folder.join("used"))
            .and_then(|f| f.set_modified(SystemTime::now()));
        Some(Entry { files: manifest.files, report: manifest.report })
    }

    /// The files of an entry as they were made; those beside the source are read from `source_folder`. If they are not what they should be,
    /// there are none, and the entry is removed.
    #[must_use]
    pub fn read(&self, key: &str, entry: &Entry, source_folder: &Path) -> Option<Vec<OutputFile>> {
        let folder = self.entry_folder(key);
        let read = |(number, file): (usize, &StoredFile)| {
            let beside = file.is_beside_source.then(|| source_folder.join(&file.path));
            let bytes = fs::read(beside.clone().unwrap_or_else(|| folder.join(number.to_string()))).ok()?;
            let is_whole = blake3::hash(&bytes).to_hex().as_str() == file.hash;
            is_whole.then(|| OutputFile { path: file.path.clone(), bytes, copied_from: beside })
        };
        let files: Option<Vec<OutputFile>> = entry.files.iter().enumerate().map(read).collect();
        if files.is_none() {
            // Whoever removed it first did the same.
            let _ = fs::remove_dir_all(&folder);
        }
        files
    }

    /// Keeps a finished bake. Nothing changes if it is there already.
    ///
    /// # Errors
    /// If it cannot be written; then nothing of it is there.
    pub fn keep(&self, key: &str, files: &[OutputFile], report: &Value) -> Result<(), CacheError> {
        let error = |source| CacheError { path: self.entry_folder(key), action: "keep a bake", source };
        let temporary = TempDir::new_in(self.folder.join("tmp")).map_err(error)?;
        let manifest = Manifest { files: files.iter().map(stored).collect(), report: report.clone() };
        for (number, file) in files.iter().enumerate().filter(|(_, file)| file.copied_from.is_none()) {
            fs::write(temporary.path().join(number.to_string()), &file.bytes).map_err(error)?;
        }
        let json = serde_json::to_vec(&manifest).map_err(|e| error(e.into()))?;
        fs::write(temporary.path().join("manifest.json"), json).map_err(error)?;
        fs::write(temporary.path().join("used"), []).map_err(error)?;
        match fs::rename(temporary.path(), self.entry_folder(key)) {
            // It is in its place now, and must stay.
            Ok(()) => _ = temporary.keep(),
            Err(e)
                if e.kind() == io::ErrorKind::DirectoryNotEmpty
                    || e.kind() == io::ErrorKind::AlreadyExists => {}
            Err(e) => return Err(error(e)),
        }
        Ok(())
    }

    /// What last went into an output.
    #[must_use]
    pub fn last_recipe(&self, output: &Path) -> Option<Recipe> {
        serde_json::from_slice(&fs::read(self.output_record(output)).ok()?).ok()
    }

    /// Remembers what went into an output.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn remember(&self, output: &Path, recipe: &Recipe) -> Result<(), CacheError> {
        if self.last_recipe(output).as_ref() == Some(recipe) {
            return Ok(());
        }
        let path = self.output_record(output);
        let error = |source| CacheError { path: path.clone(), action: "write", source };
        let json = serde_json::to_vec(recipe).map_err(|e| error(e.into()))?;
        write_file(&path, &json).map_err(|e| error(io::Error::other(e)))
    }

    /// Removes the entries not used for longest until the rest is within the limit, and what killed programs left. Nothing happens while
    /// another program uses the cache; it prunes when it is done.
    #[must_use]
    pub fn prune(self) -> Pruned {
        // The lock cannot be raised in place on every system.
        drop(self.shared);
        let Ok(lock) = lock_file(&self.folder.join("lock")) else { return Pruned::default() };
        if lock.try_lock().is_err() {
            return Pruned::default();
        }
        for part in ["tmp", "locks"] {
            for path in children(&self.folder.join(part)) {
                // What cannot be removed now is tried again next time.
                let _ = fs::remove_dir_all(&path).or_else(|_| fs::remove_file(&path));
            }
        }
        let mut entries: Vec<(SystemTime, u64, PathBuf)> = children(&self.folder.join("entries"))
            .into_iter()
            .map(|path| (last_use(&path), size(&path), path))
            .collect();
        entries.sort();
        let mut left: u64 = entries.iter().map(|(_, size, _)| size).sum();
        let mut pruned = Pruned::default();
        for (_, size, path) in entries {
            if left <= self.limit {
                break;
            }
            if fs::remove_dir_all(&path).is_ok() {
                left -= size;
                pruned = Pruned { entries: pruned.entries + 1, bytes: pruned.bytes + size };
            }
        }
        pruned
    }

    fn entry_folder(&self, key: &str) -> PathBuf {
        self.folder.join("entries").join(key)
    }

    fn output_record(&self, output: &Path) -> PathBuf {
        let absolute = std::path::absolute(output).unwrap_or_else(|_| output.to_owned());
        let name = blake3::hash(absolute.as_os_str().as_encoded_bytes()).to_hex();
        self.folder.join("outputs").join(format!("{name}.json"))
    }
}

impl StoredFile {
    /// True if the file below `folder` is this one.
    #[must_use]
    pub fn is_in(&self, folder: &Path) -> bool {
        let path = folder.join(&self.path);
        let same_length = fs::metadata(&path).is_ok_and(|data| data.is_file() && data.len() == self.length);
        same_length && fs::read(&path).is_ok_and(|bytes| blake3::hash(&bytes).to_hex().as_str() == self.hash)
    }
}

fn stored(file: &OutputFile) -> StoredFile {
    StoredFile {
        path: file.path.clone(),
        hash: blake3::hash(&file.bytes).to_hex().to_string(),
        length: file.bytes.len() as u64,
        is_beside_source: file.copied_from.is_some(),
    }
}

fn lock_file(path: &Path) -> io::Result<File> {
    File::options().read(true).write(true).create(true).truncate(false).open(path)
}

fn children(folder: &Path) -> Vec<PathBuf> {
    fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).collect()
}

fn last_use(entry: &Path) -> SystemTime {
    fs::metadata(entry.join("used")).and_then(|data| data.modified()).unwrap_or(SystemTime::UNIX_EPOCH)
}

fn size(entry: &Path) -> u64 {
    children(entry).iter().filter_map(|file| fs::metadata(file).ok()).map(|data| data.len()).sum()
}
