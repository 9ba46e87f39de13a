//! The form factor over generated cases of every kind that breaks one, on the CPU and on the GPU, with the same gates.
//!
//! `VLM_STRESS_CASES` sets how many; 1e9 takes an hour.

use vlm_tests::form_factor::command::{on_cpu, on_lanes};
use vlm_tests::form_factor::gpu::GpuFormFactor;
use vlm_tests::form_factor::stress::{Aspect, Reach, Report, run};
use vlm_tests::form_factor::textbook::{EdgeForm, textbook};

fn cases(default: u64) -> u64 {
    std::env::var("VLM_STRESS_CASES").ok().and_then(|count| count.parse().ok()).unwrap_or(default)
}

/// What a report breaks; empty if it passes.
///
/// Every light up to aspect 100 is gated. Receivers closer than a thirtieth of the light's size are gated less what the
/// rounding of their own place explains, those that touch it by range alone.
fn violations(report: &Report) -> Vec<String> {
    let mut found = Vec::new();
    let mut gate = |name: &str, value: f64, limit: f64| {
        if value.is_nan() || value > limit {
            found.push(format!("{name}: {value:.1e} above {limit:.0e}"));
        }
    };
    gate("results out of range", report.out_of_range as f64, 0.0);
    gate("lit by NaN", report.lit_by_nan as f64, 0.0);
    let is_made = |aspect: Aspect| aspect != Aspect::Above100;
    for crosses in [false, true] {
        for aspect in [Aspect::Below10, Aspect::To100] {
            let apart = report.over(|b| b.aspect == aspect && b.reach >= Reach::Near && b.crosses == crosses);
            gate("err/U max", apart.of_uncosined.max.0, 2e-5);
            gate("err/U p99.99", apart.of_uncosined.quantile(0.9999), 4e-6);
            let close =
                report.over(|b| b.aspect == aspect && b.reach == Reach::Close && b.crosses == crosses);
            gate("close, beyond the floor, err/U p99.99", close.beyond_floor.quantile(0.9999), 4e-5);
        }
    }
    let close = report.over(|b| is_made(b.aspect) && b.reach == Reach::Close && !b.crosses);
    gate("close and clear of the horizon, err/U max", close.of_uncosined.max.0, 2e-5);
    let apart = report.over(|b| is_made(b.aspect) && b.reach >= Reach::Near);
    gate("relative p99.99", apart.relative.quantile(0.9999), 2e-5);
    found
}

#[test]
fn cpu_keeps_the_gates() {
    let report = run(cases(10_000_000), on_cpu);
    println!("{}", report.table());
    let found = violations(&report);
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn lanes_keep_the_gates() {
    let report = run(cases(1_000_000), on_lanes);
    let found = violations(&report);
    assert!(found.is_empty(), "{}\n{found:#?}", report.table());
}

#[test]
fn textbook_forms_do_not() {
    for form in [EdgeForm::Acos, EdgeForm::Atan2, EdgeForm::LtcFit] {
        let report = run(200_000, |cases| cases.iter().map(|case| textbook(form, case)).collect());
        assert!(violations(&report).iter().any(|v| v.starts_with("err/U p99.99")), "{form:?}");
    }
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn gpu_keeps_the_gates() {
    let gpu =
        GpuFormFactor::new().expect("a Vulkan adapter: VLM_REQUIRE_GPU is set or a driver is installed");
    let report = run(cases(10_000_000), |cases| gpu.evaluate(cases).expect("results from the GPU"));
    println!("{}\n{}", gpu.name, report.table());
    let found = violations(&report);
    assert!(found.is_empty(), "{found:#?}");
}
