//! The picture's own input: drag to look around, keys to fly.

use egui::{Key, Response, Ui};
use glam::DVec3;
use vlm_runtime::view::{Flight, Look, Session};

/// Radians per point that the pointer is dragged.
const TURN: f64 = 0.005;

/// Each notch of the wheel multiplies the speed by about this.
const FASTER: f64 = 1.1;

/// How fast the user flies.
pub struct Flying {
    /// Metres per second; 0 until a scene is known.
    speed: f64,
}

impl Flying {
    /// The speed is chosen by the first scene.
    pub fn new() -> Self {
        Self { speed: 0.0 }
    }

    /// Takes the input over the picture; true while it moves.
    pub fn take(&mut self, ui: &Ui, picture: &Response, session: &mut Session) -> bool {
        let Some(camera) = session.camera() else { return false };
        if self.speed <= 0.0 {
            self.speed = 0.1 * extent(session);
        }
        let dragged = picture.drag_delta();
        let wants_keys = !ui.ctx().egui_wants_keyboard_input();
        let (keys, seconds, wheel) = ui.input(|input| {
            let key = |key| f64::from(u8::from(wants_keys && input.key_down(key)));
            let way =
                DVec3::new(key(Key::D) - key(Key::A), key(Key::E) - key(Key::Q), key(Key::W) - key(Key::S));
            let faster = if input.modifiers.shift { 4.0 } else { 1.0 };
            (way * faster, f64::from(input.stable_dt.min(0.1)), f64::from(input.smooth_scroll_delta.y))
        });
        if picture.hovered() && wheel != 0.0 {
            self.speed *= FASTER.powf(wheel / 20.0);
        }
        if dragged == egui::Vec2::ZERO && keys == DVec3::ZERO {
            return false;
        }
        let mut flight = match &session.look {
            Look::Flight(flight) => flight.clone(),
            Look::Camera(_) => Flight::from_camera(&camera),
        };
        flight.turn(f64::from(dragged.x) * TURN, -f64::from(dragged.y) * TURN);
        flight.move_by(keys * self.speed * seconds);
        session.look = Look::Flight(flight);
        keys != DVec3::ZERO
    }
}

/// Metres across the scene.
fn extent(session: &Session) -> f64 {
    let positions = session.viewer.scene().map_or(&[][..], |scene| &scene.positions);
    let (mut least, mut most) = (glam::Vec3::INFINITY, glam::Vec3::NEG_INFINITY);
    for position in positions {
        least = least.min(*position);
        most = most.max(*position);
    }
    let extent = f64::from((most - least).length());
    if extent.is_finite() && extent > 0.0 { extent } else { 1.0 }
}
