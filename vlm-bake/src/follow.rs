//! Follows files while others save them.
//!
//! The operating system's events only say *when* to look; what changed is decided by what the files hold. So it does not matter how an
//! editor saves (in place, by a rename, by a link), that it touches files without changing them, or that events get lost: a look at all
//! followed files costs a few calls, and happens every second anyway.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, Metadata};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant, SystemTime};

use crate::inputs::{is_gltf, walk};
use notify::{RecommendedWatcher, RecursiveMode, Watcher};

/// File systems keep times to within this: two changes may have the same time if they are no farther apart. Two seconds on FAT.
const COARSEST_TIME: Duration = Duration::from_secs(2);

/// How patient a follower is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FollowOptions {
    /// A save is over once so long nothing more happened. Lower values answer sooner, and see more files half written.
    pub quiet: Duration,
    /// Even if more happens, a save is looked at so long after it began. Higher values do less in a storm of events.
    pub most_wait: Duration,
    /// All files are looked at so often, whatever the events say. Lower values cost more calls, and answer sooner where events get lost.
    pub look_every: Duration,
    /// Ask the operating system for events. Without them, as on network drives, changes show after [`FollowOptions::look_every`].
    pub events: bool,
}

impl Default for FollowOptions {
    fn default() -> Self {
        Self {
            quiet: Duration::from_millis(30),
            most_wait: Duration::from_millis(400),
            look_every: Duration::from_secs(1),
            events: true,
        }
    }
}

/// Why nothing can be followed.
#[derive(Debug, thiserror::Error)]
#[error(
    "the system cannot watch files: {source}. Ask for polling instead, or raise its limit (Linux: `sysctl fs.inotify.max_user_instances`)"
)]
pub struct FollowError {
    #[from]
    source: notify::Error,
}

/// Files whose content changed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Change {
    /// The files as they were named, in ascending order; those that were deleted too.
    pub files: Vec<PathBuf>,
    /// When the first sign of it was seen.
    pub began: Instant,
}

/// A folder whose glTF files are followed, also those that are not there yet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tree {
    /// The folder; what lies below it counts, but for what is hidden.
    pub folder: PathBuf,
    /// Folders that do not count.
    pub except: Vec<PathBuf>,
}

/// Follows some files.
pub struct Follower {
    options: FollowOptions,
    watch: Option<Watch>,
    files: BTreeMap<PathBuf, Known>,
    trees: Vec<Tree>,
    /// All folders of the trees.
    folders: BTreeSet<PathBuf>,
    looked: Instant,
}

/// What the operating system watches: folders, since files get replaced.
struct Watch {
    watcher: RecommendedWatcher,
    events: Receiver<notify::Result<notify::Event>>,
    folders: BTreeMap<PathBuf, Option<Stamp>>,
}

/// What was last found of a file.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Known {
    /// `None` where a look has to read the file.
    stamp: Option<Stamp>,
    content: Option<blake3::Hash>,
}

/// Tells without reading that a file may be another.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Stamp {
    length: u64,
    modified: Option<SystemTime>,
    identity: (u64, u64, i64, i64),
}

impl Follower {
    /// Follows nothing yet.
    ///
    /// # Errors
    /// [`FollowError`] if the system gives no events though they are asked for.
    pub fn new(options: FollowOptions) -> Result<Self, FollowError> {
        let watch = options.events.then(Watch::new).transpose()?;
        let (files, trees, folders) = Default::default();
        Ok(Self { options, watch, files, trees, folders, looked: Instant::now() })
    }

    /// Follows these files from now on, and no others. They need not exist. A file that was followed before keeps what is known of it, so
    /// no change gets lost between.
    pub fn follow(&mut self, files: impl IntoIterator<Item = PathBuf>) {
        let before = std::mem::take(&mut self.files);
        self.files = files
            .into_iter()
            .map(|file| {
                let known = before.get(&file).copied();
                let known = known.unwrap_or_else(|| Known::of(&file));
                (file, known)
            })
            .collect();
        for file in self.discover() {
            // What nobody has heard of yet shows in the next look.
            let known = before.get(&file).copied().unwrap_or(Known { stamp: None, content: None });
            self.files.entry(file).or_insert(known);
        }
        self.watch_folders();
    }

    /// Follows the glTF files below these folders from now on, too, those that come later as soon as they are there.
    pub fn follow_trees(&mut self, trees: Vec<Tree>) {
        self.trees = trees;
        for file in self.discover() {
            let known = Known::of(&file);
            self.files.entry(file).or_insert(known);
        }
        self.watch_folders();
    }

    /// The glTF files below the trees; notes their folders.
    fn discover(&mut self) -> Vec<PathBuf> {
        let mut files = Vec::new();
        self.folders.clear();
        for entry in self.trees.iter().flat_map(|tree| walk(&tree.folder, &tree.except)) {
            if entry.file_type().is_dir() {
                self.folders.insert(entry.into_path());
            } else if is_gltf(entry.path()) {
                files.push(entry.into_path());
            }
        }
        files
    }

    /// Waits for the next change; `None` if there is none in that time.
    pub fn wait(&mut self, most: Duration) -> Option<Change> {
        let end = Instant::now() + most;
        loop {
            let next_look = self.looked + self.options.look_every;
            let has_event = self.has_event_before(end.min(next_look));
            let began = Instant::now();
            if has_event {
                self.wait_for_quiet(began);
            }
            if has_event || began >= next_look {
                let mut files = self.look();
                if !files.is_empty() {
                    if !has_event {
                        files.append(&mut self.look_until_quiet(began));
                    }
                    return Some(Change { files: files.into_iter().collect(), began });
                }
            }
            if Instant::now() >= end {
                return None;
            }
        }
    }

    /// Waits until a time for an event.
    fn has_event_before(&self, end: Instant) -> bool {
        let left = || end.saturating_duration_since(Instant::now());
        let Some(watch) = &self.watch else {
            std::thread::sleep(left());
            return false;
        };
        loop {
            match watch.events.recv_timeout(left()) {
                // Reading changes nothing, and our own reading would go on for ever.
                Ok(Ok(event)) if event.kind.is_access() => {}
                // An error means that events may be lost: a reason to look.
                Ok(_) => return true,
                Err(RecvTimeoutError::Timeout) => return false,
                Err(RecvTimeoutError::Disconnected) => {
                    std::thread::sleep(left());
                    return false;
                }
            }
        }
    }

    fn wait_for_quiet(&self, began: Instant) {
        let end = began + self.options.most_wait;
        while Instant::now() < end && self.has_event_before(end.min(Instant::now() + self.options.quiet)) {}
    }

    /// Looks again until nothing more changes: without events that is the only sign that a save is over.
    fn look_until_quiet(&mut self, began: Instant) -> BTreeSet<PathBuf> {
        let mut files = BTreeSet::new();
        while began.elapsed() < self.options.most_wait {
            std::thread::sleep(self.options.quiet);
            let mut more = self.look();
            if more.is_empty() {
                break;
            }
            files.append(&mut more);
        }
        files
    }

    /// Looks at all files, and reads those that may have changed.
    fn look(&mut self) -> BTreeSet<PathBuf> {
        self.looked = Instant::now();
        if !self.trees.is_empty() {
            for file in self.discover() {
                self.files.entry(file).or_insert(Known { stamp: None, content: None });
            }
        }
        self.watch_folders();
        let mut changed = BTreeSet::new();
        for (file, known) in &mut self.files {
            if known.stamp.is_some() && Stamp::of(file) == known.stamp {
                continue;
            }
            let now = Known::of(file);
            if now.content != known.content {
                changed.insert(file.clone());
            }
            *known = now;
        }
        changed
    }

    /// Watches the folders of all files, those again that were replaced.
    fn watch_folders(&mut self) {
        if let Some(watch) = &mut self.watch {
            let of_files = self.files.keys().flat_map(|file| folders_of(file));
            watch.set(of_files.chain(self.folders.iter().cloned()).collect());
        }
    }
}

impl Watch {
    fn new() -> Result<Self, notify::Error> {
        let (sender, events) = channel();
        let watcher = notify::recommended_watcher(sender)?;
        Ok(Self { watcher, events, folders: BTreeMap::new() })
    }

    fn set(&mut self, wanted: BTreeSet<PathBuf>) {
        let stale = |folder: &PathBuf, stamp: &Option<Stamp>| {
            !wanted.contains(folder) || !same_folder(*stamp, Stamp::of(folder))
        };
        let gone: Vec<PathBuf> =
            self.folders.iter().filter(|(f, s)| stale(f, s)).map(|(f, _)| f.clone()).collect();
        for folder in gone {
            self.folders.remove(&folder);
            // It may be gone, and its watch with it.
            let _ = self.watcher.unwatch(&folder);
        }
        for folder in wanted {
            // Where it does not exist yet, or the system has no watch left, the regular look finds the files.
            if !self.folders.contains_key(&folder)
                && self.watcher.watch(&folder, RecursiveMode::NonRecursive).is_ok()
            {
                let stamp = Stamp::of(&folder);
                self.folders.insert(folder, stamp);
            }
        }
    }
}

fn same_folder(a: Option<Stamp>, b: Option<Stamp>) -> bool {
    let place = |stamp: Stamp| (stamp.identity.0, stamp.identity.1);
    a.map(place) == b.map(place)
}

/// The folder in which a file is named, and the one in which it lies if that name is a link.
fn folders_of(file: &Path) -> Vec<PathBuf> {
    let named = std::path::absolute(file).ok();
    let real = fs::canonicalize(file).ok();
    [named, real].into_iter().flatten().filter_map(|path| path.parent().map(Path::to_owned)).collect()
}

impl Known {
    fn of(file: &Path) -> Self {
        // The stamp comes first: what changes while the file is read shows in the next look.
        let stamp = Stamp::of(file).filter(Stamp::is_settled);
        Self { stamp, content: hash(file).ok() }
    }
}

fn hash(file: &Path) -> io::Result<blake3::Hash> {
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(fs::File::open(file)?)?;
    Ok(hasher.finalize())
}

impl Stamp {
    fn of(path: &Path) -> Option<Self> {
        let data = fs::metadata(path).ok()?;
        Some(Self { length: data.len(), modified: data.modified().ok(), identity: identity(&data) })
    }

    /// Another change would have another time.
    fn is_settled(&self) -> bool {
        let age = self.modified.and_then(|modified| SystemTime::now().duration_since(modified).ok());
        age.is_some_and(|age| age > COARSEST_TIME)
    }
}

/// Device, number and time of change of a file, which also move when another takes its place with the same length and time.
#[cfg(unix)]
fn identity(data: &Metadata) -> (u64, u64, i64, i64) {
    use std::os::unix::fs::MetadataExt;
    (data.dev(), data.ino(), data.ctime(), data.ctime_nsec())
}

#[cfg(not(unix))]
fn identity(_: &Metadata) -> (u64, u64, i64, i64) {
    (0, 0, 0, 0)
}
