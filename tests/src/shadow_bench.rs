//! How far shadow maps lie from rays, at the points that phase 1 lights: the lights' radiosity by size of the maps, as rows and a table.

use glam::Vec4;
use serde::{Deserialize, Serialize};
use vlm_bake::scene::Scene;
use vlm_bake::shade::TraceScene;
use vlm_runtime::{Error, Frame, PunctualLight, Settings, ShadowMap, Visibility, VlmAsset};

use crate::runtime_gpu::{Host, visibility};
use vlm_runtime::view::{MapRenderer, frusta};

use crate::shadow_maps::{RadiosityError, radiosity_error};
use crate::text::table;

/// A scene by maps of one size. Errors are those of [`RadiosityError`], against rays.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The scene.
    pub scene: String,
    /// Virtual lights.
    pub lights: usize,
    /// Points that phase 1 lights.
    pub points: usize,
    /// Real lights.
    pub real_lights: usize,
    /// Their maps.
    pub maps: usize,
    /// Texels along a side of a map; 0 for no shadows at all.
    pub size: u32,
    /// Offset along the normal, texels.
    pub normal_offset: f32,
    /// Of radiosity, weighted by area.
    pub relative_rmse: f64,
    /// Of flux, signed.
    pub energy: f64,
    /// The pass `shadow` for all maps, seconds; 0 where the device does not tell. Where drawing the maps is not done by then, that is in it.
    pub seconds: f64,
}

/// A scene's rows: without shadows, then by maps of each size at each offset, in texels.
///
/// # Errors
/// Where the device or the asset fails.
pub fn measure(
    (name, scene, asset): (&str, &Scene, &VlmAsset),
    sizes: &[u32],
    offsets: &[f32],
) -> Result<Vec<Row>, Error> {
    let trace = TraceScene::new(scene);
    let mut host = Host::new(asset, Settings { time_passes: true, ..Settings::default() })?;
    let points = host.renderer.points()?.to_vec();
    let frusta = frusta(scene, &trace.lights);
    let areas: Vec<f64> = asset.lights().geometry.iter().map(|light| f64::from(light.area())).collect();
    let row = Row {
        scene: name.to_owned(),
        lights: areas.len(),
        points: points.len(),
        real_lights: trace.lights.len(),
        maps: frusta.len(),
        ..Row::default()
    };
    let (unshadowed, _) = radiosity(&mut host, &trace.lights, Visibility::Kept)?;
    let seen = visibility(&trace, &points);
    let (by_rays, _) = radiosity(&mut host, &trace.lights, Visibility::Given(&seen))?;
    let with_error = |row: Row, found: &[Vec4]| {
        let none = RadiosityError { relative_rmse: f64::NAN, energy: f64::NAN };
        let RadiosityError { relative_rmse, energy } =
            radiosity_error(&areas, found, &by_rays).unwrap_or(none);
        Row { relative_rmse, energy, ..row }
    };
    let mut rows = vec![with_error(row.clone(), &unshadowed)];
    let renderer = MapRenderer::new(&host.device, &host.queue, scene);
    for &size in sizes {
        let drawn = renderer.draw(&frusta, size);
        for &normal_offset in offsets {
            let maps: Vec<ShadowMap<'_>> =
                drawn.iter().map(|map| ShadowMap { normal_offset, ..map.shadow_map(0) }).collect();
            let (found, seconds) = radiosity(&mut host, &trace.lights, Visibility::Maps(&maps))?;
            rows.push(with_error(Row { size, normal_offset, seconds, ..row.clone() }, &found));
        }
    }
    Ok(rows)
}

/// The lights' radiosity by this visibility, and how long the pass `shadow` took, seconds.
fn radiosity(
    host: &mut Host,
    lights: &[PunctualLight],
    visibility: Visibility<'_>,
) -> Result<(Vec<Vec4>, f64), Error> {
    host.renderer.prepare(&host.queue, &Frame { lights, visibility, ..Frame::default() })?;
    let mut encoder = host.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    host.renderer.record_light(&mut encoder)?;
    host.queue.submit([encoder.finish()]);
    let found = host.renderer.radiosity(&host.queue)?;
    let times = host.renderer.wait_for_times(&host.queue)?.unwrap_or_default();
    let seconds = times.passes.iter().find(|time| time.pass == "shadow").map_or(0.0, |time| time.seconds);
    Ok((found, seconds))
}

/// The rows in Markdown.
#[must_use]
pub fn summary(rows: &[Row]) -> String {
    let heads = [
        "scene",
        "lights",
        "points",
        "real lights",
        "maps",
        "texels",
        "offset, texels",
        "relative RMSE",
        "energy",
    ];
    let cells = |row: &Row| {
        let or_none = |text: String| if row.size == 0 { "none".to_owned() } else { text };
        vec![
            row.scene.clone(),
            row.lights.to_string(),
            row.points.to_string(),
            row.real_lights.to_string(),
            row.maps.to_string(),
            or_none(format!("{0} x {0}", row.size)),
            or_none(row.normal_offset.to_string()),
            format!("{:.4}", row.relative_rmse),
            format!("{:+.2} %", 100.0 * row.energy),
        ]
    };
    let rows: Vec<Vec<String>> = rows.iter().map(cells).collect();
    format!("# Shadow maps against rays\n\n{}", table(&heads.map(str::to_owned), &rows))
}
