//! Curves: points, and how they look.

/// One point, with the spread of its values where they are known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Point {
    /// Horizontal value.
    pub x: f64,
    /// Vertical value.
    pub y: f64,
    /// Least and greatest horizontal value, drawn as a bar.
    pub x_spread: Option<(f64, f64)>,
    /// Least and greatest vertical value, drawn as a bar.
    pub y_spread: Option<(f64, f64)>,
}

impl Point {
    /// A point without spread.
    #[must_use]
    pub fn new(x: f64, y: f64) -> Self {
        Self { x, y, x_spread: None, y_spread: None }
    }
}

/// How the points of a curve are joined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Line {
    /// Without gaps.
    #[default]
    Solid,
    /// Dashes.
    Dashed,
    /// Not at all.
    Hidden,
}

/// How the points of a curve are marked. The shape is the series' own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Marker {
    /// A full shape.
    #[default]
    Filled,
    /// A shape's outline, filled white.
    Hollow,
    /// None.
    Hidden,
}

/// Points that belong together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curve {
    /// Its line in the legend; without a name it has none.
    pub name: String,
    /// Its colour and the shape of its markers: below [`SERIES`] all differ, beyond they repeat.
    pub series: usize,
    /// In the order in which the line joins them.
    pub points: Vec<Point>,
    /// How points are joined.
    pub line: Line,
    /// How points are marked.
    pub marker: Marker,
    /// Thinner, smaller and paler: for what stands behind another curve.
    pub faint: bool,
}

impl Curve {
    /// A solid line with filled markers.
    #[must_use]
    pub fn new(name: &str, series: usize, points: Vec<Point>) -> Self {
        Self { name: name.to_owned(), series, points, ..Self::default() }
    }
}

/// Number of series that differ in colour and shape.
pub const SERIES: usize = 8;

/// Okabe and Ito's colours (2008), which people with any of the usual colour blindnesses tell apart; their yellow, too
/// pale on white, is replaced by a grey.
const COLOURS: [[u8; 3]; SERIES] = [
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [0, 0, 0],
    [230, 159, 0],
    [86, 180, 233],
    [128, 128, 128],
];

/// The colour of a series, sRGB.
#[must_use]
pub fn series_colour(series: usize) -> [u8; 3] {
    COLOURS[series % SERIES]
}

/// The outline of a series' marker round the origin, of about equal area, for a radius of 1. Y points down.
pub(crate) fn marker_outline(series: usize) -> Vec<(f64, f64)> {
    let polygon = |corners: u32, radius: f64, turn: f64| -> Vec<(f64, f64)> {
        let angle = |i: u32| (turn + f64::from(i) / f64::from(corners)) * std::f64::consts::TAU;
        (0..corners).map(|i| (radius * angle(i).sin(), -radius * angle(i).cos())).collect()
    };
    // A plus sign, turned by 45 degrees for the cross.
    let cross = |turn: f64| -> Vec<(f64, f64)> {
        let (long, short) = (1.25, 0.38);
        let arm = [(short, short), (short, long), (-short, long)];
        let (s, c) = (turn * std::f64::consts::TAU).sin_cos();
        let turned = |(x, y): (f64, f64)| (c * x - s * y, s * x + c * y);
        (0..4).flat_map(|i| arm.map(|p| (0..i).fold(p, |(x, y), _| (-y, x)))).map(turned).collect()
    };
    match series % SERIES {
        0 => polygon(24, 1.0, 0.0),
        1 => polygon(4, 1.25, 0.125),
        2 => polygon(3, 1.4, 0.0),
        3 => polygon(4, 1.3, 0.0),
        4 => polygon(3, 1.4, 0.5),
        5 => cross(0.0),
        6 => cross(0.125),
        _ => polygon(5, 1.2, 0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn series_differ_in_colour_and_shape() {
        for i in 0..SERIES {
            for j in 0..i {
                assert_ne!(series_colour(i), series_colour(j));
                assert_ne!(marker_outline(i), marker_outline(j));
            }
        }
        assert_eq!(series_colour(SERIES), series_colour(0));
    }

    #[test]
    fn markers_are_of_about_equal_area() {
        for series in 0..SERIES {
            let outline = marker_outline(series);
            let next = outline.iter().cycle().skip(1);
            let area: f64 = outline.iter().zip(next).map(|(a, b)| 0.5 * (a.0 * b.1 - a.1 * b.0)).sum();
            assert!((2.0..4.0).contains(&area.abs()), "{series}: {area}");
        }
    }
}
