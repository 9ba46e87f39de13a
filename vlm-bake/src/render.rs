//! Pictures on the CPU: direct light, and indirect light by path tracing or by virtual lights.

use std::time::Instant;

use glam::{DMat4, Vec3};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;
use vlm_format::{Grid, VlmAsset};
use vlm_shaders::cpu::gather::{Gathered, Receiver, gather_together};
use vlm_shaders::cpu::gather_static::Frame;
use vlm_shaders::cpu::grid::leaf_at;
use vlm_shaders::cpu::inject::{radiosity, reflect, source_radiosity, uncovered_radiosity};
use vlm_shaders::cpu::refresh::{Arrived, far_sources, refresh};
use vlm_shaders::cpu::upload::LightSet;

use crate::gbuffer::GBuffer;
use crate::progress::Progress;
use crate::reference::indirect_irradiance;
use crate::scene::{Camera, Scene};
use crate::shade::{SurfacePoint, TraceScene};

/// Below this many lights, looking up a cell's list costs more than the lights that it leaves out.
const FEWEST_LIGHTS_FOR_GRID: usize = 40;

/// Pixels that are gathered as one task. More of them share a list, fewer spread better over threads.
const PIXELS_TOGETHER: usize = 4096;

/// The largest picture, pixels: one that fits in memory with room to spare.
const MOST_PIXELS: u64 = 1 << 28;

/// How the indirect light is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// No indirect light.
    Direct,
    /// One bounce by path tracing: the truth, and slow. Needs no lights.
    Reference,
    /// The exact form factor of every light at every pixel; no occlusion.
    Brute,
    /// By the static grid; every light where there is no grid or there are few lights.
    #[default]
    Vlm,
}

impl Method {
    /// The name that commands and reports use.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Direct => "direct",
            Self::Reference => "reference",
            Self::Brute => "brute",
            Self::Vlm => "vlm",
        }
    }
}

/// What picture to make.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderOptions {
    /// Pixels, above 0.
    pub width: u32,
    /// Pixels, above 0.
    pub height: u32,
    /// How the indirect light is found.
    pub method: Method,
    /// Directions per pixel of `reference`. Four times as many halve the noise or better, and take four times as long.
    pub samples: u32,
    /// Cut the holes of alphaMode MASK into surfaces; else they count as solid. Every hit then costs a texture look-up.
    pub alpha_masks: bool,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self { width: 640, height: 480, method: Method::default(), samples: 256, alpha_masks: false }
    }
}

/// A finished picture, as the light that it is made of. Arrays have one element per pixel, row 0 at the top.
#[derive(Clone, Debug, Default)]
pub struct Rendering {
    /// What each pixel shows.
    pub gbuffer: GBuffer,
    /// Direct irradiance, lx; 0 where nothing is hit.
    pub direct: Vec<Vec3>,
    /// Indirect irradiance, lx; 0 where nothing is hit.
    pub indirect: Vec<Vec3>,
    /// What it took.
    pub stats: RenderStats,
}

/// A finished picture in numbers, as `--json` prints it.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct RenderReport {
    /// The camera's name.
    pub camera: String,
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// The method's name.
    pub method: String,
    /// What it took.
    #[serde(flatten)]
    pub stats: RenderStats,
}

/// What a picture took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct RenderStats {
    /// Wall time of the two phases.
    pub seconds: PhaseSeconds,
    /// Pairs of a pixel and a light whose geometry was read.
    pub pairs_evaluated: u64,
    /// Lights of the asset.
    pub lights: u32,
}

/// Wall time, seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct PhaseSeconds {
    /// Phase 1: direct light at the samples.
    pub inject: f64,
    /// Phase 2, or the path tracing of `reference`.
    pub gather: f64,
}

/// Why there is no picture.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RenderError {
    /// The method needs virtual lights.
    #[error(
        "there is no Virtual Light Mesh to render: bake one first, or use the methods `direct` or `reference`"
    )]
    NoLights,
    /// The picture would have no pixels or far too many.
    #[error(
        "a picture of {width} x {height} pixels cannot be made: ask for 1 to {MOST_PIXELS} pixels in all"
    )]
    Size {
        /// Asked width, pixels.
        width: u32,
        /// Asked height, pixels.
        height: u32,
    },
    /// A VLM belongs to a node without geometry in this scene.
    #[error(
        "the VLM {id:?} belongs to node {node}, which has no geometry in this scene: bake the file again"
    )]
    UnknownNode {
        /// The VLM's id.
        id: String,
        /// Index of the glTF node.
        node: u32,
    },
}

/// Renders `scene` from `camera`. `asset` holds the virtual lights; `direct` and `reference` do without.
///
/// # Errors
/// For an impossible size, missing lights, and lights of nodes that the scene does not have.
pub fn render(
    scene: &Scene,
    asset: Option<&VlmAsset>,
    camera: &Camera,
    options: &RenderOptions,
    progress: &dyn Progress,
) -> Result<Rendering, RenderError> {
    check_size(options)?;
    let trace = TraceScene::new(scene);
    let trace = if options.alpha_masks { trace.with_alpha_masks() } else { trace };
    let gbuffer = GBuffer::trace(&trace, camera, options.width, options.height);
    let direct = gbuffer.direct_irradiance(&trace);
    let lights = asset.map_or(0, |asset| asset.triangles.len() as u32);
    let (indirect, stats) = match options.method {
        Method::Direct => (vec![Vec3::ZERO; direct.len()], RenderStats { lights, ..RenderStats::default() }),
        Method::Reference => {
            let start = Instant::now();
            let indirect =
                indirect_irradiance(&trace, &gbuffer.points, options.width, options.samples, progress);
            let seconds = PhaseSeconds { inject: 0.0, gather: start.elapsed().as_secs_f64() };
            (indirect, RenderStats { seconds, pairs_evaluated: 0, lights })
        }
        Method::Brute => gather_brute(&trace, asset.ok_or(RenderError::NoLights)?, &gbuffer, progress)?,
        Method::Vlm => gather_by_grid(&trace, asset.ok_or(RenderError::NoLights)?, &gbuffer, progress)?,
    };
    Ok(Rendering { gbuffer, direct, indirect, stats })
}

fn check_size(options: &RenderOptions) -> Result<(), RenderError> {
    let &RenderOptions { width, height, .. } = options;
    let pixels = u64::from(width) * u64::from(height);
    if pixels == 0 || pixels > MOST_PIXELS { Err(RenderError::Size { width, height }) } else { Ok(()) }
}

/// Phases 1 and 2 with the exact form factor of every light at every pixel.
///
/// # Errors
/// [`RenderError::UnknownNode`] if a VLM belongs to a node that the scene does not have.
pub fn gather_brute(
    trace: &TraceScene<'_>,
    asset: &VlmAsset,
    gbuffer: &GBuffer,
    progress: &dyn Progress,
) -> Result<(Vec<Vec3>, RenderStats), RenderError> {
    Ok(LitScene::new(trace, asset)?.gather_all(gbuffer, progress))
}

/// Phases 1 and 2 by the static grid; with every light where there is no grid or there are few lights.
///
/// # Errors
/// [`RenderError::UnknownNode`] if a VLM belongs to a node that the scene does not have.
pub fn gather_by_grid(
    trace: &TraceScene<'_>,
    asset: &VlmAsset,
    gbuffer: &GBuffer,
    progress: &dyn Progress,
) -> Result<(Vec<Vec3>, RenderStats), RenderError> {
    let Some(grid) = asset.grid.as_ref().filter(|_| asset.triangles.len() >= FEWEST_LIGHTS_FOR_GRID) else {
        return gather_brute(trace, asset, gbuffer, progress);
    };
    let lit = LitScene::new(trace, asset)?;
    Ok(lit.gather_static(trace, grid, gbuffer, progress))
}

/// The virtual lights of an asset after phase 1: what every gathering method starts from.
pub struct LitScene {
    /// The lights in world space.
    pub lights: LightSet,
    /// What each sample adds to its light's radiosity, lx.
    pub reflected: Vec<Vec3>,
    /// Phase 1's result: radiosity of each light, lx.
    pub radiosity: Vec<Vec3>,
    /// Wall time of phase 1.
    pub inject_seconds: f64,
    /// Tag of each of the scene's triangles, 0 for none.
    triangle_tags: Vec<u32>,
}

impl LitScene {
    /// Moves the lights into world space and runs phase 1.
    ///
    /// # Errors
    /// [`RenderError::UnknownNode`] if a VLM belongs to a node that the scene does not have.
    pub fn new(trace: &TraceScene<'_>, asset: &VlmAsset) -> Result<Self, RenderError> {
        let lights = world_lights(trace.scene, asset)?;
        let start = Instant::now();
        let reflected =
            reflect(&lights, |position, normal| trace.direct_irradiance(position, normal, normal));
        let radiosity = radiosity(&lights, &reflected);
        let inject_seconds = start.elapsed().as_secs_f64();
        let triangle_tags = triangle_tags(trace.scene, asset);
        Ok(Self { lights, reflected, radiosity, inject_seconds, triangle_tags })
    }

    /// The radiosity of the sources of the asset's grid. Lights its surface without lights, which no other method needs.
    #[must_use]
    pub fn source_radiosity(&self, trace: &TraceScene<'_>, grid: &Grid) -> Vec<Vec3> {
        let uncovered = uncovered_radiosity(&grid.uncovered, |position, normal| {
            trace.direct_irradiance(position, normal, normal)
        });
        source_radiosity(grid, &self.lights, &self.reflected, &uncovered)
    }

    /// What arrives at the probes of the asset's grid.
    #[must_use]
    pub fn arrived(&self, trace: &TraceScene<'_>, grid: &Grid) -> Arrived {
        let sources = far_sources(&self.lights, &grid.uncovered);
        refresh(grid, &self.lights, &sources, &self.source_radiosity(trace, grid))
    }

    /// Phase 2 at every pixel by `gather`: indirect irradiance in lx, and what it took.
    pub fn gather(
        &self,
        gbuffer: &GBuffer,
        progress: &dyn Progress,
        gather: impl Fn(&Receiver) -> Gathered + Sync,
    ) -> (Vec<Vec3>, RenderStats) {
        let start = Instant::now();
        let at = |point: &Option<SurfacePoint>| {
            point.as_ref().map_or(Gathered::default(), |point| gather(&self.receiver(point)))
        };
        let rows = gbuffer.points.par_chunks(gbuffer.width.max(1) as usize);
        progress.begin("gather", rows.len() as u64);
        let gathered = rows.flat_map_iter(|row| {
            progress.advance(1);
            row.iter().map(at)
        });
        let gathered: Vec<Gathered> = gathered.collect();
        let stats = self.stats(gathered.iter().map(|g| g.pairs).sum(), start);
        (gathered.iter().map(|g| g.irradiance).collect(), stats)
    }

    /// Phase 2 at every pixel with every light.
    pub fn gather_all(&self, gbuffer: &GBuffer, progress: &dyn Progress) -> (Vec<Vec3>, RenderStats) {
        let all: Vec<u32> = (0..self.lights.len() as u32).collect();
        let gather =
            |_, receivers: &[Receiver]| gather_together(&self.lights, &self.radiosity, &all, receivers);
        self.gather_grouped(gbuffer, progress, |_| Some(0), gather, Instant::now())
    }

    /// Phase 2 at every pixel by the static grid: its probes are refreshed, then pixels of a leaf are gathered together. The time of
    /// [`LitScene::source_radiosity`] counts with it.
    pub fn gather_static(
        &self,
        trace: &TraceScene<'_>,
        grid: &Grid,
        gbuffer: &GBuffer,
        progress: &dyn Progress,
    ) -> (Vec<Vec3>, RenderStats) {
        let start = Instant::now();
        let arrived = self.arrived(trace, grid);
        let frame = Frame { grid, lights: &self.lights, arrived: &arrived };
        let gather = |leaf, receivers: &[Receiver]| frame.gather_together(leaf, receivers);
        self.gather_grouped(gbuffer, progress, |position| leaf_at(grid, position), gather, start)
    }

    /// Gathers pixels of one group together; those without a group get nothing. Time counts from `start`.
    fn gather_grouped(
        &self,
        gbuffer: &GBuffer,
        progress: &dyn Progress,
        group_at: impl Fn(Vec3) -> Option<u32> + Sync,
        gather: impl Fn(u32, &[Receiver]) -> Vec<Gathered> + Sync,
        start: Instant,
    ) -> (Vec<Vec3>, RenderStats) {
        let with_group = |(pixel, point): (usize, &Option<SurfacePoint>)| {
            let point = point.as_ref()?;
            Some((group_at(point.position)?, pixel, self.receiver(point)))
        };
        let mut all: Vec<_> = gbuffer.points.par_iter().enumerate().filter_map(with_group).collect();
        all.par_sort_unstable_by_key(|&(group, pixel, _)| (group, pixel));
        let groups = all.chunk_by(|(a, ..), (b, ..)| a == b);
        let tasks: Vec<_> = groups.flat_map(|pixels| pixels.chunks(PIXELS_TOGETHER)).collect();
        progress.begin("gather", tasks.len() as u64);
        let gather = |pixels: &&[(u32, usize, Receiver)]| {
            progress.advance(1);
            let receivers: Vec<Receiver> = pixels.iter().map(|(.., receiver)| *receiver).collect();
            pixels.first().map_or_else(Vec::new, |&(group, ..)| gather(group, &receivers))
        };
        let gathered: Vec<Vec<Gathered>> = tasks.par_iter().map(gather).collect();
        let mut irradiance = vec![Vec3::ZERO; gbuffer.points.len()];
        let mut pairs_evaluated = 0;
        for ((_, pixel, _), gathered) in all.iter().zip(gathered.iter().flatten()) {
            irradiance[*pixel] = gathered.irradiance;
            pairs_evaluated += gathered.pairs;
        }
        (irradiance, self.stats(pairs_evaluated, start))
    }

    fn stats(&self, pairs_evaluated: u64, start: Instant) -> RenderStats {
        let seconds = PhaseSeconds { inject: self.inject_seconds, gather: start.elapsed().as_secs_f64() };
        RenderStats { seconds, pairs_evaluated, lights: self.lights.len() as u32 }
    }

    /// A surface point as phase 2 sees it.
    #[must_use]
    pub fn receiver(&self, point: &SurfacePoint) -> Receiver {
        point.receiver(self.tag(point.triangle))
    }

    fn tag(&self, triangle: u32) -> u32 {
        self.triangle_tags.get(triangle as usize).copied().unwrap_or(0)
    }
}

/// The lights of an asset in world space.
///
/// # Errors
/// [`RenderError::UnknownNode`] if a VLM belongs to a node that the scene does not have.
pub fn world_lights(scene: &Scene, asset: &VlmAsset) -> Result<LightSet, RenderError> {
    let transform = |node: u32| scene.objects.iter().find(|o| o.node == node).map(|o| o.world_from_node);
    for vlm in &asset.vlms {
        transform(vlm.node).ok_or(RenderError::UnknownNode { id: vlm.id.clone(), node: vlm.node })?;
    }
    Ok(LightSet::new(asset, |node| transform(node).unwrap_or(DMat4::IDENTITY)))
}

/// The tag of each of the scene's triangles as a receiver, 0 for none.
#[must_use]
pub fn triangle_tags(scene: &Scene, asset: &VlmAsset) -> Vec<u32> {
    let tag = |(&primitive, &triangle): (&u32, &u32)| {
        let primitive = scene.primitives.get(primitive as usize)?;
        let object = scene.objects.get(primitive.object as usize)?;
        Some(asset.tag_of(object.node, primitive.mesh, primitive.primitive, triangle))
    };
    let places = scene.triangle_primitive.iter().zip(&scene.triangle_in_primitive);
    places.map(|place| tag(place).unwrap_or(0)).collect()
}
