//! The bake, stage by stage.

use std::collections::BTreeMap;
use std::time::Instant;

use glam::DVec3;
use vlm_format::{Grid, VlmAsset};

use crate::authored;
use crate::clearance::required_clearance;
use crate::correspondence::{Correspondence, Light, Standing};
use crate::decimate::{Decimation, LightMesh, decimate};
use crate::grid::grid;
use crate::mend::mend;
use crate::offset::Surroundings;
use crate::options::BakeOptions;
use crate::patches::{Patches, patches};
use crate::progress::Progress;
use crate::refine::{Refiner, Snap};
use crate::report::{AreaReport, DecimationReport, GridReport, OffsetReport, Report};
use crate::samples::{BakedLight, Sources, samples};
use crate::scene::Scene;
use crate::signed_distance::IslandDistance;
use crate::slivers::MAX_ASPECT;
use crate::surface::{SurfacePoint, feature_points, spread_points};
use crate::tag::{Tags, tag};
use crate::topology::aspect_ratio;
use crate::verify::{ClearanceReport, Evidence, Violation, verify};
use crate::way_out::WayOut;
use crate::write::{assemble, order, placeable};

/// A face stands for surface at most this share of the scene's extent away, on top of four times the decimation's error.
const REACH_SHARE: f64 = 0.02;

/// Lights sink by at most this many times the clearance and the mean distance between faces and their surface together. Higher values
/// hide more lights behind bumpy surface instead of tagging them, and put all of them deeper there, where they fit their surface less.
const DEEPEST: f64 = 4.0;

/// The least number of surface points by which lights are placed: small budgets are as fine as medium ones.
const LEAST_POINTS: usize = 20_000;

/// The least number of area-uniform points of the final check.
const LEAST_CHECK_POINTS: usize = 200_000;

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
    /// The budget is too small for any light to be left.
    #[error(
        "no light is left of the {asked} asked for: the surface falls into pieces too small for them. Ask for more lights"
    )]
    NothingLeft {
        /// The budget.
        asked: u32,
    },
}

/// Bakes the Virtual Light Meshes of a scene. The result depends on the scene and the options alone, not on the number of
/// threads.
///
/// # Errors
/// [`BakeError::NothingReflects`] if no surface makes lights and no artist made any; [`BakeError::NothingLeft`] if the
/// budget leaves none.
pub fn bake(scene: &Scene, options: &BakeOptions, progress: &dyn Progress) -> Result<Bake, BakeError> {
    let mut clock = Clock::new(progress);

    clock.stage("patches");
    let surfaces = scene.triangle_surfaces();
    let patches = patches(scene, &surfaces, options.lights);
    if patches.triangles.is_empty() && scene.authored.is_empty() {
        return Err(BakeError::NothingReflects);
    }

    clock.stage("decimate");
    #[allow(clippy::clone_on_copy)]
    let (mesh, decimation) = decimate(&patches, options);

    clock.stage("mend");
    let clearance = required_clearance(scene.bounds().unwrap_or_default());
    let reach = reach(scene, &decimation);
    let points = spread_points(&patches, point_count(options));
    let points = check_points(&patches, points, options);
    let distance = IslandDistance::new(&patches);
    let way_out = WayOut::new(scene, &patches);
    let coarse = mesh.lights();
    let light_of_point = Correspondence::new(&patches, &coarse, reach, |_| true).of(&points);
    let deepest = std::env::var("DEEP").ok().and_then(|d| d.parse().ok()).unwrap_or(DEEPEST) * (clearance + mean_distance(&points, &light_of_point, &coarse));
    let around =
        Surroundings { patches: &patches, points: &points, clearance, reach, deepest, way_out: &way_out };
    let snap = Snap::new(&patches);
    let density = densities(scene, &patches, &mesh, &Standing::new(&light_of_point, coarse.len()));
    let budget = (options.lights as usize).saturating_sub(authored::count(scene));
    let hidden = mend(Refiner::new(mesh, density, &snap), budget, &around, &distance);
    let lights = hidden.lights;

    clock.stage("verify");
    let light_of_point = Correspondence::new(&patches, &lights, reach, |_| true).of(&points);
    let standing = Standing::new(&light_of_point, lights.len());
    let evidence = Evidence {
        patches: &patches,
        points: &points,
        standing: &standing,
        distance: &distance,
        way_out: &way_out,
        clearance,
    };
    let violations = verify(&lights, &evidence);
    if std::env::var("DBG").is_ok() {
        eprintln!("regions {} islands {} triangles {} decimation {decimation:?} mean distance {:.4}", patches.regions.len(), patches.islands, patches.triangles.len(), mean_distance(&points, &light_of_point, &lights));
        let total: f64 = lights.iter().map(Light::area).sum();
        let mut by: BTreeMap<[bool; 3], (u32, f64, Vec<f64>)> = BTreeMap::new();
        for v in &violations {
            let e = by.entry(v.dbg).or_default();
            e.0 += 1; e.1 += lights[v.light as usize].area()/total*100.0; e.2.push(v.depth/clearance);
        }
        for (k, (n, a, mut d)) in by { d.sort_by(f64::total_cmp); eprintln!("lit,between,beside={k:?} n={n} area={a:.2}% depth/c p10 {:.2} p50 {:.2} p90 {:.2}; deepest/c {:.1}", d[d.len()/10], d[d.len()/2], d[d.len()*9/10], deepest/clearance); }
        for v in violations.iter().take(3) { let l=&lights[v.light as usize]; eprintln!("{v:?}\n   {:?} n {:?} aspect {:.1} len/c {:.1}", l.corners, l.normal(), aspect_ratio(l.corners), l.corners[0].distance(l.corners[1])/clearance); }
    }

    clock.stage("tag");
    let mut tags = tag(scene, &patches, &lights, &violations);
    let clearance_report = remaining(scene, &evidence, &lights, &violations, &tags);

    clock.stage("samples");
    let light_tags = tags.lights.clone();
    let sources = Sources {
        scene,
        patches: &patches,
        group: &hidden.coarse,
        tags: &light_tags,
        points: &points,
        standing: &standing,
    };
    let offset = offset_report(&lights, &hidden.depths);
    let mut lights = samples(&sources, &lights, options.samples);

    clock.stage("authored");
    let authored_check = authored::merge(scene, &mut lights, &mut tags, options, clearance);

    clock.stage("grid");
    let authored_before = authored_lights(&lights);
    lights.retain(|light| placeable(scene, light));
    let authored_dropped = authored_before - authored_lights(&lights);
    order(&mut lights);
    if lights.is_empty() {
        return Err(BakeError::NothingLeft { asked: options.lights });
    }
    let corners: Vec<[DVec3; 3]> = lights.iter().map(|l| l.corners).collect();
    let grid = grid(scene, &corners, options.cell_size, options.range);

    clock.stage("assemble");
    let mut report = Report {
        visible_triangles: scene.triangles.len(),
        asked_lights: options.lights,
        decimation: decimation.into(),
        offset,
        clearance: ClearanceReport {
            samples: points.len() as u64 + authored_check.samples,
            required_m: clearance,
            ..clearance_report
        },
        tags: tags.report(),
        area: area_report(&points, &light_of_point, &lights),
        grid: grid_report(grid.as_ref()),
        notes: notes(scene, authored_dropped),
        ..Report::default()
    };
    let asset = assemble(scene, &lights, &tags, grid, options);
    report.lights = asset.triangles.len();
    report.authored_lights = authored_lights(&lights);
    report.samples = asset.samples.len();
    report.missed_because = why_missed(&report, options);
    report.seconds = clock.finish();
    Ok(Bake { asset, report })
}

/// The violations that no tag mends: a receiver ignores a light of its own tag.
fn remaining(
    scene: &Scene,
    evidence: &Evidence,
    lights: &[Light],
    violations: &[Violation],
    tags: &Tags,
) -> ClearanceReport {
    let mut report = ClearanceReport::default();
    for violation in violations {
        let region = lights[violation.light as usize].region;
        let primitive = evidence.patches.regions[region as usize].primitive;
        let tag = tags.lights[violation.light as usize];
        if tag == 0 || tag != tags.of_primitive(scene, primitive) {
            report.violations += u64::from(violation.points) + u64::from(violation.pokes_out);
            report.worst_m = report.worst_m.max(violation.depth);
        }
    }
    report
}

fn authored_lights(lights: &[BakedLight]) -> usize {
    lights.iter().filter(|light| light.authored).count()
}

fn notes(scene: &Scene, authored_dropped: usize) -> Vec<String> {
    let mut notes = scene.notes.clone();
    if authored_dropped > 0 {
        notes.push(format!(
            "{authored_dropped} authored lights left out: longer than {MAX_ASPECT} times their height; divide these triangles"
        ));
    }
    notes
}

/// The points of the final check: those of the mending or more, and every vertex and edge.
fn check_points(patches: &Patches, points: Vec<SurfacePoint>, options: &BakeOptions) -> Vec<SurfacePoint> {
    let count = point_count(options).max(LEAST_CHECK_POINTS);
    let mut points = if count > point_count(options) { spread_points(patches, count) } else { points };
    points.extend(feature_points(patches));
    points
}

fn point_count(options: &BakeOptions) -> usize {
    (options.lights as usize * options.tests_per_light as usize).max(LEAST_POINTS)
}

/// How far from the surface the face that stands for it may lie, metres.
fn reach(scene: &Scene, decimation: &Decimation) -> f64 {
    let extent = scene.bounds().map_or(0.0, |[low, high]| (high - low).max_element());
    REACH_SHARE * extent + 4.0 * decimation.error_m
}

/// The mean distance of points from the planes of the lights that stand for them, metres.
fn mean_distance(points: &[SurfacePoint], light_of_point: &[Option<u32>], lights: &[Light]) -> f64 {
    let distance = |(point, light): (&SurfacePoint, &Option<u32>)| {
        let light = &lights[(*light)? as usize];
        Some((point.position - light.corners[0]).dot(light.normal()).abs())
    };
    let (sum, count) = points
        .iter()
        .zip(light_of_point)
        .filter_map(distance)
        .fold((0.0, 0.0), |(sum, n), d| (sum + d, n + 1.0));
    if count > 0.0 { sum / count } else { 0.0 }
}

/// The artist's density per face; 0 where a face stands for nothing, or where the offset made it too thin to be a light.
fn densities(scene: &Scene, patches: &Patches, mesh: &LightMesh, standing: &Standing) -> Vec<f64> {
    let density = |(f, face): (usize, &crate::decimate::Face)| {
        let primitive = &scene.primitives[patches.regions[face.region as usize].primitive as usize];
        let asked = f64::from(scene.objects[primitive.object as usize].steering.density);
        let too_thin = aspect_ratio(mesh.corners(f)) > MAX_ASPECT;
        if standing.of(f).is_empty() || too_thin { 0.0 } else { asked }
    };
    mesh.faces.iter().enumerate().map(density).collect()
}

impl From<Decimation> for DecimationReport {
    fn from(decimation: Decimation) -> Self {
        Self { asked: decimation.asked, reached: decimation.reached, error_m: decimation.error_m }
    }
}

/// The mean is weighted by area: small lights are many, and count little.
fn offset_report(lights: &[Light], depths: &[f64]) -> OffsetReport {
    let area: f64 = lights.iter().map(Light::area).sum();
    let weighed: f64 = lights.iter().zip(depths).map(|(light, depth)| light.area() * depth).sum();
    OffsetReport {
        mean_m: weighed / area.max(f64::MIN_POSITIVE),
        max_m: depths.iter().copied().fold(0.0, f64::max),
    }
}

fn area_report(points: &[SurfacePoint], light_of_point: &[Option<u32>], lights: &[BakedLight]) -> AreaReport {
    let of = |l: &BakedLight| 0.5 * crate::topology::cross_of(l.corners).length();
    let uncovered = points.iter().zip(light_of_point).filter(|(_, light)| light.is_none());
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
