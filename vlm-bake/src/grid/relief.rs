//! How far the surface around a place rises and falls: what lies higher or lower is other surface, with other light.

use glam::Vec3;

use super::pool::Place;
use crate::shade::TraceScene;

/// Directions along which the surface is followed.
const AROUND: u32 = 16;

/// Places along each direction at which its height is taken. More of them find narrower steps and grooves.
const STATIONS: u32 = 8;

/// A change of height by more than this share of the reach, beyond what the slope explains, is a step. Lower values take roundings for
/// steps, and leave uneven surface to more, smaller probes.
const STEP: f32 = 0.04;

/// Surface whose normal is farther off (cosine) is another: it shares no probes anyway.
const STEEPEST: f32 = 0.5;

/// A place on the surface around another.
#[derive(Clone, Copy, Default)]
struct Station {
    /// Distance from the middle.
    along: f32,
    /// Over the tangent plane of the middle.
    height: f32,
    /// Of the surface, along the direction.
    slope: f32,
}

/// How far the surface rises above a place's tangent plane, and falls below it, within `reach`, up to the first step in each direction;
/// `free` is how far one comes up and down along the normal.
pub fn relief(trace: &TraceScene, place: &Place, reach: f32, free: [f32; 2]) -> [f32; 2] {
    let (u, v) = place.surface.geometric_normal.any_orthonormal_pair();
    let mut relief = [0.0_f32; 2];
    for i in 0..AROUND {
        let (sin, cos) = (std::f32::consts::TAU * (i as f32 + 0.5) / AROUND as f32).sin_cos();
        let direction = u * cos + v * sin;
        let mut last = Station::default();
        for i in 1..=STATIONS {
            let along = i as f32 * reach / STATIONS as f32;
            let Some(next) = station(trace, place, direction, along, free) else { continue };
            let expected = last.height + last.slope * (along - last.along);
            if (next.height - expected).abs() > STEP * reach {
                break;
            }
            relief = [relief[0].max(next.height), relief[1].max(-next.height)];
            last = next;
        }
    }
    relief
}

/// The surface below or above a place of the tangent plane; `None` where there is none that looks the same way.
fn station(
    trace: &TraceScene,
    place: &Place,
    direction: Vec3,
    along: f32,
    [up, down]: [f32; 2],
) -> Option<Station> {
    let surface = &place.surface;
    let normal = surface.geometric_normal;
    let top = 0.9 * up;
    let origin = surface.position + direction * along + normal * top;
    let hit = trace.path_hit_within(origin, -normal, top + down)?;
    let facing = trace.surface(&hit, 0.0)?.geometric_normal;
    let cosine = facing.dot(normal);
    let slope = -facing.dot(direction) / cosine;
    (cosine > STEEPEST).then_some(Station { along, height: top - hit.distance, slope })
}
