//! upload: what the passes read of an asset, on the device.

use glam::Vec4;
use vlm_format::Grid;
use vlm_shaders::cpu::direct::{Point, points};
use vlm_shaders::cpu::free_light::FreeLight;
use vlm_shaders::cpu::refresh::{FarLight, far_sources};
use vlm_shaders::cpu::upload::LightSet;
use vlm_shaders::tables::{GridHeader, GridTables, LightSurface};
use wgpu::Buffer;

use crate::error::{Error, within};
use crate::pass::Buffers;

/// The most real lights of a frame. Software devices stop a loop after 65,535 rounds, and an invocation walks 64 points times all lights.
pub const MOST_REAL_LIGHTS: u32 = 512;

/// The most lights that are summed at every pixel, for the same reason: assets without a grid, and lights of nodes that move.
pub const MOST_LISTED: u32 = 32_768;

/// The arrays of an asset as the shaders bind them.
pub(crate) struct Uploaded {
    pub header: Buffer,
    pub indices: Buffer,
    pub geometry: Buffer,
    pub samples: Buffer,
    pub uncovered: Buffer,
    pub light_surfaces: Buffer,
    pub sample_shares: Buffer,
    pub points: Buffer,
    /// Direct light at the points.
    pub irradiance: Buffer,
    pub light_radiosity: Buffer,
    pub source_radiosity: Buffer,
    pub grid: Option<GridBuffers>,
}

/// What only assets with a grid have.
pub(crate) struct GridBuffers {
    pub probes: Buffer,
    pub rows: Buffer,
    pub near_form_factors: Buffer,
    pub sources: Buffer,
    pub far: Buffer,
    pub near_radiosities: Buffer,
    /// The light of probes in free space, where there are any.
    pub free: Option<Buffer>,
}

/// The same on the processor, for what changes from frame to frame.
pub(crate) struct Host {
    /// In world space, as the nodes stand now.
    pub lights: LightSet,
    /// What phase 1 lights.
    pub points: Vec<Point>,
    /// With the grid's gains.
    pub light_surfaces: Vec<LightSurface>,
    /// Where the lists of `indices` begin.
    pub header: GridHeader,
}

impl Uploaded {
    /// Puts an asset on the device.
    pub(crate) fn new(
        buffers: &mut Buffers,
        lights: &LightSet,
        grid: Option<&Grid>,
        listed: &[u32],
    ) -> Result<(Self, Host), Error> {
        let none = Grid::default();
        let all = grid.unwrap_or(&none);
        check_listed(listed.len())?;
        let GridTables { header, mut indices, light_surfaces } = GridTables::new(all, lights);
        let summed = indices.iter_mut().skip(header.summed as usize);
        summed.zip(list_words(listed)).for_each(|(to, word)| *to = word);
        let points = points(lights, &all.uncovered);
        let sources = points.len() + lights.len();
        let vectors = |count: usize| (count * size_of::<Vec4>()) as u64;
        // Without a grid nothing asks for shares, but shaders divide by them.
        let shares = if grid.is_some() { all.sample_shares.clone() } else { vec![1.0; lights.samples.len()] };
        let uploaded = Self {
            header: buffers.uniform("header", bytemuck::bytes_of(&header))?,
            indices: buffers.input("indices", &indices)?,
            geometry: buffers.input("lights", &lights.geometry)?,
            samples: buffers.input("samples", &lights.samples)?,
            uncovered: buffers.input("uncovered", &all.uncovered)?,
            light_surfaces: buffers.input("light_surfaces", &light_surfaces)?,
            sample_shares: buffers.input("sample_shares", &shares)?,
            points: buffers.input("points", &points)?,
            irradiance: buffers.zeros("irradiance", vectors(points.len()))?,
            light_radiosity: buffers.zeros("light_radiosity", vectors(lights.len()))?,
            source_radiosity: buffers.zeros("source_radiosity", vectors(sources))?,
            grid: grid.map(|grid| GridBuffers::new(buffers, lights, grid)).transpose()?,
        };
        Ok((uploaded, Host { lights: lights.clone(), points, light_surfaces, header }))
    }
}

impl GridBuffers {
    fn new(buffers: &mut Buffers, lights: &LightSet, grid: &Grid) -> Result<Self, Error> {
        let far = grid.surface_probes as usize * size_of::<FarLight>();
        let near = grid.near.len() * size_of::<Vec4>();
        let free = grid.probes.len().saturating_sub(grid.surface_probes as usize) * size_of::<FreeLight>();
        Ok(Self {
            probes: buffers.input("probes", &grid.probes)?,
            rows: buffers.input("rows", &grid.rows)?,
            near_form_factors: buffers.input("near_form_factors", &grid.near_form_factors)?,
            sources: buffers.input("sources", &far_sources(lights, &grid.uncovered))?,
            far: buffers.zeros("far", far as u64)?,
            near_radiosities: buffers.zeros("near_radiosities", near as u64)?,
            free: (free > 0).then(|| buffers.zeros("free", free as u64)).transpose()?,
        })
    }
}

/// A list as the shader reads it: how many, then their numbers.
pub(crate) fn list_words(listed: &[u32]) -> Vec<u32> {
    let mut words = vec![u32::try_from(listed.len()).unwrap_or(u32::MAX)];
    words.extend_from_slice(listed);
    words
}

/// An error where too many lights would be summed at every pixel.
pub(crate) fn check_listed(count: usize) -> Result<(), Error> {
    let what = "summing every light at every pixel (lights)";
    within(what, "vlm_runtime::MOST_LISTED", count as u64, u64::from(MOST_LISTED))
}

/// An error where a frame has too many real lights.
pub(crate) fn check_real_lights(count: usize) -> Result<(), Error> {
    let limit = u64::from(MOST_REAL_LIGHTS);
    within("the frame (real lights)", "vlm_runtime::MOST_REAL_LIGHTS", count as u64, limit)
}
