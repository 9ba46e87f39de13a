//! The page's tables.

use std::collections::BTreeMap;

use maud::{Markup, html};
use vlm_format::{GltfFile, Grid, VlmAsset};

use super::checked::Checked;
use super::colour::{css, encode, of_tag};
use super::facts::Evidence;
use super::objects::{ObjectFigures, percent};
use super::text::{area, bytes, count, length};
use crate::flux::TOLERANCE;
use crate::grid_content::GridContent;
use crate::report::Report;
use crate::tag::{TagReason, TagReport};

/// Rows of a table that are shown; the rest is summed up. More make a longer page.
const MOST_ROWS: usize = 40;

/// The share of the mean irradiance that surface may receive from its own region.
const MOST_SELF_LIGHT: f64 = 1e-4;

/// A row of the first table.
#[derive(Clone, Default)]
struct Reached {
    what: &'static str,
    /// Empty where nothing was asked; then `good` says nothing.
    asked: String,
    reached: String,
    good: bool,
    note: String,
}

/// Asked against reached.
pub fn asked_and_reached(report: &Report, checked: &Checked, objects: &[ObjectFigures]) -> Markup {
    let rows = [&bake_rows(report, checked.required_m)[..], &check_rows(checked, objects)[..]].concat();
    html! {
        div.scroll { table.reached {
            thead { tr { th {} th.n { "asked" } th.n { "reached" } th {} } }
            tbody { @for row in rows {
                tr {
                    th scope="row" { (row.what) @if !row.note.is_empty() { span.note { (row.note) } } }
                    td.n { (row.asked) } td.n { (row.reached) }
                    td { @if row.asked.is_empty() {} @else if row.good { span.ok { "ok" } } @else { span.miss { "look" } } }
                }
            } }
        } }
    }
}

/// Rows about what the bake made.
fn bake_rows(report: &Report, required_m: f64) -> [Reached; 5] {
    let offset_limit = 1.5 * (report.decimation.error_m + required_m);
    let (asked, reached) = (report.decimation.asked as u64, report.decimation.reached as u64);
    [
        Reached {
            what: "Lights",
            asked: count(report.asked_lights.into()),
            reached: count(report.lights as u64),
            good: report.missed_because.is_empty(),
            note: report.missed_because.clone(),
        },
        Reached {
            what: "Faces after decimation",
            asked: format!("about {}", count(asked)),
            reached: count(reached),
            good: reached <= asked || report.missed_because.is_empty(),
            note: "the rest of the lights divides large faces".to_owned(),
        },
        Reached {
            what: "Decimation error",
            reached: length(report.decimation.error_m),
            note: "distance at the worst collapse".to_owned(),
            ..Reached::default()
        },
        Reached {
            what: "Mean offset",
            asked: format!("≤ {}", length(offset_limit)),
            reached: length(report.offset.mean_m),
            good: report.offset.mean_m <= offset_limit,
            note: "at most 1.5 × (decimation error + clearance)".to_owned(),
        },
        Reached { what: "Greatest offset", reached: length(report.offset.max_m), ..Reached::default() },
    ]
}

/// Rows about what the check found.
fn check_rows(checked: &Checked, objects: &[ObjectFigures]) -> [Reached; 7] {
    let missed = objects.iter().filter(|o| !o.why_missed().is_empty()).count();
    let Checked {
        open: failing, depth_m, required_m, self_light, tagged, covered_by_tags, uncovered, ..
    } = *checked;
    [
        Reached {
            what: "Lights that shine where they must not",
            asked: "0".to_owned(),
            reached: count(failing as u64),
            good: failing == 0,
            note: format!(
                "neither mended nor tagged: {} on their own surface, {} out of their object; {} points looked at",
                count(checked.self_lighting as u64),
                count(checked.out as u64),
                count(checked.samples)
            ),
        },
        Reached {
            what: "Clearance",
            asked: format!("≥ {}", length(required_m)),
            reached: format!("{}{}", if depth_m > 0.0 { "" } else { "≥ " }, length(required_m - depth_m)),
            good: depth_m <= 0.0,
            note: "least depth behind the surface, where no tag helps".to_owned(),
        },
        Reached {
            what: "Light of surface on itself",
            asked: format!("≤ {}", percent(MOST_SELF_LIGHT)),
            reached: percent(self_light.p999),
            good: self_light.p999 <= MOST_SELF_LIGHT,
            note: format!(
                "from lights that stand for it, of the mean irradiance, all lights alike: what 99.9 % of the surface stays below; at most {}",
                percent(self_light.max)
            ),
        },
        Reached {
            what: "Lights that carry a tag",
            asked: "≤ 3 %".to_owned(),
            reached: percent(tagged),
            good: tagged <= 0.03,
            note: "of the lights' area; sheets are tagged whole".to_owned(),
        },
        Reached {
            what: "Surface covered by tags",
            asked: "≤ 3 %".to_owned(),
            reached: percent(covered_by_tags),
            good: covered_by_tags <= 0.03,
            note: "of the surface that reflects: it ignores the lights of its tag".to_owned(),
        },
        Reached {
            what: "Surface without light",
            asked: "≤ 1 %".to_owned(),
            reached: percent(uncovered),
            good: uncovered <= 0.01,
            note: "of the surface that reflects".to_owned(),
        },
        Reached {
            what: "Objects off by more than 2 %",
            asked: "0".to_owned(),
            reached: count(missed as u64),
            good: missed == 0,
            note: "in albedo or flux, see below".to_owned(),
        },
    ]
}

/// Albedo and flux per object or part, which `what` names; those that miss the rule come first, the largest first.
pub fn object_table(what: &str, objects: &[ObjectFigures]) -> Markup {
    let mut order: Vec<&ObjectFigures> = objects.iter().collect();
    order.sort_by(|a, b| {
        let missed = |o: &ObjectFigures| !o.why_missed().is_empty();
        missed(b).cmp(&missed(a)).then(b.visible_m2.total_cmp(&a.visible_m2))
    });
    let rest = order.len().saturating_sub(MOST_ROWS);
    html! {
        div.scroll { table {
            thead { tr {
                th { (what) } th.n { "lights" } th.n { "surface" } th.n { "without light" } th.n { "area of lights" }
                th { "albedo" } th.n { "off by" } th.n { "flux" }
            } }
            tbody { @for o in order.iter().take(MOST_ROWS) { (object_row(o)) } }
        } }
        @if rest > 0 { p.rest { (count(rest as u64)) " more, smaller or within the rule." } }
    }
}

fn object_row(o: &ObjectFigures) -> Markup {
    let why = o.why_missed();
    let off = |share: f64| if share.abs() > TOLERANCE { "n off" } else { "n" };
    let swatches = [o.albedo, o.light_albedo].map(|albedo| css(encode(albedo)));
    html! {
        tr {
            th.path scope="row" { (path(&o.path)) @if !why.is_empty() { span.note { (why) } } }
            td.n { (count((o.lights + o.authored) as u64)) }
            td.n { (area(o.visible_m2)) }
            td.n { (percent(o.uncovered_m2 / o.visible_m2.max(f64::MIN_POSITIVE))) }
            td.n { (area(o.lights_m2)) }
            td { span.pair {
                span style={ "background:" (swatches[0]) } title="surface" {}
                span style={ "background:" (swatches[1]) } title="lights" {}
            } }
            td class=(off(o.albedo_error())) { (percent(o.albedo_error())) }
            td class=(off(o.flux_ratio - 1.0)) { (percent(o.flux_ratio)) }
        }
    }
}

/// The tags, those first that cover most.
pub fn tag_table(evidence: &Evidence, tags: &[TagReport]) -> Markup {
    if tags.is_empty() {
        return html! { p { "None: every light is hidden behind its surface." } };
    }
    let mut order: Vec<&TagReport> = tags.iter().collect();
    order.sort_by(|a, b| b.covers_m2.total_cmp(&a.covers_m2).then(a.tag.cmp(&b.tag)));
    let rest = order.len().saturating_sub(MOST_ROWS);
    html! {
        div.scroll { table {
            thead { tr {
                th.n { "tag" } th { "object" } th { "material, mesh / primitive" } th { "reason" } th.n { "lights" } th.n { "their area" }
                th.n { "covers" } th.n { "light lost" }
            } }
            tbody { @for t in order.iter().take(MOST_ROWS) {
                tr {
                    td.n { span.swatch style={ "background:" (css(of_tag(t.tag))) } {} (t.tag) }
                    th.path scope="row" { (path(&t.object)) }
                    td { (material(evidence, t)) ", " (t.mesh) " / " (t.primitive) }
                    td { (reason(t.reason)) }
                    td.n { (count(t.lights as u64)) }
                    td.n { (area(t.area_m2)) }
                    td.n { (area(t.covers_m2)) }
                    td.n { (percent(t.light_lost)) }
                }
            } }
        } }
        @if rest > 0 { p.rest { (count(rest as u64)) " more tags, smaller ones." } }
    }
}

/// The name of the material of a tagged primitive.
fn material<'a>(evidence: &'a Evidence, tag: &TagReport) -> &'a str {
    let primitives = &evidence.scene.primitives;
    let found = primitives.iter().position(|p| (p.mesh, p.primitive) == (tag.mesh, tag.primitive));
    found.map_or("", |p| evidence.material_name(p as u32))
}

fn reason(reason: TagReason) -> &'static str {
    match reason {
        TagReason::Authored => "set by the artist",
        TagReason::TwoSided => "two-sided: nothing lies behind it",
        TagReason::Thin => "too thin: the lights would come out on another side",
        TagReason::Uncleared => "folded or bent more than the lights can follow",
    }
}

/// A node path that may break behind its slashes.
pub fn path(path: &str) -> Markup {
    let shown = if path.is_empty() { "scene" } else { path };
    html! { @for (i, part) in shown.split('/').enumerate() { @if i > 0 { "/" wbr; } (part) } }
}

/// The static grid in numbers.
pub fn grid_table(grid: Option<&Grid>) -> Markup {
    let Some(grid) = grid.map(GridContent::of) else {
        return html! { p { "None: every pixel sums all lights, and nothing hides them." } };
    };
    html! {
        div.scroll { table.narrow { tbody { @for (what, figure) in grid_rows(&grid) {
            tr { th scope="row" { (what) } td.n { (figure) } }
        } } } }
    }
}

fn grid_rows(grid: &GridContent) -> Vec<(String, String)> {
    let number = |n: usize| count(n as u64);
    let per_probe = |n: f64| format!("{:.1} a probe", n / grid.probes.max(1) as f64);
    let [x, y, z] = grid.dimensions;
    let mut rows = vec![
        (
            "cells of the coarsest level".to_owned(),
            format!("{x} × {y} × {z} of {}", length(grid.cell_size_m.into())),
        ),
        ("of these, with something in them".to_owned(), number(grid.stored_cells)),
        ("leaves".to_owned(), number(grid.leaves)),
    ];
    let levels = grid.leaves_by_level.iter().enumerate();
    rows.extend(levels.map(|(level, &leaves)| (format!("leaves of level {level}"), number(leaves))));
    let near = format!("{}, {}", number(grid.near_entries), per_probe(grid.near_entries as f64));
    let rows_text = format!("{}, {:.1} sources a probe", count(grid.far_entries.into()), grid.mean_row);
    rows.extend([
        ("probes on surface".to_owned(), count(grid.surface_probes.into())),
        ("probes in free space".to_owned(), number(grid.free_probes)),
        ("probes listed by leaves".to_owned(), number(grid.listed_probes)),
        ("near lights".to_owned(), near),
        ("entries of rows".to_owned(), rows_text),
        ("all arrays".to_owned(), bytes(grid.bytes as u64)),
    ]);
    rows
}

/// What the asset adds to the file, by part.
pub fn size_table(asset: &VlmAsset, written: Option<&GltfFile>, file_bytes: u64) -> Markup {
    let parts = sizes(asset, written);
    let sum = |bytes: fn(&Size) -> u64| parts.iter().map(bytes).sum();
    let all = Size {
        part: "all arrays of the VLM".to_owned(),
        decoded: sum(|p| p.decoded),
        stored: sum(|p| p.stored),
    };
    let figures = |size: &Size| {
        html! {
            th scope="row" { (size.part) } td.n { (bytes(size.decoded)) } td.n { (bytes(size.stored)) }
            td.n { (percent(share(size.stored, file_bytes))) }
        }
    };
    html! {
        div.scroll { table.narrow {
            thead { tr { th { "part" } th.n { "in memory" } th.n { "in the file" } th.n { "share of the file" } } }
            tbody {
                @for size in &parts { tr { (figures(size)) } }
                tr.sum { (figures(&all)) }
                tr { th scope="row" { "the file" } td.n {} td.n { (bytes(file_bytes)) } td.n {} }
            }
        } }
    }
}

fn share(part: u64, whole: u64) -> f64 {
    part as f64 / whole.max(1) as f64
}

/// A part of an asset.
struct Size {
    part: String,
    /// Bytes in memory.
    decoded: u64,
    /// Bytes in the file.
    stored: u64,
}

/// The arrays of lights and samples, by part.
const PARTS: [(&str, &[&str]); 3] = [
    ("lights: geometry", &["lights/positions", "lights/indices"]),
    ("lights: colours and tags", &["lights/albedo", "lights/emission", "lights/tags"]),
    ("samples", &["samples/starts", "samples/positions", "samples/normals", "samples/reflectance"]),
];

/// Four bytes a number in memory, and in the file what it says.
fn sizes(asset: &VlmAsset, written: Option<&GltfFile>) -> Vec<Size> {
    let numbers = |vectors: usize, integers: usize| 4 * (3 * vectors + integers) as u64;
    let decoded = [
        numbers(asset.positions.len() + asset.triangles.len(), 0),
        numbers(asset.albedo.len() + asset.emission.len(), asset.tags.len()),
        numbers(3 * asset.samples.len(), asset.sample_starts.len()),
    ];
    let size = |part: String, arrays: &[&str], decoded: u64| {
        let stored = written.map(|file| arrays.iter().map(|array| file.stored_vlm_bytes(array)).sum());
        Size { part, decoded, stored: stored.unwrap_or(decoded) }
    };
    let mut parts: Vec<Size> = PARTS
        .iter()
        .zip(decoded)
        .map(|(&(part, arrays), bytes)| size(part.to_owned(), arrays, bytes))
        .collect();
    let grid = asset.grid.as_ref().map(Grid::sizes).into_iter().flatten();
    parts.extend(
        grid.map(|(array, bytes)| size(format!("grid: {array}"), &[&format!("grid/{array}")], bytes as u64)),
    );
    parts
}

/// Seconds by stage, in alphabetical order, as bars.
pub fn time_table(seconds: &BTreeMap<&'static str, f64>) -> Markup {
    let sum: f64 = seconds.values().sum();
    html! {
        div.scroll { table.narrow {
            thead { tr { th { "stage" } th.n { "seconds" } th {} } }
            tbody {
                @for (stage, s) in seconds {
                    tr {
                        th scope="row" { (stage) } td.n { (format!("{s:.2}")) }
                        td.bars { span.bar style=(format!("width:{:.1}%", 100.0 * s / sum.max(f64::MIN_POSITIVE))) {} }
                    }
                }
                tr.sum { th scope="row" { "all" } td.n { (format!("{sum:.2}")) } td {} }
            }
        } }
    }
}
