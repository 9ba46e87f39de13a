//! The truth that methods are measured against: path-traced one-bounce irradiance, cached by content, with an estimate
//! of its own noise.
//!
//! Two independent halves are rendered. Their mean is the truth, and half of their difference is as large as the
//! truth's own error, in the mean.

use std::fs;
use std::path::{Path, PathBuf};

use glam::Vec3;
use rayon::prelude::*;
use vlm_bake::picture::{PictureError, read_irradiance};
use vlm_bake::reference::irradiance_at;
use vlm_bake::scene::{Camera, Projection};

use crate::exr;
use crate::method::View;

/// To be raised whenever `reference` gives another result, so that cached ones no longer count.
pub const VERSION: u32 = 1;

/// The truth's noise must be below this share of the error that it judges.
pub const NOISE_SHARE: f64 = 1.0 / 3.0;

/// A truth and how noisy it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// Indirect irradiance per pixel, lx.
    pub irradiance: Vec<Vec3>,
    /// Directions per pixel, both halves.
    pub spp: u32,
    /// Relative RMSE of its noise, estimated from the halves.
    pub noise: f64,
}

impl Truth {
    /// True if the noise is below a third of this relative RMSE.
    #[must_use]
    pub fn suffices_for(&self, relative_rmse: f64) -> bool {
        self.noise < NOISE_SHARE * relative_rmse
    }
}

/// How many directions per pixel a truth may take; powers of two, 2 or more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Spp {
    /// To begin with.
    pub first: u32,
    /// No more than this, whatever the noise.
    pub most: u32,
}

/// Renders truths of one scene, or finds them in a folder.
pub struct Truths {
    folder: PathBuf,
    scene: blake3::Hash,
}

/// Why there is no truth.
#[derive(Debug, thiserror::Error)]
pub enum TruthError {
    /// The cache's folder cannot be made.
    #[error("{path}: the folder for the truth's cache cannot be made: {source}", path = path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The cache cannot be written.
    #[error(transparent)]
    Write(#[from] PictureError),
}

impl Truths {
    /// For a scene with this file content. Files that a .gltf refers to are not looked at: pack it into a .glb, or
    /// clear the cache when they change.
    ///
    /// # Errors
    /// If the folder cannot be made.
    pub fn new(folder: &Path, scene_bytes: &[u8]) -> Result<Self, TruthError> {
        fs::create_dir_all(folder)
            .map_err(|source| TruthError::Folder { path: folder.to_owned(), source })?;
        Ok(Self { folder: folder.to_owned(), scene: blake3::hash(scene_bytes) })
    }

    /// Doubles the directions per pixel until the noise is below a third of `smallest_error`, which is given the truth so
    /// far, or the limit is reached.
    ///
    /// # Errors
    /// If the cache cannot be written.
    pub fn settle(
        &self,
        view: &View<'_>,
        spp: Spp,
        smallest_error: impl Fn(&Truth) -> f64,
    ) -> Result<Truth, TruthError> {
        let mut samples = spp.first.max(2);
        loop {
            let truth = self.truth(view, samples)?;
            if truth.suffices_for(smallest_error(&truth)) || samples > spp.most / 2 {
                return Ok(truth);
            }
            samples *= 2;
        }
    }

    /// The truth from `spp` directions per pixel (even).
    ///
    /// # Errors
    /// If the cache cannot be written.
    pub fn truth(&self, view: &View<'_>, spp: u32) -> Result<Truth, TruthError> {
        let [a, b] = [self.half(view, spp / 2, 0)?, self.half(view, spp / 2, 1)?];
        let irradiance: Vec<Vec3> = a.iter().zip(&b).map(|(a, b)| (*a + *b) / 2.0).collect();
        let noise = noise_of_mean(&a, &b);
        Ok(Truth { irradiance, spp: spp / 2 * 2, noise })
    }

    fn half(&self, view: &View<'_>, samples: u32, half: u64) -> Result<Vec<Vec3>, TruthError> {
        let path = self.folder.join(format!("{}.exr", self.key(view, samples, half)));
        let size = (view.gbuffer.width, view.gbuffer.height);
        if let Ok((width, height, cached)) = read_irradiance(&path)
            && (width, height) == size
        {
            return Ok(cached);
        }
        let rendered = render_half(view, samples, half);
        exr::write(&path, size, &rendered)?;
        Ok(rendered)
    }

    /// Names everything that the result depends on.
    fn key(&self, view: &View<'_>, samples: u32, half: u64) -> String {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&VERSION.to_le_bytes()).update(self.scene.as_bytes());
        hash_camera(&mut hasher, &view.camera);
        for number in [view.gbuffer.width, view.gbuffer.height, samples] {
            hasher.update(&number.to_le_bytes());
        }
        hasher.update(&half.to_le_bytes()).finalize().to_hex().to_string()
    }
}

fn hash_camera(hasher: &mut blake3::Hasher, camera: &Camera) {
    for number in camera.world_from_view.to_cols_array() {
        hasher.update(&number.to_le_bytes());
    }
    let (kind, size) = match camera.projection {
        Projection::Perspective(angle) => (0, angle),
        Projection::Orthographic(half_height) => (1, half_height),
    };
    hasher.update(&[kind]).update(&size.to_le_bytes());
}

/// Each pixel of each half has random numbers of its own.
fn render_half(view: &View<'_>, samples: u32, half: u64) -> Vec<Vec3> {
    let pixels = view.gbuffer.points.par_iter().enumerate();
    let at = |(pixel, point): (usize, &Option<_>)| {
        let seed = pixel as u64 | half << 40;
        point.as_ref().map_or(Vec3::ZERO, |point| irradiance_at(view.trace, point, samples, seed))
    };
    pixels.map(at).collect()
}

/// Relative RMSE of the mean of two independent pictures, estimated from their difference; 0 where both are black.
#[must_use]
pub fn noise_of_mean(a: &[Vec3], b: &[Vec3]) -> f64 {
    let (mut difference, mut power) = (0.0, 0.0);
    for (a, b) in a.iter().zip(b) {
        let (a, b) = (a.as_dvec3(), b.as_dvec3());
        difference += ((a - b) / 2.0).length_squared();
        power += ((a + b) / 2.0).length_squared();
    }
    if power > 0.0 { (difference / power).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::proof::known_scenes;
    use vlm_bake::shade::TraceScene;

    #[test]
    fn the_noise_is_as_large_as_the_error_and_falls_with_the_samples() {
        let known = &known_scenes()[0];
        let trace = TraceScene::new(&known.scene);
        let view = View::new(&trace, &known.camera, (16, 16));
        let folder = tempfile::tempdir().unwrap();
        let truths = Truths::new(folder.path(), b"scene").unwrap();
        let fine = truths.truth(&view, 1 << 14).unwrap();
        let error = |truth: &Truth| 2.0 * noise_of_mean(&truth.irradiance, &fine.irradiance);
        for spp in [8, 32] {
            let coarse = truths.truth(&view, spp).unwrap();
            let ratio = coarse.noise / error(&coarse);
            assert!(
                (0.8..1.25).contains(&ratio),
                "{spp} spp: noise {} error {}",
                coarse.noise,
                error(&coarse)
            );
            assert!(fine.noise < coarse.noise / 4.0);
        }
    }

    #[test]
    fn what_is_cached_is_used_and_only_for_its_own_content() {
        let known = &known_scenes()[0];
        let trace = TraceScene::new(&known.scene);
        let view = View::new(&trace, &known.camera, (4, 4));
        let folder = tempfile::tempdir().unwrap();
        let truths = |bytes: &[u8]| Truths::new(folder.path(), bytes).unwrap();
        let files = || fs::read_dir(folder.path()).unwrap().count();
        let first = truths(b"one").truth(&view, 4).unwrap();
        assert_eq!(files(), 2);
        // A marked copy shows that the file is read.
        let marked = vec![Vec3::splat(7.0); 16];
        let path = folder.path().join(format!("{}.exr", truths(b"one").key(&view, 2, 0)));
        exr::write(&path, (4, 4), &marked).unwrap();
        assert_ne!(truths(b"one").truth(&view, 4).unwrap(), first);
        assert_eq!(truths(b"two").truth(&view, 4).unwrap(), first, "another scene file is rendered anew");
        assert_eq!(files(), 4);
        let wider = View::new(&trace, &known.camera, (4, 3));
        truths(b"one").truth(&wider, 4).unwrap();
        assert_eq!(files(), 6, "another size is rendered anew");
        fs::write(&path, b"torn").unwrap();
        assert_eq!(truths(b"one").truth(&view, 4).unwrap(), first, "a torn file is rendered anew");
    }

    #[test]
    fn directions_double_until_the_noise_suffices_or_the_limit_is_hit() {
        let known = &known_scenes()[0];
        let trace = TraceScene::new(&known.scene);
        let view = View::new(&trace, &known.camera, (8, 8));
        let folder = tempfile::tempdir().unwrap();
        let truths = Truths::new(folder.path(), b"scene").unwrap();
        let spp = Spp { first: 4, most: 64 };
        let easy = truths.settle(&view, spp, |_| 10.0).unwrap();
        let hard = truths.settle(&view, spp, |_| 1e-9).unwrap();
        assert_eq!((easy.spp, hard.spp), (4, 64));
        assert!(easy.suffices_for(10.0) && !hard.suffices_for(1e-9));
    }
}
