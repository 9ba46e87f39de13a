//! Rows with known answers, for tests.

use super::row::Row;

/// A row that says what is given and nothing else that matters.
pub(crate) fn row(
    scene: &str,
    camera: &str,
    method: &str,
    knob: &str,
    repeat: u32,
    seconds: f64,
    error: f64,
) -> Row {
    Row {
        scene: scene.to_owned(),
        camera: camera.to_owned(),
        width: 96,
        height: 96,
        method: method.to_owned(),
        knob: knob.to_owned(),
        backend: "cpu".to_owned(),
        device: "made up".to_owned(),
        repeat,
        seconds_inject: seconds / 4.0,
        seconds_gather: 3.0 * seconds / 4.0,
        relative_rmse: error,
        truth_spp: 256,
        truth_noise: 0.001,
        truth_suffices: true,
        ..Row::default()
    }
}
