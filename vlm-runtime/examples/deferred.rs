//! The indirect light of a baked file by a deferred renderer: `deferred BAKED.glb OUT.png`. The G-buffer is depth and normals.

mod common;

use std::error::Error;
use std::path::Path;

use common::{Game, VERTEX};
use vlm_runtime::{Frame, Settings, Targets, View, VlmRenderer};
use wgpu::{TextureFormat, TextureUsages, TextureViewDescriptor};

/// The G-buffer's normals.
const NORMALS: &str = "
@fragment
fn fragment(corner: Corner) -> @location(0) vec4f {
    return vec4f(normalize(corner.normal), 0.0);
}
";

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, baked, out] = &arguments[..] else { return Err("usage: deferred BAKED.glb OUT.png".into()) };
    let game = Game::open(Path::new(baked))?;
    let mut renderer = VlmRenderer::new(&game.device, Settings::default())?;
    renderer.load(&game.asset)?;

    let drawn = TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING;
    let written = TextureUsages::STORAGE_BINDING | TextureUsages::COPY_SRC;
    let irradiance = game.texture(TextureFormat::Rgba16Float, written);
    let [normal, depth, result] = [
        &game.texture(TextureFormat::Rgba16Float, drawn),
        &game.texture(TextureFormat::Depth32Float, drawn),
        &irradiance,
    ]
    .map(|texture| texture.create_view(&TextureViewDescriptor::default()));

    // Shadows of the lights on the samples: a game fills `Frame::visibility` here.
    let view = View { world_from_clip: game.clip_from_world.inverse(), exposure: 0.1, ..View::default() };
    renderer.prepare(&game.queue, &Frame { lights: &game.lights, view, ..Frame::default() })?;

    let (layout, camera) = game.camera();
    let pipeline = game.pipeline(&[VERTEX, NORMALS].concat(), &[Some(&layout)]);
    let mut encoder = game.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    game.draw(&mut encoder, &pipeline, [&normal, &depth], &[&camera]);
    let targets = Targets {
        depth: &depth,
        normal: &normal,
        geometric_normal: None,
        tag: None,
        moving: None,
        irradiance: &result,
    };
    let stats = renderer.record(&mut encoder, &targets)?;
    game.queue.submit([encoder.finish()]);

    eprintln!("{stats:?}");
    game.save(&irradiance, Path::new(out))
}
