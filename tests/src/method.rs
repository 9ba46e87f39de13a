//! How a method of indirect light takes part in the comparison.
//!
//! A [`Method`] is one way to light a scene at one setting of its knobs. [`Method::prepare`] does once per scene what
//! need not happen per frame; the [`Prepared`] it returns then renders frames. All methods get the same scene, the
//! same tree over it and the same points of the picture, so that only what they do themselves is timed.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use glam::Vec3;
use vlm_bake::bake::{BakeError, bake};
use vlm_bake::gbuffer::GBuffer;
use vlm_bake::options::{BakeOptions, Preset};
use vlm_bake::progress::Silent;
use vlm_bake::render::{PhaseSeconds, RenderError};
use vlm_bake::scene::Camera;
use vlm_bake::shade::TraceScene;
use vlm_format::VlmAsset;

use crate::device::processor;
use crate::gpu::GpuError;

/// One way to find indirect light, at one setting of its knobs. One file each under `methods/`, one line in
/// [`crate::methods::ALL`].
pub trait Method: Sync {
    /// The method's name in tables and figures.
    fn name(&self) -> &'static str;

    /// This setting of the knobs: `key=value` pairs, separated by spaces; empty without knobs.
    fn knob(&self) -> String;

    /// Where the method can run.
    fn backends(&self) -> &'static [Backend] {
        &[Backend::Cpu]
    }

    /// False for a method that claims to give no indirect light at all; it then has to prove that.
    fn gives_indirect_light(&self) -> bool {
        true
    }

    /// Does what happens once per scene.
    ///
    /// # Errors
    /// If the method cannot work in this scene.
    fn prepare(&self, stage: &Stage<'_>) -> Result<Box<dyn Prepared>, MethodError>;
}

/// A method that is ready to render frames of one scene.
pub trait Prepared {
    /// Renders a frame. Methods with random numbers draw new ones for each `frame`; the same number gives the same
    /// picture.
    ///
    /// # Errors
    /// If the method cannot render this view.
    fn render(&self, view: &View<'_>, frame: u32) -> Result<Picture, MethodError>;

    /// What was spent and is kept, beside the time of a frame.
    fn cost(&self) -> Cost;

    /// The virtual area lights that the method sums, if it has any: what its algorithm error is measured with.
    fn area_lights(&self) -> Option<Arc<Baked>> {
        None
    }

    /// The processor or graphics card, in its driver's words.
    fn device(&self) -> String {
        processor()
    }
}

/// Where a method runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Backend {
    /// The processor.
    Cpu,
    /// The graphics card.
    Gpu,
}

impl Backend {
    /// The name that tables use.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Cpu => "cpu",
            Self::Gpu => "gpu",
        }
    }
}

/// One picture's points, traced once and shared by all methods.
pub struct View<'a> {
    /// The scene, ready for rays.
    pub trace: &'a TraceScene<'a>,
    /// Where the picture is seen from.
    pub camera: Camera,
    /// What each pixel shows.
    pub gbuffer: GBuffer,
}

impl<'a> View<'a> {
    /// Traces one ray per pixel of a picture of `width` by `height` pixels.
    #[must_use]
    pub fn new(trace: &'a TraceScene<'a>, camera: &Camera, (width, height): (u32, u32)) -> Self {
        Self { trace, camera: camera.clone(), gbuffer: GBuffer::trace(trace, camera, width, height) }
    }

    /// One per pixel: it shows a surface.
    #[must_use]
    pub fn hit(&self) -> Vec<bool> {
        self.gbuffer.points.iter().map(Option::is_some).collect()
    }
}

/// A rendered frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// Indirect irradiance per pixel, row 0 at the top, lx; 0 where nothing is hit.
    pub indirect: Vec<Vec3>,
    /// Wall time of the two phases.
    pub seconds: PhaseSeconds,
    /// Lights used: virtual area lights, virtual point lights, or probes.
    pub lights: u32,
    /// Pairs of a pixel and a light (or probe) evaluated.
    pub pairs: u64,
    /// Rays traced, both phases.
    pub rays: u64,
}

/// What a method spends once and keeps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// Wall time of what happens once per scene, seconds.
    pub prepare_seconds: f64,
    /// Kept for the frame beside the scene, bytes.
    pub bytes: u64,
}

/// Why a method cannot take part.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MethodError {
    /// No lights could be baked.
    #[error(transparent)]
    Bake(#[from] BakeError),
    /// No picture could be made.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The graphics card is missing, or cannot hold the scene.
    #[error("{0}")]
    Gpu(String),
}

impl From<vlm_runtime::Error> for MethodError {
    fn from(error: vlm_runtime::Error) -> Self {
        Self::Gpu(error.to_string())
    }
}

impl From<GpuError> for MethodError {
    fn from(error: GpuError) -> Self {
        Self::Gpu(error.to_string())
    }
}

/// A scene on which methods are compared, with what several of them need.
pub struct Stage<'a> {
    /// The scene, ready for rays.
    pub trace: &'a TraceScene<'a>,
    bakes: Mutex<BTreeMap<String, Arc<Baked>>>,
}

/// Virtual area lights and what they took.
#[derive(Clone, Debug, Default)]
pub struct Baked {
    /// The lights with their grid.
    pub asset: VlmAsset,
    /// Wall time of the bake without the grid, seconds.
    pub lights_seconds: f64,
    /// Wall time of the grid, seconds.
    pub grid_seconds: f64,
}

impl<'a> Stage<'a> {
    /// A scene without any bake yet.
    #[must_use]
    pub fn new(trace: &'a TraceScene<'a>) -> Self {
        Self { trace, bakes: Mutex::default() }
    }

    /// The budget of lights that a preset has in this scene.
    #[must_use]
    pub fn budget(&self, preset: Preset) -> u32 {
        preset.lights(self.trace.scene.triangles.len())
    }

    /// The options of a preset in this scene, with another number of lights.
    #[must_use]
    pub fn options(&self, preset: Preset, lights: u32) -> BakeOptions {
        BakeOptions { lights, ..BakeOptions::preset(preset, self.trace.scene.triangles.len()) }
    }

    /// The options of a preset in this scene, with another number of lights and without a grid.
    #[must_use]
    pub fn without_grid(&self, preset: Preset, lights: u32) -> BakeOptions {
        let mut options = self.options(preset, lights);
        options.grid.probes = 0;
        options
    }

    /// Bakes with some options, once for all who ask for the same. A scene in which nothing reflects or emits has no lights.
    ///
    /// # Errors
    /// If the budget leaves no light.
    pub fn baked(&self, options: &BakeOptions) -> Result<Arc<Baked>, MethodError> {
        let mut bakes = self.bakes.lock().unwrap_or_else(PoisonError::into_inner);
        let key = format!("{options:?}");
        if let Some(baked) = bakes.get(&key) {
            return Ok(Arc::clone(baked));
        }
        let scene = self.trace.scene;
        let baked = match bake(scene, options, &Silent) {
            Ok(bake) => {
                let seconds = &bake.report.seconds;
                let grid_seconds = seconds.get("grid").copied().unwrap_or(0.0);
                let lights_seconds = seconds.values().sum::<f64>() - grid_seconds;
                Baked { asset: bake.asset, lights_seconds, grid_seconds }
            }
            Err(BakeError::NothingReflects) => Baked::default(),
            Err(error) => return Err(error.into()),
        };
        let baked = Arc::new(baked);
        bakes.insert(key, Arc::clone(&baked));
        Ok(baked)
    }

    /// The box around the scene, metres; a point where there is no surface.
    #[must_use]
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let [low, high] = self.trace.scene.bounds().unwrap_or_default();
        (low.as_vec3(), high.as_vec3())
    }

    /// Longest edge of the scene's box, metres.
    #[must_use]
    pub fn extent(&self) -> f32 {
        let (low, high) = self.bounds();
        (high - low).max_element()
    }
}
