//! A surface of lines, polygons and text that becomes an SVG or a bitmap; lengths in pixels of a screen, y down.

use std::sync::OnceLock;

use image::RgbImage;
use plotters::coord::Shift;
use plotters::element::{DashedPathElement, PathElement, Polygon, Text};
use plotters::prelude::{BitMapBackend, DrawingArea, DrawingBackend, IntoDrawingArea, IntoFont, SVGBackend};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontStyle, FontTransform, RGBColor, ShapeStyle, TextStyle, register_font};

/// The drawing library counts in whole units: so many of them make a pixel.
const UNITS: f64 = 4.0;
/// A bitmap has so many pixels per pixel of the screen, and is averaged down from twice as many.
pub const BITMAP_SCALE: u32 = 2;
/// What an SVG asks the viewer for, and the name under which the embedded font is known when a bitmap is drawn.
const FAMILY: &str = "sans-serif";

/// Where text stands relative to its point, which lies on the baseline.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Anchor {
    /// The text begins there.
    #[default]
    Start,
    /// Its middle is there.
    Middle,
    /// It ends there.
    End,
}

/// How text looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lettering {
    /// Height of an em.
    pub em: f64,
    /// sRGB.
    pub colour: [u8; 3],
    /// Bold face.
    pub bold: bool,
    /// Where the point lies.
    pub anchor: Anchor,
    /// Runs upwards instead of to the right.
    pub upwards: bool,
}

/// How a line looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// sRGB.
    pub colour: [u8; 3],
    /// Across.
    pub width: f64,
    /// Length of dashes and of the gaps between; `None`: without gaps.
    pub dash: Option<f64>,
}

/// How a backend turns a font's size into letters, in ems: what it must be told for an em of 1, and how far below the
/// top of its box it sets the baseline.
#[derive(Clone, Copy)]
struct Letters {
    size: f64,
    baseline: f64,
}

/// `plotters-svg` divides sizes by 1.24 and shifts by 0.76 em.
const SVG_LETTERS: Letters = Letters { size: 1.24, baseline: 0.76 };
/// `plotters` scales the font's ascent and descent, 1.164 em in DejaVu, to the size, and sets the baseline in the middle.
const BITMAP_LETTERS: Letters = Letters { size: 1.164, baseline: 0.582 };

/// Why a picture could not be drawn, in words.
pub type Reason = String;

/// What is drawn on.
pub struct Canvas<DB: DrawingBackend> {
    area: DrawingArea<DB, Shift>,
    letters: Letters,
}

/// Draws a picture of a width and height as SVG.
///
/// # Errors
/// The drawing library's reason.
pub fn svg(
    size: (u32, u32),
    draw: impl FnOnce(&Canvas<SVGBackend<'_>>) -> Result<(), Reason>,
) -> Result<String, Reason> {
    register_fonts()?;
    let (width, height) = (size.0 * UNITS as u32, size.1 * UNITS as u32);
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, (width, height)).into_drawing_area();
        let canvas = Canvas { area, letters: SVG_LETTERS };
        draw(&canvas)?;
        canvas.area.present().map_err(|e| e.to_string())?;
    }
    let units = format!(r#"width="{width}" height="{height}""#);
    Ok(text.replacen(&units, &format!(r#"width="{}" height="{}""#, size.0, size.1), 1))
}

/// Draws a picture of a width and height as a bitmap of [`BITMAP_SCALE`] times as many pixels, on white.
///
/// # Errors
/// The drawing library's reason.
pub fn bitmap(
    size: (u32, u32),
    draw: impl FnOnce(&Canvas<BitMapBackend<'_>>) -> Result<(), Reason>,
) -> Result<RgbImage, Reason> {
    register_fonts()?;
    let (width, height) = (size.0 * UNITS as u32, size.1 * UNITS as u32);
    let mut pixels = vec![255; (width * height * 3) as usize];
    {
        let area = BitMapBackend::with_buffer(&mut pixels, (width, height)).into_drawing_area();
        let canvas = Canvas { area, letters: BITMAP_LETTERS };
        draw(&canvas)?;
        canvas.area.present().map_err(|e| e.to_string())?;
    }
    let large = RgbImage::from_raw(width, height, pixels).ok_or("the bitmap's size is wrong")?;
    Ok(image::imageops::thumbnail(&large, size.0 * BITMAP_SCALE, size.1 * BITMAP_SCALE))
}

/// Makes the embedded font known to the drawing library, once.
fn register_fonts() -> Result<(), Reason> {
    static REGISTERED: OnceLock<bool> = OnceLock::new();
    let faces = [(FontStyle::Normal, dejavu::sans::regular()), (FontStyle::Bold, dejavu::sans::bold())];
    let register = || faces.into_iter().all(|(style, bytes)| register_font(FAMILY, style, bytes).is_ok());
    if *REGISTERED.get_or_init(register) {
        Ok(())
    } else {
        Err("the embedded font cannot be read".to_owned())
    }
}

/// Width of text in the embedded font, which is wider than most: what is laid out by it has room in every viewer.
///
/// # Errors
/// The drawing library's reason.
pub fn text_width(text: &str, em: f64, bold: bool) -> Result<f64, Reason> {
    register_fonts()?;
    // Measured large, since the library rounds to whole units.
    let enlarged = 16.0;
    let style = if bold { FontStyle::Bold } else { FontStyle::Normal };
    let font = (FAMILY, em * enlarged * BITMAP_LETTERS.size, style).into_font();
    let (width, _) = font.box_size(text).map_err(|e| e.to_string())?;
    Ok(f64::from(width) / enlarged)
}

/// Breaks text at its line breaks, and at spaces where a line would be wider than `width`. A word that is too wide alone
/// stays whole.
///
/// # Errors
/// The drawing library's reason.
pub fn wrap(text: &str, em: f64, width: f64) -> Result<Vec<String>, Reason> {
    let mut lines = Vec::new();
    for paragraph in text.lines() {
        let mut line = String::new();
        for word in paragraph.split_whitespace() {
            let longer = if line.is_empty() { word.to_owned() } else { format!("{line} {word}") };
            if line.is_empty() || text_width(&longer, em, false)? <= width {
                line = longer;
            } else {
                lines.push(std::mem::replace(&mut line, word.to_owned()));
            }
        }
        lines.push(line);
    }
    Ok(lines)
}

fn units((x, y): (f64, f64)) -> (i32, i32) {
    ((x * UNITS).round() as i32, (y * UNITS).round() as i32)
}

fn rgb([r, g, b]: [u8; 3]) -> RGBColor {
    RGBColor(r, g, b)
}

impl<DB: DrawingBackend> Canvas<DB> {
    /// Fills everything.
    ///
    /// # Errors
    /// The drawing library's reason.
    pub fn fill(&self, colour: [u8; 3]) -> Result<(), Reason> {
        self.area.fill(&rgb(colour)).map_err(|e| e.to_string())
    }

    /// Draws a line through points.
    ///
    /// # Errors
    /// The drawing library's reason.
    pub fn line(&self, points: &[(f64, f64)], stroke: Stroke) -> Result<(), Reason> {
        let width = ((stroke.width * UNITS).round() as u32).max(1);
        let style = ShapeStyle { color: rgb(stroke.colour).to_rgba(), filled: false, stroke_width: width };
        let points: Vec<_> = points.iter().map(|&p| units(p)).collect();
        match stroke.dash {
            None => self.area.draw(&PathElement::new(points, style)),
            Some(dash) => {
                let dash = (dash * UNITS).round() as i32;
                self.area.draw(&DashedPathElement::new(points, dash, dash, style))
            }
        }
        .map_err(|e| e.to_string())
    }

    /// Fills a polygon.
    ///
    /// # Errors
    /// The drawing library's reason.
    pub fn polygon(&self, corners: &[(f64, f64)], colour: [u8; 3]) -> Result<(), Reason> {
        let corners: Vec<_> = corners.iter().map(|&p| units(p)).collect();
        self.area.draw(&Polygon::new(corners, rgb(colour).filled())).map_err(|e| e.to_string())
    }

    /// Fills a rectangle between its upper left and lower right corner.
    ///
    /// # Errors
    /// The drawing library's reason.
    pub fn rectangle(&self, from: (f64, f64), to: (f64, f64), colour: [u8; 3]) -> Result<(), Reason> {
        self.polygon(&[from, (to.0, from.1), to, (from.0, to.1)], colour)
    }

    /// Sets text on a baseline.
    ///
    /// # Errors
    /// The drawing library's reason.
    pub fn text(&self, text: &str, (x, y): (f64, f64), lettering: Lettering) -> Result<(), Reason> {
        let Lettering { em, colour, bold, anchor, upwards } = lettering;
        let down = em * self.letters.baseline;
        let (corner, turn) = if upwards {
            ((x - down, y), FontTransform::Rotate270)
        } else {
            ((x, y - down), FontTransform::None)
        };
        let style = if bold { FontStyle::Bold } else { FontStyle::Normal };
        let horizontal = match anchor {
            Anchor::Start => HPos::Left,
            Anchor::Middle => HPos::Center,
            Anchor::End => HPos::Right,
        };
        let font = (FAMILY, em * UNITS * self.letters.size, style).into_font().transform(turn);
        let colour = rgb(colour);
        let style = TextStyle::from(font).color(&colour).pos(Pos::new(horizontal, VPos::Top));
        self.area.draw(&Text::new(text, units(corner), style)).map_err(|e| e.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_breaks_where_it_must() {
        assert_eq!(wrap("n=1\nx y", 12.0, 200.0).unwrap(), ["n=1", "x y"]);
        let lines = wrap("lights=464 range=4.5 list=128 grid=32 preset=quality", 12.0, 236.0).unwrap();
        assert_eq!(lines.len(), 2);
        assert!(lines.iter().all(|line| text_width(line, 12.0, false).unwrap() <= 236.0), "{lines:?}");
        assert_eq!(wrap("unbreakable word", 12.0, 10.0).unwrap(), ["unbreakable", "word"]);
        assert_eq!(wrap("", 12.0, 10.0).unwrap(), [""; 0]);
    }

    #[test]
    fn wider_letters_take_more_room() {
        let width = |text, em| text_width(text, em, false).unwrap();
        assert!(width("MMM", 12.0) > 2.0 * width("iii", 12.0));
        assert!((width("abc", 24.0) / width("abc", 12.0) - 2.0).abs() < 0.02);
    }
}
