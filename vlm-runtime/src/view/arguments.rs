//! arguments: the command line, as typed.

use std::path::PathBuf;

use clap::{Parser, ValueEnum};
use vlm_bake::flags::{positive, size};
use vlm_bake::options::Preset;
use vlm_bake::render::Method;

/// Shows the light of a glTF file on the GPU, and follows the file as it changes
#[derive(Clone, Debug, Parser)]
#[command(name = "vlm-view", version)]
pub struct Arguments {
    /// glTF file (.glb or .gltf); without a Virtual Light Mesh it is baked first. With --headless, - is standard input
    pub file: PathBuf,
    /// Make one picture without a window
    #[arg(long)]
    pub headless: bool,
    /// Camera of the file, by name or number from 0 [default: the first; one chosen to show the scene if there is none]
    #[arg(long, value_name = "NAME|INDEX")]
    pub camera: Option<String>,
    /// Size of the picture in pixels [default: 640x480, in a window 1024x768]
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<(u32, u32)>,
    /// Where the indirect light comes from
    #[arg(long, value_enum, default_value = "vlm")]
    pub method: MethodArg,
    /// How the shadows of real lights are found
    #[arg(long, value_enum, default_value = "rays")]
    pub shadows: ShadowsArg,
    /// What a bake costs and gives, for files without a Virtual Light Mesh
    #[arg(long, value_name = "draft|game|quality", default_value = "game")]
    pub preset: Preset,
    /// Cut the holes of alpha masks; without this they count as solid
    #[arg(long)]
    pub alpha_masks: bool,
    /// Write the picture, tone mapped
    #[arg(long, value_name = "IMG.png", requires = "headless")]
    pub out: Option<PathBuf>,
    /// What the picture multiplies radiance (nt) by [default: chosen so that the mean brightness shows as middle grey]
    #[arg(long, value_name = "FACTOR", value_parser = positive)]
    pub exposure: Option<f32>,
    /// Write the indirect irradiance in lx, RGB float32, 0 where nothing is hit
    #[arg(long, value_name = "E1.exr", requires = "headless")]
    pub irradiance: Option<PathBuf>,
    /// Draw this over the picture
    #[arg(long, value_enum, value_delimiter = ',')]
    pub overlay: Vec<OverlayArg>,
    /// Report as JSON
    #[arg(long, requires = "headless")]
    pub json: bool,
    /// Load the file that many times more before the picture is made, to see that nothing piles up
    #[arg(long, value_name = "N", default_value_t = 0, hide = true, requires = "headless")]
    pub reloads: u32,
}

/// Methods by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MethodArg {
    /// The virtual lights through the static grid
    Vlm,
    /// Every virtual light at every pixel
    Brute,
    /// No indirect light
    Direct,
}

impl From<MethodArg> for Method {
    fn from(method: MethodArg) -> Self {
        match method {
            MethodArg::Vlm => Self::Vlm,
            MethodArg::Brute => Self::Brute,
            MethodArg::Direct => Self::Direct,
        }
    }
}

/// Shadows by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ShadowsArg {
    /// Rays on the processor, as `vlm render` has them
    Rays,
    /// Shadow maps on the device, 2,048 texels wide
    Maps,
}

/// Overlays by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum OverlayArg {
    /// Edges of the virtual lights, coloured by how far they lie behind their surface
    Wireframe,
    /// Surface and lights with a tag, a colour per tag
    Tags,
    /// Cells of the grid, coloured by how many near lights their probes have
    Cells,
    /// The virtual lights, with the radiosity that was injected
    Radiosity,
}
