//! From a pixel's depth to its place, and from irradiance to what a texture of halves holds.

use glam::{Mat4, UVec2, Vec3, Vec4};

/// The largest finite half.
pub const LARGEST_HALF: f32 = 65504.0;

/// A camera's picture, as the deferred gather reads it. 80 bytes, a uniform buffer.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct View {
    /// From clip space as WebGPU has it (y up, depth 0 to 1) to world space, metres.
    pub world_from_clip: Mat4,
    /// Factor of the written irradiance: a sun of 100,000 lx fits a half, whose largest number is 65,504, after a factor of 0.5. Values between
    /// 6e-5 and that keep eleven bits.
    pub exposure: f32,
    /// Depth where nothing was drawn: 1, or 0 where depth is reversed.
    pub empty_depth: f32,
    /// Not used.
    pub padding: f32,
    /// Not used.
    pub padding_2: f32,
}

impl Default for View {
    fn default() -> Self {
        Self {
            world_from_clip: Mat4::IDENTITY,
            exposure: 1.0,
            empty_depth: 1.0,
            padding: 0.0,
            padding_2: 0.0,
        }
    }
}

impl View {
    /// The place of a pixel's centre at a depth, metres.
    #[must_use]
    pub fn position_at(&self, pixel: UVec2, size: UVec2, depth: f32) -> Vec3 {
        let uv = (pixel.as_vec2() + 0.5) / size.as_vec2();
        let clip = Vec4::new(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y, depth, 1.0);
        let world = self.world_from_clip * clip;
        world.truncate() / world.w
    }

    /// What is written for an irradiance in lx; never infinite.
    #[must_use]
    pub fn exposed(&self, irradiance: Vec3) -> Vec3 {
        (irradiance * self.exposure).min(Vec3::splat(LARGEST_HALF))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn pixels_go_back_to_where_they_came_from() {
        let world_from_view = glam::DMat4::from_translation(DVec3::new(1.0, 2.0, 3.0));
        // Depth is 0.1 m over the distance.
        let clip_from_view = glam::DMat4::from_cols_array_2d(&[
            [0.8, 0.0, 0.0, 0.0],
            [0.0, 1.6, 0.0, 0.0],
            [0.0, 0.0, 0.0, -1.0],
            [0.0, 0.0, 0.1, 0.0],
        ]);
        let clip_from_world = clip_from_view * world_from_view.inverse();
        let view = View { world_from_clip: clip_from_world.inverse().as_mat4(), ..View::default() };
        let clip = clip_from_world * DVec3::new(1.4, 2.3, -4.0).extend(1.0);
        let ndc = clip / clip.w;
        let size = UVec2::new(800, 400);
        let pixel = DVec3::new((ndc.x + 1.0) * 400.0, (1.0 - ndc.y) * 200.0, 0.0);
        let near = view.position_at(pixel.truncate().as_uvec2(), size, ndc.z as f32);
        // Within half a pixel's size at 7 metres.
        assert!((near - Vec3::new(1.4, 2.3, -4.0)).length() < 0.02, "{near}");
    }

    #[test]
    fn nothing_overflows() {
        let view = View { exposure: 2.0, ..View::default() };
        assert_eq!(view.exposed(Vec3::new(1.0, 1e5, f32::MAX)), Vec3::new(2.0, LARGEST_HALF, LARGEST_HALF));
    }
}
