//! headless: one picture without a window, as `vlm render` makes it, from the device.

use std::fmt::Display;
use std::io::{Cursor, ErrorKind, Write, stdout};
use std::path::Path;

use image::{ImageFormat, RgbImage};
use serde::Serialize;
use vlm_bake::picture::{PictureError, write_irradiance};
use vlm_bake::progress::Silent;
use vlm_bake::render::{Method, RenderReport, Rendering};
use vlm_format::write_file;

use super::arguments::Arguments;
use super::controls::Controls;
use super::error::ViewError;
use super::gpu::Gpu;
use super::open::{OpenOptions, Opened};
use super::shaders::Sources;
use super::viewer::{FrameReport, PICTURE_FORMAT, Viewer, ViewerOptions};
use crate::stats::Skipped;

/// As `vlm render` has it, pixels.
const DEFAULT_SIZE: (u32, u32) = (640, 480);

/// What a picture took, as `--json` prints it.
#[derive(Clone, Debug, Serialize)]
pub struct ViewReport {
    /// As `vlm render` reports it.
    #[serde(flatten)]
    pub render: RenderReport,
    /// The passes of the virtual lights that ran, in order.
    pub passes: Vec<&'static str>,
    /// Lights whose direct light was found.
    pub lights_injected: u32,
    /// Lights whose direct light was not, by reason.
    pub lights_skipped: Skipped,
    /// Written to the device for the virtual lights, loading included.
    pub bytes_uploaded: u64,
    /// The device, in its driver's words.
    pub adapter: String,
}

/// A picture that was made.
#[derive(Clone, Debug)]
pub struct Headless {
    /// What it took.
    pub report: ViewReport,
    /// The light that it is made of.
    pub rendering: Rendering,
    /// What radiance in nt was multiplied by, if it was written as a picture.
    pub exposure: f32,
}

/// Makes the picture that the arguments ask for and writes its files.
///
/// # Errors
/// Whatever keeps it from being made or written.
pub fn headless(arguments: &Arguments) -> Result<Headless, ViewError> {
    let method = Method::from(arguments.method);
    let options = OpenOptions { preset: arguments.preset, needs_lights: method != Method::Direct };
    let opened = Opened::open(&arguments.file, options, &Silent)?;
    let camera = opened.scene.camera(arguments.camera.as_deref())?;
    for note in &opened.notes {
        eprintln!("note: {}: {note}", opened.name);
    }
    let mut viewer = Viewer::new(
        Gpu::new()?,
        Sources::default(),
        ViewerOptions { format: PICTURE_FORMAT, shadows: arguments.shadows, measures: true },
    )?;
    let mut controls = Controls {
        method,
        overlays: arguments.overlay[..].into(),
        alpha_masks: arguments.alpha_masks,
        ..Controls::default()
    };
    viewer.show(opened, &mut controls)?;
    let size = arguments.size.unwrap_or(DEFAULT_SIZE);
    let mut frame = viewer.frame(&controls, &camera, size.into(), true)?;
    for _ in 0..arguments.reloads {
        viewer.show(Opened::open(&arguments.file, options, &Silent)?, &mut controls)?;
        frame = viewer.frame(&controls, &camera, size.into(), true)?;
    }
    let rendering = viewer.rendering(&frame)?;
    if let Some(path) = &arguments.irradiance {
        write_irradiance(&rendering, path)?;
    }
    if let Some(path) = &arguments.out {
        controls.exposure = match arguments.exposure {
            Some(exposure) => exposure,
            None => viewer.auto_exposure()?,
        };
        write_picture(path, size, &viewer.picture(&controls, &camera)?)?;
    }
    let report = report(&rendering, frame, (camera.name, method), viewer.gpu().name.clone());
    Ok(Headless { report, rendering, exposure: controls.exposure })
}

fn report(
    rendering: &Rendering,
    frame: FrameReport,
    (camera, method): (String, Method),
    adapter: String,
) -> ViewReport {
    let FrameReport { stats, .. } = frame;
    ViewReport {
        render: RenderReport {
            camera,
            width: rendering.gbuffer.width,
            height: rendering.gbuffer.height,
            method: method.name().to_owned(),
            stats: rendering.stats,
        },
        passes: stats.passes,
        lights_injected: stats.lights_injected,
        lights_skipped: stats.lights_skipped,
        bytes_uploaded: stats.bytes_uploaded,
        adapter,
    }
}

/// Writes rows of RGB as PNG.
///
/// # Errors
/// If the file cannot be encoded or written; then no partial file is left.
pub fn write_picture(path: &Path, (width, height): (u32, u32), pixels: &[[u8; 3]]) -> Result<(), ViewError> {
    let image = RgbImage::from_raw(width, height, pixels.concat()).unwrap_or_default();
    let mut file = Cursor::new(Vec::new());
    let encoded = image.write_to(&mut file, ImageFormat::Png);
    encoded.map_err(|source| PictureError::Encode { path: path.to_owned(), source })?;
    Ok(write_file(path, file.get_ref())?)
}

impl Headless {
    /// Prints the report on stdout.
    ///
    /// # Errors
    /// If stdout cannot be written.
    pub fn print(&self, arguments: &Arguments) -> Result<(), ViewError> {
        let Self { report, exposure, .. } = self;
        if arguments.json {
            let json = serde_json::to_string_pretty(report);
            return print_lines(&[json.map_err(|error| ViewError::Output(error.to_string()))?]);
        }
        let ViewReport { render: RenderReport { camera, width, height, method, stats }, .. } = report;
        let mut lines = vec![
            format!("rendered  {width} x {height} by {method} from camera {camera} on {}", report.adapter),
            format!("time      inject {:.3} s, gather {:.3} s", stats.seconds.inject, stats.seconds.gather),
            format!("lights    {}, {} pairs evaluated", stats.lights, stats.pairs_evaluated),
        ];
        if let Some(path) = &arguments.out {
            lines.push(format!("picture   {}  (radiance in nt times {exposure:.4})", path.display()));
        }
        if let Some(path) = &arguments.irradiance {
            lines.push(format!("E1        {}", path.display()));
        }
        print_lines(&lines)
    }
}

/// A reader that closes the pipe early has seen what it wanted.
fn print_lines(lines: &[impl Display]) -> Result<(), ViewError> {
    let mut pipe = stdout().lock();
    match lines.iter().try_for_each(|line| writeln!(pipe, "{line}")).and_then(|()| pipe.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(ViewError::Output(error.to_string())),
        _ => Ok(()),
    }
}
