//! Progress bars on stderr when it is a terminal; silence in a pipe.

use std::io::{IsTerminal, stderr};
use std::sync::Mutex;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use vlm_bake::progress::Progress;

/// One bar at a time: that of the running stage.
pub struct Bars {
    terminal: bool,
    current: Mutex<Option<ProgressBar>>,
}

impl Bars {
    /// Bars if stderr is a terminal, nothing else.
    pub fn new() -> Self {
        Self { terminal: stderr().is_terminal(), current: Mutex::new(None) }
    }
}

impl Progress for Bars {
    fn begin(&self, stage: &'static str, length: u64) {
        let Ok(mut current) = self.current.lock() else { return };
        if let Some(last) = current.take() {
            last.finish_and_clear();
        }
        if self.terminal {
            let bar = ProgressBar::new(length).with_message(stage);
            let template = "{spinner} {msg:12} {bar:32} {pos}/{len} {elapsed}";
            if let Ok(style) = ProgressStyle::with_template(template) {
                bar.set_style(style);
            }
            bar.enable_steady_tick(Duration::from_millis(100));
            *current = Some(bar);
        }
    }

    fn advance(&self, steps: u64) {
        if let Ok(current) = self.current.lock()
            && let Some(bar) = current.as_ref()
        {
            bar.inc(steps);
        }
    }
}

impl Drop for Bars {
    fn drop(&mut self) {
        if let Ok(current) = self.current.get_mut()
            && let Some(last) = current.take()
        {
            last.finish_and_clear();
        }
    }
}
