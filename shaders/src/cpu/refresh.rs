//! The far light of each probe, from the frame's radiosities: to be done again only where lights changed.

use glam::{Vec3, Vec4};
use rayon::prelude::*;
use vlm_format::{Grid, Probe, Sample, Uncovered};

use super::form_factor::LightGeometry;
use super::free_light::{FreeLight, free_light};
use super::upload::LightSet;

/// The least cosine to the normal by which a light's direction is used: lower values follow normals that lean toward grazing light
/// more closely, and make its noise count more.
const LEAST_COSINE: f32 = 0.2;

/// A source as probes see it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct FarSource {
    /// Its middle, metres.
    pub centroid: Vec3,
    /// Not used.
    pub padding: f32,
    /// Unit normal.
    pub normal: Vec3,
    /// Not used.
    pub padding_2: f32,
}

/// All sources of a grid: of the samples, then of the lights, then of surface for which none stands.
#[must_use]
pub fn far_sources(lights: &LightSet, uncovered: &[Uncovered]) -> Vec<FarSource> {
    let of_sample = |s: &Sample| FarSource { centroid: s.position, normal: s.normal, ..FarSource::default() };
    let of_light = |light: &LightGeometry| FarSource {
        centroid: light.centroid(),
        normal: light.normal.normalize_or_zero(),
        ..FarSource::default()
    };
    let of_piece = |piece: &Uncovered| FarSource {
        centroid: piece.position,
        normal: piece.normal,
        ..FarSource::default()
    };
    let of_lights = lights.geometry.iter().map(of_light);
    let of_pieces = uncovered.iter().map(of_piece);
    lights.samples.iter().map(of_sample).chain(of_lights).chain(of_pieces).collect()
}

/// The far light at a probe on surface: `E(n, u, v) = x n.x + y n.y + z n.z + along_u u + along_v v`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct FarLight {
    /// Irradiance per component of the receiver's normal, lx.
    pub by_normal: [Vec3; 3],
    /// Change of irradiance along the probe's two tangents, lx/m.
    pub along: [Vec3; 2],
    /// Not used.
    pub padding: f32,
}

impl FarLight {
    /// Irradiance for a normal, at a place in the probe's frame.
    #[must_use]
    pub fn irradiance(&self, normal: Vec3, local: Vec3) -> Vec3 {
        let [x, y, z] = self.by_normal;
        let [u, v] = self.along;
        (x * normal.x + y * normal.y + z * normal.z + u * local.x + v * local.y).max(Vec3::ZERO)
    }
}

/// What a frame's pixels find at the probes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Arrived {
    /// The far light of each probe on surface.
    pub far: Vec<FarLight>,
    /// The radiosity that its probe sees of each near light, lx: the irradiance of its row over its form factor there.
    pub near: Vec<Vec3>,
    /// The light around each probe in free space.
    pub free: Vec<FreeLight>,
}

/// The light that arrives at every probe; `radiosity` is that of the sources.
#[must_use]
pub fn refresh(grid: &Grid, lights: &LightSet, sources: &[FarSource], radiosity: &[Vec3]) -> Arrived {
    let probes = (0..grid.surface_probes as usize).into_par_iter();
    let far = probes.map(|probe| far_light(grid, probe, sources, radiosity)).collect();
    let probes = (0..grid.probes.len()).into_par_iter();
    let near = probes.flat_map_iter(|probe| {
        let row_scale = grid.probes[probe].row_scale;
        grid.near_range(probe).map(move |near| near_radiosity(grid, near, row_scale, lights, radiosity))
    });
    let probes = (grid.surface_probes as usize..grid.probes.len()).into_par_iter();
    let free = probes.map(|probe| free_light(grid, probe, sources, radiosity)).collect();
    Arrived { far, near: near.collect(), free }
}

/// In place of a light's number after the last of a probe's near lights that shine.
pub const NO_NEAR: f32 = -1.0;

/// [`Arrived::near`] as the shaders store it: of each probe the near lights that shine, with their number in w, which a float holds exactly up
/// to 2^24; then [`NO_NEAR`], if there is room left.
#[must_use]
pub fn near_entries(grid: &Grid, near: &[Vec3]) -> Vec<Vec4> {
    let mut entries = vec![Vec4::new(0.0, 0.0, 0.0, NO_NEAR); near.len()];
    for probe in 0..grid.probes.len() {
        let mut place = grid.near_range(probe).start;
        for number in grid.near_range(probe) {
            let Some((&radiosity, &light)) = near.get(number).zip(grid.near.get(number)) else { continue };
            if radiosity != Vec3::ZERO {
                entries[place] = radiosity.extend(light as f32);
                place += 1;
            }
        }
    }
    entries
}

/// The inverse of [`near_entries`].
#[must_use]
pub fn near_of_entries(grid: &Grid, entries: &[Vec4]) -> Vec<Vec3> {
    let mut near = vec![Vec3::ZERO; entries.len()];
    for probe in 0..grid.probes.len() {
        let range = grid.near_range(probe);
        for entry in entries.get(range.clone()).unwrap_or(&[]).iter().take_while(|entry| entry.w >= 0.0) {
            let number = range.clone().find(|&number| grid.near[number] as f32 == entry.w);
            if let Some(radiosity) = number.and_then(|number| near.get_mut(number)) {
                *radiosity = entry.truncate();
            }
        }
    }
    near
}

fn near_radiosity(grid: &Grid, number: usize, row_scale: f32, lights: &LightSet, radiosity: &[Vec3]) -> Vec3 {
    let (light, form_factor) =
        (grid.near[number], grid.near_form_factors.get(number).copied().unwrap_or(1.0));
    let first_sample = lights.sample_starts.get(light as usize).copied().unwrap_or(u32::MAX);
    let mut irradiance = Vec3::ZERO;
    for (source, weight) in grid.near_row(number, first_sample) {
        irradiance += radiosity.get(source as usize).copied().unwrap_or_default() * weight as f32;
    }
    irradiance * (row_scale / form_factor)
}

fn far_light(grid: &Grid, number: usize, sources: &[FarSource], radiosity: &[Vec3]) -> FarLight {
    let mut far = FarLight::default();
    let Some(probe) = grid.probes.get(number) else { return far };
    let bitangent = probe.normal.cross(probe.tangent);
    for (light, weight) in grid.row(number) {
        let light = light as usize;
        let Some((source, &radiosity)) = sources.get(light).zip(radiosity.get(light)) else { continue };
        let irradiance = radiosity * (weight as f32 * probe.row_scale);
        let lean = lean(probe, source);
        // `lean . n = 1` at the probe's own normal, so there the irradiance is the row's.
        far.by_normal[0] += irradiance * lean.x;
        far.by_normal[1] += irradiance * lean.y;
        far.by_normal[2] += irradiance * lean.z;
        let slope = slope(probe, source);
        far.along[0] += irradiance * slope.dot(probe.tangent);
        far.along[1] += irradiance * slope.dot(bitangent);
    }
    far
}

/// The direction to a light, as long as makes it 1 high above the probe's surface.
fn lean(probe: &Probe, source: &FarSource) -> Vec3 {
    let direction = (source.centroid - probe.position).normalize_or_zero();
    let cosine = direction.dot(probe.normal);
    probe.normal + (direction - probe.normal * cosine) / cosine.max(LEAST_COSINE)
}

/// Relative change of a small light's form factor `(n.r)(-N.r) / |r|^4` per metre along the surface:
/// `4 r / |r|^2 - N / (N.r)` (its part along the normal counts nothing).
fn slope(probe: &Probe, source: &FarSource) -> Vec3 {
    let r = source.centroid - probe.position;
    let squared = r.length_squared();
    let facing = source.normal.dot(r).min(-LEAST_COSINE * squared.sqrt());
    let slope = r * (4.0 / squared) - source.normal / facing;
    let most = 1.0 / (probe.reach.iter().sum::<f32>() / 4.0);
    if slope.is_finite() { slope.clamp_length_max(most) } else { Vec3::ZERO }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_lights_that_shine_come_first() {
        let grid = Grid {
            probes: vec![Probe::default(); 2],
            near_starts: vec![0, 3, 4],
            near: vec![5, 7, 9, 8],
            ..Grid::default()
        };
        let near = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
        let entries = near_entries(&grid, &near);
        let lights: Vec<f32> = entries.iter().map(|entry| entry.w).collect();
        assert_eq!(lights, [7.0, 9.0, NO_NEAR, 8.0]);
        assert_eq!(near_of_entries(&grid, &entries), near);
    }
}
