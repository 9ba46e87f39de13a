//! Why there is no picture, with which code a program ends for it.

use std::path::PathBuf;

use vlm_bake::bake::BakeError;
use vlm_bake::camera::UnknownCamera;
use vlm_bake::follow::FollowError;
use vlm_bake::picture::PictureError;
use vlm_bake::render::RenderError;
use vlm_bake::scene;

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ViewError {
    /// The file cannot be read or is not valid.
    #[error(transparent)]
    Format(#[from] vlm_format::Error),
    /// The file holds no scene.
    #[error(transparent)]
    Scene(#[from] scene::Error),
    /// The file has no lights, and none can be made.
    #[error("{file}: {source}")]
    Bake {
        /// Name of the file.
        file: String,
        /// Why not.
        source: BakeError,
    },
    /// The lights do not fit the scene, or the picture cannot be made.
    #[error("{file}: {source}")]
    Render {
        /// Name of the file.
        file: String,
        /// Why not.
        source: RenderError,
    },
    /// An image that a file refers to cannot be read.
    #[error("{file}: {reason}")]
    Image {
        /// Name of the file.
        file: String,
        /// Which images, and why.
        reason: String,
    },
    /// No such camera.
    #[error(transparent)]
    Camera(#[from] UnknownCamera),
    /// The picture was not written.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// Files cannot be followed.
    #[error(transparent)]
    Follow(#[from] FollowError),
    /// The lights' passes refuse.
    #[error(transparent)]
    Runtime(#[from] crate::Error),
    /// A shader does not compile; the last good one stays.
    #[error("{}: {reason}", file.display())]
    Shader {
        /// The file, or the name that it has inside the program.
        file: PathBuf,
        /// The compiler's words.
        reason: String,
    },
    /// No window.
    #[error(
        "no window: {0}. Without a display, use `--headless`; on Debian, install libxkbcommon-x11-0, libx11-xcb1, libxcursor1 and libxi6"
    )]
    Window(String),
    /// The device found fault with what this program asked of it.
    #[error("the GPU refused: {0}")]
    Device(String),
    /// A thread of this program ended early.
    #[error("{0} ended early; start the viewer again")]
    Ended(&'static str),
    /// Standard output cannot be written.
    #[error("standard output: cannot write: {0}; check the disk or the program that reads it")]
    Output(String),
    /// Flags that do not go together.
    #[error("{0}")]
    Usage(String),
}

impl ViewError {
    /// 1: the input failed a check; 2: it could not run.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Format(vlm_format::Error::Io { .. })
            | Self::Scene(scene::Error::File(vlm_format::Error::Io { .. }))
            | Self::Render { source: RenderError::Size { .. }, .. } => 2,
            Self::Runtime(error) => match error {
                crate::Error::Format(vlm_format::Error::Io { .. })
                | crate::Error::NoAdapter(_)
                | crate::Error::Device(_)
                | crate::Error::Limit { .. } => 2,
                _ => 1,
            },
            Self::Format(_)
            | Self::Scene(_)
            | Self::Image { .. }
            | Self::Bake { .. }
            | Self::Render { .. } => 1,
            _ => 2,
        }
    }
}
