//! The thesis' method, as the yardstick: Aquotte, "Real-time Diffuse Indirect Illumination with Virtual Light Meshes",
//! UFRGS 2017.
//!
//! Each light acts within a hemisphere on its front side, `range` times as large as the light's own radius. A uniform
//! grid over the scene keeps a list of fixed size per cell, padded with a null id, built by testing every cell against
//! every light; what does not fit is dropped. A pixel sums the lights of its cell by the textbook formula (Baum,
//! Rushmeier, Winget 1989) in single precision with the library's arc cosine.

use std::time::Instant;

use glam::Vec3;
use rayon::prelude::*;
use vlm_bake::gbuffer::GBuffer;
use vlm_bake::progress::Progress;
use vlm_bake::render::{LitScene, RenderError, RenderStats, Rendering};
use vlm_bake::scene::{Camera, Scene};
use vlm_bake::shade::TraceScene;
use vlm_format::VlmAsset;
use vlm_shaders::cpu::form_factor::LightGeometry;
use vlm_shaders::cpu::gather::{Gathered, Receiver};

use crate::active_hemisphere::{ActiveHemisphere, Lattice};
use crate::form_factor::textbook::{EdgeForm, textbook_form_factor};

/// Ends a list that is not full.
const NULL: u32 = u32::MAX;

/// The method's three knobs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThesisOptions {
    /// Radius of the hemisphere over the light's radius. Higher values lose less light and fill more of the lists.
    pub range: f32,
    /// Entries of each cell's list. Higher values drop fewer lights and cost memory and time.
    pub list: u32,
    /// Cells along each axis. Higher values make the lists fit better; memory grows with the cube.
    pub grid: u32,
}

impl Default for ThesisOptions {
    fn default() -> Self {
        Self { range: 4.5, list: 128, grid: 32 }
    }
}

/// What the lists could not hold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Overflow {
    /// Pairs of a cell and a light that were dropped.
    pub dropped: u64,
    /// Cells whose list was too short.
    pub cells: u64,
}

/// The grid of lists.
#[derive(Clone, Debug)]
pub struct ThesisGrid {
    lattice: Lattice,
    list: usize,
    /// `list` ids per cell, x fastest.
    lists: Vec<u32>,
    /// What was dropped.
    pub overflow: Overflow,
    /// Wall time of the build.
    pub build_seconds: f64,
}

impl ThesisGrid {
    /// Tests every cell over the box `low..high` against every light.
    #[must_use]
    pub fn build(lights: &[LightGeometry], low: Vec3, high: Vec3, options: &ThesisOptions) -> Self {
        let start = Instant::now();
        let lattice = Lattice::over(low, high, options.grid);
        let list = options.list.max(1) as usize;
        let hemispheres = ActiveHemisphere::of_all(lights, options.range);
        let mut lists = vec![NULL; lattice.count() * list];
        let fill = |(number, ids): (usize, &mut [u32])| {
            let [low, high] = lattice.bounds(lattice.position(number as u32));
            fill_list(ids, &hemispheres, low, high)
        };
        let dropped = lists.par_chunks_mut(list).enumerate().map(fill);
        let overflow = dropped.map(|dropped| Overflow { dropped, cells: u64::from(dropped > 0) }).reduce(
            Overflow::default,
            |a, b| Overflow { dropped: a.dropped + b.dropped, cells: a.cells + b.cells },
        );
        let build_seconds = start.elapsed().as_secs_f64();
        Self { lattice, list, lists, overflow, build_seconds }
    }

    /// Number of cells.
    #[must_use]
    pub fn cells(&self) -> usize {
        self.lattice.count()
    }

    /// What the lists take, bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        size_of_val(self.lists.as_slice()) as u64
    }

    /// Ids that the lists hold, padding not counted.
    #[must_use]
    pub fn entries(&self) -> u64 {
        self.lists.iter().filter(|&&id| id != NULL).count() as u64
    }

    /// The lights of the cell that holds `p`; points outside use the nearest cell.
    pub fn lights_at(&self, p: Vec3) -> impl Iterator<Item = u32> + '_ {
        self.list_of(self.lattice.number(self.lattice.cell_of(p)))
    }

    /// The lights of a cell by its number.
    pub fn list_of(&self, cell: u32) -> impl Iterator<Item = u32> + '_ {
        let first = cell as usize * self.list;
        self.lists[first..first + self.list].iter().copied().take_while(|&id| id != NULL)
    }
}

/// Writes the lights that reach a cell, in their order, and returns how many did not fit.
fn fill_list(ids: &mut [u32], hemispheres: &[ActiveHemisphere], low: Vec3, high: Vec3) -> u64 {
    let reaching = (0_u32..).zip(hemispheres).filter(|(_, hemisphere)| hemisphere.reaches(low, high));
    let mut count = 0;
    for (id, _) in reaching {
        if let Some(slot) = ids.get_mut(count) {
            *slot = id;
        }
        count += 1;
    }
    count.saturating_sub(ids.len()) as u64
}

/// Sums the form factors of the listed lights.
#[must_use]
pub fn gather(lit: &LitScene, list: impl Iterator<Item = u32>, receiver: &Receiver) -> Gathered {
    let mut gathered = Gathered::default();
    for light in list {
        let light = light as usize;
        let tag = lit.lights.tags[light];
        if tag != 0 && tag == receiver.tag {
            continue;
        }
        gathered.pairs += 1;
        let form_factor = by_acos(&lit.lights.geometry[light], receiver.position, receiver.normal);
        gathered.irradiance += lit.radiosity[light] * form_factor;
    }
    gathered
}

fn by_acos(light: &LightGeometry, x: Vec3, n: Vec3) -> f32 {
    textbook_form_factor(EdgeForm::Acos, light.corners(), light.normal, x, n)
}

/// A picture by the thesis' method, and what its lists could not hold.
///
/// # Errors
/// As [`vlm_bake::render::render`].
pub fn render(
    scene: &Scene,
    asset: &VlmAsset,
    camera: &Camera,
    (width, height): (u32, u32),
    options: &ThesisOptions,
    progress: &dyn Progress,
) -> Result<(Rendering, ThesisGrid), RenderError> {
    let trace = TraceScene::new(scene);
    let gbuffer = GBuffer::trace(&trace, camera, width, height);
    let direct = gbuffer.direct_irradiance(&trace);
    let lit = LitScene::new(&trace, asset)?;
    let (low, high) = bounds(&scene.positions);
    let grid = ThesisGrid::build(&lit.lights.geometry, low, high, options);
    let (indirect, stats): (_, RenderStats) =
        lit.gather(&gbuffer, progress, |receiver| gather(&lit, grid.lights_at(receiver.position), receiver));
    Ok((Rendering { gbuffer, direct, indirect, stats }, grid))
}

fn bounds(positions: &[Vec3]) -> (Vec3, Vec3) {
    let finite = positions.iter().filter(|p| p.is_finite());
    let (low, high) =
        finite.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)));
    if low.x <= high.x { (low, high) } else { (Vec3::ZERO, Vec3::ZERO) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use vlm_shaders::cpu::form_factor::form_factor;

    /// A light of radius 1 in the plane z = 0.5 around the origin, shining up.
    fn light() -> LightGeometry {
        let corner = |turn: f64| DVec3::new((turn * 2.1).cos(), (turn * 2.1).sin(), 0.5);
        LightGeometry::new([corner(0.0), corner(1.0), corner(2.0)])
    }

    fn grid(lights: &[LightGeometry], options: ThesisOptions) -> ThesisGrid {
        ThesisGrid::build(lights, Vec3::splat(-8.0), Vec3::splat(8.0), &options)
    }

    #[test]
    fn lights_reach_a_hemisphere_on_their_front() {
        let grid = grid(&[light()], ThesisOptions { range: 4.0, list: 4, grid: 16 });
        assert_eq!(grid.lights_at(Vec3::new(0.5, 0.5, 3.5)).count(), 1);
        assert_eq!(grid.lights_at(Vec3::new(0.5, 0.5, 6.5)).count(), 0, "beyond the radius");
        assert_eq!(grid.lights_at(Vec3::new(0.5, 0.5, -1.5)).count(), 0, "behind the light");
    }

    #[test]
    fn what_does_not_fit_is_dropped_in_order_and_counted() {
        let lights = vec![light(); 6];
        let short = grid(&lights, ThesisOptions { range: 4.0, list: 4, grid: 16 });
        let long = grid(&lights, ThesisOptions { range: 4.0, list: 6, grid: 16 });
        assert_eq!(short.lights_at(Vec3::new(0.5, 0.5, 3.5)).collect::<Vec<_>>(), [0, 1, 2, 3]);
        assert_eq!(long.lights_at(Vec3::new(0.5, 0.5, 3.5)).count(), 6);
        assert_eq!(long.overflow, Overflow::default());
        assert!(short.overflow.cells > 0 && short.overflow.dropped == 2 * short.overflow.cells);
    }

    #[test]
    fn textbook_formula_agrees_where_single_precision_suffices() {
        for (x, n) in [(Vec3::new(0.3, 0.1, 2.0), -Vec3::Z), (Vec3::new(1.5, 0.0, 1.5), -Vec3::X)] {
            let (textbook, exact) = (by_acos(&light(), x, n), form_factor(&light(), x, n));
            assert!(exact > 0.01 && (textbook / exact - 1.0).abs() < 1e-3, "{textbook} {exact}");
        }
        assert_eq!(by_acos(&light(), Vec3::ZERO, Vec3::Z), 0.0, "behind the light");
    }
}
