//! Figures: named curves over two axes, the same picture as SVG and as PNG.
//!
//! The PNG's text comes from an embedded font, so that a machine without fonts draws it too.

mod axis;
pub mod canvas;
mod curves;
mod draw;

use std::path::{Path, PathBuf};

pub use axis::{Axis, Scale};
pub use curves::{Curve, Line, Marker, Point, SERIES, series_colour};

/// A picture of curves.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Figure {
    /// What it shows.
    pub title: String,
    /// What a reader must know to read it: device, conditions. Broken where it does not fit; may be empty.
    pub subtitle: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// Drawn in this order, the last on top; the legend has the same order.
    pub curves: Vec<Curve>,
}

/// Why a figure was not written.
#[derive(Debug, thiserror::Error)]
pub enum PlotError {
    /// The picture could not be drawn.
    #[error("{path}: the figure could not be drawn: {reason}", path = path.display())]
    Draw {
        /// The file that was to be written.
        path: PathBuf,
        /// The drawing library's reason.
        reason: String,
    },
    /// The pixels could not be encoded.
    #[error("{path}: the figure could not be encoded: {source}", path = path.display())]
    Encode {
        /// The file that was to be written.
        path: PathBuf,
        /// The encoder's reason.
        source: image::ImageError,
    },
    /// The file could not be written.
    #[error(transparent)]
    Write(#[from] vlm_format::Error),
}

impl Figure {
    /// Writes `path` with `.svg` and with `.png` appended to its name.
    ///
    /// A point that its axis cannot show (not finite, 0 or less on a logarithmic axis, outside a given range) is left
    /// out, its curve is broken there, and a line below the figure counts such points.
    ///
    /// # Errors
    /// [`PlotError`] if the figure cannot be drawn, encoded or written; no partial file is left.
    pub fn write(&self, path: &Path) -> Result<(), PlotError> {
        let (svg_path, png_path) = (with_extension(path, "svg"), with_extension(path, "png"));
        let failed = |path: &Path| {
            let path = path.to_owned();
            move |reason| PlotError::Draw { path, reason }
        };
        let svg = canvas::svg(draw::SIZE, |canvas| draw::figure(canvas, self)).map_err(failed(&svg_path))?;
        let png =
            canvas::bitmap(draw::SIZE, |canvas| draw::figure(canvas, self)).map_err(failed(&png_path))?;
        vlm_format::write_file(&svg_path, svg.as_bytes())?;
        write_png(&image::DynamicImage::ImageRgb8(png), &png_path)
    }
}

/// Writes a picture as PNG.
///
/// # Errors
/// [`PlotError`] if it cannot be encoded or written; no partial file is left.
pub fn write_png(picture: &image::DynamicImage, path: &Path) -> Result<(), PlotError> {
    let mut file = std::io::Cursor::new(Vec::new());
    let encoded = picture.write_to(&mut file, image::ImageFormat::Png);
    encoded.map_err(|source| PlotError::Encode { path: path.to_owned(), source })?;
    Ok(vlm_format::write_file(path, file.get_ref())?)
}

/// Appends, since a name may hold dots of its own.
fn with_extension(path: &Path, extension: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".");
    name.push(extension);
    PathBuf::from(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure() -> Figure {
        let falling =
            |scale: f64| (0..6).map(move |i| Point::new(10f64.powi(i - 4), scale / f64::from(i + 1)));
        Figure {
            title: "Error over time <a & b>".to_owned(),
            subtitle: "made up".to_owned(),
            x: Axis::log("time (s)"),
            y: Axis::log("error"),
            curves: vec![
                Curve::new("first", 0, falling(0.5).collect()),
                Curve::new("second", 1, falling(0.2).collect()),
            ],
        }
    }

    fn write(figure: &Figure) -> (String, image::RgbImage) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("v1.5_error");
        figure.write(&path).unwrap();
        let svg = std::fs::read_to_string(folder.path().join("v1.5_error.svg")).unwrap();
        (svg, image::open(folder.path().join("v1.5_error.png")).unwrap().into_rgb8())
    }

    fn has_colour(picture: &image::RgbImage, series: usize) -> bool {
        picture.pixels().any(|pixel| pixel.0 == series_colour(series))
    }

    #[test]
    fn both_files_show_every_curve_and_every_word() {
        let (svg, png) = write(&figure());
        for word in ["Error over time &lt;a &amp; b&gt;", "made up", "time (s)", "error", "first", "second"] {
            assert!(svg.contains(word), "{word}");
        }
        assert!(has_colour(&png, 0) && has_colour(&png, 1));
        assert!(!has_colour(&png, 2), "the negative control");
        assert!(!svg.contains("not shown"));
    }

    #[test]
    fn the_png_holds_text() {
        let (_, named) = write(&figure());
        let (_, nameless) = write(&Figure { title: String::new(), subtitle: String::new(), ..figure() });
        let dark_above = |picture: &image::RgbImage| {
            picture.enumerate_pixels().filter(|(_, y, pixel)| *y < 80 && pixel.0[0] < 128).count()
        };
        assert!(dark_above(&named) > 500);
        assert_eq!(dark_above(&nameless), 0, "the negative control");
    }

    #[test]
    fn what_cannot_be_shown_is_counted() {
        let mut figure = figure();
        figure.curves[0].points.push(Point::new(1.0, 0.0));
        figure.curves[0].points.push(Point::new(f64::NAN, 1.0));
        assert!(write(&figure).0.contains("2 points are not shown"));
    }

    #[test]
    fn an_empty_figure_is_drawn() {
        let empty = Figure { x: Axis::log("x"), y: Axis::linear("y"), ..Figure::default() };
        assert!(write(&empty).0.contains("</svg>"));
    }

    #[test]
    fn the_same_figure_gives_the_same_bytes() {
        assert_eq!(write(&figure()), write(&figure()));
    }

    #[test]
    fn a_missing_folder_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let message = figure().write(&folder.path().join("none").join("f")).unwrap_err().to_string();
        assert!(message.contains("none"), "{message}");
    }
}
