//! `vlm bake --report-html`: what the page holds, that it can say no, and that nothing in a file can break out of it.

use std::path::Path;

use base64::Engine;
use glam::Vec3;
use image::RgbImage;
use serde_json::json;
use vlm_bake::bake::{Bake, bake};
use vlm_bake::options::{BakeOptions, Preset};
use vlm_bake::progress::Silent;
use vlm_bake::report_html::{Subjects, report_html};
use vlm_bake::scene::{LoadOptions, Scene, load};
use vlm_bake::verify::verify_asset;
use vlm_format::{GltfFile, Grid};

use crate::support::{Document, Folders, repository, run, text, vlm};

/// A square, standing free in the room, seen from both sides.
const BANNER: [[f32; 3]; 4] = [[-0.5, -0.5, 0.0], [0.5, -0.5, 0.0], [0.5, 0.5, 0.0], [-0.5, 0.5, 0.0]];

/// Bakes a document with `--report-html` and returns the page.
fn page_of(document: &Document, flags: &[&str]) -> String {
    let folders = Folders::new();
    let page = folders.output("page.html");
    let flags = [flags, &["--report-html", &page]].concat();
    folders.bake(document, &flags);
    std::fs::read_to_string(page).unwrap()
}

/// A scene and its bake, to be damaged before the page is made.
fn baked(path: &str, lights: u32) -> (Scene, Bake) {
    let scene = load(&GltfFile::open(Path::new(path)).unwrap(), &LoadOptions::default()).unwrap();
    let options = BakeOptions { lights, ..BakeOptions::preset(Preset::Game, scene.triangles.len()) };
    let bake = bake(&scene, &options, &Silent).unwrap();
    (scene, bake)
}

fn page(scene: &Scene, bake: &Bake) -> String {
    report_html(&Subjects { title: "cornell.glb", scene, bake, file_bytes: 1_000_000, written: None })
        .unwrap()
}

/// A picture of the page by the start of its title.
fn picture(page: &str, alt: &str) -> RgbImage {
    let tag = page.split("<img ").find(|tag| tag.contains(&format!("alt=\"{alt}"))).expect(alt);
    let data = tag.split(";base64,").nth(1).unwrap().split('"').next().unwrap();
    let bytes = base64::engine::general_purpose::STANDARD.decode(data).unwrap();
    image::load_from_memory(&bytes).unwrap().into_rgb8()
}

/// Pixels that are clearly red.
fn red(image: &RgbImage) -> usize {
    image.pixels().filter(|p| p[0] > 90 && p[0] / 3 > p[1] && p[0] / 3 > p[2]).count()
}

/// The rows of a section, as the text between tags.
fn section<'a>(page: &'a str, id: &str) -> &'a str {
    let start = page.find(&format!("<section id=\"{id}\"")).expect(id);
    page[start..].split("</section>").next().unwrap()
}

/// The page without what its pictures hold: letters by chance.
fn without_pictures(page: &str) -> String {
    let mut parts = page.split("base64,");
    let first = parts.next().unwrap_or("").to_owned();
    parts.fold(first, |text, part| text + part.find('"').map_or("", |end| &part[end..]))
}

/// The figure that was reached in a row of the first table.
fn reached<'a>(page: &'a str, row: &str) -> &'a str {
    let row = section(page, "reached").split("<tr>").find(|tr| tr.contains(row)).expect(row);
    row.split("<td class=\"n\">").nth(2).unwrap().split('<').next().unwrap()
}

/// True if the page holds something that a browser would fetch or run: a tag that we do not use, a handler, or an address outside the page.
fn reaches_out(page: &str) -> bool {
    let allowed = "!doctype html head meta title style body header main section nav div p h1 h2 h3 a b br code span figure img figcaption \
                   ol ul li table thead tbody tr th td wbr svg polygon circle";
    let style = page.split("<style>").nth(1).and_then(|rest| rest.split("</style>").next()).unwrap();
    let is_bad = |tag: &str| {
        let tag = tag.split('>').next().unwrap().to_lowercase();
        let name = tag.trim_start_matches('/').split(char::is_whitespace).next().unwrap();
        let pieces: Vec<&str> = tag.split('"').collect();
        // What stands outside quotation marks is names of attributes, and what follows each is its value.
        let mut attributes = pieces.chunks(2).map(|pair| (pair[0], pair.get(1).copied().unwrap_or("")));
        let is_bad = |(names, value): (&str, &str)| {
            let is_address = names.ends_with("src=") || names.ends_with("href=");
            names
                .split_whitespace()
                .any(|name| name.starts_with("on") || name.contains("=") && !name.ends_with('='))
                || is_address && !value.starts_with("data:image/") && !value.starts_with('#')
        };
        !allowed.split_whitespace().any(|a| a == name) || attributes.any(is_bad)
    };
    style.contains("url(") || style.contains("@import") || page.split('<').skip(1).any(is_bad)
}

#[test]
fn the_page_is_whole_and_fetches_nothing() {
    let page = page_of(&Document::room(), &["--lights", "60"]);
    assert!(page.starts_with("<!DOCTYPE html>") && page.ends_with("</html>"));
    assert!(!reaches_out(&page));
    for hostile in
        ["<img src=\"https://example.com/a.png\">", "<script>1</script>", "<a href=\"javascript:1\">"]
    {
        assert!(reaches_out(&(page.clone() + hostile)), "the check sees {hostile}");
    }
    for alt in [
        "Scene",
        "Virtual lights",
        "Violations",
        "Clearance",
        "Tags",
        "Decimation error",
        "Albedo of the",
        "Probes",
        "Near lights",
    ] {
        assert_eq!(picture(&page, alt).dimensions(), (480, 360), "{alt}");
    }
}

#[test]
fn the_grid_is_shown_and_told() {
    let (scene, mut bake) = baked(&repository("assets/cornell.glb"), 200);
    let whole = page(&scene, &bake);
    let grid = bake.asset.grid.as_mut().unwrap();
    let told = section(&whole, "grid");
    let probes = grid.probes.len() as u64;
    assert!(told.contains(&format!(">{},{:03}<", probes / 1000, probes % 1000)), "{probes} probes: {told}");
    assert!(told.contains("leaves of level 1") && told.contains("sources a probe"), "{told}");
    // Fewer probes show as fewer dots, and other lists as other colours.
    let (dots, colours) = (picture(&whole, "Probes"), picture(&whole, "Near lights"));
    grid.surface_probes /= 2;
    grid.near_starts.iter_mut().for_each(|start| *start = 0);
    let less = page(&scene, &bake);
    assert!(picture(&less, "Near lights") != colours, "no near light is left");
    let scene_alone = {
        bake.asset.grid.as_mut().unwrap().surface_probes = 0;
        picture(&page(&scene, &bake), "Probes")
    };
    let differing = |a: &RgbImage| a.pixels().zip(scene_alone.pixels()).filter(|(a, b)| a != b).count();
    let (all, half) = (differing(&dots), differing(&picture(&less, "Probes")));
    assert!(half > 100 && half < all, "{half} of {all} pixels");
    bake.asset.grid = None;
    let without = page(&scene, &bake);
    assert!(!without.contains("Near lights") && section(&without, "grid").contains("None"));
}

#[test]
fn names_from_the_file_are_text() {
    let hostile = "<script>alert('n')</script>\"><img src=x onerror=alert(1)>";
    let mut document = Document::room();
    document.json["nodes"][0]["name"] = json!(hostile);
    document.json["materials"][0]["name"] = json!(hostile);
    document.json["materials"][0]["doubleSided"] = json!(true);
    document.json["cameras"] =
        json!([{ "type": "perspective", "perspective": { "yfov": 1.0, "znear": 0.1 } }]);
    document.json["nodes"].as_array_mut().unwrap().push(json!({ "name": hostile, "camera": 0 }));
    document.json["scenes"][0]["nodes"].as_array_mut().unwrap().push(json!(1));
    let folders = Folders::new();
    let input = folders.input("<b>in.gltf", document.to_string());
    let (output, page) = (folders.output("out.glb"), folders.output("page.html"));
    let result = run(["bake", &input, "-o", &output, "--lights", "60", "--report-html", &page]);
    assert!(result.status.success(), "{}", text(&result.stderr));
    let page = std::fs::read_to_string(page).unwrap();
    assert!(!reaches_out(&page), "a name became markup");
    assert!(!page.contains("<b>in"), "the file's name became markup");
    let escaped = "&lt;script&gt;alert(";
    for id in ["pictures", "objects", "tags"] {
        assert!(section(&page, id).contains(escaped), "{id} shows the name");
    }
}

#[test]
fn same_page_twice_and_with_any_number_of_threads() {
    let folders = Folders::new();
    let make = |threads: &str, lights: &str| {
        let (output, page) = (folders.output("out.glb"), folders.output("page.html"));
        let input = repository("assets/cornell_sphere.glb");
        let arguments = ["bake", &input, "-o", &output, "--lights", lights, "--report-html", &page];
        assert!(vlm(arguments).env("RAYON_NUM_THREADS", threads).output().unwrap().status.success());
        let page = std::fs::read_to_string(page).unwrap();
        let time = section(&page, "time");
        assert!(time.contains("decimate"), "the seconds are in one place");
        page.replace(time, "")
    };
    let first = make("2", "200");
    assert!(first == make("2", "200"), "twice");
    assert!(first == make("1", "200"), "with one thread");
    assert!(first != make("2", "240"), "another bake has another page");
}

#[test]
fn a_light_pushed_out_of_its_wall_is_found_shown_and_named() {
    let (scene, mut bake) = baked(&repository("assets/cornell.glb"), 200);
    let clean = page(&scene, &bake);
    assert!(!clean.contains("Not fine"));
    assert_eq!(red(&picture(&clean, "Violations")), 0);
    assert!(section(&clean, "places").contains("None"));
    assert_eq!(
        verify_asset(&scene, &bake.asset).report(),
        bake.report.clearance,
        "the page shows the bake's own figures"
    );

    // The first light that looks straight up is one of the floor, in the middle of the picture's lower half.
    let asset = &mut bake.asset;
    let up = |t: &&[u32; 3]| {
        let [a, b, c] = t.map(|v| asset.positions[v as usize]);
        (b - a).cross(c - a).normalize_or_zero().y > 0.99
    };
    let light = *asset.triangles.iter().find(up).unwrap();
    for v in light {
        asset.positions[v as usize].y += 0.05;
    }
    let page = page(&scene, &bake);
    assert!(page.contains("Not fine"), "the verdict");
    assert!(reached(&page, "Clearance").contains('-'), "the least depth");
    assert!(
        verify_asset(&scene, &bake.asset).self_light.max > 1e-4,
        "its neighbours are tilted, and light themselves"
    );
    assert!(red(&picture(&page, "Violations")) > 50, "the picture");
    let places = section(&page, "places");
    assert!(places.contains("A light lights its own surface") && places.contains("room"), "{places:.600}");
    assert!(red(&picture(places, "Close-up")) > 50, "the close-up");
}

#[test]
fn lights_of_the_wrong_colour_or_size_are_called_out() {
    let path = repository("assets/cornell.glb");
    let off = |page: &str| section(page, "objects").matches("class=\"n off\"").count();
    let (scene, bake) = baked(&path, 200);
    assert_eq!(off(&page(&scene, &bake)), 0, "a friendly scene keeps albedo and flux");

    let mut tinted = bake.clone();
    tinted.asset.albedo.iter_mut().for_each(|albedo| *albedo *= Vec3::new(1.05, 1.0, 1.0));
    assert!(off(&page(&scene, &tinted)) > 0, "5 % more red");

    let mut dimmed = bake.clone();
    dimmed.asset.samples.iter_mut().for_each(|sample| sample.reflectance *= 0.97);
    let page = page(&scene, &dimmed);
    assert!(off(&page) > 0 && page.contains("light is lost"), "3 % less flux");
}

#[test]
fn two_sided_sheets_are_listed_with_their_reason_and_cost() {
    let mut document = Document::room();
    document.json["materials"][1]["doubleSided"] = json!(true);
    document.push("banner", &[BANNER], Some(1));
    let page = page_of(&document, &["--lights", "200"]);
    let tags = section(&page, "tags");
    assert!(tags.contains("banner") && tags.contains("two-sided"), "{tags}");
    assert!(!page.contains("Not fine"), "tags mend sheets");
    assert!(tags.contains("2.00 m²"), "both sides of a square metre: {tags}");
    assert!(tags.contains("0 %"), "a flat sheet loses nothing: {tags}");
    for share in ["Lights that carry a tag", "Surface covered by tags"] {
        assert_ne!(reached(&page, share), "0 %", "{share}");
    }
    let plain = page_of(&Document::room(), &["--lights", "200"]);
    assert!(!section(&plain, "tags").contains("two-sided"), "a plain room has none");
    for share in ["Lights that carry a tag", "Surface covered by tags"] {
        assert_eq!(reached(&plain, share), "0 %", "{share}");
    }
}

#[test]
fn sizes_are_listed_by_array_of_the_grid() {
    let rows = |flags: &[&str]| {
        let page = page_of(&Document::room(), &[&["--lights", "60"], flags].concat());
        section(&page, "size").matches("grid: ").count()
    };
    let arrays = Grid::default().sizes().len();
    assert_eq!((rows(&[]), rows(&["--probes", "0"])), (arrays, 0));
}

#[test]
fn a_scene_of_authored_lights_alone_has_a_page() {
    let mut document = Document::room();
    document.json["nodes"][0]["extras"] = json!({ "vlm": { "exclude": true } });
    document.push("VLM_panel", &[BANNER], Some(2));
    let page = page_of(&document, &[]);
    assert!(section(&page, "objects").contains("VLM_panel"));
    assert!(!without_pictures(&page).contains("NaN"));
    let with_one = page.replacen("base64,", "base64,NaN\">NaN<img src=\"", 1);
    assert_eq!(without_pictures(&with_one).matches("NaN").count(), 1, "the negative control");
}

#[test]
fn a_missing_folder_is_named_before_the_bake() {
    let folders = Folders::new();
    let (output, page) = (folders.output("out.glb"), folders.output("none/page.html"));
    let input = repository("assets/cornell.glb");
    let result = run(["bake", &input, "-o", &output, "--report-html", &page]);
    assert_eq!(result.status.code(), Some(2));
    assert!(text(&result.stderr).contains("none"), "{}", text(&result.stderr));
    assert_eq!(folders.outputs().len(), 0, "nothing was written");
}
