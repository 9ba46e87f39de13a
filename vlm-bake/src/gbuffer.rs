//! What the camera sees: one surface point per pixel, and its direct light.

use glam::Vec3;
use rayon::prelude::*;

use crate::camera::CameraRays;
use crate::scene::Camera;
use crate::shade::{SurfacePoint, TraceScene};

/// One surface point per pixel, row 0 at the top; `None` where the ray through the pixel's centre meets nothing.
#[derive(Clone, Debug, Default)]
pub struct GBuffer {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width * height` points.
    pub points: Vec<Option<SurfacePoint>>,
}

impl GBuffer {
    /// Traces one ray per pixel.
    #[must_use]
    pub fn trace(scene: &TraceScene<'_>, camera: &Camera, width: u32, height: u32) -> Self {
        let rays = CameraRays::new(camera, width, height);
        let rows = (0..height).into_par_iter();
        let points = rows.flat_map_iter(|y| (0..width).map(move |x| pixel(scene, &rays, x, y))).collect();
        Self { width, height, points }
    }

    /// Evaluates `value` at every pixel's point, in parallel; zero where there is none.
    #[must_use]
    pub fn map(&self, value: impl Fn(&SurfacePoint) -> Vec3 + Sync) -> Vec<Vec3> {
        self.points.par_iter().map(|point| point.as_ref().map_or(Vec3::ZERO, &value)).collect()
    }

    /// Direct irradiance with hard shadows at every pixel, lx.
    #[must_use]
    pub fn direct_irradiance(&self, scene: &TraceScene<'_>) -> Vec<Vec3> {
        self.map(|p| scene.direct_irradiance(p.position, p.normal, p.geometric_normal))
    }
}

fn pixel(scene: &TraceScene<'_>, rays: &CameraRays, x: u32, y: u32) -> Option<SurfacePoint> {
    let ray = rays.through(x, y);
    let hit = scene.camera_hit(ray.origin, ray.direction)?;
    scene.surface(&hit, rays.pixel_area(hit.distance))
}
