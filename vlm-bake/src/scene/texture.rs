//! Linear textures with mip levels, so that the mean over a footprint is a few look-ups.
//!
//! Level 0 keeps the file's sRGB bytes and decodes when read: a quarter of the memory of floats. The coarser levels are
//! means, so they are linear and hold 16 bits per channel: eight would lose the dark ones.

use glam::{Vec2, Vec4};
use std::borrow::Cow;
use std::sync::LazyLock;
use vlm_shaders::cpu::resolve::encode_srgb;

/// A decoded image and its mip chain, linear rgb with straight alpha.
#[derive(Clone, Debug)]
pub struct Texture {
    /// Level 0 first, halved down to one texel; never empty.
    levels: Vec<Level>,
    sampling: Sampling,
    /// Alpha is coverage (0 or 1 at level 0) and weighs the colour.
    masked: bool,
}

/// How a texture is read between and beyond its texels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sampling {
    /// Wrap modes for u and v.
    pub wrap: [Wrap; 2],
    /// Level 0 is read without interpolation (glTF's magFilter NEAREST).
    pub nearest: bool,
}

/// How coordinates outside 0 to 1 are read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// Tiles.
    #[default]
    Repeat,
    /// Tiles, every other tile mirrored.
    Mirror,
    /// Repeats the border texel.
    Clamp,
}

/// The test of alphaMode MASK: a texel covers if `factor * alpha >= cutoff`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mask {
    /// The material's alpha factor.
    pub factor: f32,
    /// The material's cutoff.
    pub cutoff: f32,
}

#[derive(Clone, Debug)]
struct Level {
    width: u32,
    height: u32,
    texels: Texels,
}

/// Rows from the top, as glTF's texture coordinates count.
#[derive(Clone, Debug)]
enum Texels {
    Srgb8(Vec<[u8; 4]>),
    Linear16(Vec<[u16; 4]>),
}

impl Texture {
    /// Builds the mip chain of `width * height` sRGB texels in row order, from the top.
    ///
    /// With a `mask`, alpha becomes coverage, and coarser levels hold the mean colour of what covers (of everything
    /// where nothing does). `None` if the number of texels is wrong or 0.
    #[must_use]
    pub fn from_srgb8(
        [width, height]: [u32; 2],
        mut texels: Vec<[u8; 4]>,
        sampling: Sampling,
        mask: Option<Mask>,
    ) -> Option<Self> {
        if texels.is_empty() || u64::from(width) * u64::from(height) != texels.len() as u64 {
            return None;
        }
        if let Some(mask) = mask {
            for texel in &mut texels {
                let covers = mask.factor * f32::from(texel[3]) / 255.0 >= mask.cutoff;
                texel[3] = if covers { 255 } else { 0 };
            }
        }
        let mut levels = vec![Level { width, height, texels: Texels::Srgb8(texels) }];
        while let Some(coarser) = levels.last().and_then(|finest| finest.halved(mask.is_some())) {
            levels.push(coarser);
        }
        Some(Self { levels, sampling, masked: mask.is_some() })
    }

    /// One white texel.
    #[must_use]
    pub fn white() -> Self {
        let level = Level { width: 1, height: 1, texels: Texels::Srgb8(vec![[255; 4]]) };
        Self { levels: vec![level], sampling: Sampling::default(), masked: false }
    }

    /// Without the levels that are wider or higher than `side` texels; one level always stays.
    #[must_use]
    pub fn at_most(mut self, side: u32) -> Self {
        let large = self.levels.iter().take_while(|level| level.width.max(level.height) > side).count();
        self.levels.drain(..large.min(self.levels.len() - 1));
        self
    }

    /// Width and height of level 0 in texels.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        self.levels.first().map_or([0, 0], |level| [level.width, level.height])
    }

    /// How it is read between and beyond its texels.
    #[must_use]
    pub fn sampling(&self) -> Sampling {
        self.sampling
    }

    /// Width, height and sRGB texels of every mip level, for devices that read textures themselves. Alpha is linear. Each level's sides are
    /// half of the one's before, rounded down.
    pub fn srgb8_levels(&self) -> impl Iterator<Item = (u32, u32, Cow<'_, [[u8; 4]]>)> {
        self.levels.iter().map(|level| {
            let texels = match &level.texels {
                Texels::Srgb8(texels) => texels.into(),
                Texels::Linear16(texels) => texels.iter().map(|&texel| srgb8_from_linear16(texel)).collect(),
            };
            (level.width, level.height, texels)
        })
    }

    /// Trilinear look-up at a mip level (0 is the finest): linear rgb, and alpha, which is coverage under a mask.
    ///
    /// Colour is not weighed by alpha here. Coordinates that are no numbers read as 0.
    #[must_use]
    pub fn sample(&self, uv: Vec2, level: f32) -> Vec4 {
        // max before min: it turns NaN into 0.
        let level = level.max(0.0).min((self.levels.len() - 1) as f32);
        let uv = if uv.is_finite() { uv } else { Vec2::ZERO };
        let fine = self.bilinear(uv, level as usize);
        let blend = level.fract();
        if blend == 0.0 { fine } else { fine.lerp(self.bilinear(uv, level as usize + 1), blend) }
    }

    /// The level one of whose texels has as much area as `texel_area` texels of level 0.
    #[must_use]
    pub fn level_of(&self, texel_area: f32) -> f32 {
        let coarsest = (self.levels.len() - 1) as f32;
        if texel_area > 1.0 { (0.5 * texel_area.log2()).min(coarsest) } else { 0.0 }
    }

    /// Alpha weighs the colour in a mean.
    #[must_use]
    pub fn is_masked(&self) -> bool {
        self.masked
    }

    #[inline]
    fn bilinear(&self, uv: Vec2, level: usize) -> Vec4 {
        let Some(texels) = self.levels.get(level) else { return Vec4::ONE };
        let [wrap_u, wrap_v] = self.sampling.wrap;
        if self.sampling.nearest && level == 0 {
            return texels.get(wrap_u.nearest(uv.x, texels.width), wrap_v.nearest(uv.y, texels.height));
        }
        let ([left, right], blend_x) = wrap_u.neighbours(uv.x, texels.width);
        let ([top, bottom], blend_y) = wrap_v.neighbours(uv.y, texels.height);
        let [top_left, top_right, bottom_left, bottom_right] = texels.quad([left, right], [top, bottom]);
        top_left.lerp(top_right, blend_x).lerp(bottom_left.lerp(bottom_right, blend_x), blend_y)
    }
}

impl Wrap {
    /// The coordinate's place within the image, 0 to 1.
    #[inline]
    fn inside(self, coordinate: f32) -> f32 {
        match self {
            Self::Repeat => coordinate - coordinate.floor(),
            Self::Clamp => coordinate.clamp(0.0, 1.0),
            Self::Mirror => 1.0 - (coordinate - 2.0 * (0.5 * coordinate).floor() - 1.0).abs(),
        }
    }

    /// The texel that holds a coordinate, of a row of `size`.
    #[inline]
    fn nearest(self, coordinate: f32, size: u32) -> u32 {
        ((self.inside(coordinate) * size as f32) as u32).min(size - 1)
    }

    /// The two texels whose centres a coordinate lies between, and how far it is on the way from one to the other.
    #[inline]
    fn neighbours(self, coordinate: f32, size: u32) -> ([u32; 2], f32) {
        let x = self.inside(coordinate) * size as f32 - 0.5;
        let first = x.floor();
        let last = size - 1;
        // Beyond the border lies the other end of a tile, but the border itself of a mirror.
        let (before, beyond) = if self == Self::Repeat { (last, 0) } else { (0, last) };
        let left = if first < 0.0 { before } else { (first as u32).min(last) };
        let right = if first + 1.0 > last as f32 { beyond } else { (first + 1.0) as u32 };
        ([left, right], x - first)
    }
}

impl Level {
    fn get(&self, x: u32, y: u32) -> Vec4 {
        let i = y as usize * self.width as usize + x as usize;
        match &self.texels {
            Texels::Srgb8(texels) => linear_from_srgb8(&LINEAR, texels.get(i).copied().unwrap_or([255; 4])),
            Texels::Linear16(texels) => linear_from_linear16(texels.get(i).copied().unwrap_or([u16::MAX; 4])),
        }
    }

    /// The texels at two columns and two rows, row by row: as four times [`Level::get`], but faster.
    #[inline]
    fn quad(&self, [left, right]: [u32; 2], [top, bottom]: [u32; 2]) -> [Vec4; 4] {
        let index = |x: u32, y: u32| y as usize * self.width as usize + x as usize;
        let at = [index(left, top), index(right, top), index(left, bottom), index(right, bottom)];
        match &self.texels {
            Texels::Srgb8(texels) => {
                let linear = &*LINEAR;
                at.map(|i| linear_from_srgb8(linear, texels.get(i).copied().unwrap_or([255; 4])))
            }
            Texels::Linear16(texels) => {
                at.map(|i| linear_from_linear16(texels.get(i).copied().unwrap_or([u16::MAX; 4])))
            }
        }
    }

    /// The next coarser level, or `None` after one texel. Odd sizes are area-correct: a coarse texel takes border
    /// texels in proportion to their overlap.
    fn halved(&self, masked: bool) -> Option<Self> {
        if self.width == 1 && self.height == 1 {
            return None;
        }
        let columns = overlaps(self.width);
        let rows = overlaps(self.height);
        let mut texels = Vec::with_capacity(columns.len() * rows.len());
        for row in &rows {
            for column in &columns {
                texels.push(linear16(self.box_mean(column, row, masked)));
            }
        }
        let (width, height) = (columns.len() as u32, rows.len() as u32);
        Some(Self { width, height, texels: Texels::Linear16(texels) })
    }

    fn box_mean(&self, columns: &Overlap, rows: &Overlap, masked: bool) -> Vec4 {
        let mut sum = Vec4::ZERO;
        let mut weighted = Vec4::ZERO;
        for (y, weight_y) in rows.iter() {
            for (x, weight_x) in columns.iter() {
                let texel = self.get(x, y);
                let share = texel * (weight_x * weight_y);
                sum += share;
                weighted += share * texel.w;
            }
        }
        if masked && sum.w > 0.0 { (weighted.truncate() / sum.w).extend(sum.w) } else { sum }
    }
}

/// Up to three neighbouring texels with weights that sum to 1.
struct Overlap {
    first: u32,
    weights: [f32; 3],
}

impl Overlap {
    fn iter(&self) -> impl Iterator<Item = (u32, f32)> {
        (self.first..).zip(self.weights).filter(|&(_, weight)| weight > 0.0)
    }
}

/// How each texel of a row of `size / 2` (at least 1) overlaps the texels of a row of `size`.
fn overlaps(size: u32) -> Vec<Overlap> {
    let coarse = (size / 2).max(1);
    let scale = f64::from(size) / f64::from(coarse);
    let overlap = |i: u32| {
        let (start, end) = (f64::from(i) * scale, f64::from(i + 1) * scale);
        let first = start.floor();
        let weights = [0.0, 1.0, 2.0].map(|k| {
            let covered = (first + k + 1.0).min(end) - (first + k).max(start);
            // Below a millionth it is rounding, which would reach beyond the last texel.
            if covered > 1e-6 { (covered / scale) as f32 } else { 0.0 }
        });
        Overlap { first: first as u32, weights }
    };
    (0..coarse).map(overlap).collect()
}

fn linear16(color: Vec4) -> [u16; 4] {
    color.to_array().map(|c| (c.clamp(0.0, 1.0) * 65535.0 + 0.5) as u16)
}

#[inline]
fn linear_from_linear16(texel: [u16; 4]) -> Vec4 {
    Vec4::from_array(texel.map(f32::from)) * (1.0 / 65535.0)
}

fn srgb8_from_linear16(texel: [u16; 4]) -> [u8; 4] {
    let linear = linear_from_linear16(texel);
    let [r, g, b] = encode_srgb(linear.truncate());
    [r, g, b, (linear.w * 255.0 + 0.5) as u8]
}

#[inline]
fn linear_from_srgb8(linear: &[f32; 256], [r, g, b, a]: [u8; 4]) -> Vec4 {
    let linear = |byte: u8| linear[usize::from(byte)];
    Vec4::new(linear(r), linear(g), linear(b), f32::from(a) * (1.0 / 255.0))
}

/// The sRGB transfer function (IEC 61966-2-1) for every byte.
static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|byte| {
        let encoded = byte as f64 / 255.0;
        let linear = if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) };
        linear as f32
    })
});

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec2;

    const BLACK: [u8; 4] = [0, 0, 0, 255];
    const WHITE: [u8; 4] = [255; 4];

    fn texture(size: [u32; 2], texels: Vec<[u8; 4]>, wrap: Wrap) -> Texture {
        let sampling = Sampling { wrap: [wrap; 2], nearest: false };
        Texture::from_srgb8(size, texels, sampling, None).unwrap()
    }

    #[test]
    fn srgb_decodes_exactly() {
        let grey = texture([1, 1], vec![[188, 10, 255, 51]], Wrap::Repeat).sample(Vec2::ZERO, 0.0);
        // ((188/255 + 0.055)/1.055)^2.4 and (10/255)/12.92.
        assert!(grey.abs_diff_eq(Vec4::new(0.502_886_5, 0.003_035_27, 1.0, 0.2), 1e-6), "{grey}");
    }

    #[test]
    fn coarsest_level_is_the_linear_mean_for_odd_sizes_too() {
        for size in [[4, 4], [5, 3], [7, 1], [1, 13], [255, 6]] {
            let count = size[0] * size[1];
            let texels: Vec<_> = (0..count).map(|i| [(i * 37 % 256) as u8, 0, 255, 255]).collect();
            let expected = texels.iter().map(|&t| linear_from_srgb8(&LINEAR, t)).sum::<Vec4>() / count as f32;
            let texture = texture(size, texels, Wrap::Repeat);
            let mean = texture.sample(vec2(0.5, 0.5), 99.0);
            assert!(mean.abs_diff_eq(expected, 1e-4), "{size:?}: {mean} against {expected}");
        }
    }

    #[test]
    fn levels_as_bytes_are_what_is_sampled() {
        let texels: Vec<_> = (0..5 * 3).map(|i| [i * 17, 40, 255 - i, 255]).collect();
        let texture = texture([5, 3], texels.clone(), Wrap::Clamp);
        let levels: Vec<_> = texture.srgb8_levels().collect();
        let sizes: Vec<_> = levels.iter().map(|(w, h, t)| (*w, *h, t.len())).collect();
        assert_eq!(sizes, [(5, 3, 15), (2, 1, 2), (1, 1, 1)]);
        assert_eq!(levels[0].2.as_ref(), texels);
        let mean = linear_from_srgb8(&LINEAR, levels[2].2[0]);
        assert!(mean.abs_diff_eq(texture.sample(Vec2::ZERO, 9.0), 0.005), "{mean}");
    }

    #[test]
    fn wrap_modes_read_beyond_the_border() {
        let texels = vec![BLACK, WHITE];
        // Two texels wide: 1.25 is the centre of the third.
        for (wrap, expected) in [(Wrap::Repeat, 0.0), (Wrap::Mirror, 1.0), (Wrap::Clamp, 1.0)] {
            let red = texture([2, 1], texels.clone(), wrap).sample(vec2(1.25, 0.0), 0.0).x;
            assert_eq!(red, expected, "{wrap:?}");
            let red = texture([2, 1], texels.clone(), wrap).sample(vec2(-0.75, 0.0), 0.0).x;
            assert_eq!(red, if wrap == Wrap::Mirror { 1.0 } else { 0.0 }, "{wrap:?}");
        }
    }

    #[test]
    fn bilinear_half_way_is_the_mean_and_nearest_is_not() {
        let smooth = texture([2, 1], vec![BLACK, WHITE], Wrap::Clamp);
        assert!((smooth.sample(vec2(0.5, 0.5), 0.0).x - 0.5).abs() < 1e-6);
        let nearest = Sampling { nearest: true, ..Sampling::default() };
        let hard = Texture::from_srgb8([2, 1], vec![BLACK, WHITE], nearest, None).unwrap();
        assert_eq!(hard.sample(vec2(0.49, 0.5), 0.0).x, 0.0);
    }

    #[test]
    fn mask_makes_coverage_and_weighs_the_colour() {
        // White covers (alpha 128 of 255 at cutoff 0.5), the black ones do not.
        let texels = vec![[255, 255, 255, 128], [0, 0, 0, 127], [0, 0, 0, 0], [0, 0, 0, 0]];
        let mask = Some(Mask { factor: 1.0, cutoff: 0.5 });
        let masked = Texture::from_srgb8([4, 1], texels.clone(), Sampling::default(), mask).unwrap();
        assert!(masked.sample(Vec2::ZERO, 9.0).abs_diff_eq(Vec4::new(1.0, 1.0, 1.0, 0.25), 1e-4));
        let plain = Texture::from_srgb8([4, 1], texels, Sampling::default(), None).unwrap();
        assert!((plain.sample(Vec2::ZERO, 9.0).x - 0.25).abs() < 1e-4, "without a mask nothing is weighed");
    }

    #[test]
    fn odd_coordinates_read_something() {
        let texture = texture([2, 2], vec![WHITE; 4], Wrap::Repeat);
        for uv in [Vec2::NAN, Vec2::INFINITY, Vec2::splat(-1e30)] {
            assert_eq!(texture.sample(uv, f32::NAN).x, 1.0);
        }
    }

    #[test]
    fn wrong_sizes_are_refused() {
        assert!(Texture::from_srgb8([2, 2], vec![WHITE; 3], Sampling::default(), None).is_none());
        assert!(Texture::from_srgb8([0, 0], vec![], Sampling::default(), None).is_none());
    }
}
