//! `vlm-bench form-factor`.

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use vlm_shaders::cpu::form_factor::{Receivers, form_factor, form_factors};

use super::case::Case;
use super::error_plot::plot;
use super::gpu::GpuFormFactor;
use super::stress;

/// Which mirror runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Backend {
    /// Rust.
    #[default]
    Cpu,
    /// WGSL on the first Vulkan adapter.
    Gpu,
}

/// Form factors of a file of cases, or the stress test.
#[derive(Args, Clone, Debug, Default)]
pub struct FormFactorArgs {
    /// Little-endian f32 rows `v0 v1 v2 x n`, 15 per row; corners counter-clockwise seen from the emitting side.
    #[arg(long, requires = "out", conflicts_with = "stress")]
    pub cases: Option<PathBuf>,
    /// One little-endian f32 per row.
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Where the form factor is evaluated.
    #[arg(long, value_enum, default_value_t)]
    pub backend: Backend,
    /// Runs this many generated cases, 1e7 unless told, and prints the errors by bin.
    #[arg(long, num_args = 0..=1, default_missing_value = "10000000", required_unless_present = "cases")]
    pub stress: Option<u64>,
    /// Also draws error against distance for this and the textbook forms, on CPU and GPU, as FILE.svg and FILE.png.
    #[arg(long, value_name = "FILE", requires = "stress")]
    pub plot: Option<PathBuf>,
}

/// Runs `vlm-bench form-factor`.
///
/// # Errors
/// For files that cannot be read or written, broken rows and a missing GPU.
pub fn run(args: &FormFactorArgs) -> Result<(), Box<dyn Error>> {
    match (&args.cases, &args.out) {
        (Some(cases), Some(out)) => evaluate_file(cases, out, args.backend),
        _ => {
            let count = args.stress.unwrap_or(10_000_000);
            run_stress(count, args.backend)?;
            args.plot.as_deref().map_or(Ok(()), |path| plot(count, path))
        }
    }
}

fn evaluate_file(cases: &Path, out: &Path, backend: Backend) -> Result<(), Box<dyn Error>> {
    let bytes = std::fs::read(cases).map_err(|error| format!("cannot read {}: {error}", cases.display()))?;
    let row = size_of::<Case>();
    if bytes.len() % row != 0 {
        let message = "its length is not a multiple of 60 bytes: a row is 15 little-endian f32";
        return Err(format!("{}: {} bytes; {message}", cases.display(), bytes.len()).into());
    }
    let rows: Vec<Case> = bytes.chunks_exact(row).map(bytemuck::pod_read_unaligned).collect();
    let results = match backend {
        Backend::Cpu => on_cpu(&rows),
        Backend::Gpu => {
            let gpu = GpuFormFactor::new()?;
            let mut all = Vec::with_capacity(rows.len());
            for batch in rows.chunks(stress::BATCH as usize) {
                all.extend(gpu.evaluate(batch)?);
            }
            all
        }
    };
    let bytes: Vec<u8> = results.iter().flat_map(|f| f.to_le_bytes()).collect();
    std::fs::write(out, bytes).map_err(|error| format!("cannot write {}: {error}", out.display()))?;
    Ok(())
}

/// The kernel, one case at a time.
#[must_use]
pub fn on_cpu(cases: &[Case]) -> Vec<f32> {
    cases.iter().map(|case| form_factor(&case.light(), case.x, case.n)).collect()
}

/// The kernel's lanes; each case has a light of its own, so most of them idle.
#[must_use]
pub fn on_lanes(cases: &[Case]) -> Vec<f32> {
    let mut result = [0.0];
    let one = |case: &Case| {
        form_factors(&case.light(), &Receivers::new([(case.x, case.n)]), &mut result);
        result[0]
    };
    cases.iter().map(one).collect()
}

fn run_stress(count: u64, backend: Backend) -> Result<(), Box<dyn Error>> {
    let report = match backend {
        Backend::Cpu => stress::run(count, on_cpu),
        Backend::Gpu => {
            let gpu = GpuFormFactor::new()?;
            // A lost device shows as NaN, which no bin forgives.
            stress::run(count, |cases| gpu.evaluate(cases).unwrap_or_else(|_| vec![f32::NAN; cases.len()]))
        }
    };
    println!("{}", report.table());
    println!("out of range: {}; lit by NaN: {}", report.out_of_range, report.lit_by_nan);
    match report.first_out_of_range {
        Some(case) => Err(format!("results out of range, the first in case {case}").into()),
        None => Ok(()),
    }
}
