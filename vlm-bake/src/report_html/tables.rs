//! The page's tables.

use std::collections::BTreeMap;

use maud::{Markup, html};
use vlm_format::VlmAsset;

use super::colour::{css, encode, of_tag};
use super::objects::{ALLOWED, ObjectFigures, percent};
use super::text::{area, bytes, count, length};
use crate::report::Report;
use crate::tag::{TagReason, TagReport};

/// Rows of a table that are shown; the rest is summed up. More make a longer page.
const MOST_ROWS: usize = 40;

/// A row of the first table.
struct Reached {
    what: &'static str,
    asked: String,
    reached: String,
    good: bool,
    why: String,
}

/// Asked against reached. `open` is the number of lights that fail untagged.
pub fn asked_and_reached(report: &Report, open: usize, objects: &[ObjectFigures]) -> Markup {
    html! {
        div.scroll { table {
            thead { tr { th {} th.n { "asked" } th.n { "reached" } th {} th.note { "note" } } }
            tbody { @for row in rows(report, open, objects) {
                tr {
                    th scope="row" { (row.what) }
                    td.n { (row.asked) } td.n { (row.reached) }
                    td { @if row.good { span.ok { "ok" } } @else { span.miss { "look" } } }
                    td.note { (row.why) }
                }
            } }
        } }
    }
}

fn rows(report: &Report, open: usize, objects: &[ObjectFigures]) -> Vec<Reached> {
    let share = |part: f64, whole: f64| part.max(0.0) / whole.max(f64::MIN_POSITIVE);
    let row = |what, asked: String, reached: String, good, why: &str| Reached {
        what,
        asked,
        reached,
        good,
        why: why.to_owned(),
    };
    let offset_limit = 1.5 * (report.decimation.error_m + report.clearance.required_m);
    let tagged = share(report.area.tagged_m2, report.area.lights_m2);
    let uncovered = share(report.area.uncovered_m2, report.area.visible_m2);
    let missed = objects.iter().filter(|o| !o.why_missed().is_empty()).count();
    vec![
        row(
            "Lights",
            count(report.asked_lights.into()),
            count(report.lights as u64),
            report.missed_because.is_empty(),
            &report.missed_because,
        ),
        row(
            "Faces after decimation",
            format!("≤ {}", count(report.decimation.asked as u64)),
            count(report.decimation.reached as u64),
            report.decimation.reached <= report.decimation.asked,
            "the rest of the lights divides large faces",
        ),
        row(
            "Decimation error",
            "–".to_owned(),
            length(report.decimation.error_m),
            true,
            "distance at the worst collapse",
        ),
        row(
            "Lights that light themselves",
            "0".to_owned(),
            count(open as u64),
            open == 0,
            "neither mended nor tagged",
        ),
        row(
            "Clearance",
            length(report.clearance.required_m),
            length(report.clearance.required_m - report.clearance.worst_m),
            report.clearance.violations == 0,
            "least depth behind the surface where no tag helps",
        ),
        row(
            "Mean offset",
            format!("≤ {}", length(offset_limit)),
            length(report.offset.mean_m),
            report.offset.mean_m <= offset_limit,
            "1.5 × (decimation error + clearance)",
        ),
        row("Greatest offset", "–".to_owned(), length(report.offset.max_m), true, ""),
        row(
            "Tagged lights",
            "≤ 3 %".to_owned(),
            percent(tagged),
            tagged <= 0.03,
            "of the lights' area; sheets are tagged whole",
        ),
        row(
            "Surface without light",
            "≤ 1 %".to_owned(),
            percent(uncovered),
            uncovered <= 0.01,
            "of the surface that reflects",
        ),
        row(
            "Objects off by more than 2 %",
            "0".to_owned(),
            count(missed as u64),
            missed == 0,
            "in albedo or flux, see below",
        ),
    ]
}

/// Albedo and flux per object; those that miss the rule come first, the largest first.
pub fn object_table(objects: &[ObjectFigures]) -> Markup {
    let mut order: Vec<&ObjectFigures> = objects.iter().collect();
    order.sort_by(|a, b| {
        let missed = |o: &ObjectFigures| !o.why_missed().is_empty();
        missed(b).cmp(&missed(a)).then(b.visible_m2.total_cmp(&a.visible_m2))
    });
    let rest = order.len().saturating_sub(MOST_ROWS);
    html! {
        div.scroll { table {
            thead { tr {
                th { "object" } th.n { "lights" } th.n { "surface" } th.n { "without light" } th.n { "area of lights" }
                th { "albedo" } th.n { "albedo off by" } th.n { "flux" } th.note { "why" }
            } }
            tbody { @for o in order.iter().take(MOST_ROWS) { (object_row(o)) } }
        } }
        @if rest > 0 { p.rest { (count(rest as u64)) " more objects, smaller or within the rule." } }
    }
}

fn object_row(o: &ObjectFigures) -> Markup {
    let why = o.why_missed();
    let off = |share: f64| if share.abs() > ALLOWED { "n off" } else { "n" };
    let swatches = [o.albedo, o.light_albedo].map(|albedo| css(encode(albedo)));
    html! {
        tr {
            th.path scope="row" { (path(&o.path)) }
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
            td.note { (why) }
        }
    }
}

/// The tags, the largest first. `costs` holds the share of light that each takes from its surface.
pub fn tag_table(tags: &[TagReport], costs: &BTreeMap<u32, f64>) -> Markup {
    if tags.is_empty() {
        return html! { p { "None: every light is hidden behind its surface." } };
    }
    let mut order: Vec<&TagReport> = tags.iter().collect();
    order.sort_by(|a, b| b.area_m2.total_cmp(&a.area_m2).then(a.tag.cmp(&b.tag)));
    let rest = order.len().saturating_sub(MOST_ROWS);
    html! {
        div.scroll { table {
            thead { tr {
                th.n { "tag" } th { "object" } th { "mesh / primitive" } th { "reason" } th.n { "lights" } th.n { "area" }
                th.n { "light lost" }
            } }
            tbody { @for t in order.iter().take(MOST_ROWS) {
                tr {
                    td.n { span.swatch style={ "background:" (css(of_tag(t.tag))) } {} (t.tag) }
                    th.path scope="row" { (path(&t.object)) }
                    td { (t.mesh) " / " (t.primitive) }
                    td { (reason(t.reason)) }
                    td.n { (count(t.lights as u64)) }
                    td.n { (area(t.area_m2)) }
                    td.n { (costs.get(&t.tag).map_or_else(|| "–".to_owned(), |&c| percent(c))) }
                }
            } }
        } }
        @if rest > 0 { p.rest { (count(rest as u64)) " more tags, smaller ones." } }
    }
}

fn reason(reason: TagReason) -> &'static str {
    match reason {
        TagReason::Authored => "set by the artist",
        TagReason::TwoSided => "two-sided: nothing lies behind it",
        TagReason::Uncleared => "too thin or folded to hide the lights",
    }
}

/// A node path that may break behind its slashes.
pub fn path(path: &str) -> Markup {
    let shown = if path.is_empty() { "scene" } else { path };
    html! { @for (i, part) in shown.split('/').enumerate() { @if i > 0 { "/" wbr; } (part) } }
}

/// What the asset adds to the file, by part.
pub fn size_table(asset: &VlmAsset, file_bytes: u64) -> Markup {
    let parts = sizes(asset);
    let sum: u64 = parts.iter().map(|(_, size)| size).sum();
    html! {
        div.scroll { table.narrow {
            thead { tr { th { "part" } th.n { "size" } th.n { "share of the file" } } }
            tbody {
                @for (part, size) in &parts {
                    tr { th scope="row" { (part) } td.n { (bytes(*size)) } td.n { (percent(share(*size, file_bytes))) } }
                }
                tr.sum { th scope="row" { "all arrays of the VLM" } td.n { (bytes(sum)) } td.n { (percent(share(sum, file_bytes))) } }
                tr { th scope="row" { "the file" } td.n { (bytes(file_bytes)) } td.n {} }
            }
        } }
    }
}

fn share(part: u64, whole: u64) -> f64 {
    part as f64 / whole.max(1) as f64
}

/// Four bytes a number, as `vlm-format` writes them.
fn sizes(asset: &VlmAsset) -> [(&'static str, u64); 4] {
    let numbers = |vectors: usize, integers: usize| 4 * (3 * vectors + integers) as u64;
    let lights = numbers(asset.positions.len() + asset.triangles.len(), 0);
    let colours = numbers(asset.albedo.len() + asset.emission.len(), asset.tags.len());
    let samples = numbers(3 * asset.samples.len(), asset.sample_starts.len());
    let grid =
        asset.grid.as_ref().map_or(0, |g| numbers(0, g.cells.len() + g.starts.len() + g.entries.len()));
    [
        ("lights: geometry", lights),
        ("lights: colours and tags", colours),
        ("samples", samples),
        ("grid", grid),
    ]
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
