//! `vlm-bench form-factor` and `vlm-bench kernel`.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{Args, ValueEnum};
use glam::Vec3;
use vlm_shaders::cpu::form_factor::{LightGeometry, Receivers, form_factor, form_factors};

use super::case::Case;
use super::gpu::GpuFormFactor;
use super::stress;
use super::textbook::{EdgeForm, textbook};

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
}

/// Throughput of the form factor on one core.
#[derive(Args, Clone, Debug)]
pub struct KernelArgs {
    /// Interleaved repeats, of which the median counts.
    #[arg(long, default_value_t = 15)]
    pub repeats: usize,
}

/// Runs `vlm-bench form-factor`.
///
/// # Errors
/// For files that cannot be read or written, broken rows and a missing GPU.
pub fn run(args: &FormFactorArgs) -> Result<(), Box<dyn Error>> {
    match (&args.cases, &args.out) {
        (Some(cases), Some(out)) => evaluate_file(cases, out, args.backend),
        _ => run_stress(args.stress.unwrap_or(10_000_000), args.backend),
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

/// Runs `vlm-bench kernel`: millions of pairs per second of each form in the same, interleaved run.
pub fn run_kernel(args: &KernelArgs) {
    let scene = Scene::new();
    let mut out = vec![0.0; scene.points.len()];
    let mut sink = 0.0f32;
    let mut seconds: [Vec<f64>; 3] = Default::default();
    for _ in 0..args.repeats.max(1) {
        let start = Instant::now();
        for light in &scene.lights {
            form_factors(light, &scene.receivers, &mut out);
            sink += out[0];
        }
        seconds[0].push(start.elapsed().as_secs_f64());
        let start = Instant::now();
        sink += scene.pairs().map(|(i, x, n)| form_factor(&scene.lights[i], x, n)).sum::<f32>();
        seconds[1].push(start.elapsed().as_secs_f64());
        let start = Instant::now();
        sink += scene
            .pairs()
            .map(|(i, x, n)| textbook(EdgeForm::Acos, &Case { corners: scene.triangles[i], x, n }))
            .sum::<f32>();
        seconds[2].push(start.elapsed().as_secs_f64());
    }
    let pairs = (scene.lights.len() * scene.points.len()) as f64;
    let rates = seconds.map(|mut s| {
        s.sort_by(f64::total_cmp);
        pairs / s[s.len() / 2] / 1e6
    });
    println!("| form | M pairs/s, one core | over the textbook's |\n|---|---|---|");
    for (name, rate) in ["lanes", "scalar", "textbook acos, scalar"].iter().zip(rates) {
        println!("| {name} | {rate:.1} | {:.1} |", rate / rates[2]);
    }
    std::hint::black_box(sink);
}

/// Lights and receivers all over a box: a quarter of the pairs lit, of those one in six close or across the horizon.
struct Scene {
    triangles: Vec<[Vec3; 3]>,
    lights: Vec<LightGeometry>,
    points: Vec<(Vec3, Vec3)>,
    receivers: Receivers,
}

impl Scene {
    fn new() -> Self {
        let mut state = 1u64;
        let mut unit = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / (1u32 << 24) as f32
        };
        let mut point = || Vec3::new(unit(), unit(), unit());
        let points: Vec<_> =
            (0..4096).map(|_| (point() * 10.0, (point() - 0.5).normalize_or_zero())).collect();
        let triangles: Vec<_> = (0..64)
            .map(|_| {
                let (centre, size) = (point() * 10.0, 0.1 * 20f32.powf(point().x));
                [point(), point(), point()].map(|corner| centre + (corner - 0.5) * size)
            })
            .collect();
        let lights = triangles.iter().map(|t| LightGeometry::new(t.map(|v| v.as_dvec3()))).collect();
        let receivers = Receivers::new(points.iter().copied());
        Self { triangles, lights, points, receivers }
    }

    /// Every light with every receiver.
    fn pairs(&self) -> impl Iterator<Item = (usize, Vec3, Vec3)> + '_ {
        (0..self.lights.len()).flat_map(|i| self.points.iter().map(move |&(x, n)| (i, x, n)))
    }
}
