//! The page: HTML around pictures and tables. Everything that comes from the file is escaped by `maud`.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::advice::Remedies;
use super::legend::{caption, legend};
use super::pictures::{Scales, Subject};
use super::places::WorstPlace;
use super::summary::{Level, Summary};
use super::tables::path;
use super::text::{plural, three_digits};

/// The pictures of one camera.
pub struct Gallery {
    /// The camera's name.
    pub camera: String,
    /// What each shows, and its `data:` URI.
    pub pictures: Vec<(Subject, String)>,
}

/// A place with its picture.
pub struct CloseUp {
    /// The place.
    pub place: WorstPlace,
    /// `data:` URI.
    pub picture: String,
    /// The place in shares of the picture, from the top left.
    pub mark: Option<[f64; 2]>,
    /// The corners of its light, likewise.
    pub outline: Option<[[f64; 2]; 3]>,
}

/// All parts of the page.
pub struct Page<'a> {
    /// What was baked.
    pub title: &'a str,
    /// The verdict.
    pub summary: &'a Summary,
    /// Asked against reached.
    pub reached: Markup,
    /// Pictures by camera.
    pub galleries: &'a [Gallery],
    /// Size of the pictures, pixels.
    pub size: [u32; 2],
    /// Worst places.
    pub close_ups: &'a [CloseUp],
    /// What helps in this scene.
    pub remedies: &'a Remedies,
    /// Where the pictures' ramps end.
    pub scales: Scales,
    /// Area of the surface that reflects, square metres.
    pub visible_m2: f64,
    /// Albedo and flux per object.
    pub objects: Markup,
    /// Tags.
    pub tags: Markup,
    /// The static grid in numbers.
    pub grid: Markup,
    /// Sizes of the file's parts.
    pub sizes: Markup,
    /// Seconds by stage.
    pub times: Markup,
    /// What was left out or guessed.
    pub notes: &'a [String],
}

impl Page<'_> {
    /// The whole document.
    pub fn render(&self) -> String {
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    title { "VLM of " (self.title) }
                    style { (PreEscaped(include_str!("style.css"))) }
                }
                body {
                    (self.header())
                    main {
                        (section("reached", "Asked against reached", "", &self.reached))
                        (section("pictures", "Pictures", "", &self.pictures()))
                        (section("places", "Worst places", PLACES, &self.places()))
                        (section("objects", "Albedo and flux by object", OBJECTS, &self.objects))
                        (section("tags", "Tags", TAGS, &self.tags))
                        (section("grid", "Static grid", GRID, &self.grid))
                        (section("size", "Size", "", &self.sizes))
                        (section("time", "Time", "", &self.times))
                        @if !self.notes.is_empty() { (section("notes", "Notes", "", &self.notes())) }
                    }
                }
            }
        };
        page.into_string()
    }

    fn header(&self) -> Markup {
        let level = match self.summary.level {
            Level::Good => "good",
            Level::Look => "look",
            Level::Bad => "bad",
        };
        html! {
            header {
                p.kind { "Virtual Light Mesh" }
                h1 { (self.title) }
                div class={ "verdict " (level) } {
                    h2 { (self.summary.headline) }
                    p { (self.summary.text) }
                    @if !self.summary.changes.is_empty() {
                        h3 { "What to change first" }
                        ol { @for change in &self.summary.changes { li { (with_code(change)) } } }
                    }
                }
                nav {
                    @for (id, name) in [("reached", "Figures"), ("pictures", "Pictures"), ("places", "Worst places"),
                        ("objects", "Objects"), ("tags", "Tags"), ("grid", "Grid"), ("size", "Size"), ("time", "Time")]
                    { a href={ "#" (id) } { (name) } }
                }
            }
        }
    }

    fn pictures(&self) -> Markup {
        html! { @for (i, gallery) in self.galleries.iter().enumerate() {
            h3 { "Camera " (gallery.camera) }
            div.gallery { @for (subject, picture) in &gallery.pictures {
                @let (title, explanation) = caption(*subject);
                @let id = format!("{}-{i}", caption(*subject).0.to_lowercase().replace(' ', "-"));
                figure id=(id) {
                    a href={ "#" (id) } title="enlarge" { img src=(picture) width=(self.size[0]) height=(self.size[1]) alt={ (title) ", camera " (gallery.camera) }; }
                    div.legend { (legend(*subject, self.remedies.required_m, &self.scales)) }
                    figcaption { b { (title) ". " } (explanation) }
                }
            } }
        } }
    }

    fn places(&self) -> Markup {
        if self.close_ups.is_empty() {
            return html! { p { "None: every place is within what was asked." } };
        }
        html! { ol.places { @for close_up in self.close_ups { li { (self.place(close_up)) } } } }
    }

    fn place(&self, close_up: &CloseUp) -> Markup {
        let place = &close_up.place;
        let [x, y, z] = place.place.to_array().map(three_digits);
        html! {
            div.close { img src=(close_up.picture) alt={ "Close-up of " (place.object) }; (overlay(close_up)) }
            div.what {
                h3 { (place.title()) @if place.tagged { " " span.badge { "tagged" } } }
                p.where { (path(&place.object)) @if !place.material.is_empty() { ", " (place.material) } br; span.at { "(" (x) ", " (y) ", " (z) ") m" } }
                p { (place.problem(self.remedies.required_m, self.visible_m2))
                    @if let Some(light) = place.light { " Light " (light) "." }
                    @if place.more > 0 { " " (plural(place.more, "more place", "more places")) " like it near by." } }
                p.advice { (with_code(&place.advice(self.remedies))) }
            }
        }
    }

    fn notes(&self) -> Markup {
        html! { ul { @for note in self.notes { li { (note) } } } }
    }
}

const PLACES: &str = "The camera stands in front of the place (circle) and looks straight at it. Outlined in yellow is the light in \
    question, though it lies behind the surface; orange is what shows of it. Red is surface that its light reaches, blue is kept dark by a \
    tag, hatched has no light.";

const OBJECTS: &str = "An object's lights should have the mean albedo of its surface, and return as much light as it under uniform \
    light: flux near 100 %. The rule allows 2 %. In each pair the left colour is the surface's, the right one the lights'.";

const TAGS: &str = "Surface does not receive light from lights of its own tag; a tag covers that surface. Light lost is the share of its \
    lights' light that would have fallen there rightly, on parts for which the light does not stand, were nothing between.";

const GRID: &str = "Each point blends the probes of its cell, and evaluates the lights that are near for any of them. The bytes of each array \
    stand under Size.";

fn section(id: &str, title: &str, explanation: &str, content: &Markup) -> Markup {
    html! { section id=(id) {
        h2 { (title) }
        @if !explanation.is_empty() { p.explanation { (explanation) } }
        (content)
    } }
}

/// Text with what stands between backticks as code.
fn with_code(text: &str) -> Markup {
    html! { @for (i, part) in text.split('`').enumerate() {
        @if i % 2 == 1 { code { (part) } } @else { (part) }
    } }
}

/// The outline of the light and a ring round the place.
fn overlay(close_up: &CloseUp) -> Markup {
    let at = |[x, y]: [f64; 2]| format!("{:.1},{:.1}", 240.0 * x, 180.0 * y);
    let outline = close_up.outline.map(|corners| corners.map(at).join(" "));
    html! {
        svg viewBox="0 0 240 180" preserveAspectRatio="none" aria-hidden="true" {
            @if let Some(points) = outline {
                polygon.under points=(points) {}
                polygon.over points=(points) {}
            }
            @if let Some([x, y]) = close_up.mark {
                circle cx=(format!("{:.1}", 240.0 * x)) cy=(format!("{:.1}", 180.0 * y)) r="6" {}
            }
        }
    }
}
