//! `vlm-bench frame`: how long the passes of a frame take.

use std::error::Error;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use vlm_bake::flags::size;
use vlm_bake::options::Preset;
use vlm_bake::shade::TraceScene;
use vlm_tests::baked::Baked;
use vlm_tests::frame_bench::{GpuFrame, Row, measure_cpu, summary};

use crate::output::write_run;

/// Flags of `vlm-bench frame`.
#[derive(Args)]
pub struct FrameArgs {
    /// glTF file (.glb or .gltf), which is baked first
    #[arg(value_name = "FILE")]
    input: PathBuf,
    /// Camera of the file, by name or number from 0 [default: the first]
    #[arg(long, value_name = "NAME|INDEX")]
    camera: Option<String>,
    /// Sizes of the picture in pixels, separated by commas
    #[arg(long, value_name = "WxH", value_delimiter = ',', default_value = "640x360", value_parser = size)]
    sizes: Vec<(u32, u32)>,
    /// Numbers of lights, separated by commas; 0 for the preset's own
    #[arg(long, value_name = "NS", value_delimiter = ',', default_value = "0")]
    lights: Vec<u32>,
    /// Preset of the bake: draft, game or quality
    #[arg(long, value_name = "draft|game|quality", default_value = "draft")]
    preset: Preset,
    /// What runs the passes
    #[arg(long, value_enum, value_delimiter = ',', default_value = "gpu")]
    backend: Vec<Backend>,
    /// Sum every light at every pixel, as without a grid
    #[arg(long)]
    no_grid: bool,
    /// Interleaved repeats, of which the median counts
    #[arg(long, value_name = "N", default_value_t = 7)]
    repeats: usize,
    /// Print the rows as JSON in place of the table
    #[arg(long)]
    json: bool,
    /// Also write raw.csv and table.md into this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Backend {
    /// The runtime on the first Vulkan device
    Gpu,
    /// The mirrors
    Cpu,
}

/// Runs the command.
///
/// # Errors
/// For files that cannot be baked, a device that fails, and files that cannot be written.
pub fn run(args: &FrameArgs) -> Result<(), Box<dyn Error>> {
    let baked: Vec<Baked> = args
        .lights
        .iter()
        .map(|&lights| Baked::with_lights(&args.input, args.preset, lights))
        .collect::<Result<_, _>>()?;
    let rows = measure(args, &baked)?;
    let text = summary(&rows);
    if args.json {
        println!("{}", serde_json::to_string_pretty(&rows)?);
    } else {
        println!("{text}");
    }
    args.out.as_deref().map_or(Ok(()), |out| write_run(out, &rows, &text))
}

/// All sizes and budgets, one after the other in each repeat.
fn measure(args: &FrameArgs, baked: &[Baked]) -> Result<Vec<Row>, Box<dyn Error>> {
    let traces: Vec<TraceScene<'_>> = baked.iter().map(|baked| TraceScene::new(&baked.scene)).collect();
    let mut frames = Vec::new();
    for (baked, trace) in baked.iter().zip(&traces) {
        let camera = baked.scene.camera(args.camera.as_deref())?;
        for &size in &args.sizes {
            let gpu = args.backend.contains(&Backend::Gpu);
            let gpu = gpu.then(|| GpuFrame::new(baked, trace, &camera, (size, args.no_grid))).transpose()?;
            frames.push((baked, trace, camera.clone(), size, gpu));
        }
    }
    let mut rows = Vec::new();
    // The first round compiles and warms up.
    for repeat in 0..=args.repeats {
        for (baked, trace, camera, size, gpu) in &mut frames {
            let mut found = gpu.as_mut().map_or_else(|| Ok(Vec::new()), |gpu| gpu.measure(repeat))?;
            if args.backend.contains(&Backend::Cpu) {
                found.extend(measure_cpu(baked, trace, camera, *size, repeat)?);
            }
            if repeat > 0 {
                rows.extend(found);
            }
        }
    }
    Ok(rows)
}
