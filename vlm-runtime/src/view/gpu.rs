//! gpu: the device that the viewer draws with, and what it complains of.

use std::sync::{Arc, Mutex};

use wgpu::{Adapter, Device, Features, Instance, Limits, Queue, Surface};

use super::error::ViewError;
use crate::Error;

/// A device, its queue, and its complaints.
#[derive(Clone)]
pub struct Gpu {
    /// The device.
    pub device: Device,
    /// Its queue.
    pub queue: Queue,
    /// The adapter, in its driver's words.
    pub name: String,
    /// Timestamps may stand between passes.
    pub has_timestamps: bool,
    failures: Arc<Mutex<Vec<String>>>,
}

impl Gpu {
    /// A device for pictures without a window.
    ///
    /// # Errors
    /// [`Error::NoAdapter`] says what to install.
    pub fn new() -> Result<Self, ViewError> {
        let instance = Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        Self::of(&adapter(&instance, None)?)
    }

    /// A device that draws to a window's surface, with the adapter.
    ///
    /// # Errors
    /// As [`Gpu::new`].
    pub fn for_surface(instance: &Instance, surface: &Surface<'_>) -> Result<(Self, Adapter), ViewError> {
        let adapter = adapter(instance, Some(surface))?;
        Ok((Self::of(&adapter)?, adapter))
    }

    fn of(adapter: &Adapter) -> Result<Self, ViewError> {
        let timestamps = Features::TIMESTAMP_QUERY | Features::TIMESTAMP_QUERY_INSIDE_ENCODERS;
        let has_timestamps = adapter.features().contains(timestamps);
        let there = adapter.limits();
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("vlm-view"),
            required_features: if has_timestamps { timestamps } else { Features::empty() },
            // The default limits, but scenes may be as large as the device allows.
            required_limits: Limits {
                max_buffer_size: there.max_buffer_size,
                max_storage_buffer_binding_size: there.max_storage_buffer_binding_size,
                ..Limits::default()
            },
            ..wgpu::DeviceDescriptor::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|error| Error::Device(error.to_string()))?;
        let failures = Arc::new(Mutex::new(Vec::new()));
        let noted = failures.clone();
        // The default would end the program.
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            if let Ok(mut noted) = noted.lock() {
                noted.push(error.to_string());
            }
        }));
        Ok(Self { device, queue, name: adapter.get_info().name, has_timestamps, failures })
    }

    /// What the device complained of since the last call, as an error.
    ///
    /// # Errors
    /// [`ViewError::Device`] if there was any complaint.
    pub fn check(&self) -> Result<(), ViewError> {
        let complaints = self.failures.lock().map(|mut failures| std::mem::take(&mut *failures));
        match complaints.unwrap_or_default().first() {
            None => Ok(()),
            Some(first) => Err(ViewError::Device(first.clone())),
        }
    }

    /// Waits until all that was submitted is done.
    ///
    /// # Errors
    /// [`Error::Device`] if the device is lost.
    pub fn wait(&self) -> Result<(), ViewError> {
        let wait = wgpu::PollType::Wait { submission_index: None, timeout: None };
        let done = self.device.poll(wait).map_err(|error| Error::Device(error.to_string()));
        Ok(done.map(|_| ())?)
    }
}

fn adapter(instance: &Instance, surface: Option<&Surface<'_>>) -> Result<Adapter, ViewError> {
    let options = wgpu::RequestAdapterOptions {
        power_preference: wgpu::PowerPreference::HighPerformance,
        compatible_surface: surface,
        ..wgpu::RequestAdapterOptions::default()
    };
    let adapter = pollster::block_on(instance.request_adapter(&options));
    Ok(adapter.map_err(|error| Error::NoAdapter(error.to_string()))?)
}
