//! The grid and its lights as the shaders bind them: many lists in one buffer, since a stage has only eight storage buffers by WebGPU's
//! default limits.

use glam::Vec3;
use vlm_format::Grid;

use crate::cpu::upload::LightSet;

/// Where each of the grid's lists begins in [`GridTables::indices`]; the cells begin at 0. 96 bytes, a uniform buffer.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct GridHeader {
    /// Minimum corner, metres.
    pub origin: Vec3,
    /// Edge of a cell of the coarsest level, metres.
    pub cell_size: f32,
    /// Cells of the coarsest level along x, y, z.
    pub dimensions: [u32; 3],
    /// Number of probes on surface.
    pub surface_probes: u32,
    /// Of [`Grid::leaves`], two numbers each; the cells end here.
    pub leaves: u32,
    /// Of [`Grid::leaf_probes`].
    pub leaf_probes: u32,
    /// Of [`Grid::near_starts`].
    pub near_starts: u32,
    /// Of [`Grid::near`].
    pub near: u32,
    /// Of [`Grid::row_starts`].
    pub row_starts: u32,
    /// Of [`LightSet::sample_starts`].
    pub sample_starts: u32,
    /// Number of probes.
    pub probe_count: u32,
    /// Length of [`Grid::near`].
    pub near_count: u32,
    /// Number of lights.
    pub light_count: u32,
    /// Number of samples.
    pub sample_count: u32,
    /// Number of pieces of surface without a light.
    pub uncovered_count: u32,
    /// Of [`LightSet::tags`].
    pub light_tags: u32,
    /// The lights that are summed at every point: how many, then their numbers; room for all of them.
    pub summed: u32,
    /// What `inject` works on, likewise, or [`ALL`]: lights, then pieces of surface without one.
    pub injected: u32,
    /// The probes that `refresh` and `refresh_free` work on, likewise.
    pub refreshed: u32,
    /// Not used.
    pub padding: u32,
}

/// In place of a list's length: no list, but all that there are.
pub const ALL: u32 = u32::MAX;

/// What a light emits by itself, and the radiosity of the surface that it stands for over its own. 16 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct LightSurface {
    /// lx.
    pub emission: Vec3,
    /// Of [`Grid::surface_gains`].
    pub gain: f32,
}

/// What is put together for the shaders; all other buffers hold arrays of [`Grid`] and [`LightSet`] as they are.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GridTables {
    /// Where the lists begin.
    pub header: GridHeader,
    /// The lists.
    pub indices: Vec<u32>,
    /// One per light.
    pub light_surfaces: Vec<LightSurface>,
}

impl GridTables {
    /// The tables of a grid over its lights.
    #[must_use]
    pub fn new(grid: &Grid, lights: &LightSet) -> Self {
        let mut indices = grid.cells.clone();
        let mut append = |list: &[u32]| {
            let start = indices.len() as u32;
            indices.extend_from_slice(list);
            start
        };
        let header = GridHeader {
            origin: grid.origin,
            cell_size: grid.cell_size,
            dimensions: grid.dimensions,
            surface_probes: grid.surface_probes,
            leaves: append(bytemuck::cast_slice(&grid.leaves)),
            leaf_probes: append(&grid.leaf_probes),
            near_starts: append(&grid.near_starts),
            near: append(&grid.near),
            row_starts: append(&grid.row_starts),
            sample_starts: append(&lights.sample_starts),
            probe_count: grid.probes.len() as u32,
            near_count: grid.near.len() as u32,
            light_count: lights.len() as u32,
            sample_count: lights.samples.len() as u32,
            uncovered_count: grid.uncovered.len() as u32,
            light_tags: append(&lights.tags),
            summed: append(&room(0, lights.len())),
            injected: append(&room(ALL, lights.len() + grid.uncovered.len())),
            refreshed: append(&room(ALL, grid.probes.len())),
            padding: 0,
        };
        let surface = |light| LightSurface {
            emission: lights.emission.get(light).copied().unwrap_or_default(),
            gain: grid.surface_gains.get(light).copied().unwrap_or(0.0),
        };
        Self { header, indices, light_surfaces: (0..lights.len()).map(surface).collect() }
    }
}

/// A list of this length, with room for so many.
fn room(count: u32, most: usize) -> Vec<u32> {
    let mut list = vec![0; most + 1];
    list[0] = count;
    list
}

#[cfg(test)]
mod tests {
    use super::*;
    use vlm_format::Leaf;

    #[test]
    fn every_list_lies_where_the_header_says() {
        let grid = Grid {
            cells: vec![1, 3, 0],
            leaves: vec![Leaf { probes: 10, free_probes: 11 }, Leaf { probes: 12, free_probes: 13 }],
            leaf_probes: vec![20, 21],
            near_starts: vec![30, 31, 32],
            near: vec![40],
            row_starts: vec![50, 51],
            surface_gains: vec![2.0],
            ..Grid::default()
        };
        let lights = LightSet {
            geometry: vec![Default::default()],
            sample_starts: vec![60, 61],
            tags: vec![70],
            ..LightSet::default()
        };
        let GridTables { header, indices, light_surfaces } = GridTables::new(&grid, &lights);
        let at = |start: u32| indices[start as usize];
        let lists = [
            header.leaves,
            header.leaf_probes,
            header.near_starts,
            header.near,
            header.row_starts,
            header.sample_starts,
            header.light_tags,
            header.summed,
            header.injected,
            header.refreshed,
        ];
        assert_eq!(lists.map(at), [10, 20, 30, 40, 50, 60, 70, 0, ALL, ALL]);
        // Each of the last three has room for its length and one light, or no probe.
        assert_eq!((indices[..3].to_vec(), indices.len()), (grid.cells, 18 + 2 + 2 + 1));
        assert_eq!(light_surfaces[0].gain, 2.0);
    }
}
