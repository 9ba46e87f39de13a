//! The report of a bake as a page for artists: one HTML file with everything in it.
//!
//! Facts first (`stand_in -> lights, tagged -> correspondence -> facts`), then what is made of them: pictures, tables, places, a
//! verdict, the page. The same bake gives the same page, but for the seconds by stage.

mod lights;
mod tagged;
mod stand_in;
mod correspondence;
mod facts;
mod views;
mod colour;
mod encode;
mod pictures;
mod objects;
mod tag_cost;
mod text;
mod places;
mod summary;
mod legend;
mod tables;
mod page;

use glam::DVec3;
use image::ImageError;

use crate::bake::Bake;
use crate::scene::{Camera, Scene};
use crate::shade::TraceScene;
use correspondence::Correspondence;
use facts::Evidence;
use lights::WorldLights;
use page::{CloseUp, Gallery, Page};
use pictures::Subject;
use places::WorstPlace;
use stand_in::verify_asset;
use tagged::SurfaceTags;

/// Size of the pictures, pixels. Larger ones show smaller lights and take more space.
const PICTURE: [u32; 2] = [480, 360];

/// Size of close-ups, pixels.
const CLOSE_UP: [u32; 2] = [320, 240];

/// A close-up shows this many times the size of the light from bottom to top, and of the clearance at least that many.
const CLOSE_SPAN: [f64; 2] = [4.0, 60.0];

/// What the page is about.
#[derive(Clone, Copy)]
pub struct Subjects<'a> {
    /// Shown as the title, such as the name of the file.
    pub title: &'a str,
    /// What was baked.
    pub scene: &'a Scene,
    /// What came out.
    pub bake: &'a Bake,
    /// Size of all files written, bytes.
    pub file_bytes: u64,
}

/// The page of a bake, as one HTML document without references to other files.
///
/// # Errors
/// If a picture cannot be encoded.
pub fn report_html(subjects: &Subjects) -> Result<String, ImageError> {
    let Subjects { scene, bake, .. } = *subjects;
    let (asset, report) = (&bake.asset, &bake.report);
    let verification = verify_asset(scene, asset);
    let lights = WorldLights::new(scene, asset);
    let mut pokes_out = vec![false; asset.triangles.len()];
    let open = verification.findings.iter().filter(|f| !f.tagged);
    for finding in open.clone().filter(|f| f.kind == stand_in::FindingKind::PokesOut) {
        pokes_out[finding.light as usize] = true;
    }
    let open = open.count();
    let evidence = Evidence {
        scene,
        trace: TraceScene::new(scene),
        asset,
        lights: &lights,
        verification: &verification,
        correspondence: Correspondence::new(scene, &verification, &lights),
        tags: SurfaceTags::new(scene, asset),
        pokes_out,
    };
    let error_end_m = pictures::error_end(&evidence);
    let objects = objects::objects(&evidence, &scene.triangle_surfaces());
    let places = places::worst_places(&evidence, error_end_m);
    let summary = summary::summary(report, open, &objects, &places);
    let galleries: Result<Vec<Gallery>, ImageError> =
        views::cameras(scene).iter().map(|camera| gallery(&evidence, camera, error_end_m)).collect();
    let close_ups: Result<Vec<CloseUp>, ImageError> =
        places.into_iter().map(|place| close_up(&evidence, place)).collect();
    let page = Page {
        title: subjects.title,
        summary: &summary,
        reached: tables::asked_and_reached(report, open, &objects),
        galleries: &galleries?,
        size: PICTURE,
        close_ups: &close_ups?,
        required_m: verification.required_m,
        error_end_m,
        visible_m2: report.area.visible_m2,
        objects: tables::object_table(&objects),
        tags: tables::tag_table(&report.tags, &tag_cost::tag_costs(&evidence)),
        sizes: tables::size_table(asset, subjects.file_bytes),
        times: tables::time_table(&report.seconds),
        notes: &report.notes,
    };
    Ok(page.render())
}

fn gallery(evidence: &Evidence, camera: &Camera, error_end_m: f64) -> Result<Gallery, ImageError> {
    let view = evidence.view(camera, PICTURE[0], PICTURE[1]);
    let draw = |subject| encode::data_uri(&pictures::draw(evidence, &view, camera, subject, error_end_m));
    let pictures: Result<Vec<String>, ImageError> = Subject::ALL.into_iter().map(draw).collect();
    Ok(Gallery { camera: camera.name.clone(), pictures: pictures? })
}

fn close_up(evidence: &Evidence, place: WorstPlace) -> Result<CloseUp, ImageError> {
    let size = place.light.map_or(0.0, |light| evidence.lights.size(light as usize));
    let size = if place.light.is_none() { place.amount.sqrt() } else { size };
    let span = (CLOSE_SPAN[0] * size).max(CLOSE_SPAN[1] * evidence.verification.required_m);
    let camera = views::close_up(evidence, place.place, place.normal, span);
    let view = evidence.view(&camera, CLOSE_UP[0], CLOSE_UP[1]);
    let aspect = f64::from(CLOSE_UP[0]) / f64::from(CLOSE_UP[1]);
    let project = |p: DVec3| views::project(&camera, aspect, p);
    let outline = place.light.and_then(|light| {
        let [a, b, c] = evidence.lights.corners[light as usize].map(project);
        Some([a?, b?, c?])
    });
    let picture = encode::data_uri(&pictures::draw_close(evidence, &view))?;
    Ok(CloseUp { mark: project(place.place), place, picture, outline })
}
