//! The report of a bake as a page for artists: one HTML file with everything in it.
//!
//! Facts first (the check, `lights -> correspondence -> facts`), then what is made of them: pictures, tables, places, a verdict, the
//! page. The same bake gives the same page, but for the seconds by stage.

mod lights;
mod correspondence;
mod facts;
mod views;
mod colour;
mod encode;
mod grid_view;
mod pictures;
mod objects;
mod text;
mod checked;
mod places;
mod advice;
mod summary;
mod legend;
mod tables;
mod page;

use glam::DVec3;
use image::ImageError;

use maud::{Markup, html};
use vlm_format::GltfFile;

use crate::bake::Bake;
use crate::ground::Ground;
use crate::patches::patches;
use crate::scene::{Camera, Scene};
use crate::verify::check;
use advice::Remedies;
use checked::Checked;
use facts::Evidence;
use lights::WorldLights;
use objects::{Grouping, ObjectFigures};
use page::{CloseUp, Gallery, Page};
use pictures::{Scales, Subject};
use places::WorstPlace;

/// Size of the pictures, pixels. Larger ones show smaller lights and take more space.
const PICTURE: [u32; 2] = [480, 360];

/// Size of close-ups, pixels.
const CLOSE_UP: [u32; 2] = [320, 240];

/// A close-up shows this many times the size of the light and its distance from the place, from bottom to top, and at least that many
/// times the clearance.
const CLOSE_SPAN: [f64; 2] = [2.5, 40.0];

/// Up to so many objects are shown by part, too.
const FEW_OBJECTS: usize = 8;

/// No bake makes more lights than this.
const MOST_LIGHTS: u32 = 1_000_000;

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
    /// The file written, if its arrays may be compressed; without one they count as they are in memory.
    pub written: Option<&'a GltfFile>,
}

/// The page of a bake, as one HTML document without references to other files.
///
/// # Errors
/// If a picture cannot be encoded.
pub fn report_html(subjects: &Subjects) -> Result<String, ImageError> {
    let Subjects { scene, bake, .. } = *subjects;
    let (asset, report) = (&bake.asset, &bake.report);
    let surfaces = scene.triangle_surfaces();
    let patches = patches(scene, &surfaces, asset.settings.lights);
    let ground = Ground::new(scene, &patches);
    let points = ground.points(asset.settings.lights as usize);
    let verification = check(scene, asset, &ground, points);
    let lights = WorldLights::new(scene, asset);
    let checked = Checked::of(&verification, report);
    let evidence = Evidence::new(scene, asset, &lights, &ground, &verification);
    let scales = Scales::new(&evidence);
    let objects = objects::figures(&evidence, &surfaces, Grouping::Object);
    let parts = objects::figures(&evidence, &surfaces, Grouping::Part);
    let remedies = Remedies {
        required_m: checked.required_m,
        more_lights: report.asked_lights.saturating_mul(2).min(MOST_LIGHTS),
        can_steer: objects.len() > 1,
    };
    let places = places::worst_places(&evidence, scales.error_end_m);
    let summary = summary::summary(report, &checked, &objects, &places, &remedies);
    let galleries: Result<Vec<Gallery>, ImageError> =
        views::cameras(scene, f64::from(PICTURE[0]) / f64::from(PICTURE[1]))
            .iter()
            .map(|camera| gallery(&evidence, camera, &scales))
            .collect();
    let close_ups: Result<Vec<CloseUp>, ImageError> =
        places.into_iter().map(|place| close_up(&evidence, place)).collect();
    let page = Page {
        title: subjects.title,
        summary: &summary,
        reached: tables::asked_and_reached(report, &checked, &objects),
        galleries: &galleries?,
        size: PICTURE,
        close_ups: &close_ups?,
        remedies: &remedies,
        scales,
        visible_m2: checked.visible_m2,
        objects: object_tables(&objects, &parts),
        tags: tables::tag_table(&evidence, &report.tags),
        grid: tables::grid_table(asset.grid.as_ref()),
        sizes: tables::size_table(asset, subjects.written, subjects.file_bytes),
        times: tables::time_table(&report.seconds),
        notes: &report.notes,
    };
    Ok(page.render())
}

/// Figures by object, and by part where objects are so few that they say little.
fn object_tables(objects: &[ObjectFigures], parts: &[ObjectFigures]) -> Markup {
    let is_coarse = objects.len() <= FEW_OBJECTS && parts.len() > objects.len();
    html! {
        (tables::object_table("object", objects))
        @if is_coarse { h3 { "By part" } (tables::object_table("part", parts)) }
    }
}

fn gallery(evidence: &Evidence, camera: &Camera, scales: &Scales) -> Result<Gallery, ImageError> {
    let view = evidence.view(camera, PICTURE[0], PICTURE[1]);
    let draw = |&subject: &Subject| {
        let picture = pictures::draw(evidence, &view, camera, subject, scales);
        Ok((subject, encode::data_uri(&picture)?))
    };
    let pictures: Result<_, ImageError> = Subject::of(evidence.asset).iter().map(draw).collect();
    Ok(Gallery { camera: camera.name.clone(), pictures: pictures? })
}

fn close_up(evidence: &Evidence, place: WorstPlace) -> Result<CloseUp, ImageError> {
    let size = place.light.map_or_else(
        || place.amount.sqrt(),
        |light| {
            let corners = evidence.lights.corners[light as usize];
            corners.map(|corner| corner.distance(place.place)).into_iter().fold(0.0, f64::max)
        },
    );
    let span = (CLOSE_SPAN[0] * size).max(CLOSE_SPAN[1] * evidence.verification.required_m);
    let camera = views::close_up(evidence, place.place, place.normal, span);
    let view = evidence.view(&camera, CLOSE_UP[0], CLOSE_UP[1]);
    let aspect = f64::from(CLOSE_UP[0]) / f64::from(CLOSE_UP[1]);
    let project = |p: DVec3| views::project(&camera, aspect, p);
    let outline = place.light.and_then(|light| {
        let [a, b, c] = evidence.lights.corners[light as usize].map(project);
        Some([a?, b?, c?])
    });
    let picture = encode::data_uri(&pictures::draw_close(evidence, &view, &camera, place.light))?;
    Ok(CloseUp { mark: project(place.place), place, picture, outline })
}
