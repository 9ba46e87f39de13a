//! The viewer behind `vlm-view`: shows the light of a glTF file and follows the file as it changes.
//!
//! Data flows `arguments -> open -> scene_buffers, materials -> surface -> shadows, pixel_light -> indirect -> resolve -> overlay`;
//! [`Viewer`] puts the stages together. A window needs no more than `headless` does, so all but the window itself runs, and is tested,
//! without a display.

mod arguments;
mod error;
mod open;
mod gpu;
mod bindings;
mod shaders;
mod targets;
mod materials;
mod scene_buffers;
mod eye;
mod surface;
mod shadow_maps;
mod shadows;
mod pixel_light;
mod indirect;
mod resolve;
mod overlay;
mod readback;
mod times;
mod controls;
mod shown;
mod viewer;
mod watch;
mod session;
mod headless;

#[cfg(test)]
mod shader_tests;

pub use arguments::{Arguments, MethodArg, OverlayArg, ShadowsArg};
pub use controls::{BounceControl, Controls, LightControl, Overlays};
pub use error::ViewError;
pub use eye::{Eye, Flight};
pub use gpu::Gpu;
pub use headless::{Headless, ViewReport, headless, write_picture};
pub use open::{LightGroup, OpenOptions, Opened};
pub use resolve::Screen;
pub use session::{Look, Session};
pub use shaders::Sources;
pub use shadow_maps::{DrawnMap, Frustum, MapRenderer, frusta};
pub use shadows::{Rays, Shadows, visibility};
pub use times::PassTimes;
pub use viewer::{FrameReport, PICTURE_FORMAT, Viewer, ViewerOptions};
pub use watch::{News, Wake, WatchOptions, Watcher};
