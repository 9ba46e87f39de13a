//! times: what each pass took on the device, a frame or two later, without waiting for it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use wgpu::{Buffer, BufferUsages, CommandEncoder, QuerySet};

use super::gpu::Gpu;

/// The most passes of a frame.
const MOST: u32 = 16;

/// Milliseconds of the passes of a frame, in order; those of one name together.
pub type PassTimes = Vec<(&'static str, f32)>;

/// Puts timestamps between passes.
pub(crate) struct Stopwatch {
    timer: Option<Timer>,
    laps: Vec<&'static str>,
    state: State,
}

struct Timer {
    queries: QuerySet,
    resolved: Buffer,
    back: Buffer,
    /// Nanoseconds per tick.
    period: f32,
}

/// A frame is measured only once the last one was read.
enum State {
    Idle,
    Running,
    Submitted,
    Mapping(Arc<AtomicBool>),
}

impl Stopwatch {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        let timer = gpu.has_timestamps.then(|| {
            let buffer = |usage| {
                let size = u64::from(MOST) * u64::from(wgpu::QUERY_SIZE);
                gpu.device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some("timestamps"),
                    size,
                    usage,
                    mapped_at_creation: false,
                })
            };
            Timer {
                queries: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                    label: Some("timestamps"),
                    ty: wgpu::QueryType::Timestamp,
                    count: MOST,
                }),
                resolved: buffer(BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC),
                back: buffer(BufferUsages::MAP_READ | BufferUsages::COPY_DST),
                period: gpu.queue.get_timestamp_period(),
            }
        });
        Self { timer, laps: Vec::new(), state: State::Idle }
    }

    /// A frame begins.
    pub(crate) fn begin(&mut self) {
        if matches!(self.state, State::Idle | State::Running) && self.timer.is_some() {
            self.state = State::Running;
            self.laps.clear();
        }
    }

    /// A pass of that name begins.
    pub(crate) fn lap(&mut self, encoder: &mut CommandEncoder, name: &'static str) {
        if let (State::Running, Some(timer)) = (&self.state, &self.timer) {
            let index = self.laps.len() as u32;
            if index + 1 < MOST {
                encoder.write_timestamp(&timer.queries, index);
                self.laps.push(name);
            }
        }
    }

    /// The last pass ends.
    pub(crate) fn end(&mut self, encoder: &mut CommandEncoder) {
        if let (State::Running, Some(timer)) = (&self.state, &self.timer) {
            let count = self.laps.len() as u32 + 1;
            encoder.write_timestamp(&timer.queries, count - 1);
            encoder.resolve_query_set(&timer.queries, 0..count, &timer.resolved, 0);
            encoder.copy_buffer_to_buffer(&timer.resolved, 0, &timer.back, 0, timer.back.size());
            self.state = State::Submitted;
        }
    }

    /// The times of the last frame that was measured, once they are there.
    pub(crate) fn read(&mut self, gpu: &Gpu) -> Option<PassTimes> {
        let timer = self.timer.as_ref()?;
        if matches!(self.state, State::Submitted) {
            let is_done = Arc::new(AtomicBool::new(false));
            let done = is_done.clone();
            timer.back.map_async(wgpu::MapMode::Read, .., move |result| {
                done.store(result.is_ok(), Ordering::Release);
            });
            self.state = State::Mapping(is_done);
        }
        let State::Mapping(is_done) = &self.state else { return None };
        let _ = gpu.device.poll(wgpu::PollType::Poll);
        if !is_done.load(Ordering::Acquire) {
            return None;
        }
        let ticks: Vec<u64> = {
            let mapped = timer.back.get_mapped_range(..).ok()?;
            bytemuck::pod_collect_to_vec(&mapped)
        };
        timer.back.unmap();
        self.state = State::Idle;
        let mut times: PassTimes = Vec::new();
        for (name, pair) in self.laps.iter().zip(ticks.windows(2)) {
            let milliseconds = pair[1].saturating_sub(pair[0]) as f32 * timer.period * 1e-6;
            match times.iter_mut().find(|(known, _)| known == name) {
                Some((_, sum)) => *sum += milliseconds,
                None => times.push((name, milliseconds)),
            }
        }
        Some(times)
    }
}
