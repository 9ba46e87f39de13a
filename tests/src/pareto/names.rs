//! File names inside a run's folder.

/// A name that every file system takes: spaces become `_`, separators `-`.
#[must_use]
pub fn file_name(name: &str) -> String {
    let safe = |c: char| match c {
        ' ' => '_',
        c if c.is_alphanumeric() || "._=-".contains(c) => c,
        _ => '-',
    };
    name.chars().map(safe).collect()
}

/// The file of a method's irradiance at a setting of its knobs, in `images/SCENE/CAMERA`.
#[must_use]
pub fn picture_file(method: &str, knob: &str) -> String {
    file_name(format!("{method} {knob}").trim()) + ".exr"
}

/// The contact sheet of a scene and camera.
#[must_use]
pub fn sheet_file(scene: &str, camera: &str) -> String {
    format!("{}_{}_sheet.png", file_name(scene), file_name(camera))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_keep_what_tells_them_apart() {
        assert_eq!(picture_file("thesis", "lights=464 range=4.5"), "thesis_lights=464_range=4.5.exr");
        assert_eq!(picture_file("direct", ""), "direct.exr");
        assert_eq!(file_name("hall/left ../x"), "hall-left_..-x");
    }
}
