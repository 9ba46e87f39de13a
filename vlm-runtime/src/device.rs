//! A device for programs without one of their own, and the limits that all passes keep.

use crate::error::{Error, within};

/// A device of the first adapter of these backends, with WebGPU's default limits and no optional feature. Blocks until it is there.
///
/// # Errors
/// [`Error::NoAdapter`] where there is none, [`Error::Device`] where it gives no device.
pub fn request_device(backends: wgpu::Backends) -> Result<(wgpu::Device, wgpu::Queue), Error> {
    request_device_with(backends, wgpu::Features::empty())
}

/// [`request_device`] with those of these optional features that the adapter has: `TIMESTAMP_QUERY` for [`crate::Settings::time_passes`].
///
/// # Errors
/// As [`request_device`].
pub fn request_device_with(
    backends: wgpu::Backends,
    optional: wgpu::Features,
) -> Result<(wgpu::Device, wgpu::Queue), Error> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = backends;
    let instance = wgpu::Instance::new(descriptor);
    let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))
        .map_err(|error| Error::NoAdapter(error.to_string()))?;
    let required_features = adapter.features() & optional;
    let descriptor = wgpu::DeviceDescriptor { required_features, ..wgpu::DeviceDescriptor::default() };
    pollster::block_on(adapter.request_device(&descriptor)).map_err(|error| Error::Device(error.to_string()))
}

/// What any asset's passes need of a device, whatever its size.
///
/// # Errors
/// [`Error::Limit`] names the first limit that is too low.
pub fn check_limits(limits: &wgpu::Limits) -> Result<(), Error> {
    let needs = [
        ("a pass", "max_storage_buffers_per_shader_stage", 8, limits.max_storage_buffers_per_shader_stage),
        ("a pass", "max_bind_groups", 3, limits.max_bind_groups),
        (
            "the gather",
            "max_storage_textures_per_shader_stage",
            1,
            limits.max_storage_textures_per_shader_stage,
        ),
        (
            "the gather",
            "max_sampled_textures_per_shader_stage",
            5,
            limits.max_sampled_textures_per_shader_stage,
        ),
        (
            "a workgroup",
            "max_compute_invocations_per_workgroup",
            64,
            limits.max_compute_invocations_per_workgroup,
        ),
        ("a workgroup", "max_compute_workgroup_size_x", 64, limits.max_compute_workgroup_size_x),
    ];
    needs.into_iter().try_for_each(|(what, name, needed, limit)| within(what, name, needed, u64::from(limit)))
}
