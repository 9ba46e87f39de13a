//! A contact sheet: the truth, and of each method its picture and the false-coloured difference, with labels and a scale.

use std::path::Path;

use glam::Vec3;
use image::imageops::{FilterType, overlay, resize};
use image::{DynamicImage, Rgb, RgbImage};
use vlm_shaders::cpu::resolve::{auto_exposure, encode_srgb, luminance, tone_map};

use super::false_colour::false_colour;
use super::numbers::{levels, short};
use crate::plot::canvas::{Anchor, BITMAP_SCALE, Canvas, Lettering, Reason, Stroke, bitmap, wrap};
use crate::plot::{PlotError, write_png};

/// One method's picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// The method.
    pub name: String,
    /// What else to say, one line each.
    pub notes: Vec<String>,
    /// Irradiance, lx, rows from the top.
    pub pixels: Vec<Vec3>,
}

/// Everything on a sheet.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet {
    /// What it shows.
    pub title: String,
    /// Pixels in a row of every picture.
    pub width: u32,
    /// Rows of every picture.
    pub height: u32,
    /// The truth.
    pub truth: Entry,
    /// One per method, each with as many pixels as the truth.
    pub methods: Vec<Entry>,
}

/// Width of a picture on the sheet, pixels of a screen.
const TILE: f64 = 236.0;
/// Between pictures, and round everything.
const GAP: f64 = 16.0;
/// Pictures beside each other, at most.
const COLUMNS: usize = 4;
/// The sheet's title.
const TITLE: f64 = 44.0;
/// A line of a label.
const LINE: f64 = 15.0;
/// The scale below everything.
const SCALE: f64 = 62.0;
const EM: f64 = 11.5;
const INK: [u8; 3] = [34, 34, 34];
const GREY: [u8; 3] = [90, 90, 90];
/// Where nothing is hit.
const NOTHING: [u8; 3] = [24, 26, 30];

impl Sheet {
    /// Writes the sheet as PNG. All pictures are shown with the exposure that suits the truth.
    ///
    /// # Errors
    /// [`PlotError`] if it cannot be drawn, encoded or written.
    pub fn write(&self, path: &Path) -> Result<(), PlotError> {
        let failed = |reason| PlotError::Draw { path: path.to_owned(), reason };
        let layout = self.layout().map_err(failed)?;
        let scale = self.scale();
        let mut sheet =
            bitmap(layout.size, |canvas| self.draw_words(canvas, &layout, scale)).map_err(failed)?;
        let exposure = auto_exposure(&self.truth.pixels);
        let units = f64::from(BITMAP_SCALE);
        for (cell, entry) in std::iter::once(&self.truth).chain(&self.methods).enumerate() {
            let (x, y) = layout.corner(cell);
            let mut place = |picture: RgbImage, y: f64| {
                let (width, height) = ((TILE * units) as u32, (layout.tile_height * units) as u32);
                // Small pictures keep their pixels visible, large ones are averaged.
                let filter = if self.width > width { FilterType::Triangle } else { FilterType::Nearest };
                overlay(
                    &mut sheet,
                    &resize(&picture, width, height, filter),
                    (x * units) as i64,
                    (y * units) as i64,
                );
            };
            place(self.picture(|i| shown(entry.pixels[i] * exposure)), y);
            if cell > 0 {
                place(self.picture(|i| self.difference(entry, i, scale)), y + layout.tile_height + 4.0);
            }
        }
        write_png(&DynamicImage::ImageRgb8(sheet), path)
    }

    fn picture(&self, colour: impl Fn(usize) -> [u8; 3]) -> RgbImage {
        RgbImage::from_fn(self.width, self.height, |x, y| Rgb(colour((y * self.width + x) as usize)))
    }

    fn difference(&self, entry: &Entry, pixel: usize, scale: f64) -> [u8; 3] {
        // A surface that one picture leaves black is lit in another.
        if std::iter::once(&self.truth).chain(&self.methods).all(|entry| entry.pixels[pixel] == Vec3::ZERO) {
            return NOTHING;
        }
        let (image, truth) = (entry.pixels[pixel], self.truth.pixels[pixel]);
        false_colour(f64::from(luminance(image) - luminance(truth)) / (scale * self.mean_luminance()))
    }

    /// Of the truth, over pixels that are lit.
    fn mean_luminance(&self) -> f64 {
        let lit = self.truth.pixels.iter().map(|&p| f64::from(luminance(p))).filter(|l| *l > 0.0);
        let (sum, count) = lit.fold((0.0, 0usize), |(sum, count), l| (sum + l, count + 1));
        if count == 0 { 1.0 } else { sum / count as f64 }
    }

    /// Where the colour scale ends, over the truth's mean luminance: a round number that most pixels of the middle method
    /// stay below, so that one bad method does not whiten all others.
    fn scale(&self) -> f64 {
        let mean = self.mean_luminance();
        let mut ends: Vec<f64> = self
            .methods
            .iter()
            .map(|entry| {
                let pairs = entry.pixels.iter().zip(&self.truth.pixels);
                let mut errors: Vec<f64> =
                    pairs.map(|(&a, &b)| f64::from((luminance(a) - luminance(b)).abs()) / mean).collect();
                errors.sort_by(f64::total_cmp);
                errors.get(errors.len() * 98 / 100).copied().unwrap_or(0.0)
            })
            .collect();
        ends.sort_by(f64::total_cmp);
        let middle =
            ends.get(ends.len() / 2).copied().filter(|end| end.is_finite()).unwrap_or(1.0).clamp(1e-4, 1e4);
        levels(middle, 10.0 * middle, 4).first().copied().unwrap_or(middle)
    }

    fn layout(&self) -> Result<Layout, Reason> {
        let entries = 1 + self.methods.len();
        // As few rows as it takes, of about equal length.
        let columns = entries.div_ceil(entries.div_ceil(COLUMNS));
        let tile_height = (TILE * f64::from(self.height) / f64::from(self.width.max(1))).round();
        let mut lines = 0;
        for entry in std::iter::once(&self.truth).chain(&self.methods) {
            lines = lines.max(1 + wrapped(&entry.notes)?.len());
        }
        let label = LINE * lines as f64 + 8.0;
        let cell_height = label + 2.0 * tile_height + 4.0 + GAP;
        let rows = entries.div_ceil(columns) as f64;
        let width = GAP + columns as f64 * (TILE + GAP);
        let height = TITLE + rows * cell_height + SCALE;
        Ok(Layout {
            size: (width.max(520.0) as u32, height as u32),
            columns,
            tile_height,
            label,
            cell_height,
        })
    }

    fn draw_words<DB: plotters::prelude::DrawingBackend>(
        &self,
        canvas: &Canvas<DB>,
        layout: &Layout,
        scale: f64,
    ) -> Result<(), Reason> {
        canvas.text(&self.title, (GAP, 28.0), Lettering { em: 17.0, bold: true, ..lettering() })?;
        for (cell, entry) in std::iter::once(&self.truth).chain(&self.methods).enumerate() {
            let (x, y) = layout.corner(cell);
            let first = y - layout.label + LINE;
            canvas.text(&entry.name, (x, first), Lettering { em: 13.0, bold: true, ..lettering() })?;
            for (line, note) in wrapped(&entry.notes)?.iter().enumerate() {
                let y = first + LINE * (line + 1) as f64;
                canvas.text(note, (x, y), Lettering { colour: GREY, ..lettering() })?;
            }
        }
        draw_scale(canvas, scale, f64::from(layout.size.1) - SCALE)
    }
}

/// Where everything is, pixels of a screen.
struct Layout {
    size: (u32, u32),
    columns: usize,
    tile_height: f64,
    label: f64,
    cell_height: f64,
}

impl Layout {
    /// Upper left corner of a cell's picture, below its label.
    fn corner(&self, cell: usize) -> (f64, f64) {
        let (column, row) = (cell % self.columns, cell / self.columns);
        (GAP + column as f64 * (TILE + GAP), TITLE + row as f64 * self.cell_height + self.label)
    }
}

fn lettering() -> Lettering {
    Lettering { em: EM, colour: INK, bold: false, anchor: Anchor::Start, upwards: false }
}

/// The notes in lines that fit above a picture.
fn wrapped(notes: &[String]) -> Result<Vec<String>, Reason> {
    wrap(&notes.join("\n"), EM, TILE)
}

fn shown(exposed: Vec3) -> [u8; 3] {
    if exposed == Vec3::ZERO { NOTHING } else { encode_srgb(tone_map(exposed)) }
}

fn draw_scale<DB: plotters::prelude::DrawingBackend>(
    canvas: &Canvas<DB>,
    scale: f64,
    top: f64,
) -> Result<(), Reason> {
    const STEPS: usize = 240;
    let (left, width, height) = (GAP, 480.0, 14.0);
    for step in 0..STEPS {
        let at = |step: usize| left + width * step as f64 / STEPS as f64;
        let error = 2.0 * (step as f64 + 0.5) / STEPS as f64 - 1.0;
        canvas.rectangle((at(step), top), (at(step + 1), top + height), false_colour(error))?;
    }
    for quarter in -2..=2 {
        let share = f64::from(quarter) / 2.0;
        let x = left + 0.5 * width * (1.0 + share);
        canvas.line(
            &[(x, top + height), (x, top + height + 4.0)],
            Stroke { colour: INK, width: 1.0, dash: None },
        )?;
        let number = format!("{}{}", if quarter > 0 { "+" } else { "" }, short(share * scale));
        let anchor = [Anchor::Start, Anchor::Middle, Anchor::Middle, Anchor::Middle, Anchor::End]
            [(quarter + 2) as usize];
        canvas.text(&number, (x, top + height + 16.0), Lettering { anchor, ..lettering() })?;
    }
    let words = "difference of luminance over the truth's mean; blue: too dark, red: too bright; ends hold what lies beyond";
    canvas.text(words, (left, top + height + 34.0), Lettering { colour: GREY, ..lettering() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(name: &str, scale: f32) -> Entry {
        let pixel = |i: usize| Vec3::new(1.0, 0.8, 0.6) * (1.0 + (i % 8) as f32) * scale;
        Entry {
            name: name.to_owned(),
            notes: vec!["lights=464 range=4.5 list=128 grid=32 and more of that".to_owned()],
            pixels: (0..64).map(pixel).collect(),
        }
    }

    fn sheet(scales: &[f32]) -> Sheet {
        let methods = scales.iter().map(|&scale| entry("method", scale)).collect();
        Sheet { title: "box".to_owned(), width: 8, height: 8, truth: entry("truth", 1.0), methods }
    }

    fn written(sheet: &Sheet) -> RgbImage {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sheet.png");
        sheet.write(&path).unwrap();
        image::open(&path).unwrap().into_rgb8()
    }

    /// Colour in the middle of a cell's difference.
    fn difference_at(sheet: &Sheet, picture: &RgbImage, cell: usize) -> [u8; 3] {
        let layout = sheet.layout().unwrap();
        let (x, y) = layout.corner(cell);
        let (x, y) = (x + 0.5 * TILE + 3.0, y + 1.5 * layout.tile_height + 4.0);
        picture.get_pixel((2.0 * x) as u32, (2.0 * y) as u32).0
    }

    #[test]
    fn too_dark_is_blue_too_bright_is_red_and_none_is_white() {
        let sheet = sheet(&[0.7, 1.3, 1.0]);
        let picture = written(&sheet);
        let [dark, bright, same] = [1, 2, 3].map(|cell| difference_at(&sheet, &picture, cell));
        assert!(
            dark[2] > dark[0].saturating_add(30) && bright[0] > bright[2].saturating_add(30),
            "{dark:?} {bright:?}"
        );
        assert_eq!(same, false_colour(0.0));
    }

    #[test]
    fn black_surface_is_no_background() {
        let mut sheet = sheet(&[1.0, 1.0]);
        for (pixel, lit) in [(3, 1.0), (4, 0.0)] {
            sheet.truth.pixels[pixel] = Vec3::ZERO;
            sheet.methods[0].pixels[pixel] = Vec3::ZERO;
            sheet.methods[1].pixels[pixel] = Vec3::splat(lit);
        }
        let colour = |pixel| sheet.difference(&sheet.methods[0], pixel, 1.0);
        assert_eq!((colour(3), colour(4)), (false_colour(0.0), NOTHING));
    }

    #[test]
    fn the_scale_is_round_and_that_of_the_middle_method() {
        // The brightest pixel is 8 / 4.5 times the mean.
        assert_eq!(sheet(&[0.0, 0.9, 0.95]).scale(), 0.2);
        assert_eq!(sheet(&[0.5, 0.0, 1.01]).scale(), 1.0);
    }

    #[test]
    fn sheets_have_rows_of_about_equal_length() {
        assert_eq!(sheet(&[1.0; 2]).layout().unwrap().columns, 3);
        assert_eq!(sheet(&[1.0; 3]).layout().unwrap().columns, 4);
        let two_rows = sheet(&[1.0; 4]).layout().unwrap();
        assert_eq!((two_rows.columns, two_rows.corner(3).0), (3, two_rows.corner(0).0));
        assert!(two_rows.corner(3).1 > two_rows.corner(0).1);
    }
}
