//! Random cases of every kind that breaks a form factor, numbered so that any of them can be made again.

use std::f64::consts::TAU;

use glam::{DMat3, DVec3, Vec3};

use super::case::Case;

/// What a case tries. All but the last two have finite coordinates of ordinary size and unit normals.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    /// Anywhere in front of the light, any normal.
    Anywhere,
    /// The horizon passes through a corner, or within 1e-8 to 1e-1 of it.
    HorizonAtCorner,
    /// The horizon holds an edge, or misses it by 1e-8 to 1e-1.
    HorizonAlongEdge,
    /// On the light's plane or 1e-8 to 1e-1 of the distance away from it.
    NearPlane,
    /// Normals from 1e-3 to 1e3 long.
    NormalLength,
    /// Light and receiver scaled by 1e-42 to 1e36.
    OddSize,
    /// Without area, or with NaN or infinity in one of the coordinates.
    Broken,
}

/// Every kind, in the order of the table.
pub const KINDS: [Kind; 7] = [
    Kind::Anywhere,
    Kind::HorizonAtCorner,
    Kind::HorizonAlongEdge,
    Kind::NearPlane,
    Kind::NormalLength,
    Kind::OddSize,
    Kind::Broken,
];

/// The kinds of `KINDS`, as often as they come: half of all cases are of the plain kind.
const SCHEDULE: [Kind; 16] = {
    use Kind::*;
    [
        Anywhere,
        HorizonAtCorner,
        Anywhere,
        HorizonAlongEdge,
        Anywhere,
        NearPlane,
        Anywhere,
        HorizonAtCorner,
        Anywhere,
        HorizonAlongEdge,
        Anywhere,
        NormalLength,
        Anywhere,
        OddSize,
        Anywhere,
        Broken,
    ]
};

/// Case number `index`: the same on every machine and in any order.
#[must_use]
pub fn generate(index: u64) -> (Kind, Case) {
    let kind = SCHEDULE[(index % SCHEDULE.len() as u64) as usize];
    let mut random = Random::new(index);
    (kind, make(kind, &mut random))
}

fn make(kind: Kind, random: &mut Random) -> Case {
    let size = random.log(1e-3, 1e3);
    let aspect = if random.chance(0.75) { random.log(1.2, 100.0) } else { random.log(100.0, 1e6) };
    let frame = random.rotation();
    let corners = triangle(random, aspect).map(|p| frame * p);
    let anchor = anchor(random, corners);
    let direction = frame * direction_in_front(kind, random);
    let x = anchor + direction * random.log(1e-7, 1e4);
    let n = normal(kind, random, corners.map(|p| p - x));
    let scale = if kind == Kind::OddSize { size * random.log(1e-39, 1e33) } else { size };
    let offset = offset(kind, random) * scale.min(1.0);
    let round = |p: DVec3| (p * scale + offset).as_vec3();
    let mut case = Case { corners: corners.map(round), x: round(x), n: n.as_vec3() };
    match kind {
        Kind::NormalLength => case.n *= random.log(1e-3, 1e3) as f32,
        Kind::Broken => break_case(random, &mut case),
        _ => {}
    }
    case
}

/// Longest edge 1, height `1 / aspect`, apex anywhere above it, in the plane z = 0, counter-clockwise from above; any
/// of the corners may come first.
fn triangle(random: &mut Random, aspect: f64) -> [DVec3; 3] {
    // The other two edges may not be longer than 1, and needles are as likely as caps.
    let height = 1.0 / aspect;
    let reach = (1.0 - height * height).max(0.0).sqrt();
    let along = match random.below(4) {
        0 => 1.0 - reach + random.unit() * height.min(0.5),
        1 => reach - random.unit() * height.min(0.5),
        _ => 1.0 - reach + random.unit() * (2.0 * reach - 1.0),
    };
    let mut corners = [DVec3::ZERO, DVec3::X, DVec3::new(along.clamp(0.0, 1.0), height, 0.0)];
    corners.rotate_left(random.below(3) as usize);
    corners
}

/// A point of the light: inside, on an edge, or a corner.
fn anchor(random: &mut Random, [a, b, c]: [DVec3; 3]) -> DVec3 {
    let (u, v) = (random.unit(), random.unit());
    match random.below(4) {
        0 => a,
        1 => a + u * (b - a),
        _ => a + (1.0 - u.sqrt()) * (b - a) + u.sqrt() * v * (c - a),
    }
}

fn direction_in_front(kind: Kind, random: &mut Random) -> DVec3 {
    let mut direction = random.direction();
    direction.z = direction.z.abs();
    if kind == Kind::NearPlane {
        direction.z = if random.chance(0.1) { 0.0 } else { random.log(1e-8, 0.1) };
    }
    direction.try_normalize().unwrap_or(DVec3::Z)
}

/// `corners` are relative to the receiver.
fn normal(kind: Kind, random: &mut Random, corners: [DVec3; 3]) -> DVec3 {
    let i = random.below(3) as usize;
    let (p, q) = (corners[i], corners[(i + 1) % 3]);
    let grazed = match kind {
        Kind::HorizonAtCorner => p.cross(random.direction()),
        Kind::HorizonAlongEdge => p.cross(q),
        _ => return any_normal(random, corners),
    };
    let miss = if random.chance(0.1) { 0.0 } else { random.log(1e-8, 0.1) };
    let sign = if random.chance(0.5) { 1.0 } else { -1.0 };
    let grazed = grazed.try_normalize().unwrap_or(DVec3::Z) * sign;
    (grazed + random.direction() * miss).try_normalize().unwrap_or(DVec3::Z)
}

/// Mostly such that some of the light is above the horizon.
fn any_normal(random: &mut Random, corners: [DVec3; 3]) -> DVec3 {
    let n = random.direction();
    let centre = corners[0] + corners[1] + corners[2];
    if n.dot(centre) < 0.0 && random.chance(0.9) { -n } else { n }
}

fn offset(kind: Kind, random: &mut Random) -> DVec3 {
    if kind == Kind::OddSize || random.chance(0.7) {
        return DVec3::ZERO;
    }
    random.direction() * random.log(1.0, 1e6)
}

/// Takes the area away, or puts NaN, an infinity or the largest number into one of the fifteen coordinates.
fn break_case(random: &mut Random, case: &mut Case) {
    match random.below(8) {
        0 => case.corners[1] = case.corners[0],
        1 => case.corners[2] = case.corners[0] + (case.corners[1] - case.corners[0]) * 0.5,
        2 => case.corners = [case.corners[0]; 3],
        3 => case.n = Vec3::ZERO,
        _ => {
            let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX];
            let value = odd[random.below(odd.len() as u64) as usize];
            let place = random.below(15) as usize;
            bytemuck::cast_mut::<Case, [f32; 15]>(case)[place] = value;
        }
    }
}

/// SplitMix64 (Steele, Lea, Flood 2014): a counter through a hash, so that any case can be made alone.
struct Random(u64);

impl Random {
    fn new(index: u64) -> Self {
        Self(index.wrapping_mul(0xd129_0dc5_3c2b_9e47) ^ 0x5f0f_42a1_9c3d_77b3)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// 0 to 1, without 1.
    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn below(&mut self, count: u64) -> u64 {
        self.next() % count
    }

    fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    /// Log-uniform.
    fn log(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.unit())
    }

    fn direction(&mut self) -> DVec3 {
        let z = 2.0 * self.unit() - 1.0;
        let (sin, cos) = (self.unit() * TAU).sin_cos();
        let radius = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(radius * cos, radius * sin, z)
    }

    fn rotation(&mut self) -> DMat3 {
        let z = self.direction();
        let x = z.any_orthonormal_vector();
        DMat3::from_cols(x, z.cross(x), z)
    }
}
