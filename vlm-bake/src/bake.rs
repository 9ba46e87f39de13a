//! The bake, stage by stage.

use std::collections::BTreeMap;
use std::time::Instant;

use glam::DVec3;
use vlm_format::{Grid, VlmAsset};

use crate::authored;
use crate::clearance::required_clearance;
use crate::decimate::{Decimation, LightMesh, decimate};
use crate::grid::grid;
use crate::offset::offset;
use crate::options::BakeOptions;
use crate::patches::{Patches, patches};
use crate::progress::Progress;
use crate::refine::refine;
use crate::report::{AreaReport, DecimationReport, GridReport, OffsetReport, Report};
use crate::samples::{BakedLight, Sources, samples};
use crate::scene::Scene;
use crate::signed_distance::IslandDistance;
use crate::surface::{Standing, SurfacePoint, spread_points, stand_ins};
use crate::tag::{Tags, tag};
use crate::verify::{ClearanceReport, Violation, verify};
use crate::write::{assemble, order, placeable};

/// A face stands for surface at most this share of the scene's extent away, on top of four times the decimation's error.
const REACH_SHARE: f64 = 0.02;

/// The least number of surface points of a bake: small budgets are tested as finely as medium ones.
const LEAST_POINTS: usize = 20_000;

/// An asset and how it came about.
#[derive(Clone, Debug, Default)]
pub struct Bake {
    /// To be written by [`vlm_format`].
    pub asset: VlmAsset,
    /// To be shown to the user.
    pub report: Report,
}

/// Why nothing could be baked.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BakeError {
    /// No surface reflects or emits.
    #[error(
        "no surface reflects or emits light, so there is nothing to bake: every material is black, blended or transmissive, or \
         every object is excluded by `extras.vlm`. Give at least one surface an opaque material that is not black"
    )]
    NothingReflects,
}

/// Bakes the Virtual Light Meshes of a scene. The result depends on the scene and the options alone, not on the number of
/// threads.
///
/// # Errors
/// [`BakeError::NothingReflects`] if no surface makes lights and no artist made any.
pub fn bake(scene: &Scene, options: &BakeOptions, progress: &dyn Progress) -> Result<Bake, BakeError> {
    let mut clock = Clock::new(progress);

    clock.stage("patches");
    let surfaces = scene.triangle_surfaces();
    let patches = patches(scene, &surfaces, options.lights);
    if patches.triangles.is_empty() && scene.authored.is_empty() {
        return Err(BakeError::NothingReflects);
    }

    clock.stage("decimate");
    let (mut mesh, decimation) = decimate(&patches, options);

    clock.stage("offset");
    let clearance = required_clearance(scene.bounds().unwrap_or_default());
    let points = spread_points(&patches, point_count(options));
    let stand_ins = stand_ins(&points, &patches, &mesh, reach(scene, &decimation));
    let standing = Standing::new(&stand_ins, mesh.faces.len());
    let distance = IslandDistance::new(&patches);
    let moved = offset(&mut mesh, &patches, &points, &standing, &distance, clearance);

    clock.stage("verify");
    let violations = verify(&mesh, &patches, &points, &standing, &distance, clearance);

    clock.stage("tag");
    let mut tags = tag(scene, &patches, &mesh, &violations);

    clock.stage("refine");
    let density = densities(scene, &patches, &mesh, &standing);
    let authored_count = authored::count(scene);
    let lights = refine(&mesh, &density, (options.lights as usize).saturating_sub(authored_count));

    clock.stage("samples");
    let sources = Sources {
        scene,
        patches: &patches,
        mesh: &mesh,
        tags: &tags.faces,
        points: &points,
        standing: &standing,
    };
    let mut lights = samples(&sources, &lights, options.samples);

    clock.stage("authored");
    let authored_check = authored::merge(scene, &mut lights, &mut tags, options, clearance);

    clock.stage("grid");
    lights.retain(|light| placeable(scene, light));
    order(&mut lights);
    let corners: Vec<[DVec3; 3]> = lights.iter().map(|l| l.corners).collect();
    let grid = grid(scene, &corners, options.cell_size, options.range);

    clock.stage("assemble");
    let mut report = Report {
        visible_triangles: scene.triangles.len(),
        asked_lights: options.lights,
        decimation: decimation.into(),
        offset: offset_report(&mesh, &moved.vertex_moved),
        clearance: ClearanceReport {
            samples: points.len() as u64 + authored_check.samples,
            required_m: clearance,
            ..remaining(scene, &patches, &mesh, &violations, &tags)
        },
        tags: tags.report(),
        area: area_report(&points, &stand_ins, &lights),
        grid: grid_report(grid.as_ref()),
        notes: scene.notes.clone(),
        ..Report::default()
    };
    let asset = assemble(scene, &lights, &tags, grid, options);
    report.lights = asset.triangles.len();
    report.authored_lights = lights.iter().filter(|l| l.authored).count();
    report.samples = asset.samples.len();
    report.missed_because = why_missed(&report, options);
    report.seconds = clock.finish();
    Ok(Bake { asset, report })
}

/// The violations that no tag mends: a receiver ignores a light of its own tag.
fn remaining(
    scene: &Scene,
    patches: &Patches,
    mesh: &LightMesh,
    violations: &[Violation],
    tags: &Tags,
) -> ClearanceReport {
    let mut report = ClearanceReport::default();
    for violation in violations {
        let primitive = patches.regions[mesh.faces[violation.face as usize].region as usize].primitive;
        let tag = tags.faces[violation.face as usize];
        if tag == 0 || tag != tags.of_primitive(scene, primitive) {
            report.violations += u64::from(violation.points) + u64::from(violation.pokes_out);
            report.worst_m = report.worst_m.max(violation.depth);
        }
    }
    report
}

fn point_count(options: &BakeOptions) -> usize {
    (options.lights as usize * options.tests_per_light as usize).max(LEAST_POINTS)
}

/// How far from the surface the face that stands for it may lie, metres.
fn reach(scene: &Scene, decimation: &Decimation) -> f64 {
    let extent = scene.bounds().map_or(0.0, |[low, high]| (high - low).max_element());
    REACH_SHARE * extent + 4.0 * decimation.error_m
}

/// The artist's density per face; 0 where a face stands for nothing.
fn densities(scene: &Scene, patches: &Patches, mesh: &LightMesh, standing: &Standing) -> Vec<f64> {
    let density = |(f, face): (usize, &crate::decimate::Face)| {
        let primitive = &scene.primitives[patches.regions[face.region as usize].primitive as usize];
        let asked = f64::from(scene.objects[primitive.object as usize].steering.density);
        if standing.of(f).is_empty() { 0.0 } else { asked }
    };
    mesh.faces.iter().enumerate().map(density).collect()
}

impl From<Decimation> for DecimationReport {
    fn from(decimation: Decimation) -> Self {
        Self { asked: decimation.asked, reached: decimation.reached, error_m: decimation.error_m }
    }
}

fn offset_report(mesh: &LightMesh, moved: &[f64]) -> OffsetReport {
    let mut used: Vec<u32> = mesh.faces.iter().flat_map(|f| f.vertices).collect();
    used.sort_unstable();
    used.dedup();
    let of = |v: &u32| moved[*v as usize];
    let mean_m = used.iter().map(of).sum::<f64>() / used.len().max(1) as f64;
    OffsetReport { mean_m, max_m: used.iter().map(of).fold(0.0, f64::max) }
}

fn area_report(points: &[SurfacePoint], stand_ins: &[Option<u32>], lights: &[BakedLight]) -> AreaReport {
    let of = |l: &BakedLight| 0.5 * crate::topology::cross_of(l.corners).length();
    let uncovered = points.iter().zip(stand_ins).filter(|(_, face)| face.is_none());
    AreaReport {
        visible_m2: points.iter().map(|p| p.area).sum(),
        uncovered_m2: uncovered.map(|(p, _)| p.area).sum(),
        lights_m2: lights.iter().map(of).sum(),
        tagged_m2: lights.iter().filter(|l| l.tag != 0).map(of).sum(),
    }
}

fn grid_report(grid: Option<&Grid>) -> GridReport {
    grid.map_or_else(GridReport::default, |g| GridReport {
        cells: g.dimensions.iter().map(|&d| u64::from(d)).product(),
        stored_cells: g.cells.len(),
        entries: g.entries.len(),
        bytes: 4 * (g.cells.len() + g.starts.len() + g.entries.len()),
    })
}

/// A sentence for the user where the budget was missed by more than 5 %.
fn why_missed(report: &Report, options: &BakeOptions) -> String {
    let asked = f64::from(options.lights);
    let missed = (report.lights as f64 - asked) / asked.max(1.0);
    if missed.abs() <= 0.05 {
        String::new()
    } else if missed < 0.0 {
        "some faces are too thin to be lights or stand for no visible surface, and were dropped".to_owned()
    } else if report.authored_lights as f64 > asked {
        "the authored meshes alone hold more lights than asked".to_owned()
    } else {
        format!(
            "the surface could not be decimated below {} faces: it falls into too many separate pieces, borders of colour or \
             folds; join pieces that touch, or ask for more lights",
            report.decimation.reached
        )
    }
}

/// Takes the time of the stages and announces them.
struct Clock<'a> {
    progress: &'a dyn Progress,
    running: Option<(&'static str, Instant)>,
    seconds: BTreeMap<&'static str, f64>,
}

impl<'a> Clock<'a> {
    fn new(progress: &'a dyn Progress) -> Self {
        Self { progress, running: None, seconds: BTreeMap::new() }
    }

    fn stage(&mut self, name: &'static str) {
        self.stop();
        self.progress.begin(name, 1);
        self.running = Some((name, Instant::now()));
    }

    fn stop(&mut self) {
        if let Some((name, start)) = self.running.take() {
            self.progress.advance(1);
            self.seconds.insert(name, start.elapsed().as_secs_f64());
        }
    }

    fn finish(mut self) -> BTreeMap<&'static str, f64> {
        self.stop();
        self.seconds
    }
}
