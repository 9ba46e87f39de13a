//! What each picture shows, in words, and the legend below it.

use maud::{Markup, html};

use super::colour::{HATCH, KEPT_DARK, MAKES_NONE, PLAIN, POKING, VIOLATION, css, of_tag, pale};
use super::pictures::{CLEARANCE_END, Scales, Subject, css_ramp};
use super::text::{length, three_digits};

/// Title and explanation.
pub fn caption(subject: Subject) -> (&'static str, &'static str) {
    match subject {
        Subject::Scene => ("Scene", "Your surfaces, by a lamp at the camera."),
        Subject::Lights => (
            "Virtual lights",
            "The lights alone, one facet each. Large facets blur light and shadow; missing shapes bounce nothing.",
        ),
        Subject::Violations => {
            ("Violations", "Where a light shines on the surface that it stands for. All grey is right.")
        }
        Subject::Clearance => (
            "Clearance",
            "How deep the light lies behind the surface, over the depth required. Near 1 is best; yellow lies far too deep.",
        ),
        Subject::Tags => {
            ("Tags", "Surface in colour ignores lights of that colour. Hatched surface has no light at all.")
        }
        Subject::Error => (
            "Decimation error",
            "How far the light is from the surface, beyond the clearance. Bright means that shape was simplified away.",
        ),
        Subject::TexelAlbedo => ("Albedo of the surface", "The colour that bounces, as textured."),
        Subject::LightAlbedo => (
            "Albedo of the lights",
            "The colour of the light that stands there. It should be that of the surface, averaged.",
        ),
        Subject::Probes => (
            "Probes",
            "Places where light is known, by how far they count along the surface. They should lie denser where light changes.",
        ),
        Subject::NearLights => (
            "Near lights",
            "How many lights a pixel evaluates by itself: what it costs. Dark grey surface is in no cell of the grid.",
        ),
    }
}

/// The legend of a subject; empty where colours speak for themselves.
pub fn legend(subject: Subject, required_m: f64, scales: &Scales) -> Markup {
    match subject {
        Subject::Violations => html! {
            (swatch(VIOLATION, "lights itself"))
            (swatch(POKING, "comes out elsewhere"))
            (swatch(KEPT_DARK, "would, but a tag keeps it off"))
        },
        Subject::Clearance => {
            let middle = CLEARANCE_END.sqrt();
            html! {
                (scale(&["1 ×".to_owned(), format!("{middle:.0} ×"), format!("{CLEARANCE_END:.0} ×")]))
                (swatch(VIOLATION, &format!("below 1 × = {}", length(required_m))))
                (swatch(KEPT_DARK, "below, tagged"))
            }
        }
        Subject::Error => html! {
            (scale(&[0.0, 0.5, 1.0].map(|share| length(share * scales.error_end_m))))
        },
        Subject::Probes => {
            let [low, high] = scales.grid.reach_m;
            scale(&[low, (low * high).sqrt(), high].map(length))
        }
        Subject::NearLights => html! {
            (scale(&[0.0, 0.5, 1.0].map(|share| three_digits(share * scales.grid.near))))
            (swatch(MAKES_NONE, "in no cell"))
        },
        Subject::Tags => html! {
            (swatch(PLAIN, "no tag"))
            (swatch(of_tag(1), "surface and its light"))
            (swatch(pale(of_tag(1)), "surface alone"))
            (dotted("light alone"))
            (hatched("no light"))
            (swatch(MAKES_NONE, "makes none"))
        },
        Subject::LightAlbedo => html! { (hatched("no light")) (swatch(MAKES_NONE, "makes none")) },
        Subject::Scene | Subject::Lights | Subject::TexelAlbedo => html! {},
    }
}

/// A patch of colour and its name.
pub fn swatch(colour: [u8; 3], name: &str) -> Markup {
    html! { span.key { span.swatch style={ "background:" (css(colour)) } {} (name) } }
}

fn hatched(name: &str) -> Markup {
    let [light, dark] = [PLAIN, HATCH].map(css);
    let stripes = format!("background:repeating-linear-gradient(135deg,{light} 0 3px,{dark} 3px 5px)");
    html! { span.key { span.swatch style=(stripes) {} (name) } }
}

fn dotted(name: &str) -> Markup {
    let [dot, ground] = [of_tag(1), PLAIN].map(css);
    let dots = format!("background:{ground} radial-gradient({dot} 1.5px,transparent 2px) 0 0/5px 5px");
    html! { span.key { span.swatch style=(dots) {} (name) } }
}

/// The ramp with labels at its ends and between.
fn scale(labels: &[String; 3]) -> Markup {
    html! {
        span.scale {
            span.ramp style={ "background:" (css_ramp()) } {}
            span.ticks { @for label in labels { span { (label) } } }
        }
    }
}
