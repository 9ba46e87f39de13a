//! `vlm-bench kernel`: form factors per second by every form and backend, and their share of the processor's limit.

use std::error::Error;
use std::hint::black_box;
use std::time::Instant;

use clap::Args;
use glam::Vec3;
use vlm_bake::bake::bake;
use vlm_bake::gbuffer::GBuffer;
use vlm_bake::options::{BakeOptions, Preset};
use vlm_bake::progress::Silent;
use vlm_bake::scene::{LoadOptions, load};
use vlm_bake::shade::TraceScene;
use vlm_format::GltfFile;
use vlm_shaders::cpu::form_factor::{
    ErrorBound, LightGeometry, Receivers, far_operations, form_factor, form_factor_within, form_factors,
};
use vlm_shaders::cpu::upload::LightSet;

use super::gpu::GpuFormFactor;
use super::peak::peak_gflops;
use super::textbook::{EdgeForm, textbook_form_factor};
use crate::cornell;

/// Throughput of the form factor on one core.
#[derive(Args, Clone, Debug)]
pub struct KernelArgs {
    /// Interleaved repeats, of which the median counts.
    #[arg(long, default_value_t = 15)]
    pub repeats: usize,
}

/// A measured form: name, whether its share of the limit is known, and one round over all pairs, whose sum it returns.
type Form<'a> = (&'static str, bool, Box<dyn FnMut() -> f32 + 'a>);

/// Prints a table per workload: millions of pairs per second of each form in the same, interleaved run.
///
/// # Errors
/// If the Cornell box cannot be baked.
pub fn run(args: &KernelArgs) -> Result<(), Box<dyn Error>> {
    let peak = peak_gflops();
    let operations = far_operations();
    println!(
        "{operations} operations a pair by the far form; this core's measured limit: {peak:.0} G operations/s\n"
    );
    for workload in [Workload::anywhere(), Workload::room()?, Workload::lit()] {
        println!("{}\n", workload.describe());
        println!("| form | M pairs/s, one core | quartiles | over scalar acos | share of the limit |");
        println!("|---|---|---|---|---|");
        workload.measure(args.repeats.max(1), f64::from(operations), peak);
        println!();
        workload.measure_gpu(args.repeats.clamp(1, 5), f64::from(operations), peak);
    }
    Ok(())
}

/// Every light with every receiver.
struct Workload {
    name: &'static str,
    lights: Vec<LightGeometry>,
    points: Vec<(Vec3, Vec3)>,
    receivers: Receivers,
}

impl Workload {
    fn new(name: &'static str, lights: Vec<LightGeometry>, points: Vec<(Vec3, Vec3)>) -> Self {
        let receivers = Receivers::new(points.iter().copied());
        Self { name, lights, points, receivers }
    }

    /// The baked lights of the Cornell box, and what its camera sees.
    fn room() -> Result<Self, Box<dyn Error>> {
        let file = GltfFile::from_slice(&cornell::cornell(), "cornell.glb", None)?;
        let scene = load(&file, &LoadOptions::default())?;
        let asset = bake(&scene, &BakeOptions::preset(Preset::Game, scene.triangles.len()), &Silent)?.asset;
        let world = |node: u32| scene.objects.iter().find(|o| o.node == node).map(|o| o.world_from_node);
        let lights = LightSet::new(&asset, |node| world(node).unwrap_or_default()).geometry;
        let trace = TraceScene::new(&scene);
        let gbuffer = GBuffer::trace(&trace, &scene.camera(None)?, 64, 64);
        let points = gbuffer.points.iter().flatten().map(|p| (p.position, p.normal)).collect();
        Ok(Self::new("the Cornell box's lights and pixels", lights, points))
    }

    /// Lights and receivers anywhere in a box, facing anywhere.
    fn anywhere() -> Self {
        let mut state = 1u64;
        let mut unit = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / (1u32 << 24) as f32
        };
        let mut point = || Vec3::new(unit(), unit(), unit());
        let points = (0..4096).map(|_| (point() * 10.0, (point() - 0.5).normalize_or_zero())).collect();
        let mut light = || {
            let (centre, size) = (point() * 10.0, 0.1 * 20f32.powf(point().x));
            let corners = [point(), point(), point()].map(|corner| centre + (corner - 0.5) * size);
            LightGeometry::new(corners.map(|v| v.as_dvec3()))
        };
        Self::new("lights and points anywhere in a box", (0..64).map(|_| light()).collect(), points)
    }

    /// Lights and receivers that all face each other across a distance.
    fn lit() -> Self {
        let Self { mut lights, points, .. } = Self::anywhere();
        let up = points
            .iter()
            .map(|&(x, n)| (x - Vec3::Z * 30.0, Vec3::new(0.3 * n.x, 0.3 * n.y, 1.0).normalize_or_zero()));
        let points = up.collect();
        for light in &mut lights {
            if light.normal.z > 0.0 {
                *light = LightGeometry::new([light.v0, light.v2, light.v1].map(|v| v.as_dvec3()));
            }
        }
        Self::new("lights and points that face each other across a room", lights, points)
    }

    fn pairs(&self) -> impl Iterator<Item = (&LightGeometry, Vec3, Vec3)> + '_ {
        self.lights.iter().flat_map(|light| self.points.iter().map(move |&(x, n)| (light, x, n)))
    }

    fn count(&self) -> f64 {
        (self.lights.len() * self.points.len()) as f64
    }

    fn describe(&self) -> String {
        let lit = self.pairs().filter(|&(light, x, n)| form_factor(light, x, n) > 0.0).count() as f64;
        let Self { name, lights, points, .. } = self;
        let share = 100.0 * lit / self.count();
        format!(
            "**{name}**: {} lights, {} receivers, {share:.0} % of the pairs lit",
            lights.len(),
            points.len()
        )
    }

    fn forms<'a>(&'a self, results: &'a mut Vec<f32>) -> Vec<Form<'a>> {
        results.resize(self.points.len(), 0.0);
        let by = |name, f: fn(&LightGeometry, Vec3, Vec3) -> f32| -> Form<'a> {
            (name, false, Box::new(move || self.pairs().map(|(light, x, n)| f(light, x, n)).sum()))
        };
        let bound = ErrorBound::new(1e-3);
        let lanes = move || {
            let mut sum = 0.0;
            for light in &self.lights {
                form_factors(light, &self.receivers, results);
                sum += results[0];
            }
            sum
        };
        vec![
            ("exact, lanes", true, Box::new(lanes)),
            by("exact, scalar", form_factor),
            (
                "within 1e-3, scalar",
                false,
                Box::new(move || {
                    self.pairs().map(|(light, x, n)| form_factor_within(light, x, n, &bound)).sum()
                }),
            ),
            by("LTC fit, scalar", |light, x, n| {
                textbook_form_factor(EdgeForm::LtcFit, light.corners(), light.normal, x, n)
            }),
            by("atan2, scalar", |light, x, n| {
                textbook_form_factor(EdgeForm::Atan2, light.corners(), light.normal, x, n)
            }),
            by("acos, scalar", |light, x, n| {
                textbook_form_factor(EdgeForm::Acos, light.corners(), light.normal, x, n)
            }),
        ]
    }

    fn measure(&self, repeats: usize, operations: f64, peak: f64) {
        let mut results = Vec::new();
        let mut forms = self.forms(&mut results);
        let mut rates = vec![Vec::with_capacity(repeats); forms.len()];
        for _ in 0..repeats {
            for ((_, _, form), rates) in forms.iter_mut().zip(&mut rates) {
                let start = Instant::now();
                black_box(form());
                rates.push(self.count() / start.elapsed().as_secs_f64() / 1e6);
            }
        }
        for rates in &mut rates {
            rates.sort_by(f64::total_cmp);
        }
        let at = |rates: &[f64], share: f64| rates[((rates.len() - 1) as f64 * share).round() as usize];
        let textbook = rates.last().map_or(1.0, |rates| at(rates, 0.5));
        for ((name, is_counted, _), rates) in forms.iter().zip(&rates) {
            let [low, middle, high] = [0.25, 0.5, 0.75].map(|share| at(rates, share));
            let share = if *is_counted {
                format!("{:.0} %", 100.0 * middle * operations / 1e3 / peak)
            } else {
                String::new()
            };
            println!("| {name} | {middle:.1} | {low:.1} to {high:.1} | {:.1} | {share} |", middle / textbook);
        }
    }

    /// Sums over all lights at each receiver, as a gather does it.
    fn measure_gpu(&self, repeats: usize, operations: f64, peak: f64) {
        let Ok(gpu) = GpuFormFactor::sums() else {
            println!("no GPU\n");
            return;
        };
        let one = |_| gpu.measure_sums(&self.lights, &self.points).map(|(_, rate)| rate);
        let mut rates: Vec<f64> = (0..repeats).filter_map(|i| one(i).ok()).collect();
        rates.sort_by(f64::total_cmp);
        if let Some(rate) = rates.get(rates.len() / 2) {
            println!("{}: {:.1} M pairs/s", gpu.name, rate / 1e6);
            if gpu.is_software {
                let cores = std::thread::available_parallelism().map_or(1, usize::from) as f64;
                let share = 100.0 * rate * operations / 1e9 / (peak * cores);
                println!("({share:.0} % of the limit of {cores} cores)");
            }
            println!();
        }
    }
}
