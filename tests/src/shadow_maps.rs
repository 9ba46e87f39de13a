//! How far the light by shadow maps lies from that by rays.

use glam::Vec4;

/// How far radiosity by one visibility lies from that by another, weighted by the lights' area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadiosityError {
    /// Relative RMSE: `sqrt(sum A (B - b)^2 / sum A b^2)`.
    pub relative_rmse: f64,
    /// Signed, of the flux: `sum A B / sum A b - 1`.
    pub energy: f64,
}

/// The error of the lights' `found` radiosity against the `expected`, by their `areas`; `None` where all is black.
#[must_use]
pub fn radiosity_error(areas: &[f64], found: &[Vec4], expected: &[Vec4]) -> Option<RadiosityError> {
    let [mut squares, mut squared_errors, mut flux, mut found_flux] = [0.0; 4];
    for ((area, found), expected) in areas.iter().zip(found).zip(expected) {
        let [found, expected] = [found, expected].map(|v| v.truncate().as_dvec3());
        squares += area * expected.length_squared();
        squared_errors += area * (found - expected).length_squared();
        flux += area * expected.element_sum();
        found_flux += area * found.element_sum();
    }
    let error =
        RadiosityError { relative_rmse: (squared_errors / squares).sqrt(), energy: found_flux / flux - 1.0 };
    (squares > 0.0).then_some(error)
}
