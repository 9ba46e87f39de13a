//! session: a file that is looked at: the viewer, what the user chose, and the news of the file.

use std::time::Duration;

use vlm_bake::scene::Camera;

use super::controls::Controls;
use super::error::ViewError;
use super::eye::Flight;
use super::resolve::Screen;
use super::times::PassTimes;
use super::viewer::{FrameReport, Viewer};
use super::watch::{News, Watcher};

/// Where the user looks from.
#[derive(Clone, Debug, PartialEq)]
pub enum Look {
    /// A camera of the file, by its name or number; the first without.
    Camera(Option<String>),
    /// Freely.
    Flight(Flight),
}

/// A file that is looked at.
pub struct Session {
    /// What draws it.
    pub viewer: Viewer,
    /// What the user chose.
    pub controls: Controls,
    /// Where the user looks from.
    pub look: Look,
    /// Choose an exposure for the next frame.
    pub wants_exposure: bool,
    watcher: Watcher,
    /// Why the file is not shown as it is now.
    error: Option<String>,
    /// Why there is no frame.
    frame_error: Option<String>,
    /// Why a shader is not used as it is now.
    shader_error: Option<String>,
    notes: Vec<String>,
    name: String,
    is_baked: bool,
    opened: u64,
    report: FrameReport,
    times: Option<PassTimes>,
    has_worked: bool,
}

impl Session {
    /// A session without a scene so far: the watcher's news bring it.
    #[must_use]
    pub fn new(viewer: Viewer, watcher: Watcher, controls: Controls) -> Self {
        Self {
            viewer,
            controls,
            look: Look::Camera(None),
            wants_exposure: false,
            watcher,
            error: None,
            frame_error: None,
            shader_error: None,
            notes: Vec::new(),
            name: String::new(),
            is_baked: false,
            opened: 0,
            report: FrameReport::default(),
            times: None,
            has_worked: false,
        }
    }

    /// Takes the news that there are; true if there were any.
    pub fn take_news(&mut self) -> bool {
        let mut any = false;
        while let Some(news) = self.watcher.news() {
            self.take(news);
            any = true;
        }
        any
    }

    /// Waits for news and takes them; false if there were none in that time.
    pub fn wait_for_news(&mut self, most: Duration) -> bool {
        match self.watcher.wait(most) {
            Some(news) => {
                self.take(news);
                true
            }
            None => false,
        }
    }

    fn take(&mut self, news: News) {
        match news {
            News::Failed(error) => self.error = Some(error.to_string()),
            News::Shaders => {
                self.shader_error = self.viewer.reload_shaders().err().map(|error| error.to_string());
            }
            News::Opened(opened) => {
                let (name, notes, is_baked) = (opened.name.clone(), opened.notes.clone(), opened.is_baked);
                match self.viewer.show(*opened, &mut self.controls) {
                    Err(error) => self.error = Some(error.to_string()),
                    Ok(()) => {
                        (self.name, self.notes, self.is_baked) = (name, notes, is_baked);
                        self.error = self.missing_camera();
                        self.opened += 1;
                    }
                }
            }
        }
    }

    /// Why the first camera is shown and not the one that was asked for, where that is so.
    fn missing_camera(&self) -> Option<String> {
        let Look::Camera(wanted) = &self.look else { return None };
        let found = self.viewer.scene()?.camera(wanted.as_deref());
        found.err().map(|error| error.to_string())
    }

    /// The camera that the user looks through; `None` as long as there is no scene.
    #[must_use]
    pub fn camera(&self) -> Option<Camera> {
        let scene = self.viewer.scene()?;
        match &self.look {
            Look::Flight(flight) => Some(flight.camera()),
            // One that a change of the file took away leaves the first.
            Look::Camera(name) => scene.camera(name.as_deref()).or_else(|_| scene.camera(None)).ok(),
        }
    }

    /// Makes the light of a frame of that size, as far as it is not there already. What goes wrong becomes the error that is shown; true if
    /// there is a frame.
    pub fn frame(&mut self, size: [u32; 2], must_wait: bool) -> bool {
        let Some(camera) = self.camera() else { return false };
        let made = self.try_frame(&camera, size, must_wait);
        self.frame_error = made.err().map(|error| error.to_string());
        self.frame_error.is_none()
    }

    /// Shows the last frame; true if it could.
    pub fn present(&mut self, screen: Screen<'_>) -> bool {
        let Some(camera) = self.camera() else { return false };
        let shown = self.viewer.present(&self.controls, &camera, screen);
        self.frame_error = shown.err().map(|error| error.to_string());
        self.frame_error.is_none()
    }

    fn try_frame(&mut self, camera: &Camera, size: [u32; 2], must_wait: bool) -> Result<(), ViewError> {
        let report = self.viewer.frame(&self.controls, camera, size, must_wait)?;
        self.has_worked = report.is_new;
        if self.has_worked {
            self.report = report;
        } else {
            self.report.is_pending = report.is_pending;
        }
        if std::mem::take(&mut self.wants_exposure) {
            self.controls.exposure = self.viewer.auto_exposure()?;
        }
        self.times = self.viewer.pass_times().or(self.times.take());
        Ok(())
    }

    /// Why the file, or a shader, is not shown as it is now.
    pub fn errors(&self) -> impl Iterator<Item = &str> {
        [&self.error, &self.frame_error, &self.shader_error].into_iter().flatten().map(String::as_str)
    }

    /// What the user should know of the file that is shown.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Name of the file that is shown.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The lights that are shown were made by this program.
    #[must_use]
    pub fn is_baked(&self) -> bool {
        self.is_baked
    }

    /// How often the file was opened and shown.
    #[must_use]
    pub fn opened(&self) -> u64 {
        self.opened
    }

    /// What is being done to open the file, if anything is, and the share of it that is done.
    #[must_use]
    pub fn activity(&self) -> Option<(&'static str, f32)> {
        self.watcher.activity()
    }

    /// What the last frame that had anything to do took.
    #[must_use]
    pub fn report(&self) -> &FrameReport {
        &self.report
    }

    /// The last frame had anything to do.
    #[must_use]
    pub fn has_worked(&self) -> bool {
        self.has_worked
    }

    /// Milliseconds of the passes of a recent frame, once each; `None` where the device does not tell.
    pub fn take_times(&mut self) -> Option<PassTimes> {
        self.times.take()
    }
}
