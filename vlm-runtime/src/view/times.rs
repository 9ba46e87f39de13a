//! times: what each pass took on the device, a frame or two later, without waiting for it.

use wgpu::CommandEncoder;

use super::gpu::Gpu;
use crate::timer::Timer;

/// Milliseconds of the passes of a frame, in order; those of one name together.
pub type PassTimes = Vec<(&'static str, f32)>;

/// Puts timestamps between passes, the renderer's own included.
pub(crate) struct Stopwatch {
    timer: Option<Timer>,
    laps: Vec<&'static str>,
    frame: u64,
}

impl Stopwatch {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        let timer = gpu.has_timestamps.then(|| Timer::new(&gpu.device)).flatten();
        Self { timer, laps: Vec::new(), frame: 0 }
    }

    /// A frame begins.
    pub(crate) fn begin(&mut self) {
        self.frame += 1;
        self.laps.clear();
    }

    /// A pass of that name begins, and the one before ends.
    pub(crate) fn lap(&mut self, encoder: &mut CommandEncoder, name: &'static str) {
        let Some(timer) = &self.timer else { return };
        timer.stamp(encoder, self.laps.len());
        self.laps.push(name);
    }

    /// The last pass ends.
    pub(crate) fn end(&mut self, encoder: &mut CommandEncoder) {
        let Some(timer) = &mut self.timer else { return };
        timer.stamp(encoder, self.laps.len());
        timer.finish(encoder, self.frame, &self.laps);
    }

    /// The times of the last frame whose are there.
    pub(crate) fn read(&mut self, gpu: &Gpu) -> Option<PassTimes> {
        let timer = self.timer.as_mut()?;
        timer.collect(&gpu.device, &gpu.queue).ok()?;
        let mut times: PassTimes = Vec::new();
        for lap in &timer.newest()?.passes {
            let milliseconds = lap.seconds as f32 * 1e3;
            match times.iter_mut().find(|(known, _)| *known == lap.pass) {
                Some((_, sum)) => *sum += milliseconds,
                None => times.push((lap.pass, milliseconds)),
            }
        }
        Some(times)
    }
}
