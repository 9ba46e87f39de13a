//! What a command says when it fails, and with which code it exits.

use std::fmt;
use std::process::ExitCode;

use vlm_bake::camera::UnknownCamera;
use vlm_bake::job::JobError;
use vlm_bake::picture::PictureError;
use vlm_bake::render::RenderError;
use vlm_bake::scene;

/// Why a command failed: one message with file, place, cause and remedy.
#[derive(Debug)]
pub enum CliError {
    /// The input or the result failed a check: exit code 1.
    Check(String),
    /// The command could not run: exit code 2.
    Usage(String),
    /// The report on stdout says it all: exit code 1, and nothing on stderr.
    Quiet,
}

impl CliError {
    /// The input, named `file`, or what was made of it failed a check.
    pub fn check(file: &str, error: impl fmt::Display) -> Self {
        Self::Check(format!("{file}: {error}"))
    }

    /// The command could not run.
    pub fn usage(message: impl Into<String>) -> Self {
        Self::Usage(message.into())
    }

    /// The code that tells a script which of the two it was.
    pub fn exit_code(&self) -> ExitCode {
        match self {
            Self::Check(_) | Self::Quiet => ExitCode::from(1),
            Self::Usage(_) => ExitCode::from(2),
        }
    }
}

impl fmt::Display for CliError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Check(message) | Self::Usage(message) => f.write_str(message),
            Self::Quiet => Ok(()),
        }
    }
}

impl From<vlm_format::Error> for CliError {
    fn from(error: vlm_format::Error) -> Self {
        match error {
            vlm_format::Error::Io { .. } => Self::Usage(error.to_string()),
            _ => Self::Check(error.to_string()),
        }
    }
}

impl From<scene::Error> for CliError {
    fn from(error: scene::Error) -> Self {
        match error {
            scene::Error::File(error) => error.into(),
            _ => Self::Check(error.to_string()),
        }
    }
}

impl From<JobError> for CliError {
    fn from(error: JobError) -> Self {
        match error {
            JobError::File(error) => error.into(),
            JobError::Scene(error) => error.into(),
            JobError::Bake { .. } | JobError::Fault { .. } => Self::Check(error.to_string()),
            JobError::Cache(_) | JobError::OverSource { .. } | JobError::Unsteady { .. } => {
                Self::Usage(error.to_string())
            }
        }
    }
}

impl From<RenderError> for CliError {
    fn from(error: RenderError) -> Self {
        match error {
            RenderError::Size { .. } => Self::Usage(error.to_string()),
            RenderError::NoLights | RenderError::UnknownNode { .. } => Self::Check(error.to_string()),
        }
    }
}

impl From<PictureError> for CliError {
    fn from(error: PictureError) -> Self {
        Self::Usage(error.to_string())
    }
}

impl From<UnknownCamera> for CliError {
    fn from(error: UnknownCamera) -> Self {
        Self::Usage(error.to_string())
    }
}
