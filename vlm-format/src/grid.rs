//! The static grid: how light gets from the virtual lights to the places that it reaches, in arrays as a GPU reads them.

use std::ops::Range;

use glam::Vec3;

/// The most probes on surface that a leaf lists.
pub const MOST_PROBES: usize = 32;

/// Transport from lights to probes on the visible surface and in free space, and a tree of cells that tells which of them a point
/// looks at. World space.
///
/// A point's irradiance is the blend of its probes' far light plus the form factors of their near lights, each times the
/// blend of the radiosities that the probes see of it. See [`Probe`] for the weights of the blend.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Grid {
    /// Minimum corner, metres.
    pub origin: Vec3,
    /// Edge of a cell of the coarsest level, metres, above 0.
    pub cell_size: f32,
    /// Cells of the coarsest level along x, y, z; their product is below 2^30.
    pub dimensions: [u32; 3],
    /// The cells of the coarsest level, x fastest, then groups of eight that divide a cell (x fastest). A cell holds 0 where
    /// nothing is stored, `2 * i + 1` for leaf `i`, or `2 * i` where the group of eight begins at `cells[i]`, after itself.
    pub cells: Vec<u32>,
    /// The leaves, and one more that ends the last one's lists.
    pub leaves: Vec<Leaf>,
    /// Numbers of probes, for each leaf those on surface, then those in free space, ascending.
    pub leaf_probes: Vec<u32>,
    /// `probes.len() + 1` offsets: the lights that points around probe `i` evaluate exactly are `near[near_starts[i]..near_starts[i + 1]]`.
    pub near_starts: Vec<u32>,
    /// Numbers of lights, ascending for each probe.
    pub near: Vec<u32>,
    /// The form factor of each near light at its probe, above 0. The irradiance of its row over this is the radiosity that the probe sees of
    /// it: what is hidden, and which part of it shines, is in that.
    pub near_form_factors: Vec<f32>,
    /// Probes on surface, then those in free space.
    pub probes: Vec<Probe>,
    /// Number of probes on surface.
    pub surface_probes: u32,
    /// The share of its light's area that each sample speaks for, above 0.
    pub sample_shares: Vec<f32>,
    /// Radiosity of the surface that each light stands for over the light's own.
    pub surface_gains: Vec<f32>,
    /// Surface for which no light stands.
    pub uncovered: Vec<Uncovered>,
    /// `probes.len() + near.len() + 1` offsets in entries: the far light of probe `i` is that of the entries
    /// `row_starts[i]..row_starts[i + 1]`; after the probes' rows come those of the near lights, which take the same scale as the row of their
    /// probe, and count their steps from the first sample of their light.
    pub row_starts: Vec<u32>,
    /// Two entries to a word, the first in its lower half: weight times 256 plus step. A step counts from the source of the entry before
    /// (0 at a row's beginning); an entry of weight 0 takes 256 of its steps and nothing else. Irradiance per radiosity is the
    /// weight times [`Probe::row_scale`].
    ///
    /// Sources are pieces of surface: those of the samples, in their order, then those of whole lights, then those for which no light
    /// stands. A sample's radiosity is `gain (reflectance E / share + emission)`, a light's the sum of `share` times that over its
    /// samples, that of a piece without light `reflectance E + emission`.
    pub rows: Vec<u32>,
}

/// A piece of visible surface for which no light stands: probes see its light, and no pixel evaluates its form factor. 64 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Uncovered {
    /// Where phase 1 looks, metres.
    pub position: Vec3,
    /// Square metres.
    pub area: f32,
    /// Unit normal.
    pub normal: Vec3,
    /// Not used.
    pub padding: f32,
    /// Radiosity per irradiance: mean albedo times what artists ask for.
    pub reflectance: Vec3,
    /// Not used.
    pub padding_2: f32,
    /// Radiosity that it emits by itself, lx.
    pub emission: Vec3,
    /// Not used.
    pub padding_3: f32,
}

/// Where the lists of a leaf begin; they end where those of the next leaf do.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Leaf {
    /// Index into [`Grid::leaf_probes`]: probes on surface.
    pub probes: u32,
    /// Likewise: probes in free space.
    pub free_probes: u32,
}

/// A place where the light's way is known. 64 bytes.
///
/// On surface, irradiance is known around its normal. In the frame `(tangent, normal x tangent, normal)` a point lies at `(u, v, h)`;
/// each coordinate is divided by the probe's reach on its side, and the weight is the product of `(1 - c^2)^2` over the three,
/// 0 where any `|c| >= 1`. Reaches end where walls begin. The normal gives a factor of its own, [`Probe::normal_weight`].
///
/// In free space, light from all sides is known, the frame is the world's, and normals do not count. Where [`Probe::depth`] is below a
/// hundredth for all probes of the leaf, those that do not reach the point fade in.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Probe {
    /// Metres.
    pub position: Vec3,
    /// Per radiosity and unit of weight in the probe's row: irradiance (on surface), or the share of all directions around the probe in which
    /// it sees the source (in free space), which is mean radiance times pi per radiosity.
    pub row_scale: f32,
    /// Unit normal; +z in free space.
    pub normal: Vec3,
    /// Reach along the normal, metres, above 0.
    pub reach_up: f32,
    /// Unit tangent; +x in free space.
    pub tangent: Vec3,
    /// Reach against the normal, metres, above 0.
    pub reach_down: f32,
    /// Reach against and along the tangent, against and along `normal x tangent`, metres, above 0.
    pub reach: [f32; 4],
}

/// Probes count where their normal is within this cosine of the point's. Lower values smooth over sharper edges.
const LEAST_COSINE: f32 = 0.5;

impl Probe {
    /// The place of a point in the probe's frame, metres.
    #[must_use]
    pub fn local(&self, position: Vec3) -> Vec3 {
        let away = position - self.position;
        let bitangent = self.normal.cross(self.tangent);
        Vec3::new(away.dot(self.tangent), away.dot(bitangent), away.dot(self.normal))
    }

    /// The weight of a place given by [`Probe::local`].
    #[must_use]
    pub fn place_weight(&self, local: Vec3) -> f32 {
        let w = self.within(local);
        let product = w.x * w.y * w.z;
        product * product
    }

    /// How deep within the reach a place given by [`Probe::local`] lies: 1 at the probe, 0 where the reach ends and beyond.
    #[must_use]
    pub fn depth(&self, local: Vec3) -> f32 {
        self.within(local).min_element()
    }

    /// `1 - c^2` along each axis, 0 beyond the reach.
    fn within(&self, local: Vec3) -> Vec3 {
        let [left, right, back, front] = self.reach;
        let c = Vec3::new(
            local.x / if local.x < 0.0 { left } else { right },
            local.y / if local.y < 0.0 { back } else { front },
            local.z / if local.z < 0.0 { self.reach_down } else { self.reach_up },
        );
        (1.0 - c * c).max(Vec3::ZERO)
    }

    /// The weight outside of the reach, for points that no probe reaches: above 0 everywhere.
    #[must_use]
    pub fn stray_weight(&self, local: Vec3, normal: Vec3) -> f32 {
        let facing = (0.5 + 0.5 * normal.dot(self.normal)).max(0.0);
        let size = self.reach[0].max(self.reach[1]).max(self.reach[2]).max(self.reach[3]);
        let away = local.length_squared() / (size * size);
        (facing * facing + 1e-3) / (1e-2 + away * away)
    }

    /// The factor of a unit normal, 0 to 1.
    #[must_use]
    pub fn normal_weight(&self, normal: Vec3) -> f32 {
        let c = ((normal.dot(self.normal) - LEAST_COSINE) / (1.0 - LEAST_COSINE)).clamp(0.0, 1.0);
        c * c
    }
}

/// The sources and weights (without [`Probe::row_scale`]) of a row.
#[derive(Clone, Debug)]
pub struct Row<'a> {
    words: &'a [u32],
    next: u32,
    end: u32,
    source: u32,
}

impl Grid {
    /// Bytes of all arrays.
    #[must_use]
    pub fn byte_len(&self) -> usize {
        self.sizes().iter().map(|(_, bytes)| bytes).sum()
    }

    /// Bytes of each array, by its name in the file.
    #[must_use]
    pub fn sizes(&self) -> [(&'static str, usize); 12] {
        [
            ("cells", size_of_val(&*self.cells)),
            ("leaves", size_of_val(&*self.leaves)),
            ("leafProbes", size_of_val(&*self.leaf_probes)),
            ("probes", size_of_val(&*self.probes)),
            ("nearStarts", size_of_val(&*self.near_starts)),
            ("near", size_of_val(&*self.near)),
            ("nearFormFactors", size_of_val(&*self.near_form_factors)),
            ("sampleShares", size_of_val(&*self.sample_shares)),
            ("surfaceGains", size_of_val(&*self.surface_gains)),
            ("uncovered", size_of_val(&*self.uncovered)),
            ("rowStarts", size_of_val(&*self.row_starts)),
            ("rows", size_of_val(&*self.rows)),
        ]
    }

    /// Indices of the near lights of a probe; empty where they are out of range.
    #[must_use]
    pub fn near_range(&self, probe: usize) -> Range<usize> {
        let range = self.near_starts.get(probe).zip(self.near_starts.get(probe + 1));
        let range = range.map_or(0..0, |(&from, &to)| from as usize..to as usize);
        if range.end <= self.near.len() { range } else { 0..0 }
    }

    /// The near lights of a probe; empty where indices are out of range.
    #[must_use]
    pub fn near_of(&self, probe: usize) -> &[u32] {
        self.near.get(self.near_range(probe)).unwrap_or(&[])
    }

    /// What near light `near` adds at its probe; `first_sample` is the first of its light. Empty where indices are out of range.
    #[must_use]
    pub fn near_row(&self, near: usize, first_sample: u32) -> Row<'_> {
        Row { source: first_sample, ..self.row(self.probes.len() + near) }
    }

    /// The far light of a probe; empty where indices are out of range.
    #[must_use]
    pub fn row(&self, probe: usize) -> Row<'_> {
        let range = self.row_starts.get(probe).zip(self.row_starts.get(probe + 1));
        let (next, end) = range.map_or((0, 0), |(&start, &end)| (start, end));
        Row { words: &self.rows, next, end, source: 0 }
    }
}

impl Iterator for Row<'_> {
    type Item = (u32, u32);

    fn next(&mut self) -> Option<(u32, u32)> {
        while self.next < self.end {
            let word = self.words.get(self.next as usize / 2)?;
            let entry = (word >> (16 * (self.next & 1))) & 0xffff;
            self.next += 1;
            let (step, weight) = (entry & 0xff, entry >> 8);
            self.source = self.source.wrapping_add(if weight == 0 { 256 * step } else { step });
            if weight > 0 {
                return Some((self.source, weight));
            }
        }
        None
    }
}

/// Packs rows one after the other.
#[derive(Clone, Debug)]
pub struct RowWriter {
    /// [`Grid::row_starts`] so far.
    pub starts: Vec<u32>,
    /// [`Grid::rows`] so far.
    pub words: Vec<u32>,
}

impl Default for RowWriter {
    fn default() -> Self {
        Self { starts: vec![0], words: Vec::new() }
    }
}

impl RowWriter {
    /// Adds a row of sources, ascending from `first` on, with weights of 1 to 255.
    pub fn push(&mut self, first: u32, row: impl IntoIterator<Item = (u32, u8)>) {
        let mut end = self.starts.last().copied().unwrap_or(0);
        let mut at = first;
        for (source, weight) in row {
            let mut step = source.saturating_sub(at);
            while step > 0xff {
                let pages = (step / 256).min(0xff);
                self.entry(&mut end, pages);
                step -= 256 * pages;
            }
            self.entry(&mut end, (u32::from(weight) << 8) | step);
            at = source;
        }
        self.starts.push(end);
    }

    fn entry(&mut self, end: &mut u32, entry: u32) {
        match self.words.last_mut().filter(|_| *end % 2 == 1) {
            Some(word) => *word |= entry << 16,
            None => self.words.push(entry),
        }
        *end += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_survive_packing() {
        let rows: [Vec<(u32, u8)>; 5] = [
            vec![(0, 255), (1, 1), (300, 7)],
            vec![],
            vec![(70_000, 3)],
            vec![(255, 9), (511, 9), (512, 1)],
            vec![(20_000_000, 200)],
        ];
        let mut writer = RowWriter::default();
        rows.iter().for_each(|row| writer.push(0, row.iter().copied()));
        let grid = Grid { row_starts: writer.starts, rows: writer.words, ..Grid::default() };
        for (i, row) in rows.iter().enumerate() {
            let read: Vec<(u32, u8)> = grid.row(i).map(|(light, weight)| (light, weight as u8)).collect();
            assert_eq!(&read, row, "row {i}");
        }
        assert_eq!(grid.row(5).next(), None, "out of range");
        assert_eq!(grid.near_row(2, 7).next(), Some((70_007, 3)), "counted from the light's first sample");
    }

    #[test]
    fn weights_end_where_the_reach_does() {
        let probe = Probe {
            normal: Vec3::Y,
            tangent: Vec3::X,
            reach: [1.0, 2.0, 1.0, 1.0],
            reach_up: 0.5,
            reach_down: 0.5,
            ..Probe::default()
        };
        let weight = |x, y, z| probe.place_weight(probe.local(Vec3::new(x, y, z)));
        assert_eq!(weight(0.0, 0.0, 0.0), 1.0);
        assert!(weight(1.9, 0.0, 0.0) > 0.0 && weight(-1.1, 0.0, 0.0) == 0.0);
        assert!(weight(0.0, 0.4, 0.0) > 0.0 && weight(0.0, 0.5, 0.0) == 0.0);
        let depth = |x, y, z| probe.depth(probe.local(Vec3::new(x, y, z)));
        assert_eq!((depth(0.0, 0.0, 0.0), depth(1.0, 0.0, 0.0), depth(2.0, 0.0, 0.0)), (1.0, 0.75, 0.0));
        assert_eq!((probe.normal_weight(Vec3::Y), probe.normal_weight(Vec3::X)), (1.0, 0.0));
    }
}
