//! The indirect light of a baked file by a forward renderer: `forward BAKED.glb OUT.png`. The fragment shader asks for it.

mod common;

use std::error::Error;
use std::path::Path;

use common::{Game, VERTEX};
use vlm_runtime::{Frame, Settings, VlmRenderer};
use wgpu::{TextureFormat, TextureUsages, TextureViewDescriptor};

/// The camera is group 0, so the lights are groups 1 and 2.
const LIGHTS_GROUP: u32 = 1;

/// Shows irradiance times 0.1; a game multiplies it by albedo / pi and adds direct light.
const SURFACE: &str = "
@fragment
fn fragment(corner: Corner) -> @location(0) vec4f {
    let normal = normalize(corner.normal);
    return vec4f(0.1 * indirect(corner.position, normal, normal, 0u).irradiance, 1.0);
}
";

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, baked, out] = &arguments[..] else { return Err("usage: forward BAKED.glb OUT.png".into()) };
    let game = Game::open(Path::new(baked))?;
    let mut renderer = VlmRenderer::new(&game.device, Settings::default())?;
    renderer.load(&game.asset)?;

    let drawn = TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC;
    let picture = game.texture(TextureFormat::Rgba16Float, drawn);
    let depth = game.texture(TextureFormat::Depth32Float, drawn);
    let [color, depth] = [&picture, &depth].map(|t| t.create_view(&TextureViewDescriptor::default()));

    // Shadows of the lights on the samples: a game fills `Frame::visibility` here.
    renderer.prepare(&game.queue, &Frame { lights: &game.lights, ..Frame::default() })?;
    let mut encoder = game.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let stats = renderer.record_light(&mut encoder)?;

    let (layout, camera) = game.camera();
    let [grid, scene] = renderer.forward_layouts()?;
    let source = [renderer.forward_module(LIGHTS_GROUP)?.as_str(), VERTEX, SURFACE].concat();
    let pipeline = game.pipeline(&source, &[Some(&layout), Some(grid), Some(scene)]);
    let [grid, scene] = renderer.forward_groups()?;
    game.draw(&mut encoder, &pipeline, [&color, &depth], &[&camera, grid, scene]);
    game.queue.submit([encoder.finish()]);

    eprintln!("{stats:?}");
    game.save(&picture, Path::new(out))
}
