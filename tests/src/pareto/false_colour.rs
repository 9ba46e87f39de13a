//! A signed error as a colour: blue too dark, red too bright, white none.

/// ColorBrewer's `RdBu` (Harrower and Brewer 2003), from blue to red, at even steps; safe for colour-blind readers.
const STOPS: [[u8; 3]; 9] = [
    [5, 48, 97],
    [33, 102, 172],
    [67, 147, 195],
    [146, 197, 222],
    [247, 247, 247],
    [244, 165, 130],
    [214, 96, 77],
    [178, 24, 43],
    [103, 0, 31],
];

/// The colour of an error, sRGB, for a scale that ends at -1 and 1; what lies beyond has the end's colour, and what is no
/// number is yellow.
#[must_use]
pub fn false_colour(error: f64) -> [u8; 3] {
    if error.is_nan() {
        return [255, 255, 0];
    }
    let place = (error.clamp(-1.0, 1.0) + 1.0) * 0.5 * (STOPS.len() - 1) as f64;
    let below = (place as usize).min(STOPS.len() - 2);
    let share = place - below as f64;
    let mix = |i: usize| {
        (f64::from(STOPS[below][i]) * (1.0 - share) + f64::from(STOPS[below + 1][i]) * share).round() as u8
    };
    [mix(0), mix(1), mix(2)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_and_middle_have_their_colours() {
        assert_eq!(
            [-9.0, -1.0, 0.0, 1.0, 9.0].map(false_colour),
            [STOPS[0], STOPS[0], STOPS[4], STOPS[8], STOPS[8]]
        );
        assert_eq!(false_colour(0.125), [246, 206, 189]);
        assert_eq!(false_colour(f64::NAN), [255, 255, 0]);
    }

    #[test]
    fn the_sign_shows() {
        for error in [0.1, 0.5, 0.9] {
            let ([r, _, b], [r_dark, _, b_dark]) = (false_colour(error), false_colour(-error));
            assert!(r > b && r_dark < b_dark);
        }
    }
}
