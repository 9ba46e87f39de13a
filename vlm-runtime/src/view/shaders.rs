//! shaders: the viewer's own WGSL: inside the program, and in debug builds from its files, so that an edit shows at once.

use std::fs;
use std::path::PathBuf;

use vlm_shaders::wgsl;
use wgpu::ShaderModule;

use super::error::ViewError;
use super::gpu::Gpu;

/// Each file with its text when the program was built.
pub(super) const FILES: [(&str, &str); 5] = [
    ("surface.wgsl", include_str!("wgsl/surface.wgsl")),
    ("pixel_light.wgsl", include_str!("wgsl/pixel_light.wgsl")),
    ("resolve.wgsl", include_str!("wgsl/resolve.wgsl")),
    ("overlay_lights.wgsl", include_str!("wgsl/overlay_lights.wgsl")),
    ("overlay_surface.wgsl", include_str!("wgsl/overlay_surface.wgsl")),
];

/// Where shaders come from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Sources {
    /// A folder whose files win over those inside the program.
    pub folder: Option<PathBuf>,
}

impl Sources {
    /// In debug builds the folder of the source tree, if it is there; else the program's own.
    #[must_use]
    pub fn for_this_build() -> Self {
        let folder = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/src/view/wgsl"));
        Self { folder: Some(folder).filter(|folder| cfg!(debug_assertions) && folder.is_dir()) }
    }

    /// The files to be followed.
    #[must_use]
    pub fn files(&self) -> Vec<PathBuf> {
        let of = |folder: &PathBuf| FILES.iter().map(|(name, _)| folder.join(name)).collect();
        self.folder.as_ref().map_or_else(Vec::new, of)
    }

    /// Compiles one of the files, with the shared modules before it.
    pub(crate) fn module(
        &self,
        gpu: &Gpu,
        name: &'static str,
        shared: &[&str],
    ) -> Result<ShaderModule, ViewError> {
        let file = self.folder.as_ref().map(|folder| folder.join(name)).filter(|file| file.is_file());
        let own = match &file {
            None => FILES.iter().find(|(file, _)| *file == name).map_or("", |(_, text)| text).to_owned(),
            Some(file) => fs::read_to_string(file).map_err(|error| ViewError::Shader {
                file: file.clone(),
                reason: format!("cannot be read: {error}"),
            })?,
        };
        // The file's own text comes first, so that the compiler's line numbers are the file's.
        let mut parts = vec![own.as_str()];
        parts.extend(shared);
        let source = wgpu::ShaderSource::Wgsl(parts.join("\n").into());
        guarded(gpu, file.unwrap_or_else(|| PathBuf::from(name)), || {
            gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some(name), source })
        })
    }
}

/// What `make` makes, if the device finds no fault with it.
pub(crate) fn guarded<T>(
    gpu: &Gpu,
    file: impl Into<PathBuf>,
    make: impl FnOnce() -> T,
) -> Result<T, ViewError> {
    let scope = gpu.device.push_error_scope(wgpu::ErrorFilter::Validation);
    let made = make();
    match pollster::block_on(scope.pop()) {
        None => Ok(made),
        Some(error) => Err(ViewError::Shader { file: file.into(), reason: reason(&error) }),
    }
}

/// The compiler's words, without what stands around them.
fn reason(error: &wgpu::Error) -> String {
    let text = error.to_string();
    let lines: Vec<&str> = text.lines().map(str::trim_end).filter(|line| !line.is_empty()).collect();
    lines.join("\n")
}

/// What pixel_light.wgsl needs.
pub(crate) const PIXEL_LIGHT_SHARED: [&str; 2] = [wgsl::VIEW, wgsl::PUNCTUAL];

/// What overlay_surface.wgsl needs.
pub(crate) const OVERLAY_SHARED: [&str; 2] = [wgsl::GRID, wgsl::VIEW];
