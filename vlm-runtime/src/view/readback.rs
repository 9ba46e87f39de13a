//! readback: textures and buffers back on the processor.

use glam::Vec4;
use wgpu::{Buffer, BufferUsages, Texture, TextureFormat};

use super::error::ViewError;
use super::gpu::Gpu;
use crate::Error;

/// The pixels of a texture of four bytes, halves or floats, rows from the top. Bytes count as 0 to 255.
pub(crate) fn pixels(gpu: &Gpu, texture: &Texture) -> Result<Vec<Vec4>, ViewError> {
    let (width, height, format) = (texture.width(), texture.height(), texture.format());
    let pixel = format.block_copy_size(None).unwrap_or(4);
    let row = (pixel * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let back = mappable(gpu, u64::from(row) * u64::from(height));
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
    let to = wgpu::TexelCopyBufferInfo { buffer: &back, layout };
    encoder.copy_texture_to_buffer(texture.as_image_copy(), to, texture.size());
    gpu.queue.submit([encoder.finish()]);
    let bytes = bytes(gpu, &back)?;
    let of_row = |row: &[u8]| -> Vec<Vec4> {
        let row = row.get(..(pixel * width) as usize).unwrap_or(&[]);
        row.chunks_exact(pixel as usize).map(|bytes| four(format, bytes)).collect()
    };
    Ok(bytes.chunks_exact(row as usize).flat_map(of_row).collect())
}

/// The elements of a buffer that can be copied.
pub(crate) fn elements<T: bytemuck::Pod>(gpu: &Gpu, buffer: &Buffer) -> Result<Vec<T>, ViewError> {
    let back = mappable(gpu, buffer.size());
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    encoder.copy_buffer_to_buffer(buffer, 0, &back, 0, buffer.size());
    gpu.queue.submit([encoder.finish()]);
    Ok(bytemuck::pod_collect_to_vec(&bytes(gpu, &back)?))
}

fn mappable(gpu: &Gpu, size: u64) -> Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("back"),
        size,
        usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

fn bytes(gpu: &Gpu, buffer: &Buffer) -> Result<Vec<u8>, ViewError> {
    buffer.map_async(wgpu::MapMode::Read, .., |_| {});
    gpu.wait()?;
    let mapped = buffer.get_mapped_range(..).map_err(|error| Error::Device(error.to_string()))?;
    Ok(mapped.to_vec())
}

fn four(format: TextureFormat, bytes: &[u8]) -> Vec4 {
    let mut numbers = [0.0; 4];
    let size = bytes.len() / 4;
    for (number, bytes) in numbers.iter_mut().zip(bytes.chunks_exact(size.max(1))) {
        *number = match (bytes, format) {
            (&[byte], _) => f32::from(byte),
            (&[a, b], _) => half::f16::from_le_bytes([a, b]).to_f32(),
            (&[a, b, c, d], _) => f32::from_le_bytes([a, b, c, d]),
            _ => 0.0,
        };
    }
    Vec4::from_array(numbers)
}
