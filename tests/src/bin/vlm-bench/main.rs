//! `vlm-bench`: runs every method there is, for measurements.

mod render;
mod report;
mod pareto;
mod grid;
mod bake;
mod rebuild;
mod breakdown;
mod clearance;
mod shadows;
mod frame;
mod output;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use vlm_tests::form_factor::{command, kernel};

#[derive(Parser)]
#[command(name = "vlm-bench", version, about = "Measures Virtual Light Meshes against other methods")]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Render a picture by any method, and compare it with a reference
    Render(render::RenderArgs),
    /// Write the summary and the figures of a Pareto run anew
    Report(report::ReportArgs),
    /// Run every method over its knobs: time against error
    Pareto(pareto::ParetoArgs),
    /// Build time of the grid against lights and cells, beside the thesis' build
    Grid(grid::GridArgs),
    /// Seconds of each bake stage and peak memory against triangles, beside gltfpack
    Bake(bake::BakeArgs),
    /// From a change to the written file: batches that are baked already, and edits under a watch
    Rebuild(rebuild::RebuildArgs),
    /// One bake, in the process whose memory `bake` measures
    #[command(hide = true)]
    BakeChild(bake::ChildArgs),
    /// What limits the static grid's accuracy, scene by scene
    Breakdown(breakdown::BreakdownArgs),
    /// How well lights hide behind their surface, over files and budgets
    Clearance(clearance::ClearanceArgs),
    /// How long the passes of a frame take, beside the bare form factor
    Frame(frame::FrameArgs),
    /// How far shadow maps lie from rays, by their size
    Shadows(shadows::ShadowsArgs),
    /// Form factors of a file of cases, or the stress test
    FormFactor(command::FormFactorArgs),
    /// Measure the form factor's throughput on one core
    Kernel(kernel::KernelArgs),
}

fn main() -> ExitCode {
    let result = match Cli::parse().command {
        Command::Render(args) => render::run(&args).map(|()| ExitCode::SUCCESS),
        Command::Pareto(args) => pareto::command(&args),
        Command::Report(args) => report::run(&args).map(|()| ExitCode::SUCCESS),
        Command::Grid(args) => grid::run(&args).map(|()| ExitCode::SUCCESS),
        Command::Bake(args) => bake::run(&args).map(|()| ExitCode::SUCCESS),
        Command::Rebuild(args) => rebuild::run(&args).map(|()| ExitCode::SUCCESS),
        Command::BakeChild(args) => bake::run_child(&args).map(|()| ExitCode::SUCCESS),
        Command::Breakdown(args) => breakdown::run(&args).map(|()| ExitCode::SUCCESS),
        Command::Clearance(args) => clearance::run(&args).map(|()| ExitCode::SUCCESS),
        Command::Frame(args) => frame::run(&args).map(|()| ExitCode::SUCCESS),
        Command::Shadows(args) => shadows::run(&args).map(|()| ExitCode::SUCCESS),
        Command::FormFactor(args) => command::run(&args).map(|()| ExitCode::SUCCESS),
        Command::Kernel(args) => kernel::run(&args).map(|()| ExitCode::SUCCESS),
    };
    match result {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}
