//! What changed since the last frame: which points need their direct light anew.

use glam::Vec3;
use vlm_shaders::cpu::direct::{Point, Span};
use vlm_shaders::cpu::punctual::PunctualLight;
use vlm_shaders::cpu::upload::LightSet;

use crate::stats::Skipped;

/// The most points of a span: more of them make fewer, longer invocations.
const MOST_POINTS: u32 = 64;

/// Points that are lit together: samples of one light, or one piece of surface without a light.
#[derive(Clone, Debug)]
struct LitSpan {
    span: Span,
    /// `None` for surface without a light.
    light: Option<u32>,
    least: Vec3,
    most: Vec3,
    /// Some real light of the frame reaches it.
    is_lit: bool,
    /// Needs its light anew.
    dirty: bool,
}

/// Where the visibility comes from.
enum Seen {
    /// Every point sees every light.
    All,
    /// From the host.
    Given(Vec<f32>),
    /// From shadow maps of so many lights, on the device.
    Maps(usize),
}

/// What the last frame was lit by, and what changed since.
pub(crate) struct Changes {
    /// Those that reflect something, by their points.
    spans: Vec<LitSpan>,
    /// Of all the asset's.
    light_count: u32,
    /// Of all the asset's.
    sample_count: u32,
    /// Lights that reflect nothing.
    black: u32,
    lights: Vec<PunctualLight>,
    seen: Seen,
    point_count: usize,
}

impl Changes {
    /// Nothing is lit, which the direct light on the device, all 0, says already.
    pub(crate) fn new(set: &LightSet, reflectance_of_pieces: &[Vec3], points: &[Point]) -> Self {
        let reflects = |sample: u32| {
            set.samples.get(sample as usize).is_some_and(|sample| sample.reflectance != Vec3::ZERO)
        };
        let mut spans = Vec::new();
        let mut black = 0;
        for light in 0..set.len() {
            let range = set.sample_range(light).unwrap_or_default();
            let (start, end) = (range.start as u32, range.end.min(set.samples.len()) as u32);
            if !(start..end).any(reflects) {
                black += 1;
                continue;
            }
            for first in (start..end).step_by(MOST_POINTS as usize) {
                let count = (end - first).min(MOST_POINTS);
                spans.push(LitSpan::new(Span { first, count }, Some(light as u32), points));
            }
        }
        for (piece, reflectance) in reflectance_of_pieces.iter().enumerate() {
            if *reflectance != Vec3::ZERO {
                let first = (set.samples.len() + piece) as u32;
                spans.push(LitSpan::new(Span { first, count: 1 }, None, points));
            }
        }
        Self {
            spans,
            light_count: set.len() as u32,
            sample_count: set.samples.len() as u32,
            black,
            lights: Vec::new(),
            seen: Seen::All,
            point_count: points.len(),
        }
    }

    /// Number of spans there are.
    pub(crate) fn span_count(&self) -> usize {
        self.spans.len()
    }

    /// The spans whose light is to be found anew.
    pub(crate) fn dirty(&self) -> Vec<Span> {
        self.spans.iter().filter(|lit| lit.dirty).map(|lit| lit.span).collect()
    }

    /// The lights and, counted on from these, pieces of surface that the spans belong to; ascending.
    pub(crate) fn dirty_elements(&self) -> Vec<u32> {
        let samples = self.sample_count;
        let element = |lit: &LitSpan| {
            lit.light.unwrap_or_else(|| self.light_count + lit.span.first.saturating_sub(samples))
        };
        let mut elements: Vec<u32> = self.spans.iter().filter(|lit| lit.dirty).map(element).collect();
        elements.dedup();
        elements
    }

    /// How many lights have dirty spans, and how many are skipped.
    pub(crate) fn counts(&self) -> (u32, Skipped) {
        let (mut injected, mut skipped) = (0, Skipped { black: self.black, ..Skipped::default() });
        for spans in self.spans.chunk_by(|a, b| a.light == b.light && a.light.is_some()) {
            if spans.iter().any(|lit| lit.light.is_none()) {
                continue;
            }
            match (spans.iter().any(|lit| lit.dirty), spans.iter().any(|lit| lit.is_lit)) {
                (true, _) => injected += 1,
                (false, true) => skipped.unchanged += 1,
                (false, false) => skipped.unlit += 1,
            }
        }
        (injected, skipped)
    }

    /// All that was dirty has its light.
    pub(crate) fn clean(&mut self) {
        self.spans.iter_mut().for_each(|lit| lit.dirty = false);
    }

    /// Takes a frame's real lights; true if any of them changed.
    pub(crate) fn light(&mut self, lights: &[PunctualLight]) -> bool {
        let before = std::mem::replace(&mut self.lights, lights.to_vec());
        let changed: Vec<PunctualLight> = (0..before.len().max(lights.len()))
            .filter(|&i| before.get(i) != lights.get(i))
            .flat_map(|i| before.get(i).into_iter().chain(lights.get(i)).copied())
            .collect();
        if changed.is_empty() {
            return false;
        }
        for lit in &mut self.spans {
            lit.dirty |= changed.iter().any(|light| lit.is_reached(light));
            lit.is_lit = lights.iter().any(|light| lit.is_reached(light));
        }
        true
    }

    /// Takes a frame's visibility; the numbers of the lights for which any of it changed.
    pub(crate) fn see(&mut self, visibility: &[f32]) -> Vec<u32> {
        if matches!(&self.seen, Seen::Given(before) if before == visibility) {
            return Vec::new();
        }
        let points = self.point_count.max(1);
        let before = match std::mem::replace(&mut self.seen, Seen::Given(visibility.to_vec())) {
            Seen::All => None,
            Seen::Given(before) => Some(before),
            Seen::Maps(_) => {
                self.spans.iter_mut().for_each(|lit| lit.dirty |= lit.is_lit);
                return (0..visibility.len().div_ceil(points) as u32).collect();
            }
        };
        // Before the first visibility, every point saw every light.
        let seen = vec![1.0; points];
        let mut changed = Vec::new();
        for (light, now) in visibility.chunks(points).enumerate() {
            let known = before.as_deref().and_then(|all| all.get(light * points..(light + 1) * points));
            if known == Some(now) {
                continue;
            }
            let then = known.unwrap_or(&seen);
            changed.push(light as u32);
            let real_light = self.lights.get(light);
            for lit in &mut self.spans {
                let span = lit.span.first as usize..(lit.span.first + lit.span.count) as usize;
                let is_reached = real_light.is_some_and(|light| lit.is_reached(light));
                lit.dirty |= is_reached && then.get(span.clone()) != now.get(span);
            }
        }
        changed
    }

    /// The visibility of this frame's lights comes from shadow maps, and that of these lights changes.
    pub(crate) fn map(&mut self, changed: &[u32]) {
        if matches!(self.seen, Seen::Given(_)) {
            self.spans.iter_mut().for_each(|lit| lit.dirty |= lit.is_lit);
        }
        self.seen = Seen::Maps(self.lights.len());
        let changed: Vec<&PunctualLight> =
            changed.iter().filter_map(|&light| self.lights.get(light as usize)).collect();
        for lit in &mut self.spans {
            lit.dirty |= changed.iter().any(|light| lit.is_reached(light));
        }
    }

    /// Whether visibility was ever given.
    pub(crate) fn has_visibility(&self) -> bool {
        !matches!(self.seen, Seen::All)
    }

    /// Numbers of visibility as it was last given.
    pub(crate) fn visibility_len(&self) -> usize {
        match &self.seen {
            Seen::All => 0,
            Seen::Given(visibility) => visibility.len(),
            Seen::Maps(lights) => lights * self.point_count,
        }
    }

    /// The points of some lights moved.
    pub(crate) fn moved(&mut self, lights: std::ops::Range<u32>, points: &[Point]) {
        for lit in &mut self.spans {
            if lit.light.is_some_and(|light| lights.contains(&light)) {
                *lit = LitSpan { dirty: true, ..LitSpan::new(lit.span, lit.light, points) };
                lit.is_lit = self.lights.iter().any(|light| lit.is_reached(light));
            }
        }
    }
}

impl LitSpan {
    fn new(span: Span, light: Option<u32>, points: &[Point]) -> Self {
        let own = points.get(span.first as usize..(span.first + span.count) as usize).unwrap_or(&[]);
        let (mut least, mut most) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for point in own {
            least = least.min(point.position);
            most = most.max(point.position);
        }
        Self { span, light, least, most, is_lit: false, dirty: false }
    }

    /// False only where a light's range ends before all points.
    fn is_reached(&self, light: &PunctualLight) -> bool {
        if light.directional {
            return true;
        }
        let nearest = light.position.clamp(self.least.min(self.most), self.most.max(self.least));
        let is_beyond = nearest.distance(light.position) > light.range;
        !is_beyond
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vlm_format::Sample;

    /// Lights of one, none and 70 samples at x = 0, 10 and 20, then a piece at x = 30.
    fn changes() -> Changes {
        let sample = |x: f32, reflectance: f32| Sample {
            position: Vec3::X * x,
            normal: Vec3::Z,
            reflectance: Vec3::splat(reflectance),
        };
        let mut samples = vec![sample(0.0, 0.5), sample(10.0, 0.0)];
        samples.extend((0..70).map(|_| sample(20.0, 0.5)));
        let set = LightSet {
            geometry: vec![Default::default(); 3],
            sample_starts: vec![0, 1, 2, 72],
            samples,
            ..LightSet::default()
        };
        let mut points = vlm_shaders::cpu::direct::points(&set, &[]);
        points.push(Point { position: Vec3::X * 30.0, ..Point::default() });
        Changes::new(&set, &[Vec3::ONE], &points)
    }

    #[test]
    fn long_lights_divide_and_black_ones_are_left_out() {
        let mut changes = changes();
        assert!(changes.dirty().is_empty(), "without lights all is black");
        changes.light(&[PunctualLight::directional(Vec3::Z, Vec3::ONE)]);
        let spans: Vec<(u32, u32)> = changes.dirty().iter().map(|span| (span.first, span.count)).collect();
        assert_eq!(spans, [(0, 1), (2, 64), (66, 6), (72, 1)]);
        assert_eq!(changes.counts(), (2, Skipped { black: 1, ..Skipped::default() }));
    }

    #[test]
    fn only_what_a_changed_light_reaches_is_dirty() {
        let mut changes = changes();
        let lamp = PunctualLight { range: 3.0, ..PunctualLight::point(Vec3::X * -2.0, Vec3::ONE) };
        assert!(changes.light(&[lamp]));
        changes.clean();
        assert!(!changes.light(&[lamp]) && changes.dirty().is_empty(), "the same light");
        assert!(changes.light(&[PunctualLight { intensity: Vec3::X, ..lamp }]));
        assert_eq!(changes.dirty().len(), 1);
        assert_eq!(changes.counts(), (1, Skipped { unlit: 1, black: 1, ..Skipped::default() }));
        assert_eq!(changes.dirty_elements(), [0]);
        changes.clean();
        // Where it was and where it is.
        assert!(changes.light(&[PunctualLight { position: Vec3::X * 29.0, ..lamp }]));
        assert_eq!(changes.dirty(), [Span { first: 0, count: 1 }, Span { first: 72, count: 1 }]);
        assert_eq!(changes.dirty_elements(), [0, 3], "a light and the first piece");
        changes.clean();
        assert!(changes.light(&[]), "it went out");
        assert_eq!(changes.dirty().len(), 1);
    }

    #[test]
    fn only_points_whose_visibility_changed_are_dirty() {
        let mut changes = changes();
        changes.light(&[PunctualLight::directional(Vec3::Z, Vec3::ONE); 2]);
        changes.clean();
        let mut visibility = vec![1.0; 2 * 73];
        assert_eq!(changes.see(&visibility), [0, 1], "the first time all is written");
        assert!(changes.dirty().is_empty(), "but as long as every point sees every light, none changed");
        visibility[73 + 70] = 0.5;
        assert_eq!(changes.see(&visibility), [1]);
        assert_eq!(changes.dirty(), [Span { first: 66, count: 6 }]);
        changes.clean();
        assert!(changes.see(&visibility).is_empty() && changes.dirty().is_empty());
    }
}
