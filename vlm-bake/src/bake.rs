//! The bake, stage by stage.

use std::collections::BTreeMap;
use std::time::Instant;

use glam::Vec3A;
use vlm_format::{Grid, VlmAsset};

use crate::authored;
use crate::bvh::nearest::closest_point;
use crate::correspondence::{Correspondence, Light, points_of_lights};
use crate::decimate::{Decimation, LightMesh, decimate};
use crate::flux::{conserve, steer};
use crate::grid::{GridInput, GridOptions, Pieces, StandIns, grid};
use crate::ground::Ground;
use crate::memory::{self, Last, Memory};
use crate::mend::{Hidden, mend, thinned};
use crate::offset::Surroundings;
use crate::options::BakeOptions;
use crate::patches::{Patches, patches};
use crate::progress::Progress;
use crate::prove::{accusations, prove};
use crate::refine::{Refiner, Snap};
use crate::refusal;
use crate::render::world_lights;
use crate::report::{AreaReport, DecimationReport, GridReport, OffsetReport, Report};
use crate::samples::{BakedLight, Sources, samples};
use crate::scene::Scene;
use crate::shade::TraceScene;
use crate::slivers::MAX_ASPECT;
use crate::surface::SurfacePoint;
use crate::tag::Tags;
use crate::topology::{Lists, area, aspect_ratio};
use crate::verify::Verification;
use crate::write::{order, placeable};

pub use crate::refusal::BakeError;

/// Lights sink by at most this many times the clearance and the mean distance between faces and their surface together. Higher values
/// hide more lights behind bumpy surface instead of shrinking them, and put all of them deeper there, where they fit their surface less.
const DEEPEST_OF_MEAN: f64 = 16.0;

/// Likewise, times the simplifier's error, on top of [`DEEPEST_OF_CLEARANCE`]: their mean depth is then below 1.5 times the error and the
/// clearance.
const DEEPEST_OF_ERROR: f64 = 1.05;

/// Times the clearance: twice what a corner of three walls needs.
const DEEPEST_OF_CLEARANCE: f64 = 4.0;

/// An asset and how it came about.
#[derive(Clone, Debug, Default)]
pub struct Bake {
    /// To be written by [`vlm_format`].
    pub asset: VlmAsset,
    /// Which light stands for which surface.
    pub stand_ins: StandIns,
    /// To be shown to the user.
    pub report: Report,
}

/// Bakes the Virtual Light Meshes of a scene. The result depends on the scene and the options alone, not on the number of
/// threads.
///
/// # Errors
/// [`BakeError::NothingReflects`] if no surface makes lights and no artist made any; [`BakeError::NothingLeft`] if the
/// budget leaves none; [`BakeError::Cancelled`] soon after `progress` is.
pub fn bake(scene: &Scene, options: &BakeOptions, progress: &dyn Progress) -> Result<Bake, BakeError> {
    rebake(scene, options, &mut Memory::default(), progress)
}

/// Bakes as [`bake()`] does, to the same bytes, but uses what `memory` holds of the last bake wherever nothing changed on which it depends: a
/// new colour moves no light and traces no ray. [`Report::reused`] tells which stages did not run.
///
/// # Errors
/// As [`bake()`]; the memory then holds the stages that were finished.
pub fn rebake(
    scene: &Scene,
    options: &BakeOptions,
    memory: &mut Memory,
    progress: &dyn Progress,
) -> Result<Bake, BakeError> {
    let mut clock = Clock::new(progress);

    clock.stage("patches")?;
    let surfaces = scene.triangle_surfaces();
    let patches = patches(scene, &surfaces, options.lights);
    if patches.triangles.is_empty() && scene.authored.is_empty() {
        return Err(BakeError::NothingReflects);
    }
    let ground = Ground::new(scene, &patches);
    let points = ground.points_of(options.lights as usize, options.least_points);

    let shape = memory::of_shape(scene, &patches, options);
    let mend = || mended(scene, options, &ground, &points, &mut clock);
    let (mended, is_known) = memory.mended.get_or_try(shape, mend)?;
    clock.reused(if is_known { &["decimate", "mend"] } else { &[] });
    let hidden = &mended.hidden;

    clock.stage("samples")?;
    let lights = &hidden.lights;
    let accused = accusations(&patches, lights, &hidden.violations);
    let standing = points_of_lights(&hidden.light_of_point, lights.len());
    let sources = Sources {
        scene,
        patches: &patches,
        group: &hidden.coarse,
        rest_areas: &hidden.rest_areas,
        accused: &accused,
        points: &points,
        standing: &standing,
    };
    let mut baked = samples(&sources, lights, options.samples);
    let flux = conserve(scene, &patches, &surfaces, &points, &mut baked);
    steer(scene, &mut baked);

    clock.stage("authored")?;
    authored::merge(scene, &mut baked, options, ground.clearance);
    let authored_before = authored_lights(&baked);
    baked.retain(|light| placeable(scene, light));
    let authored_dropped = authored_before - authored_lights(&baked);
    order(&mut baked);
    if baked.is_empty() {
        return Err(refusal::nothing_left(&ground, lights.len(), options));
    }

    clock.stage("tag")?;
    let (mut asset, tags, proof) = prove(scene, &mut baked, options, &ground, points);

    clock.stage("stand-ins")?;
    let uncovered = uncovered(scene, &patches, &proof, &baked);
    let stand_ins = StandIns::new(scene, &ground, &baked, &uncovered);
    let sources = GridSources { baked: &baked, stand_ins: &stand_ins, uncovered: &uncovered };
    asset.grid = static_grid(scene, &asset, &sources, &options.grid, &mut memory.grid, &mut clock)?;
    asset.settings.cell_size = asset.grid.as_ref().map_or(0.0, |grid| grid.cell_size);

    let mut report = Report {
        visible_triangles: scene.triangles.len(),
        asked_lights: options.lights,
        lights: asset.triangles.len(),
        authored_lights: authored_lights(&baked),
        samples: asset.samples.len(),
        decimation: decimation_report(&mended.decimation, mended.distance),
        offset: offset_report(lights, &hidden.depths),
        clearance: proof.report(),
        area: area_report(&proof, &baked, &tags),
        flux,
        tags: tags.reports,
        grid: grid_report(asset.grid.as_ref()),
        notes: notes(scene, authored_dropped),
        ..Report::default()
    };
    report.missed_because = why_missed(&report, options);
    (report.seconds, report.reused) = clock.finish()?;
    Ok(Bake { asset, stand_ins, report })
}

/// Lights in their places, and how far they are from their surface.
#[derive(Clone, Debug)]
pub(crate) struct Mended {
    hidden: Hidden,
    decimation: Decimation,
    distance: Distance,
}

/// The mended lights of the budget. Where the surface falls into so many pieces that none is left within it, of twice the budget and so on,
/// as long as that lets decimation keep more: the report tells that the budget was missed.
fn mended(
    scene: &Scene,
    options: &BakeOptions,
    ground: &Ground,
    points: &[SurfacePoint],
    clock: &mut Clock,
) -> Result<Mended, BakeError> {
    let mut options = options.clone();
    let mut mended = mended_within(scene, &options, ground, points, clock)?;
    if !mended.hidden.lights.is_empty() || refusal::no_room(ground).is_some() {
        return Ok(mended);
    }
    // Once some are left, most pieces still have none.
    while 2 * mended.hidden.lights.len() < options.lights as usize
        && (options.lights as usize) < 2 * ground.patches.triangles.len()
    {
        options.lights = options.lights.saturating_mul(2);
        mended = mended_within(scene, &options, ground, points, clock)?;
    }
    Ok(mended)
}

/// Decimates the surface to the budget, and hides the lights behind it.
fn mended_within(
    scene: &Scene,
    options: &BakeOptions,
    ground: &Ground,
    points: &[SurfacePoint],
    clock: &mut Clock,
) -> Result<Mended, BakeError> {
    clock.stage("decimate")?;
    let patches = ground.patches;
    let (mesh, decimation) = decimate(patches, options);

    clock.stage("mend")?;
    let coarse = mesh.lights();
    let fewer = thinned(points, coarse.len());
    let light_of_point = Correspondence::new(ground, &coarse, |_| true).of(&fewer);
    let distance = measured_distance(&fewer, &light_of_point, &coarse);
    let deepest = deepest(ground.clearance, distance.mean_m, decimation.error_m);
    let around = Surroundings { ground, deepest, progress: clock.progress };
    let snap = Snap::new(patches);
    let density = densities(scene, patches, &mesh, &points_of_lights(&light_of_point, coarse.len()));
    let budget = (options.lights as usize).saturating_sub(authored::count(scene));
    let hidden = mend(scene, Refiner::new(mesh, density, &snap), budget, &around, points);
    clock.go_on()?;
    Ok(Mended { hidden, decimation, distance })
}

/// Surface for which no light stands, in pieces about as large as the surface around a sample.
fn uncovered(scene: &Scene, patches: &Patches, proof: &Verification, baked: &[BakedLight]) -> Pieces {
    let points = proof.points.iter().zip(&proof.light_of_point);
    let points = points.filter(|(_, light)| light.is_none()).map(|(point, _)| point);
    let area: f64 = baked.iter().map(|l| area(l.corners)).sum();
    let samples: usize = baked.iter().map(|l| l.samples.len()).sum();
    Pieces::new(scene, patches, points, area / samples.max(1) as f64)
}

/// What shines in a grid.
struct GridSources<'a> {
    baked: &'a [BakedLight],
    stand_ins: &'a StandIns,
    uncovered: &'a Pieces,
}

/// The static grid over an asset's lights.
fn static_grid(
    scene: &Scene,
    asset: &VlmAsset,
    &GridSources { baked, stand_ins, uncovered }: &GridSources,
    options: &GridOptions,
    memory: &mut Last<Option<Grid>>,
    clock: &mut Clock,
) -> Result<Option<Grid>, BakeError> {
    let Ok(lights) = world_lights(scene, asset) else { return Ok(None) };
    let trace = TraceScene::new(scene);
    let area_gains: Vec<f32> = baked.iter().map(BakedLight::area_gain).collect();
    let shares: Vec<f32> = baked.iter().flat_map(|l| &l.samples).map(|s| s.share).collect();
    let light_of_sample: Vec<u32> =
        baked.iter().zip(0..).flat_map(|(light, number)| light.samples.iter().map(move |_| number)).collect();
    let made: Vec<u32> = baked.iter().zip(0..).filter(|(light, _)| light.authored).map(|(_, l)| l).collect();
    let input = GridInput {
        made: &made,
        uncovered: &uncovered.pieces,
        trace: &trace,
        stand_ins,
        lights: &lights,
        light_of_sample: &light_of_sample,
        area_gains: &area_gains,
        shares: &shares,
    };
    let make = || {
        clock.stage("grid")?;
        let grid = grid(&input, options, clock.progress);
        clock.go_on()?;
        Ok(grid)
    };
    let (grid, is_known) = memory.get_or_try(memory::of_grid(&input, options), make)?;
    clock.reused(if is_known { &["grid"] } else { &[] });
    Ok(grid.clone().map(|grid| Grid {
        surface_gains: baked.iter().map(BakedLight::surface_gain).collect(),
        uncovered: uncovered.pieces.clone(),
        ..grid
    }))
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

/// The distances of points from the faces that stand for them.
fn measured_distance(points: &[SurfacePoint], light_of_point: &[Option<u32>], faces: &[Light]) -> Distance {
    let distance = |(point, face): (&SurfacePoint, &Option<u32>)| {
        let corners = faces[(*face)? as usize].corners.map(|v| (v - point.position).as_vec3a());
        Some((point.area, f64::from(closest_point(&corners, Vec3A::ZERO).length())))
    };
    let mut all: Vec<(f64, f64)> = points.iter().zip(light_of_point).filter_map(distance).collect();
    all.sort_unstable_by(|a, b| a.1.total_cmp(&b.1));
    let area: f64 = all.iter().map(|(area, _)| area).sum();
    let mean_m = all.iter().map(|(area, d)| area * d).sum::<f64>() / area.max(f64::MIN_POSITIVE);
    let mut below = 0.0;
    let p99 = all.iter().find(|(area_of, _)| {
        below += area_of;
        below >= 0.99 * area
    });
    Distance { mean_m, p99_m: p99.map_or(0.0, |(_, d)| *d) }
}

/// No light sinks farther than this, metres.
fn deepest(clearance: f64, mean: f64, error: f64) -> f64 {
    let of_mean = DEEPEST_OF_MEAN * (clearance + mean);
    of_mean.min(DEEPEST_OF_ERROR * error + DEEPEST_OF_CLEARANCE * clearance)
}

/// The artist's density per face; 0 where a face stands for nothing, or where the offset made it too thin to be a light.
fn densities(scene: &Scene, patches: &Patches, mesh: &LightMesh, standing: &Lists) -> Vec<f64> {
    let density = |(f, face): (usize, &crate::decimate::Face)| {
        let primitive = &scene.primitives[patches.regions[face.region as usize].primitive as usize];
        let asked = f64::from(scene.objects[primitive.object as usize].steering.density);
        let too_thin = aspect_ratio(mesh.corners(f)) > MAX_ASPECT;
        if standing.of(f).is_empty() || too_thin { 0.0 } else { asked }
    };
    mesh.faces.iter().enumerate().map(density).collect()
}

/// How far decimated faces lie from their surface.
#[derive(Clone, Copy, Debug)]
struct Distance {
    mean_m: f64,
    p99_m: f64,
}

fn decimation_report(decimation: &Decimation, distance: Distance) -> DecimationReport {
    let Decimation { asked, reached, error_m } = *decimation;
    DecimationReport { asked, reached, error_m, mean_m: distance.mean_m, p99_m: distance.p99_m }
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

fn area_report(proof: &Verification, lights: &[BakedLight], tags: &Tags) -> AreaReport {
    let Verification { points, light_of_point, .. } = proof;
    let of = |l: &BakedLight| area(l.corners);
    let uncovered = points.iter().zip(light_of_point).filter(|(_, light)| light.is_none());
    AreaReport {
        visible_m2: points.iter().map(|p| p.area).sum(),
        uncovered_m2: uncovered.map(|(p, _)| p.area).sum(),
        lights_m2: lights.iter().map(of).sum(),
        tagged_m2: lights.iter().filter(|l| l.tag != 0).map(of).sum(),
        covered_by_tags_m2: tags.reports.iter().map(|r| r.covers_m2).sum(),
    }
}

fn grid_report(grid: Option<&Grid>) -> GridReport {
    grid.map_or_else(GridReport::default, |g| GridReport {
        leaves: g.leaves.len().saturating_sub(1),
        probes: g.probes.len(),
        near_entries: g.near.len(),
        far_entries: g.row_starts.get(g.probes.len()).map_or(0, |&end| end as usize),
        bytes: g.byte_len(),
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
    reused: Vec<&'static str>,
}

impl<'a> Clock<'a> {
    fn new(progress: &'a dyn Progress) -> Self {
        Self { progress, running: None, seconds: BTreeMap::new(), reused: Vec::new() }
    }

    fn stage(&mut self, name: &'static str) -> Result<(), BakeError> {
        self.stop()?;
        self.progress.begin(name, 1);
        self.running = Some((name, Instant::now()));
        self.go_on()
    }

    /// What a cancelled stage leaves is not whole, so nothing may look at it.
    fn go_on(&self) -> Result<(), BakeError> {
        if self.progress.is_cancelled() { Err(BakeError::Cancelled) } else { Ok(()) }
    }

    fn stop(&mut self) -> Result<(), BakeError> {
        self.go_on()?;
        if let Some((name, start)) = self.running.take() {
            self.progress.advance(1);
            *self.seconds.entry(name).or_default() += start.elapsed().as_secs_f64();
        }
        Ok(())
    }

    /// Notes stages that had nothing to do.
    fn reused(&mut self, stages: &[&'static str]) {
        self.reused.extend(stages);
    }

    /// Seconds per stage, and the stages that had nothing to do.
    fn finish(mut self) -> Result<(BTreeMap<&'static str, f64>, Vec<&'static str>), BakeError> {
        self.stop()?;
        Ok((self.seconds, self.reused))
    }
}
