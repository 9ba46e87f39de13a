//! Where the surface around a probe ends in a step, up or down: light on the other side is another.

use glam::Vec3;

use super::pool::Place;
use super::reach::Wall;
use crate::shade::TraceScene;

/// Directions in which steps are looked for. More of them find shorter steps.
const DIRECTIONS: u32 = 16;

/// Places along each direction at which the height of the surface is taken. More of them find lower steps and narrower grooves.
const STATIONS: u32 = 16;

/// A step is a change of height by more than this share of the reach beyond what the slope explains. Lower values take roundings for steps,
/// and give uneven surface more and smaller probes.
const STEP: f32 = 0.08;

/// Surface whose normal is farther off (cosine) is another: it shares no probes anyway.
const STEEPEST: f32 = 0.5;

/// Distance along a direction, height over the probe's tangent plane and slope there.
#[derive(Clone, Copy)]
struct Station {
    along: f32,
    height: f32,
    slope: f32,
}

/// The nearest step along each direction around a place, within `reach`; `top` is how far the way up is free, `down` how far below the
/// surface a step may lead and still count as surface.
pub fn steps(trace: &TraceScene, place: &Place, reach: f32, [top, down]: [f32; 2]) -> Vec<Wall> {
    let surface = &place.surface;
    let (u, v) = surface.geometric_normal.any_orthonormal_pair();
    let step = |i: u32| {
        let (sin, cos) = (std::f32::consts::TAU * (i as f32 + 0.5) / DIRECTIONS as f32).sin_cos();
        let direction = u * cos + v * sin;
        let distance = first_step(trace, place, direction, reach, [top, down])?;
        Some(Wall { distance, at: direction * distance, facing: -direction })
    };
    let mut all: Vec<Option<Wall>> = (0..DIRECTIONS).map(step).collect();
    face(&mut all, surface.geometric_normal);
    all.into_iter().flatten().collect()
}

/// Turns each step to lie along the line to its neighbours.
fn face(steps: &mut [Option<Wall>], normal: Vec3) {
    let at: Vec<Option<Vec3>> = steps.iter().map(|step| step.as_ref().map(|s| s.at)).collect();
    let count = at.len();
    for (i, step) in steps.iter_mut().enumerate() {
        let Some(step) = step else { continue };
        let before = at[(i + count - 1) % count].unwrap_or(step.at);
        let after = at[(i + 1) % count].unwrap_or(step.at);
        if let Some(facing) = (after - before).cross(normal).try_normalize() {
            step.facing = if facing.dot(step.at) > 0.0 { -facing } else { facing };
        }
    }
}

/// How far away surface that looks the same way first lies elsewhere than the slope leads. Where there is none, nothing can be mistaken.
fn first_step(
    trace: &TraceScene,
    place: &Place,
    direction: Vec3,
    reach: f32,
    [top, down]: [f32; 2],
) -> Option<f32> {
    let apart = reach / STATIONS as f32;
    let mut last = Station { along: 0.0, height: 0.0, slope: 0.0 };
    for i in 1..=STATIONS {
        let along = i as f32 * apart;
        let Some(next) = station(trace, place, direction, along, [top, down]) else { continue };
        let expected = last.height + last.slope * (along - last.along);
        if (next.height - expected).abs() > STEP * reach {
            return Some(along - 0.5 * apart);
        }
        last = next;
    }
    None
}

/// The surface below or above a place of the tangent plane; `None` where there is none that looks the same way.
fn station(
    trace: &TraceScene,
    place: &Place,
    direction: Vec3,
    along: f32,
    [top, down]: [f32; 2],
) -> Option<Station> {
    let surface = &place.surface;
    let normal = surface.geometric_normal;
    let origin = surface.position + direction * along + normal * top;
    let hit = trace.path_hit_within(origin, -normal, top + down)?;
    let facing = trace.surface(&hit, 0.0)?.geometric_normal;
    let cosine = facing.dot(normal);
    (cosine > STEEPEST).then(|| Station {
        along,
        height: top - hit.distance,
        slope: -facing.dot(direction) / cosine,
    })
}
