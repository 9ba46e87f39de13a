//! How long the passes of a frame take, beside the bare form factor on the same device, in interleaved repeats.

use std::time::Instant;

use glam::Vec3;
use serde::{Deserialize, Serialize};
use vlm_bake::gbuffer::GBuffer;
use vlm_bake::progress::Silent;
use vlm_bake::render::{RenderError, gather_by_grid};
use vlm_bake::scene::Camera;
use vlm_bake::shade::TraceScene;
use vlm_runtime::{Error, Frame, FrameStats, PunctualLight, Settings, Visibility};
use vlm_shaders::cpu::form_factor::LightGeometry;

use crate::baked::Baked;
use crate::form_factor::gpu::{GpuError, GpuFormFactor};
use crate::runtime_gpu::{Host, Pictures, view, visibility};
use crate::text::table;

/// Lights of the bare form factor: more than any pixel meets, few enough that a repeat is short.
const KERNEL_LIGHTS: usize = 64;

/// Reach of the lamp of [`Case::Lamp`] over the scene's extent.
const LAMP_RANGE: f32 = 0.05;

/// What changes from frame to frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Case {
    /// The real lights: everything is done again.
    Lights,
    /// A lamp of short range.
    Lamp,
    /// The camera alone.
    Camera,
}

impl Case {
    const ALL: [Self; 3] = [Self::Lights, Self::Lamp, Self::Camera];

    fn name(self) -> &'static str {
        match self {
            Self::Lights => "lights",
            Self::Lamp => "lamp",
            Self::Camera => "camera",
        }
    }
}

/// What took how long, once.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The scene.
    pub scene: String,
    /// The camera.
    pub camera: String,
    /// Pixels along x.
    pub width: u32,
    /// Pixels along y.
    pub height: u32,
    /// Virtual lights.
    pub lights: usize,
    /// Probes of the grid.
    pub probes: usize,
    /// `gpu` or `cpu`.
    pub backend: String,
    /// What changed: `lights`, `lamp` or `camera`; empty for the form factor.
    pub changed: String,
    /// The pass, `frame` for all of them from submission to completion, or `form factor`.
    pub pass: String,
    /// Number of the repeat.
    pub repeat: usize,
    /// How long it took, seconds.
    pub seconds: f64,
    /// What it worked on: pairs of a pixel and a light, lights or probes; 0 where that is not counted.
    pub items: u64,
}

/// Why nothing is measured.
#[derive(Debug, thiserror::Error)]
pub enum FrameError {
    /// The runtime refuses.
    #[error(transparent)]
    Runtime(#[from] Error),
    /// The device fails.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The processor's gather refuses.
    #[error(transparent)]
    Render(#[from] RenderError),
}

/// A scene by a camera at one size, ready to be measured again and again.
pub struct GpuFrame<'a> {
    trace: &'a TraceScene<'a>,
    host: Host,
    pictures: Pictures,
    kernel: GpuFormFactor,
    kernel_lights: Vec<LightGeometry>,
    points: Vec<(Vec3, Vec3)>,
    view: vlm_runtime::View,
    lamp: PunctualLight,
    /// With a row for the lamp.
    seen: Vec<f32>,
    row: Row,
}

impl<'a> GpuFrame<'a> {
    /// Puts everything on the device; without a grid, every light is summed at every pixel.
    ///
    /// # Errors
    /// Where the device or the asset fails.
    pub fn new(
        baked: &Baked,
        trace: &'a TraceScene<'a>,
        camera: &Camera,
        ((width, height), no_grid): ((u32, u32), bool),
    ) -> Result<Self, FrameError> {
        let Baked { name, scene, asset } = baked;
        let gbuffer = GBuffer::trace(trace, camera, width, height);
        let settings = Settings { count_pairs: true, time_passes: true, ..Settings::default() };
        let fewest_lights_for_grid = if no_grid { u32::MAX } else { settings.fewest_lights_for_grid };
        let settings = Settings { fewest_lights_for_grid, ..settings };
        let host = Host::new(asset, settings)?;
        let pictures = host.upload(&gbuffer, camera, |_| 0);
        let lights = &asset.lights().geometry;
        let step = lights.len().div_ceil(KERNEL_LIGHTS).max(1);
        let points = host.renderer.points()?.to_vec();
        let mut seen = visibility(trace, &points);
        seen.extend(vec![1.0; points.len()]);
        let extent = scene.bounds().map_or(1.0, |[low, high]| low.distance(high) as f32);
        let middle = points.get(points.len() / 2).copied().unwrap_or_default();
        let position = middle.position + middle.normal * (0.2 * LAMP_RANGE * extent);
        Ok(Self {
            trace,
            host,
            pictures,
            kernel: GpuFormFactor::sums()?,
            kernel_lights: lights.iter().step_by(step).copied().collect(),
            points: gbuffer.points.iter().flatten().map(|p| (p.position, p.normal)).collect(),
            view: view(camera, &gbuffer, 1.0),
            lamp: PunctualLight {
                range: LAMP_RANGE * extent,
                ..PunctualLight::point(position, Vec3::splat(extent))
            },
            seen,
            row: Row {
                scene: name.clone(),
                camera: camera.name.clone(),
                width,
                height,
                lights: lights.len(),
                probes: asset.data().grid.as_ref().filter(|_| !no_grid).map_or(0, |grid| grid.probes.len()),
                backend: "gpu".to_owned(),
                ..Row::default()
            },
        })
    }

    /// One repeat: the bare form factor, then a frame of each kind.
    ///
    /// # Errors
    /// If the device is lost.
    pub fn measure(&mut self, repeat: usize) -> Result<Vec<Row>, FrameError> {
        let (_, rate) = self.kernel.measure_sums(&self.kernel_lights, &self.points)?;
        let pairs = (self.kernel_lights.len() * self.points.len()) as f64;
        let row = Row { repeat, ..self.row.clone() };
        let (seconds, items) = (pairs / rate, pairs as u64);
        let mut rows = vec![Row { pass: "form factor".to_owned(), seconds, items, ..row.clone() }];
        // So that the first case, too, changes nothing but what it is named for.
        let mut frame = (1.0 + 0.001 * repeat as f32, 1.0);
        self.run(frame)?;
        for case in Case::ALL {
            match case {
                Case::Lights => frame.0 *= 1.0005,
                Case::Lamp => frame.1 *= 2.0,
                Case::Camera => self.view.exposure *= 1.001,
            }
            let row = Row { changed: case.name().to_owned(), ..row.clone() };
            rows.extend(self.run(frame)?.into_iter().map(|(pass, seconds, items)| Row {
                pass: pass.to_owned(),
                seconds,
                items,
                ..row.clone()
            }));
        }
        Ok(rows)
    }

    /// A frame with the lights and the lamp this much brighter: passes, seconds, and items.
    fn run(&mut self, (lights, lamp): (f32, f32)) -> Result<Vec<(&'static str, f64, u64)>, FrameError> {
        let brighter =
            |l: &PunctualLight, factor: f32| PunctualLight { intensity: l.intensity * factor, ..*l };
        let mut all: Vec<PunctualLight> = self.trace.lights.iter().map(|l| brighter(l, lights)).collect();
        all.push(brighter(&self.lamp, lamp));
        let visibility = Visibility::Given(&self.seen);
        let frame = Frame { lights: &all, visibility, view: self.view, ..Frame::default() };
        let start = Instant::now();
        let stats = self.host.draw(&frame, &self.pictures)?;
        let times = self.host.renderer.wait_for_times(&self.host.queue)?.unwrap_or_default();
        self.host.wait()?;
        let wall = start.elapsed().as_secs_f64();
        let pairs = self.host.renderer.pairs_evaluated(&self.host.queue)?;
        let items = |pass: &str| items(pass, &stats, pairs);
        let mut passes: Vec<_> =
            times.passes.iter().map(|time| (time.pass, time.seconds, items(time.pass))).collect();
        passes.push(("frame", wall, pairs));
        Ok(passes)
    }
}

fn items(pass: &str, stats: &FrameStats, pairs: u64) -> u64 {
    match pass {
        "gather" => pairs,
        "direct" | "inject" => u64::from(stats.lights_injected),
        "refresh" => u64::from(stats.probes_refreshed),
        _ => 0,
    }
}

/// The same frame on the processor, where only the two phases are told apart.
///
/// # Errors
/// Where the asset has no grid.
pub fn measure_cpu(
    baked: &Baked,
    trace: &TraceScene<'_>,
    camera: &Camera,
    (width, height): (u32, u32),
    repeat: usize,
) -> Result<Vec<Row>, FrameError> {
    let gbuffer = GBuffer::trace(trace, camera, width, height);
    let data = baked.asset.data();
    let (_, stats) = gather_by_grid(trace, data, &gbuffer, &Silent)?;
    let row = Row {
        scene: baked.name.clone(),
        camera: camera.name.clone(),
        width,
        height,
        lights: baked.asset.lights().len(),
        probes: data.grid.as_ref().map_or(0, |grid| grid.probes.len()),
        backend: "cpu".to_owned(),
        changed: Case::Lights.name().to_owned(),
        repeat,
        ..Row::default()
    };
    let of = |pass: &str, seconds, items| Row { pass: pass.to_owned(), seconds, items, ..row.clone() };
    Ok(vec![of("inject", stats.seconds.inject, 0), of("gather", stats.seconds.gather, stats.pairs_evaluated)])
}

/// What a row is a repeat of.
type Key<'a> = (&'a str, &'a str, u32, usize, &'a str, &'a str, &'a str);

fn key(row: &Row) -> Key<'_> {
    (&row.scene, &row.camera, row.width, row.lights, &row.backend, &row.changed, &row.pass)
}

/// The medians in Markdown, in the order of the rows. The last column is the rate over that of the bare form factor on the same pixels.
#[must_use]
pub fn summary(rows: &[Row]) -> String {
    let mut keys: Vec<Key<'_>> = Vec::new();
    for row in rows {
        if !keys.contains(&key(row)) {
            keys.push(key(row));
        }
    }
    let heads = [
        "scene",
        "camera",
        "pixels",
        "lights",
        "probes",
        "on",
        "changed",
        "pass",
        "ms",
        "quartiles",
        "items",
        "M items/s",
        "of the form factor's",
    ];
    let line = |key_of: &Key<'_>| {
        let own: Vec<&Row> = rows.iter().filter(|row| key(row) == *key_of).collect();
        let Some(first) = own.first() else { return Vec::new() };
        let seconds: Vec<f64> = own.iter().map(|row| row.seconds).collect();
        let [low, middle, high] = quartiles(&seconds);
        let rate = first.items as f64 / middle / 1e6;
        let share = ratio_to_form_factor(rows, &own);
        let or_empty = |is_there: bool, text: String| if is_there { text } else { String::new() };
        vec![
            first.scene.clone(),
            first.camera.clone(),
            format!("{}x{}", first.width, first.height),
            first.lights.to_string(),
            first.probes.to_string(),
            first.backend.clone(),
            first.changed.clone(),
            first.pass.clone(),
            format!("{:.3}", 1e3 * middle),
            format!("{:.3} to {:.3}", 1e3 * low, 1e3 * high),
            or_empty(first.items > 0, first.items.to_string()),
            or_empty(first.items > 0, format!("{rate:.2}")),
            share.map_or_else(String::new, |share| format!("{:.0} %", 100.0 * share)),
        ]
    };
    let lines: Vec<Vec<String>> = keys.iter().map(line).collect();
    format!("# Passes of a frame\n\n{}", table(&heads.map(str::to_owned), &lines))
}

/// The gather's rate over that of the form factor in the same repeat, median over repeats; `None` for other passes.
#[must_use]
pub fn ratio_to_form_factor(rows: &[Row], gather: &[&Row]) -> Option<f64> {
    let bare = |row: &Row| {
        let same = |other: &&Row| {
            let place = |row: &Row| (row.width, row.lights, row.repeat);
            other.pass == "form factor"
                && (&other.scene, &other.camera, place(other)) == (&row.scene, &row.camera, place(row))
        };
        rows.iter().find(same).map(|other| other.items as f64 / other.seconds)
    };
    let is_gather = |row: &&&Row| row.pass == "gather" && row.backend == "gpu";
    let ratio = |row: &&Row| Some(row.items as f64 / row.seconds / bare(row)?);
    let ratios: Vec<f64> = gather.iter().filter(is_gather).filter_map(ratio).collect();
    (!ratios.is_empty()).then(|| quartiles(&ratios)[1])
}

/// The first quartile, the median, and the third; 0 where there is nothing.
fn quartiles(values: &[f64]) -> [f64; 3] {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().saturating_sub(1) as f64;
    [0.25, 0.5, 0.75].map(|share| sorted.get((last * share).round() as usize).copied().unwrap_or(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(pass: &str, repeat: usize, seconds: f64, items: u64) -> Row {
        let (pass, backend) = (pass.to_owned(), "gpu".to_owned());
        Row { pass, backend, repeat, seconds, items, ..Row::default() }
    }

    #[test]
    fn ratios_are_those_of_the_same_repeat() {
        // The machine is half as fast in the second repeat, which no ratio may show.
        let rows = [
            row("form factor", 0, 1.0, 100),
            row("gather", 0, 2.0, 100),
            row("form factor", 1, 2.0, 100),
            row("gather", 1, 4.0, 100),
        ];
        let gather: Vec<&Row> = rows.iter().filter(|row| row.pass == "gather").collect();
        assert_eq!(ratio_to_form_factor(&rows, &gather), Some(0.5));
        assert_eq!(ratio_to_form_factor(&rows, &[&rows[0]]), None, "the negative control");
        assert!(summary(&rows).contains("| 50 % |"), "{}", summary(&rows));
    }
}
