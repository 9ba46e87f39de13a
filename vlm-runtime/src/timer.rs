//! How long passes take on the device, by timestamp queries that are read a frame or two later, so that no frame waits for them.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

use wgpu::{Buffer, BufferUsages, CommandEncoder, ComputePassTimestampWrites, Device, QuerySet, Queue};

use crate::error::Error;
use crate::stats::{FrameTimes, PassTime};

/// The most passes of a frame.
const MOST_PASSES: u32 = 8;
/// Frames whose times are under way at most; those beyond are not timed.
const MOST_FRAMES: usize = 4;
/// A timestamp, bytes.
const TIMESTAMP: u64 = 8;

const PENDING: u8 = 0;
const MAPPED: u8 = 1;
const FAILED: u8 = 2;

/// Timestamps of the passes of the last frames.
pub(crate) struct Timer {
    queries: QuerySet,
    resolved: Buffer,
    slots: Vec<Slot>,
    newest: Option<FrameTimes>,
}

/// A frame's timestamps on their way back.
struct Slot {
    buffer: Buffer,
    state: State,
}

enum State {
    Free,
    /// Added to an encoder, which is submitted before the next frame is prepared.
    Recorded(Frame),
    Mapping(Frame, Arc<AtomicU8>),
}

#[derive(Clone)]
struct Frame {
    number: u64,
    passes: Vec<&'static str>,
}

impl Timer {
    /// `None` where the device has no timestamp queries.
    pub(crate) fn new(device: &Device) -> Option<Self> {
        if !device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return None;
        }
        let count = 2 * MOST_PASSES;
        let queries = device.create_query_set(&wgpu::QuerySetDescriptor {
            label: Some("times"),
            ty: wgpu::QueryType::Timestamp,
            count,
        });
        let buffer = |usage| {
            let size = u64::from(count) * TIMESTAMP;
            let (label, mapped_at_creation) = (Some("times"), false);
            device.create_buffer(&wgpu::BufferDescriptor { label, size, usage, mapped_at_creation })
        };
        let slot =
            |_| Slot { buffer: buffer(BufferUsages::MAP_READ | BufferUsages::COPY_DST), state: State::Free };
        Some(Self {
            queries,
            resolved: buffer(BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC),
            slots: (0..MOST_FRAMES).map(slot).collect(),
            newest: None,
        })
    }

    /// Where the pass of this number writes its times.
    pub(crate) fn writes(&self, pass: usize) -> Option<ComputePassTimestampWrites<'_>> {
        let first = 2 * u32::try_from(pass).ok().filter(|pass| *pass < MOST_PASSES)?;
        let (beginning_of_pass_write_index, end_of_pass_write_index) = (Some(first), Some(first + 1));
        let query_set = &self.queries;
        Some(ComputePassTimestampWrites { query_set, beginning_of_pass_write_index, end_of_pass_write_index })
    }

    /// Ends the pass before that of this number, and begins it, between passes; the device needs `TIMESTAMP_QUERY_INSIDE_ENCODERS`.
    #[cfg(feature = "view")]
    pub(crate) fn stamp(&self, encoder: &mut CommandEncoder, pass: usize) {
        let first = 2 * pass as u32;
        if (1..=2 * MOST_PASSES).contains(&first) {
            encoder.write_timestamp(&self.queries, first - 1);
        }
        if first < 2 * MOST_PASSES {
            encoder.write_timestamp(&self.queries, first);
        }
    }

    /// Adds the way back of a frame's times, if a slot is free.
    pub(crate) fn finish(&mut self, encoder: &mut CommandEncoder, number: u64, passes: &[&'static str]) {
        let passes: Vec<_> = passes.iter().copied().take(MOST_PASSES as usize).collect();
        let Some(slot) = self.slots.iter_mut().find(|slot| matches!(slot.state, State::Free)) else { return };
        if passes.is_empty() {
            return;
        }
        let count = 2 * passes.len() as u32;
        encoder.resolve_query_set(&self.queries, 0..count, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &slot.buffer, 0, u64::from(count) * TIMESTAMP);
        slot.state = State::Recorded(Frame { number, passes });
    }

    /// Takes what has arrived, without waiting, and asks for the rest; all recorded frames are submitted by now.
    pub(crate) fn collect(&mut self, device: &Device, queue: &Queue) -> Result<(), Error> {
        self.ask();
        self.poll(device, queue, wgpu::PollType::Poll)
    }

    /// Waits for the times of all recorded frames.
    pub(crate) fn wait(&mut self, device: &Device, queue: &Queue) -> Result<(), Error> {
        self.ask();
        self.poll(device, queue, wgpu::PollType::Wait { submission_index: None, timeout: None })
    }

    /// The newest that arrived.
    pub(crate) fn newest(&self) -> Option<&FrameTimes> {
        self.newest.as_ref()
    }

    fn ask(&mut self) {
        for slot in &mut self.slots {
            let State::Recorded(frame) = &slot.state else { continue };
            let (arrived, frame) = (Arc::new(AtomicU8::new(PENDING)), frame.clone());
            let told = Arc::clone(&arrived);
            slot.buffer.map_async(wgpu::MapMode::Read, .., move |result| {
                told.store(if result.is_ok() { MAPPED } else { FAILED }, Ordering::Release);
            });
            slot.state = State::Mapping(frame, arrived);
        }
    }

    fn poll(&mut self, device: &Device, queue: &Queue, how: wgpu::PollType) -> Result<(), Error> {
        device.poll(how).map_err(|error| Error::Device(error.to_string()))?;
        let period = f64::from(queue.get_timestamp_period()) * 1e-9;
        for slot in &mut self.slots {
            let State::Mapping(frame, arrived) = &slot.state else { continue };
            match arrived.load(Ordering::Acquire) {
                PENDING => continue,
                MAPPED => {
                    let times = read(&slot.buffer, frame, period)?;
                    if self.newest.as_ref().is_none_or(|newest| newest.frame < times.frame) {
                        self.newest = Some(times);
                    }
                    slot.buffer.unmap();
                }
                _ => {}
            }
            slot.state = State::Free;
        }
        Ok(())
    }
}

fn read(buffer: &Buffer, frame: &Frame, period: f64) -> Result<FrameTimes, Error> {
    let mapped = buffer.get_mapped_range(..).map_err(|error| Error::Device(error.to_string()))?;
    let stamps: Vec<u64> = bytemuck::pod_collect_to_vec(&mapped);
    // From the end of the pass before, so that waiting for it counts for none; a driver may stamp the beginning late, too.
    let mut before = stamps.first().copied().unwrap_or(0);
    let time = |(&pass, stamps): (&&'static str, &[u64])| {
        let end = stamps.get(1).copied().unwrap_or(before);
        let ticks = end.saturating_sub(std::mem::replace(&mut before, end));
        PassTime { pass, seconds: ticks as f64 * period }
    };
    let passes = frame.passes.iter().zip(stamps.chunks_exact(2)).map(time).collect();
    Ok(FrameTimes { frame: frame.number, passes })
}
