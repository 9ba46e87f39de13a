//! The measurement: every number of lights and cells by both builds, in one interleaved run.

use std::time::Instant;

use glam::Vec3;
use vlm_bake::scene::Scene;

use super::GridBenchError;
use super::lights::{Lights, lights, load_scene};
use super::row::{OURS, Row, THESIS};
use super::scatter::light_lists;
use crate::device::processor;
use crate::random;
use crate::thesis::{ThesisGrid, ThesisOptions};

/// What to measure.
#[derive(Clone, Debug, PartialEq)]
pub struct GridOptions {
    /// Names: `room`, or those of [`crate::pareto::scene::file`].
    pub scenes: Vec<String>,
    /// Numbers of lights. The grids hold about so many; the rows say how many.
    pub lights: Vec<u32>,
    /// Cells along the longest axis, 1 to 256.
    pub cells: Vec<u32>,
    /// Reach of a light over its radius. Our build's time and entries grow with its square at least.
    pub range: f32,
    /// Entries of each of the thesis' lists. Its bytes are in proportion.
    pub list: u32,
    /// Triangles of the room's surface.
    pub surface: u64,
    /// The thesis' build is left out where its speed so far, tests a second, says that it would take longer, seconds.
    pub limit: f64,
    /// Times that everything is built.
    pub repeats: u32,
}

impl Default for GridOptions {
    fn default() -> Self {
        Self {
            scenes: vec!["room".to_owned()],
            lights: vec![1_000, 3_000, 10_000, 30_000, 100_000],
            cells: vec![16, 32, 64, 100],
            range: 8.0,
            list: 128,
            surface: 100_000,
            limit: 20.0,
            repeats: 3,
        }
    }
}

/// One grid to build.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Build {
    builder: &'static str,
    /// Index of the lights.
    lights: usize,
    cells: u32,
}

/// Builds all grids of all scenes, and returns a row for each build. `log` is told what is going on.
///
/// # Errors
/// [`GridBenchError`] for scenes that cannot be had.
pub fn measure(options: &GridOptions, log: &dyn Fn(&str)) -> Result<Vec<Row>, GridBenchError> {
    let mut rows = Vec::new();
    for name in &options.scenes {
        log(&format!("{name}: lights"));
        let scene = load_scene(name, options.surface)?;
        let lights: Result<Vec<Lights>, _> =
            options.lights.iter().map(|&count| lights(name, &scene, count)).collect();
        rows.extend(Measurement { options, name, scene: &scene, lights: &lights?, log }.rows());
    }
    Ok(rows)
}

struct Measurement<'a> {
    options: &'a GridOptions,
    name: &'a str,
    scene: &'a Scene,
    lights: &'a [Lights],
    log: &'a dyn Fn(&str),
}

impl Measurement<'_> {
    /// The first repeat goes from few to many and finds out what is too slow; the others take what is left in an order of
    /// their own.
    fn rows(&self) -> Vec<Row> {
        let mut rows = Vec::new();
        (self.log)(&format!("{}: repeat 0", self.name));
        let mut kept = Vec::new();
        for build in self.builds() {
            if build.builder == THESIS && self.expected(&rows, build) > self.options.limit {
                (self.log)(&format!("{}: left out: {}", self.name, self.describe(build)));
                continue;
            }
            rows.push(self.row(build, 0));
            kept.push(build);
        }
        for repeat in 1..self.options.repeats.max(1) {
            (self.log)(&format!("{}: repeat {repeat}", self.name));
            let mut order: Vec<(usize, Build)> = kept.iter().copied().enumerate().collect();
            order.sort_by_key(|&(i, _)| random::bits(u64::from(repeat), i as u64));
            rows.extend(order.into_iter().map(|(_, build)| self.row(build, repeat)));
        }
        rows
    }

    /// All builds, by the number of tests that the thesis' needs.
    fn builds(&self) -> Vec<Build> {
        let pairs = (0..self.lights.len()).flat_map(|l| self.options.cells.iter().map(move |&c| (l, c)));
        let mut builds: Vec<Build> = pairs
            .flat_map(|(lights, cells)| [OURS, THESIS].map(|builder| Build { builder, lights, cells }))
            .collect();
        builds.sort_by_key(|&build| self.tests(build));
        builds
    }

    /// Pairs of a cell and a light.
    fn tests(&self, build: Build) -> u64 {
        u64::from(build.cells).pow(3) * self.lights[build.lights].corners.len() as u64
    }

    /// Seconds that the thesis' build would take at the speed of the largest one so far; 0 without any.
    fn expected(&self, rows: &[Row], build: Build) -> f64 {
        let tests = |row: &Row| row.cells * row.lights;
        let built = rows.iter().filter(|row| row.builder == THESIS && row.scene == self.name);
        let largest = built.max_by_key(|row| tests(row));
        largest.map_or(0.0, |row| row.seconds * self.tests(build) as f64 / tests(row) as f64)
    }

    fn describe(&self, build: Build) -> String {
        let lights = self.lights[build.lights].corners.len();
        format!("{} with {lights} lights and {} cells along each axis", build.builder, build.cells)
    }

    fn row(&self, build: Build, repeat: u32) -> Row {
        let lights = &self.lights[build.lights];
        let common = Row {
            scene: self.name.to_owned(),
            triangles: self.scene.triangles.len() as u64,
            lights: lights.corners.len() as u64,
            cells_per_axis: build.cells,
            range: self.options.range,
            builder: build.builder.to_owned(),
            repeat,
            threads: rayon::current_num_threads() as u32,
            device: processor(),
            ..Row::default()
        };
        if build.builder == OURS { self.ours(lights, common) } else { self.thesis(lights, common) }
    }

    fn ours(&self, lights: &Lights, common: Row) -> Row {
        let size = cell_size(self.scene, common.cells_per_axis);
        let start = Instant::now();
        let grid = light_lists(self.scene, &lights.corners, Some(size), self.options.range);
        let seconds = start.elapsed().as_secs_f64();
        let Some(grid) = grid else { return Row { seconds, ..common } };
        let words = grid.cells.len() + grid.starts.len() + grid.entries.len();
        Row {
            seconds,
            cells: grid.dimensions.iter().map(|&d| u64::from(d)).product(),
            stored_cells: grid.cells.len() as u64,
            entries: grid.entries.len() as u64,
            bytes: (words * size_of::<u32>()) as u64,
            ..common
        }
    }

    fn thesis(&self, lights: &Lights, common: Row) -> Row {
        let options =
            ThesisOptions { range: self.options.range, list: self.options.list, grid: common.cells_per_axis };
        let [low, high] = self.scene.bounds().unwrap_or_default().map(|p| p.as_vec3());
        let grid = ThesisGrid::build(&lights.geometry, low, high, &options);
        let cells = u64::from(common.cells_per_axis).pow(3);
        Row {
            seconds: grid.build_seconds,
            cells,
            stored_cells: cells,
            entries: grid.entries(),
            dropped: grid.overflow.dropped,
            bytes: grid.bytes(),
            ..common
        }
    }
}

/// The edge of the cubes of which `cells` cover the longest axis, metres.
fn cell_size(scene: &Scene, cells: u32) -> f32 {
    let extent = scene.bounds().map_or(Vec3::ONE, |[low, high]| (high - low).as_vec3()).max_element();
    // The lattice leaves a few thousandths of a cell of room at its ends.
    extent / (cells as f32 - 0.01)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn options() -> GridOptions {
        GridOptions {
            lights: vec![200, 800],
            cells: vec![4, 8],
            surface: 3_000,
            repeats: 2,
            ..GridOptions::default()
        }
    }

    fn rows(options: &GridOptions) -> Vec<Row> {
        measure(options, &|_| ()).unwrap()
    }

    #[test]
    fn every_grid_is_built_by_both_in_every_repeat() {
        let rows = rows(&options());
        assert_eq!(rows.len(), 2 * 2 * 2 * 2);
        for builder in [OURS, THESIS] {
            assert_eq!(rows.iter().filter(|row| row.builder == builder).count(), 8);
        }
        // Counts do not depend on the repeat.
        for row in &rows {
            let same = |other: &&Row| {
                (&other.builder, other.lights, other.cells_per_axis)
                    == (&row.builder, row.lights, row.cells_per_axis)
            };
            assert_eq!(rows.iter().filter(same).filter(|other| other.entries == row.entries).count(), 2);
        }
    }

    #[test]
    fn lists_are_about_as_long_in_both() {
        // The thesis' cells are flatter, since the room is; its lists here hold everything.
        let rows = rows(&GridOptions { list: 1_000, ..options() });
        for ours in rows.iter().filter(|row| row.builder == OURS) {
            let thesis = rows.iter().find(|row| {
                row.builder == THESIS
                    && (row.lights, row.cells_per_axis) == (ours.lights, ours.cells_per_axis)
            });
            let thesis = thesis.unwrap();
            assert_eq!(thesis.cells, u64::from(ours.cells_per_axis).pow(3));
            assert!(ours.cells < thesis.cells && ours.stored_cells <= ours.cells);
            assert!(ours.cells_per_axis < 8 || ours.stored_cells < ours.cells);
            assert_eq!(thesis.dropped, 0);
            // Cells with surface are nearer to lights than others.
            let length = |row: &Row| row.entries as f64 / row.stored_cells as f64;
            let ratio = length(ours) / length(thesis);
            assert!((0.5..4.0).contains(&ratio), "{ratio}");
        }
    }

    #[test]
    fn short_lists_drop_what_long_ones_hold() {
        let of = |list: u32| {
            let rows = rows(&GridOptions { list, ..options() });
            rows.into_iter().filter(|row| row.builder == THESIS).collect::<Vec<_>>()
        };
        for (short, long) in of(4).iter().zip(&of(1_000)) {
            assert_eq!(short.entries + short.dropped, long.entries);
            assert!(short.dropped > 0, "the negative control");
        }
    }

    #[test]
    fn the_longest_axis_has_as_many_cells_as_asked() {
        let scene = load_scene("room", 3_000).unwrap();
        let lights = lights("room", &scene, 100).unwrap();
        for cells in [1, 2, 16, 33, 100, 256] {
            let grid = light_lists(&scene, &lights.corners, Some(cell_size(&scene, cells)), 1.0).unwrap();
            assert_eq!(grid.dimensions.into_iter().max(), Some(cells));
        }
    }

    #[test]
    fn what_would_take_too_long_is_left_out() {
        // Whatever the machine: nothing is as fast as that, but the first build, of which nothing is known, is always done.
        let rows = rows(&GridOptions { limit: 1e-12, ..options() });
        assert_eq!(rows.iter().filter(|row| row.builder == THESIS).count(), 2);
        assert_eq!(rows.iter().filter(|row| row.builder == OURS).count(), 8);
    }

    #[test]
    fn an_unknown_scene_is_named() {
        let wrong = GridOptions { scenes: vec!["nowhere".to_owned()], ..options() };
        let message = measure(&wrong, &|_| ()).unwrap_err().to_string();
        assert!(message.contains("`nowhere`"), "{message}");
    }
}
