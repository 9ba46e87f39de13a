//! An asset on the device, and what of it a frame changes.

use std::ops::Range;

use glam::{DMat4, Vec3};
use vlm_format::Grid;
use vlm_shaders::cpu::direct::points;
use vlm_shaders::cpu::punctual::PunctualLight;
use vlm_shaders::tables::LightSurface;
use wgpu::{BindGroup, Queue};

use crate::changes::Changes;
use crate::direct::{Direct, DirectPipeline, write};
use crate::error::Error;
use crate::frame::{Frame, MovedNode, ShadowMap, Visibility};
use crate::gather::Gather;
use crate::inject::Inject;
use crate::load::{VlmAsset, world_lights};
use crate::pass::Buffers;
use crate::refresh::Refresh;
use crate::shadow::{self, Shadow, ShadowPipeline};
use crate::stats::FrameStats;
use crate::upload::{Host, Uploaded, check_listed, check_real_lights, list_words};

/// An asset on the device.
pub(crate) struct Loaded {
    pub(crate) asset: VlmAsset,
    pub(crate) host: Host,
    pub(crate) uploaded: Uploaded,
    pub(crate) common: BindGroup,
    pub(crate) shadow: Shadow,
    pub(crate) direct: Direct,
    pub(crate) inject: Inject,
    pub(crate) refresh: Option<Refresh>,
    pub(crate) gather: Gather,
    pub(crate) changes: Changes,
    /// Nodes that are not at rest.
    pub(crate) moved: Vec<MovedNode>,
    /// Factors of the lights; 1 where there is none.
    pub(crate) tints: Vec<Vec3>,
    /// The radiosity of all lights is to be found anew.
    pub(crate) is_stale: bool,
    pub(crate) is_prepared: bool,
    pub(crate) stats: FrameStats,
}

impl Loaded {
    pub(crate) fn check(
        &self,
        frame: &Frame<'_>,
        buffers: &Buffers<'_>,
        moving_nodes: bool,
    ) -> Result<(), Error> {
        check_finite(frame)?;
        check_real_lights(frame.lights.len())?;
        let (lights, points) = (frame.lights.len(), self.host.points.len());
        let found = match frame.visibility {
            Visibility::Given(visibility) => Some(visibility.len()),
            Visibility::Maps(maps) => {
                shadow::check(maps, lights)?;
                None
            }
            Visibility::Kept => self.changes.has_visibility().then(|| self.changes.visibility_len()),
        };
        if let Some(found) = found.filter(|&found| found != lights * points) {
            let (found, lights, points) = (found as u64, lights as u32, points as u32);
            return Err(Error::VisibilityLength { found, lights, points });
        }
        if frame.visibility != Visibility::Kept {
            buffers.check("visibility", (lights * points * size_of::<f32>()) as u64)?;
        }
        if !frame.moved.is_empty() && !moving_nodes {
            return Err(Error::MovingOff);
        }
        let vlms = &self.asset.asset.vlms;
        match frame.moved.iter().find(|moved| !vlms.iter().any(|vlm| vlm.node == moved.node)) {
            Some(&MovedNode { node, .. }) => Err(Error::UnknownNode { node }),
            None => Ok(()),
        }
    }

    /// Writes the real lights and their visibility where they changed, and which points that lights anew; bytes written.
    pub(crate) fn write_direct(
        &mut self,
        queue: &Queue,
        buffers: &Buffers<'_>,
        pipelines: (&ShadowPipeline, &DirectPipeline),
        frame: &Frame<'_>,
    ) -> Result<u64, Error> {
        let mut bytes = 0;
        if self.changes.light(frame.lights) {
            bytes += self.direct.write_lights(queue, frame.lights);
        }
        bytes += match frame.visibility {
            Visibility::Kept => 0,
            Visibility::Given(visibility) => {
                self.shadow.forget();
                let changed = self.changes.see(visibility);
                self.direct.write_visibility(queue, (buffers, pipelines.1), visibility, &changed)?
            }
            Visibility::Maps(maps) => self.take_maps(queue, buffers, pipelines, (frame.lights, maps))?,
        };
        let spans = self.changes.dirty();
        let header = (frame.lights.len(), self.changes.has_visibility());
        Ok(bytes + self.direct.write_spans(queue, buffers.device, &spans, header)?)
    }

    /// Says which shadow maps are to be read; bytes written.
    fn take_maps(
        &mut self,
        queue: &Queue,
        buffers: &Buffers<'_>,
        (shadow, direct): (&ShadowPipeline, &DirectPipeline),
        frame: (&[PunctualLight], &[ShadowMap<'_>]),
    ) -> Result<u64, Error> {
        let points = self.host.points.len();
        let size = (frame.0.len() * points * size_of::<f32>()) as u64;
        if self.direct.make_room((buffers, direct), size)? {
            self.shadow.forget();
        }
        let bound = self.direct.points_and_visibility();
        let (changed, bytes) = self.shadow.take(queue, (buffers, shadow), bound, frame, points)?;
        self.changes.map(&changed);
        Ok(bytes)
    }

    /// Says what of phase 1 is to be done again: nothing, what the dirty points reach, or all; bytes written.
    pub(crate) fn plan(&mut self, queue: &Queue) -> u64 {
        let elements = self.changes.dirty_elements();
        let is_whole = self.is_stale || 2 * elements.len() > self.inject.work.total();
        let elements = (!is_whole).then_some(&elements[..]);
        let indices = &self.uploaded.indices;
        let mut bytes = self.inject.work.plan(queue, indices, elements);
        if let Some(refresh) = &mut self.refresh {
            let probes = elements.and_then(|elements| refresh.dependents.of(elements));
            bytes += refresh.work.plan(queue, indices, probes.as_deref());
        }
        bytes
    }

    /// Moves the lights of nodes that are elsewhere than in the last frame; bytes written.
    pub(crate) fn move_nodes(&mut self, queue: &Queue, moved: &[MovedNode]) -> Result<u64, Error> {
        let at_rest = |m: &&MovedNode| self.rest(m.node) != Some(m.world_from_node);
        let moved: Vec<MovedNode> = moved.iter().filter(at_rest).copied().collect();
        if moved == self.moved {
            return Ok(0);
        }
        let listed = self.lights_of(&moved);
        if self.refresh.is_some() {
            check_listed(listed.len())?;
        }
        let place =
            |moved: &[MovedNode], node: u32| moved.iter().find(|m| m.node == node).map(|m| m.world_from_node);
        let elsewhere: Vec<Range<u32>> = self
            .asset
            .asset
            .vlms
            .iter()
            .filter(|vlm| place(&moved, vlm.node) != place(&self.moved, vlm.node))
            .map(|vlm| vlm.lights[0]..vlm.lights[0].saturating_add(vlm.lights[1]))
            .collect();
        let now = |node| place(&moved, node).or_else(|| self.rest(node));
        self.host.lights = world_lights(&self.asset.asset, now);
        let uncovered =
            self.host.points.split_off(self.host.lights.samples.len().min(self.host.points.len()));
        self.host.points = points(&self.host.lights, &[]);
        self.host.points.extend(uncovered);
        self.moved = moved;
        self.is_stale = true;
        self.shadow.points_moved();
        let bytes: u64 = elsewhere.into_iter().map(|lights| self.write_moved(queue, lights)).sum();
        Ok(bytes + self.write_listed(queue, &listed))
    }

    /// Writes the reflectances and emissions of the lights from the first to the last whose tint changed; bytes written.
    pub(crate) fn tint(&mut self, queue: &Queue, tints: &[Vec3]) -> u64 {
        let of = |tints: &[Vec3], light: usize| tints.get(light).copied().unwrap_or(Vec3::ONE);
        let changes = |light: &usize| of(tints, *light) != of(&self.tints, *light);
        let set = &self.asset.lights;
        let (first, last) = ((0..set.len()).find(changes), (0..set.len()).rfind(changes));
        self.tints = tints.to_vec();
        let Some((first, last)) = first.zip(last) else { return 0 };
        let start = |light: usize| set.sample_starts.get(light).map_or(0, |&start| start as usize);
        let mut samples = set.samples.get(start(first)..start(last + 1)).unwrap_or(&[]).to_vec();
        for light in first..=last {
            let tint = of(tints, light);
            let own = start(light) - start(first)..start(light + 1) - start(first);
            samples.get_mut(own).unwrap_or_default().iter_mut().for_each(|s| s.reflectance *= tint);
            if let Some(surface) = self.host.light_surfaces.get_mut(light) {
                surface.emission = set.emission.get(light).copied().unwrap_or_default() * tint;
            }
        }
        self.is_stale = true;
        let listed = self.lights_of(&self.moved);
        write(queue, &self.uploaded.samples, start(first), &samples)
            + write(queue, &self.uploaded.light_surfaces, 0, &self.host.light_surfaces)
            + self.write_listed(queue, &listed)
    }

    fn rest(&self, node: u32) -> Option<DMat4> {
        self.asset.world_from_node.get(node as usize).copied()
    }

    fn lights_of(&self, moved: &[MovedNode]) -> Vec<u32> {
        let is_moved = |node| moved.iter().any(|m| m.node == node);
        let vlms = self.asset.asset.vlms.iter().filter(|vlm| is_moved(vlm.node));
        vlms.flat_map(|vlm| vlm.lights[0]..vlm.lights[0].saturating_add(vlm.lights[1])).collect()
    }

    /// Writes where some lights are, and their points; bytes written.
    fn write_moved(&mut self, queue: &Queue, lights: Range<u32>) -> u64 {
        let Host { lights: set, points, .. } = &self.host;
        let starts = |light: u32| set.sample_starts.get(light as usize).map_or(0, |&start| start as usize);
        let (first, samples) = (lights.start as usize, starts(lights.start)..starts(lights.end));
        let geometry = set.geometry.get(first..lights.end as usize).unwrap_or(&[]);
        let own_points = points.get(samples.clone()).unwrap_or(&[]);
        let bytes = write(queue, &self.uploaded.geometry, first, geometry)
            + write(queue, &self.uploaded.points, samples.start, own_points);
        self.changes.moved(lights, points);
        bytes
    }

    /// Lists the lights that moved, and takes them out of the grid, which has their light where they were; bytes written.
    fn write_listed(&self, queue: &Queue, listed: &[u32]) -> u64 {
        if self.refresh.is_none() {
            return 0;
        }
        let mut surfaces: Vec<LightSurface> = self.host.light_surfaces.clone();
        for &light in listed {
            if let Some(surface) = surfaces.get_mut(light as usize) {
                surface.gain = 0.0;
            }
        }
        write(queue, &self.uploaded.light_surfaces, 0, &surfaces)
            + write(queue, &self.uploaded.indices, self.host.header.summed as usize, &list_words(listed))
    }

    /// The numbers of this frame; those of the next begin at 0.
    pub(crate) fn take_stats(&mut self) -> FrameStats {
        let (lights_injected, lights_skipped) = self.changes.counts();
        self.changes.clean();
        self.is_stale = false;
        self.stats.frame += 1;
        let stats = FrameStats { lights_injected, lights_skipped, ..self.stats.clone() };
        self.stats.bytes_uploaded = 0;
        stats
    }
}

pub(crate) fn reflectances(grid: &Grid) -> Vec<Vec3> {
    grid.uncovered.iter().map(|piece| piece.reflectance).collect()
}

/// The lights that may ever shine.
pub(crate) fn shining(asset: &VlmAsset) -> Vec<u32> {
    let set = &asset.lights;
    let shines = |&light: &u32| {
        let emits = set.emission.get(light as usize).is_some_and(|emission| *emission != Vec3::ZERO);
        emits || set.samples_of(light as usize).iter().any(|sample| sample.reflectance != Vec3::ZERO)
    };
    (0..set.len() as u32).filter(shines).collect()
}

/// All numbers of a frame count, since one that is not finite spreads over the picture.
fn check_finite(frame: &Frame<'_>) -> Result<(), Error> {
    let finite =
        |what: String, is_finite: bool| if is_finite { Ok(()) } else { Err(Error::NotFinite { what }) };
    for (number, light) in frame.lights.iter().enumerate() {
        let vectors = [light.position, light.direction, light.intensity].iter().all(|v| v.is_finite());
        let cone = light.cone_scale.is_finite() && light.cone_offset.is_finite() && !light.range.is_nan();
        finite(format!("light {number}"), vectors && cone)?;
    }
    for moved in frame.moved {
        finite(format!("the transform of node {}", moved.node), moved.world_from_node.is_finite())?;
    }
    finite("the camera".to_owned(), frame.view.world_from_clip.is_finite())?;
    finite("the exposure".to_owned(), frame.view.exposure.is_finite())
}
