//! Cases that searches for large errors found, each once far above the gates: light, receiver, and the exact result.

use glam::Vec3;
use vlm_tests::form_factor::case::Case;
use vlm_tests::form_factor::command::{on_cpu, on_lanes};
use vlm_tests::form_factor::gpu::GpuFormFactor;
use vlm_tests::form_factor::reference::truth;

/// What went wrong; corners, receiver, normal; the form factor in 60 digits, rounded.
type Found = (&'static str, [[f32; 3]; 5], f64);

const FOUND: [Found; 7] = [
    (
        "a needle across the horizon, an edge seen under more than 90 degrees, fell to the plain sum",
        [
            [-9.934_191e-5, 4.800_346e-6, 0.000_238_652_57],
            [0.977_863_7, -0.095_567_12, -0.200_257_9],
            [0.800_197_3, -0.072_847_61, -0.152_874_11],
            [-0.005_521_203, -0.030_085_506, -0.035_257_71],
            [-0.053_022_8, 0.765_719_83, -0.640_984_95],
        ],
        1.616_299_9e-6,
    ),
    (
        "the same at a needle's tip",
        [
            [4.406_725_2e-7, 4.387_322e-7, -1.047_503_7e-6],
            [-0.965_951_3, 0.250_705_54, -0.063_607_045],
            [-0.971_750_7, 0.243_236_87, -0.051_993_057],
            [-0.012_964_504, 0.001_938_785_5, 0.044_057_43],
            [-0.247_207_24, -0.968_485_7, -0.030_398_017],
        ],
        6.689_006_3e-6,
    ),
    (
        "the same at aspect 94",
        [
            [0.002_911_222_9, 0.003_318_684_9, 0.002_851_349_5],
            [-0.423_970_04, 0.020_974_599, -0.905_434_5],
            [0.010_702_012, -0.007_205_293, 0.010_926_15],
            [-0.458_745_42, 0.008_434_935_5, -0.883_429],
            [0.255_847_63, -0.956_237_8, -0.141_955_23],
        ],
        1.002_038_07e-5,
    ),
    (
        "an argument just beyond the arctangent's fit fell to the plain sum",
        [
            [0.038_702_92, -0.001_123_815_3, -0.017_232_463],
            [0.141_348_75, 0.836_095_04, 0.498_034_2],
            [0.125_234_19, 0.770_525_63, 0.441_497_06],
            [0.165_214_39, -0.047_117_36, 0.335_335_67],
            [0.882_760_35, 0.105_494_04, -0.457_826_55],
        ],
        6.588_871_7e-5,
    ),
    (
        "the same without a horizon",
        [
            [-0.000_337_740_46, 0.000_813_696_6, 0.000_289_123_53],
            [0.002_587_774, 0.888_429_1, -0.458_337_07],
            [-0.006_871_472_6, -0.001_290_989, 0.016_915_949],
            [0.239_037_41, 0.483_353_64, -0.666_513],
            [-0.851_272_4, -0.232_002_57, -0.470_648_6],
        ],
        7.095_577_8e-6,
    ),
    (
        "parallel surfaces: the fit's slope erred by 7e-6",
        [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 0.021_739_13, 0.0],
            [0.25, 0.4375, 0.0625],
            [0.0, 0.0, -1.0],
        ],
        1.333_183_84e-4,
    ),
    (
        "the same at aspect 57",
        [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.125, 0.017_543_86, 0.0],
            [0.5625, 0.4375, 0.0625],
            [0.0, 0.0, -1.0],
        ],
        1.761_978_25e-4,
    ),
];

fn cases() -> Vec<Case> {
    let case = |&(_, [a, b, c, x, n], _): &Found| Case {
        corners: [a, b, c].map(Vec3::from),
        x: Vec3::from(x),
        n: Vec3::from(n),
    };
    FOUND.iter().map(case).collect()
}

/// A tenth of the gate: the differences serve these cases, not the plain sum.
fn check(results: &[f32]) {
    for ((case, result), (name, _, exact)) in cases().iter().zip(results).zip(&FOUND) {
        let uncosined = truth(case).map_or(0.0, |t| t.uncosined);
        let error = (f64::from(*result) - exact).abs() / uncosined;
        assert!(error < 2e-6, "{name}: {result:e} for {exact:e}, {error:.1e} of U");
    }
}

#[test]
fn cpu() {
    check(&on_cpu(&cases()));
    check(&on_lanes(&cases()));
}

#[test]
#[should_panic = "of U"]
fn a_wrong_result_is_seen() {
    check(&on_cpu(&cases()).iter().map(|f| f * 1.01).collect::<Vec<_>>());
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn gpu() {
    let gpu =
        GpuFormFactor::new().expect("a Vulkan adapter: VLM_REQUIRE_GPU is set or a driver is installed");
    check(&gpu.evaluate(&cases()).expect("results from the GPU"));
}

#[test]
fn reference_agrees() {
    for (case, (name, _, exact)) in cases().iter().zip(&FOUND) {
        let truth = truth(case).expect("a sound case");
        assert!((truth.form_factor - exact).abs() < 1e-7 * exact, "{name}: {truth:?}");
    }
}
