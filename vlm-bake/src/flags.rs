//! Values of flags as users type them, for every program that takes them.

/// Why a value is not one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FlagError {
    /// Not a size.
    #[error("expected WIDTHxHEIGHT, such as 640x480")]
    Size,
    /// Not a number, or one that is not above 0.
    #[error("expected a number above 0")]
    Positive,
    /// Not a preset.
    #[error("expected draft, game or quality")]
    Preset,
}

/// `WIDTHxHEIGHT`, pixels, both above 0.
///
/// # Errors
/// [`FlagError::Size`].
pub fn size(text: &str) -> Result<(u32, u32), FlagError> {
    let numbers = text.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    numbers.filter(|&(w, h)| w > 0 && h > 0).ok_or(FlagError::Size)
}

/// A finite number above 0.
///
/// # Errors
/// [`FlagError::Positive`].
pub fn positive(text: &str) -> Result<f32, FlagError> {
    let number = text.parse::<f32>().ok().filter(|value| value.is_finite() && *value > 0.0);
    number.ok_or(FlagError::Positive)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::Preset;

    #[test]
    fn values_are_read_or_refused() {
        assert_eq!(size("640x480"), Ok((640, 480)));
        for wrong in ["640", "0x480", "640x", "-1x2", "1x2x3", "axb"] {
            assert_eq!(size(wrong), Err(FlagError::Size), "{wrong}");
        }
        assert_eq!(positive("0.5"), Ok(0.5));
        for wrong in ["0", "-1", "nan", "inf", "much"] {
            assert_eq!(positive(wrong), Err(FlagError::Positive), "{wrong}");
        }
        for preset in Preset::ALL {
            assert_eq!(preset.name().parse(), Ok(preset));
        }
        assert_eq!("Game".parse::<Preset>(), Err(FlagError::Preset));
    }
}
