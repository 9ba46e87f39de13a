//! The measurement: every number of lights and cells by every build, in one interleaved run.

use std::time::Instant;

use vlm_bake::scene::Scene;
use vlm_shaders::cpu::form_factor::LightGeometry;

use super::GridBenchError;
use super::lights::{lights, load_scene};
use super::row::{BUILDERS, Row, SCATTER, SURFACE, THESIS};
use super::scatter::{LightLists, StoredCells, scatter};
use crate::active_hemisphere::{ActiveHemisphere, Lattice};
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
    /// Cells along every axis, 1 to 256.
    pub cells: Vec<u32>,
    /// Reach of a light over its radius. Scattering's time and entries grow with its square at least.
    pub range: f32,
    /// The most entries of a list. The thesis' bytes are in proportion.
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
            range: ThesisOptions::default().range,
            list: ThesisOptions::default().list,
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

/// What a build made.
enum Built {
    /// Lists of one length.
    Padded(ThesisGrid),
    /// Lists as long as they need be.
    Compact(LightLists),
}

/// Builds all grids of all scenes, and returns a row for each build. `log` is told what is going on.
///
/// # Errors
/// [`GridBenchError`] for scenes that cannot be had, and for builds that disagree.
pub fn measure(options: &GridOptions, log: &dyn Fn(&str)) -> Result<Vec<Row>, GridBenchError> {
    let mut rows = Vec::new();
    for name in &options.scenes {
        log(&format!("{name}: lights"));
        let scene = load_scene(name, options.surface)?;
        let lights: Result<Vec<Vec<LightGeometry>>, _> =
            options.lights.iter().map(|&count| lights(name, &scene, count)).collect();
        rows.extend(Measurement { options, name, scene: &scene, lights: &lights?, log }.rows()?);
    }
    Ok(rows)
}

struct Measurement<'a> {
    options: &'a GridOptions,
    name: &'a str,
    scene: &'a Scene,
    lights: &'a [Vec<LightGeometry>],
    log: &'a dyn Fn(&str),
}

impl Measurement<'_> {
    /// The first repeat goes from few to many, finds out what is too slow and compares the lists; the others take what is left in an
    /// order of their own.
    fn rows(&self) -> Result<Vec<Row>, GridBenchError> {
        let mut rows = Vec::new();
        (self.log)(&format!("{}: repeat 0", self.name));
        let mut kept = Vec::new();
        for build in self.builds() {
            if build.builder == THESIS && self.expected(&rows, build) > self.options.limit {
                (self.log)(&format!("{}: left out: {}", self.name, self.describe(build)));
                continue;
            }
            let (row, grid) = self.build(build, 0);
            if let Built::Padded(thesis) = &grid {
                self.compare(build, thesis)?;
            }
            rows.push(row);
            kept.push(build);
        }
        for repeat in 1..self.options.repeats.max(1) {
            (self.log)(&format!("{}: repeat {repeat}", self.name));
            let mut order: Vec<(usize, Build)> = kept.iter().copied().enumerate().collect();
            order.sort_by_key(|&(i, _)| random::bits(u64::from(repeat), i as u64));
            rows.extend(order.into_iter().map(|(_, build)| self.build(build, repeat).0));
        }
        Ok(rows)
    }

    /// Builds by scattering what the thesis built, untimed, and compares all lists.
    fn compare(&self, build: Build, thesis: &ThesisGrid) -> Result<(), GridBenchError> {
        for builder in [SCATTER, SURFACE] {
            let lists = self.lists(Build { builder, ..build });
            if let Some(how) = lists.disagreement(thesis) {
                let (scene, lights) = (self.name.to_owned(), self.lights[build.lights].len());
                return Err(GridBenchError::Differ { scene, lights, cells: build.cells, builder, how });
            }
        }
        Ok(())
    }

    /// All builds, by the number of tests that the thesis' needs.
    fn builds(&self) -> Vec<Build> {
        let pairs = (0..self.lights.len()).flat_map(|l| self.options.cells.iter().map(move |&c| (l, c)));
        let mut builds: Vec<Build> = pairs
            .flat_map(|(lights, cells)| BUILDERS.map(|builder| Build { builder, lights, cells }))
            .collect();
        builds.sort_by_key(|&build| self.tests(build));
        builds
    }

    /// Pairs of a cell and a light.
    fn tests(&self, build: Build) -> u64 {
        u64::from(build.cells).pow(3) * self.lights[build.lights].len() as u64
    }

    /// Seconds that the thesis' build would take at the speed of the largest one so far; 0 without any.
    fn expected(&self, rows: &[Row], build: Build) -> f64 {
        let tests = |row: &Row| row.cells * row.lights;
        let built = rows.iter().filter(|row| row.builder == THESIS && row.scene == self.name);
        let largest = built.max_by_key(|row| tests(row));
        largest.map_or(0.0, |row| row.seconds * self.tests(build) as f64 / tests(row) as f64)
    }

    fn describe(&self, build: Build) -> String {
        let lights = self.lights[build.lights].len();
        format!("{} with {lights} lights and {} cells along each axis", build.builder, build.cells)
    }

    fn build(&self, build: Build, repeat: u32) -> (Row, Built) {
        let start = Instant::now();
        let grid = if build.builder == THESIS {
            Built::Padded(self.padded(build))
        } else {
            Built::Compact(self.lists(build))
        };
        let seconds = start.elapsed().as_secs_f64();
        let row = Row {
            scene: self.name.to_owned(),
            triangles: self.scene.triangles.len() as u64,
            lights: self.lights[build.lights].len() as u64,
            cells_per_axis: build.cells,
            range: self.options.range,
            builder: build.builder.to_owned(),
            repeat,
            seconds,
            cells: u64::from(build.cells).pow(3),
            threads: rayon::current_num_threads() as u32,
            device: processor(),
            ..Row::default()
        };
        let row = match &grid {
            Built::Padded(grid) => Row {
                tests: self.tests(build),
                stored_cells: row.cells,
                entries: grid.entries(),
                dropped: grid.overflow.dropped,
                bytes: grid.bytes(),
                ..row
            },
            Built::Compact(lists) => Row {
                tests: lists.tests,
                stored_cells: lists.cells.len() as u64,
                entries: lists.entries.len() as u64,
                dropped: lists.dropped,
                bytes: lists.bytes(),
                ..row
            },
        };
        (row, grid)
    }

    fn lattice(&self, cells: u32) -> Lattice {
        let [low, high] = self.scene.bounds().unwrap_or_default().map(|p| p.as_vec3());
        Lattice::over(low, high, cells)
    }

    fn padded(&self, build: Build) -> ThesisGrid {
        let (range, list) = (self.options.range, self.options.list);
        let [low, high] = self.scene.bounds().unwrap_or_default().map(|p| p.as_vec3());
        let options = ThesisOptions { range, list, grid: build.cells };
        ThesisGrid::build(&self.lights[build.lights], low, high, &options)
    }

    fn lists(&self, build: Build) -> LightLists {
        let lattice = self.lattice(build.cells);
        let lights = ActiveHemisphere::of_all(&self.lights[build.lights], self.options.range);
        let cells = if build.builder == SURFACE {
            StoredCells::with_surface(lattice, self.scene)
        } else {
            StoredCells::all(lattice)
        };
        scatter(&lights, &cells, self.options.list)
    }
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
    fn every_grid_is_built_by_all_in_every_repeat() {
        let rows = rows(&options());
        assert_eq!(rows.len(), 2 * 2 * 3 * 2);
        for builder in BUILDERS {
            assert_eq!(rows.iter().filter(|row| row.builder == builder).count(), 8);
        }
        // Counts do not depend on the repeat.
        for row in &rows {
            let same = |other: &&Row| {
                (&other.builder, other.lights, other.cells_per_axis)
                    == (&row.builder, row.lights, row.cells_per_axis)
            };
            let alike = |other: &&Row| (other.entries, other.tests) == (row.entries, row.tests);
            assert_eq!(rows.iter().filter(same).filter(alike).count(), 2);
        }
    }

    #[test]
    fn scattering_tests_less_and_finds_the_same() {
        // In one repeat, all builders take the grids in the same order.
        let rows = rows(&GridOptions { list: 1_000, repeats: 1, ..options() });
        let of = |builder: &str| rows.iter().filter(|row| row.builder == builder).collect::<Vec<_>>();
        for ((thesis, scatter), surface) in of(THESIS).into_iter().zip(of(SCATTER)).zip(of(SURFACE)) {
            assert_eq!((thesis.lights, thesis.cells), (scatter.lights, scatter.cells));
            assert_eq!(thesis.tests, thesis.lights * thesis.cells);
            assert_eq!((thesis.dropped, thesis.entries), (0, scatter.entries));
            assert!(surface.tests == scatter.tests && scatter.tests < thesis.tests);
            // Four cells along an axis leave none without surface.
            let fewer = surface.stored_cells < scatter.stored_cells && surface.entries < scatter.entries;
            assert_eq!(fewer, surface.cells_per_axis == 8);
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
    fn what_would_take_too_long_is_left_out() {
        // Whatever the machine: nothing is as fast as that, but the first build, of which nothing is known, is always done.
        let rows = rows(&GridOptions { limit: 1e-12, ..options() });
        assert_eq!(rows.iter().filter(|row| row.builder == THESIS).count(), 2);
        assert_eq!(rows.iter().filter(|row| row.builder == SCATTER).count(), 8);
    }

    #[test]
    fn an_unknown_scene_is_named() {
        let wrong = GridOptions { scenes: vec!["nowhere".to_owned()], ..options() };
        let message = measure(&wrong, &|_| ()).unwrap_err().to_string();
        assert!(message.contains("`nowhere`"), "{message}");
    }
}
