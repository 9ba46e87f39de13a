//! watch: follows a file and what it refers to, and opens it anew (bakes it, where it must) on a thread of its own.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use vlm_bake::follow::{Change, FollowOptions, Follower};
use vlm_bake::memory::Memory;
use vlm_bake::progress::Progress;
use vlm_bake::references::references;

use super::error::ViewError;
use super::open::{OpenOptions, Opened};

/// So often the following thread looks whether it is still wanted.
const LOOK_UP: Duration = Duration::from_millis(250);

/// What happened to the files.
pub enum News {
    /// The file was opened, or opened anew.
    Opened(Box<Opened>),
    /// It cannot be opened as it is now.
    Failed(ViewError),
    /// A shader's file changed.
    Shaders,
}

/// What is followed, and how.
#[derive(Clone, Debug)]
pub struct WatchOptions {
    /// The glTF file.
    pub file: PathBuf,
    /// How it is opened.
    pub open: OpenOptions,
    /// Files of shaders.
    pub shaders: Vec<PathBuf>,
    /// How patiently.
    pub follow: FollowOptions,
}

/// Called from any thread when there are news, or the bake came along.
pub type Wake = Arc<dyn Fn() + Send + Sync>;

/// Follows a file until it is dropped.
pub struct Watcher {
    news: Receiver<News>,
    shared: Arc<Shared>,
}

/// What the threads know together.
struct Shared {
    /// Counts the changes of the file: what was begun for an older one is not wanted any more.
    generation: AtomicU64,
    is_over: AtomicBool,
    stage: Mutex<Option<(&'static str, u64)>>,
    done: AtomicUsize,
    wake: Wake,
}

impl Watcher {
    /// Opens the file, and does so again whenever it, or what it refers to, changes.
    ///
    /// # Errors
    /// If files cannot be followed.
    pub fn start(options: WatchOptions, wake: Wake) -> Result<Self, ViewError> {
        let follower = Follower::new(options.follow)?;
        let (tell, news) = channel();
        let (ask, asked) = channel();
        let shared = Arc::new(Shared {
            generation: AtomicU64::new(0),
            is_over: AtomicBool::new(false),
            stage: Mutex::new(None),
            done: AtomicUsize::new(0),
            wake,
        });
        let (file, open) = (options.file.clone(), options.open);
        let (for_opening, told) = (shared.clone(), tell.clone());
        std::thread::spawn(move || open_when_asked(&file, open, &for_opening, (&asked, &told)));
        let for_following = shared.clone();
        std::thread::spawn(move || follow(follower, &options, &for_following, (&ask, &tell)));
        Ok(Self { news, shared })
    }

    /// The next news, if there are any.
    #[must_use]
    pub fn news(&self) -> Option<News> {
        self.news.try_recv().ok()
    }

    /// Waits for the next news; `None` if there are none in that time.
    #[must_use]
    pub fn wait(&self, most: Duration) -> Option<News> {
        self.news.recv_timeout(most).ok()
    }

    /// What is being done to open the file, if anything is: a stage, and the share of it that is done.
    #[must_use]
    pub fn activity(&self) -> Option<(&'static str, f32)> {
        let (stage, length) = *self.shared.stage.lock().ok()?.as_ref()?;
        let done = self.shared.done.load(Ordering::Relaxed) as f32;
        Some((stage, (done / length.max(1) as f32).min(1.0)))
    }
}

impl Drop for Watcher {
    fn drop(&mut self) {
        self.shared.is_over.store(true, Ordering::Relaxed);
    }
}

/// Asks for the file to be opened, at once and after every change.
fn follow(
    mut follower: Follower,
    options: &WatchOptions,
    shared: &Shared,
    (ask, tell): (&Sender<u64>, &Sender<News>),
) {
    let is_shader = |file: &PathBuf| options.shaders.contains(file);
    let mut change = None;
    while !shared.is_over.load(Ordering::Relaxed) {
        let files: &[PathBuf] = change.as_ref().map_or(&[], |change: &Change| &change.files);
        if files.iter().any(is_shader) && tell.send(News::Shaders).is_ok() {
            (shared.wake)();
        }
        let is_first = shared.generation.load(Ordering::Relaxed) == 0;
        if is_first || !files.iter().all(is_shader) {
            // Followed before it is read: what changes from here on asks once more.
            follower.follow(references(&options.file).into_iter().chain(options.shaders.iter().cloned()));
            let generation = shared.generation.fetch_add(1, Ordering::Relaxed) + 1;
            if ask.send(generation).is_err() {
                return;
            }
        }
        change = follower.wait(LOOK_UP);
    }
}

/// Opens the file for the newest question; those before it are not answered.
fn open_when_asked(
    file: &std::path::Path,
    options: OpenOptions,
    shared: &Shared,
    (asked, tell): (&Receiver<u64>, &Sender<News>),
) {
    let (mut was_opened, mut memory) = (false, Memory::default());
    while let Ok(first) = asked.recv() {
        let generation = asked.try_iter().last().unwrap_or(first);
        let opening = Opening { shared, generation };
        let opened = Opened::open_again(file, options, &mut memory, &opening);
        shared.show_stage(None);
        if opening.is_cancelled() {
            continue;
        }
        // At first, a missing image is worth a note; later, it is most likely just being saved.
        let opened = opened.and_then(|opened| match opened.unreadable_images() {
            reason if reason.is_empty() || !was_opened => Ok(opened),
            reason => Err(ViewError::Image { file: opened.name, reason }),
        });
        was_opened |= opened.is_ok();
        let news = opened.map_or_else(News::Failed, |opened| News::Opened(Box::new(opened)));
        if tell.send(news).is_err() {
            return;
        }
        (shared.wake)();
    }
}

/// A file being opened for one change of it.
struct Opening<'a> {
    shared: &'a Shared,
    generation: u64,
}

impl Progress for Opening<'_> {
    fn begin(&self, stage: &'static str, length: u64) {
        self.shared.show_stage(Some((stage, length)));
    }

    fn advance(&self, steps: u64) {
        self.shared.done.fetch_add(steps as usize, Ordering::Relaxed);
    }

    fn is_cancelled(&self) -> bool {
        self.shared.is_over.load(Ordering::Relaxed)
            || self.shared.generation.load(Ordering::Relaxed) != self.generation
    }
}

impl Shared {
    fn show_stage(&self, stage: Option<(&'static str, u64)>) {
        if let Ok(mut shown) = self.stage.lock() {
            *shown = stage;
        }
        self.done.store(0, Ordering::Relaxed);
        (self.wake)();
    }
}
