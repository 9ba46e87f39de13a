//! Lays out a figure: titles above, axes round the plot, the legend beside it, so that nothing covers a point.

use plotters::prelude::DrawingBackend;

use super::Figure;
use super::axis::{Axis, Tick};
use super::canvas::{Anchor, Canvas, Lettering, Reason, Stroke, text_width, wrap};
use super::curves::{Curve, Line, Marker, Point, marker_outline, series_colour};

/// Width and height of every figure, pixels.
pub(crate) const SIZE: (u32, u32) = (900, 560);

const INK: [u8; 3] = [34, 34, 34];
const GREY: [u8; 3] = [100, 100, 100];
const GRID_MAJOR: [u8; 3] = [208, 208, 208];
const GRID_MINOR: [u8; 3] = [236, 236, 236];
const WHITE: [u8; 3] = [255, 255, 255];

const EM: f64 = 13.0;
/// Between the figure's edge and what is in it.
const EDGE: f64 = 14.0;
const SUBTITLE_EM: f64 = 12.0;
const SUBTITLE_LINE: f64 = 16.0;
/// From one line of the legend to the next.
const LEGEND_LINE: f64 = 21.0;
/// Length of the piece of line in the legend.
const LEGEND_KEY: f64 = 30.0;

/// Where the plot is, and what its edges stand for.
struct Plot<'a> {
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
    x: (&'a Axis, (f64, f64)),
    y: (&'a Axis, (f64, f64)),
}

impl Plot<'_> {
    fn across(&self, x: f64) -> f64 {
        self.left + (self.right - self.left) * self.x.0.place(x, self.x.1)
    }

    fn down(&self, y: f64) -> f64 {
        self.bottom - (self.bottom - self.top) * self.y.0.place(y, self.y.1)
    }

    /// Where the point is drawn, if the axes have a place for it.
    fn place(&self, point: &Point) -> Option<(f64, f64)> {
        let shown = self.x.0.shows(point.x, Some(self.x.1)) && self.y.0.shows(point.y, Some(self.y.1));
        shown.then(|| (self.across(point.x), self.down(point.y)))
    }
}

/// Draws the whole figure.
pub(crate) fn figure<DB: DrawingBackend>(canvas: &Canvas<DB>, figure: &Figure) -> Result<(), Reason> {
    canvas.fill(WHITE)?;
    let plot = layout(figure)?;
    draw_titles(canvas, figure, &plot)?;
    draw_axes(canvas, &plot)?;
    for curve in &figure.curves {
        draw_curve(canvas, &plot, curve)?;
    }
    draw_legend(canvas, figure, &plot)?;
    draw_note(canvas, figure, &plot)
}

fn lettering(em: f64, colour: [u8; 3], anchor: Anchor) -> Lettering {
    Lettering { em, colour, bold: false, anchor, upwards: false }
}

fn layout(figure: &Figure) -> Result<Plot<'_>, Reason> {
    let points = || figure.curves.iter().flat_map(|curve| &curve.points);
    let spread = |value: f64, spread: Option<(f64, f64)>| {
        let (low, high) = spread.unwrap_or((value, value));
        [value, low, high]
    };
    let x_range = figure.x.cover(points().flat_map(|p| spread(p.x, p.x_spread)));
    let y_range = figure.y.cover(points().flat_map(|p| spread(p.y, p.y_spread)));
    let ticks = figure.y.ticks(y_range);
    let labels = widest(ticks.iter().filter_map(|tick| tick.label.as_deref()))?;
    let names = widest(figure.curves.iter().map(|curve| curve.name.as_str()))?;
    let legend = if names > 0.0 { LEGEND_KEY + 8.0 + names + EDGE } else { 0.0 };
    let left = EDGE + EM + 12.0 + labels + 8.0;
    let subtitle = subtitle_lines(figure, left)?.len();
    Ok(Plot {
        left,
        right: f64::from(SIZE.0) - EDGE - legend - 8.0,
        top: 44.0 + if subtitle == 0 { 0.0 } else { 4.0 + SUBTITLE_LINE * subtitle as f64 },
        bottom: f64::from(SIZE.1) - 68.0,
        x: (&figure.x, x_range),
        y: (&figure.y, y_range),
    })
}

fn widest<'a>(mut texts: impl Iterator<Item = &'a str>) -> Result<f64, Reason> {
    texts.try_fold(0f64, |widest, text| Ok(widest.max(text_width(text, EM, false)?)))
}

/// The subtitle, broken at the figure's edge.
fn subtitle_lines(figure: &Figure, left: f64) -> Result<Vec<String>, Reason> {
    wrap(&figure.subtitle, SUBTITLE_EM, f64::from(SIZE.0) - EDGE - left)
}

fn draw_titles<DB: DrawingBackend>(
    canvas: &Canvas<DB>,
    figure: &Figure,
    plot: &Plot<'_>,
) -> Result<(), Reason> {
    let title = Lettering { bold: true, ..lettering(17.0, INK, Anchor::Start) };
    canvas.text(&figure.title, (plot.left, 28.0), title)?;
    for (i, line) in subtitle_lines(figure, plot.left)?.iter().enumerate() {
        let baseline = 49.0 + SUBTITLE_LINE * i as f64;
        canvas.text(line, (plot.left, baseline), lettering(SUBTITLE_EM, GREY, Anchor::Start))?;
    }
    let middle = (0.5 * (plot.left + plot.right), 0.5 * (plot.top + plot.bottom));
    let label = lettering(EM + 1.0, INK, Anchor::Middle);
    canvas.text(&figure.x.label, (middle.0, plot.bottom + 43.0), label)?;
    canvas.text(&figure.y.label, (EDGE + EM, middle.1), Lettering { upwards: true, ..label })
}

fn draw_axes<DB: DrawingBackend>(canvas: &Canvas<DB>, plot: &Plot<'_>) -> Result<(), Reason> {
    let Plot { left, right, top, bottom, .. } = *plot;
    let (columns, rows) = (plot.x.0.ticks(plot.x.1), plot.y.0.ticks(plot.y.1));
    let grid = |tick: &Tick| {
        let colour = if tick.label.is_some() { GRID_MAJOR } else { GRID_MINOR };
        Stroke { colour, width: 1.0, dash: None }
    };
    // The strong lines last, so that no weak one crosses them.
    for strong in [false, true] {
        for tick in columns.iter().filter(|tick| tick.label.is_some() == strong) {
            let x = plot.across(tick.value);
            canvas.line(&[(x, top), (x, bottom)], grid(tick))?;
        }
        for tick in rows.iter().filter(|tick| tick.label.is_some() == strong) {
            let y = plot.down(tick.value);
            canvas.line(&[(left, y), (right, y)], grid(tick))?;
        }
    }
    let frame = Stroke { colour: INK, width: 1.0, dash: None };
    canvas.line(&[(left, top), (left, bottom), (right, bottom)], frame)?;
    draw_column_labels(canvas, plot, &columns)?;
    for tick in &rows {
        let label = tick.label.as_deref().unwrap_or_default();
        canvas.text(
            label,
            (left - 8.0, plot.down(tick.value) + 0.36 * EM),
            lettering(EM, INK, Anchor::End),
        )?;
    }
    Ok(())
}

/// A label that would touch its neighbour is left out.
fn draw_column_labels<DB: DrawingBackend>(
    canvas: &Canvas<DB>,
    plot: &Plot<'_>,
    ticks: &[Tick],
) -> Result<(), Reason> {
    let mut free_from = f64::NEG_INFINITY;
    for tick in ticks {
        let (x, label) = (plot.across(tick.value), tick.label.as_deref().unwrap_or_default());
        let half = 0.5 * text_width(label, EM, false)?;
        if x - half > free_from && !label.is_empty() {
            canvas.text(label, (x, plot.bottom + 20.0), lettering(EM, INK, Anchor::Middle))?;
            free_from = x + half + 6.0;
        }
    }
    Ok(())
}

/// A paler colour: what stands behind.
fn pale(colour: [u8; 3]) -> [u8; 3] {
    colour.map(|channel| (0.4 * f64::from(channel) + 0.6 * 255.0) as u8)
}

fn colour(curve: &Curve) -> [u8; 3] {
    let colour = series_colour(curve.series);
    if curve.faint { pale(colour) } else { colour }
}

fn draw_curve<DB: DrawingBackend>(canvas: &Canvas<DB>, plot: &Plot<'_>, curve: &Curve) -> Result<(), Reason> {
    let places: Vec<_> = curve.points.iter().map(|point| plot.place(point)).collect();
    let placed = || curve.points.iter().zip(&places).filter_map(|(point, place)| Some((point, (*place)?)));
    for (point, place) in placed() {
        draw_spread(canvas, plot, point, place, pale(series_colour(curve.series)))?;
    }
    for run in places.split(Option::is_none) {
        let run: Vec<_> = run.iter().flatten().copied().collect();
        draw_line(canvas, curve, &run)?;
    }
    placed().try_for_each(|(_, place)| draw_marker(canvas, curve, place))
}

fn draw_line<DB: DrawingBackend>(
    canvas: &Canvas<DB>,
    curve: &Curve,
    run: &[(f64, f64)],
) -> Result<(), Reason> {
    let dash = match curve.line {
        Line::Hidden => return Ok(()),
        Line::Solid => None,
        Line::Dashed => Some(5.0),
    };
    let width = if curve.faint { 1.0 } else { 2.0 };
    if run.len() < 2 { Ok(()) } else { canvas.line(run, Stroke { colour: colour(curve), width, dash }) }
}

/// Bars from the least to the greatest value, with caps.
fn draw_spread<DB: DrawingBackend>(
    canvas: &Canvas<DB>,
    plot: &Plot<'_>,
    point: &Point,
    (x, y): (f64, f64),
    colour: [u8; 3],
) -> Result<(), Reason> {
    const CAP: f64 = 3.0;
    let stroke = Stroke { colour, width: 1.5, dash: None };
    let whole = |axis: (&Axis, (f64, f64)), spread: Option<(f64, f64)>| {
        spread.filter(|s| axis.0.shows(s.0, Some(axis.1)) && axis.0.shows(s.1, Some(axis.1)))
    };
    if let Some((low, high)) = whole(plot.x, point.x_spread) {
        let (left, right) = (plot.across(low), plot.across(high));
        canvas.line(&[(left, y), (right, y)], stroke)?;
        for end in [left, right] {
            canvas.line(&[(end, y - CAP), (end, y + CAP)], stroke)?;
        }
    }
    if let Some((low, high)) = whole(plot.y, point.y_spread) {
        let (bottom, top) = (plot.down(low), plot.down(high));
        canvas.line(&[(x, bottom), (x, top)], stroke)?;
        for end in [bottom, top] {
            canvas.line(&[(x - CAP, end), (x + CAP, end)], stroke)?;
        }
    }
    Ok(())
}

fn draw_marker<DB: DrawingBackend>(canvas: &Canvas<DB>, curve: &Curve, at: (f64, f64)) -> Result<(), Reason> {
    let radius = if curve.faint { 2.6 } else { 4.2 };
    let outline = |radius: f64| -> Vec<(f64, f64)> {
        marker_outline(curve.series).iter().map(|(x, y)| (at.0 + radius * x, at.1 + radius * y)).collect()
    };
    match curve.marker {
        Marker::Hidden => Ok(()),
        Marker::Filled => canvas.polygon(&outline(radius), colour(curve)),
        Marker::Hollow => {
            canvas.polygon(&outline(radius), colour(curve))?;
            canvas.polygon(&outline(0.6 * radius), WHITE)
        }
    }
}

fn draw_legend<DB: DrawingBackend>(
    canvas: &Canvas<DB>,
    figure: &Figure,
    plot: &Plot<'_>,
) -> Result<(), Reason> {
    let left = plot.right + EDGE;
    for (row, curve) in figure.curves.iter().filter(|curve| !curve.name.is_empty()).enumerate() {
        let y = plot.top + 8.0 + LEGEND_LINE * row as f64;
        draw_line(canvas, curve, &[(left, y), (left + LEGEND_KEY, y)])?;
        draw_marker(canvas, curve, (left + 0.5 * LEGEND_KEY, y))?;
        let text = (left + LEGEND_KEY + 8.0, y + 0.36 * EM);
        canvas.text(&curve.name, text, lettering(EM, INK, Anchor::Start))?;
    }
    Ok(())
}

/// Says how many points the axes could not show.
fn draw_note<DB: DrawingBackend>(
    canvas: &Canvas<DB>,
    figure: &Figure,
    plot: &Plot<'_>,
) -> Result<(), Reason> {
    let points = figure.curves.iter().flat_map(|curve| &curve.points);
    let note = match points.filter(|point| plot.place(point).is_none()).count() {
        0 => return Ok(()),
        1 => "1 point is not shown: an axis has no place for its value".to_owned(),
        n => format!("{n} points are not shown: an axis has no place for their values"),
    };
    let corner = (f64::from(SIZE.0) - EDGE, f64::from(SIZE.1) - 8.0);
    canvas.text(&note, corner, lettering(11.0, GREY, Anchor::End))
}
