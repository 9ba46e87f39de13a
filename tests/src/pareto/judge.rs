//! What pictures are worth: rows of `raw.csv`, and the pictures themselves as files.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::Vec3;

use super::names::file_name;
use super::row::Row;
use super::run::{Contestant, RunError, RunOptions, create_folder, failed};
use crate::exact::ExactPixels;
use crate::exr;
use crate::method::{MethodError, Picture, View};
use crate::metrics::{Comparison, Metrics, compare, compare_shown, frame_change};
use crate::truth::{Truth, Truths};

/// Measures the pictures of one view against its truth.
pub(super) struct Judge<'a> {
    pub(super) options: &'a RunOptions,
    /// The scene's name.
    pub(super) scene: &'a str,
    pub(super) truths: &'a Truths,
    pub(super) view: &'a View<'a>,
    pub(super) log: &'a dyn Fn(&str),
}

impl Judge<'_> {
    /// One row per picture (by contestant, then repeat); writes the truth and the last picture of each contestant.
    pub(super) fn rows(
        &self,
        contestants: &[Contestant],
        pictures: &[Vec<Picture>],
    ) -> Result<Vec<Row>, RunError> {
        let truth = self.settled_truth(pictures)?;
        let folder = self.folder();
        create_folder(&folder)?;
        self.write(&folder, "truth", &truth.irradiance)?;
        let mut sums: Vec<ExactPixels> = Vec::new();
        let mut rows = Vec::new();
        for (contestant, pictures) in contestants.iter().zip(pictures) {
            for (repeat, picture) in pictures.iter().enumerate() {
                let neighbour = pictures.get(repeat.checked_sub(1).unwrap_or(1)).unwrap_or(picture);
                let algorithm_rmse = algorithm_rmse(self.view, contestant, picture, &mut sums);
                rows.push(Row {
                    repeat: repeat as u32,
                    frame_change: self.change(picture, neighbour, &truth),
                    algorithm_rmse: algorithm_rmse
                        .map_err(|error| failed(self.scene, &*contestant.method, error))?,
                    ..self.row(contestant, picture, &truth)?
                });
            }
            if let Some(last) = pictures.last() {
                let method = &contestant.method;
                self.write(&folder, format!("{} {}", method.name(), method.knob()).trim(), &last.indirect)?;
            }
        }
        Ok(rows)
    }

    /// The truth, with as many directions as the best method's last picture asks for.
    fn settled_truth(&self, pictures: &[Vec<Picture>]) -> Result<Truth, RunError> {
        let last = || pictures.iter().filter_map(|pictures| pictures.last());
        let error = |picture: &Picture, truth: &Truth| {
            self.measure(compare, &picture.indirect, truth)
                .map_or(f64::INFINITY, |metrics| metrics.relative_rmse)
        };
        let smallest = |truth: &Truth| last().map(|p| error(p, truth)).fold(f64::INFINITY, f64::min);
        let truth = self.truths.settle(self.view, self.options.spp, smallest)?;
        let camera = &self.view.camera.name;
        let Truth { spp, noise, .. } = truth;
        (self.log)(&format!("{}: {camera}: truth of {spp} directions, noise {noise:.4}", self.scene));
        Ok(truth)
    }

    fn measure(
        &self,
        by: fn(&Comparison<'_>) -> Option<Metrics>,
        image: &[Vec3],
        truth: &Truth,
    ) -> Option<Metrics> {
        let width = self.view.gbuffer.width as usize;
        by(&Comparison { width, image, truth: &truth.irradiance, hit: &self.view.hit() })
    }

    fn change(&self, picture: &Picture, neighbour: &Picture, truth: &Truth) -> f64 {
        let change =
            frame_change(&picture.indirect, &neighbour.indirect, &truth.irradiance, &self.view.hit());
        change.unwrap_or(0.0)
    }

    fn folder(&self) -> PathBuf {
        let camera = file_name(&self.view.camera.name);
        self.options.out.join("images").join(file_name(self.scene)).join(camera)
    }

    fn write(&self, folder: &Path, name: &str, pixels: &[Vec3]) -> Result<(), RunError> {
        let size = (self.view.gbuffer.width, self.view.gbuffer.height);
        Ok(exr::write(&folder.join(file_name(name) + ".exr"), size, pixels)?)
    }

    /// Without what needs more than one picture.
    fn row(&self, contestant: &Contestant, picture: &Picture, truth: &Truth) -> Result<Row, RunError> {
        let camera = &self.view.camera.name;
        let black = || RunError::BlackTruth { scene: self.scene.to_owned(), camera: camera.clone() };
        let metrics = self.measure(compare_shown, &picture.indirect, truth).ok_or_else(black)?;
        let Contestant { method, cost, .. } = contestant;
        Ok(Row {
            scene: self.scene.to_owned(),
            camera: camera.clone(),
            width: self.view.gbuffer.width,
            height: self.view.gbuffer.height,
            method: method.name().to_owned(),
            knob: method.knob(),
            backend: method.backends().first().map_or("", |backend| backend.name()).to_owned(),
            device: contestant.prepared.device(),
            lights: picture.lights,
            pairs: picture.pairs,
            rays: picture.rays,
            bytes: cost.bytes,
            seconds_prepare: cost.prepare_seconds,
            seconds_inject: picture.seconds.inject,
            seconds_gather: picture.seconds.gather,
            relative_rmse: metrics.relative_rmse,
            rel_mse: metrics.rel_mse,
            flip: metrics.flip.unwrap_or(0.0),
            signed_energy: metrics.signed_energy,
            p99: metrics.p99,
            largest_jump: metrics.largest_jump,
            truth_spp: truth.spp,
            truth_noise: truth.noise,
            truth_suffices: truth.suffices_for(metrics.relative_rmse),
            ..Row::default()
        })
    }
}

/// Against the exact sum over the same lights, which is found once per set of lights.
fn algorithm_rmse(
    view: &View<'_>,
    contestant: &Contestant,
    picture: &Picture,
    sums: &mut Vec<ExactPixels>,
) -> Result<Option<f64>, MethodError> {
    let Some(baked) = contestant.prepared.area_lights() else { return Ok(None) };
    let known = sums.iter().position(|sum| Arc::ptr_eq(&sum.baked, &baked));
    let index = match known {
        Some(index) => index,
        None => {
            sums.push(ExactPixels::new(view, &baked)?);
            sums.len() - 1
        }
    };
    Ok(sums[index].relative_rmse(&picture.indirect))
}
