//! What a player sees: sums of many form factors while something moves by a millionth of the scene at a time.

use glam::{DVec3, Vec3};
use vlm_shaders::cpu::form_factor::{
    ErrorBound, LightGeometry, Receivers, centroid_form_factor, form_factor, form_factor_within, form_factors,
};
use vlm_shaders::cpu::gather::{Receiver, gather_together};
use vlm_shaders::cpu::upload::LightSet;
use vlm_tests::form_factor::case::Case;
use vlm_tests::form_factor::gpu::GpuFormFactor;
use vlm_tests::form_factor::reference::truth;

/// The sphere of radius 5, `4 * 4^levels * 2` lights that face its centre.
fn sphere(levels: u32) -> Vec<[Vec3; 3]> {
    let tips = [Vec3::X, Vec3::Y, Vec3::NEG_X, Vec3::NEG_Y];
    let mut triangles: Vec<[Vec3; 3]> = (0..4)
        .flat_map(|i| {
            let (p, q) = (tips[i], tips[(i + 1) % 4]);
            [[q, p, Vec3::Z], [p, q, Vec3::NEG_Z]]
        })
        .collect();
    for _ in 0..levels {
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                let [ab, bc, ca] = [a + b, b + c, c + a].map(Vec3::normalize_or_zero);
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    triangles.iter().map(|t| t.map(|v| v * 5.0)).collect()
}

fn lights(triangles: &[[Vec3; 3]]) -> Vec<LightGeometry> {
    triangles.iter().map(|t| LightGeometry::new(t.map(|v| v.as_dvec3()))).collect()
}

fn exact_sum(triangles: &[[Vec3; 3]], x: Vec3, n: Vec3) -> f64 {
    let each = triangles.iter().map(|&corners| truth(&Case { corners, x, n }).map_or(0.0, |t| t.form_factor));
    each.sum()
}

#[test]
fn thousands_of_lights_sum_to_one_inside_a_closed_sphere() {
    let triangles = sphere(5);
    assert_eq!(triangles.len(), 8192);
    let lights = lights(&triangles);
    for (x, n) in [(Vec3::ZERO, Vec3::Z), (Vec3::new(1.0, -2.0, 3.0), Vec3::new(0.6, 0.0, -0.8))] {
        let sum: f32 = lights.iter().map(|light| form_factor(light, x, n)).sum();
        let exact = exact_sum(&triangles, x, n);
        assert!((exact - 1.0).abs() < 1e-6, "{exact}");
        assert!((f64::from(sum) - exact).abs() < 2e-5, "{sum} {exact}");
    }
}

#[test]
fn a_step_of_a_millionth_does_not_make_the_sum_jump() {
    let triangles = sphere(3);
    let lights = lights(&triangles);
    let n = Vec3::new(0.48, -0.6, 0.64);
    for (name, eps) in [("exact", 0.0), ("within 1e-3", 1e-3)] {
        let bound = ErrorBound::new(eps);
        for start in [Vec3::new(0.3, 0.1, -0.2), Vec3::new(3.6, 1.2, 2.4), Vec3::new(-4.2, 1.3, 0.4)] {
            let mut largest = (0.0f64, 0.0f64);
            let mut before: Option<(f64, f64)> = None;
            for step in 0..300 {
                let x = (start.as_dvec3() + DVec3::new(1.0, 0.7, -0.4) * 1e-5 * f64::from(step)).as_vec3();
                let sum: f32 = lights.iter().map(|light| form_factor_within(light, x, n, &bound)).sum();
                let now = (f64::from(sum), exact_sum(&triangles, x, n));
                if let Some(last) = before {
                    largest.0 = largest.0.max((now.0 - last.0).abs());
                    largest.1 = largest.1.max((now.1 - last.1).abs());
                }
                before = Some(now);
            }
            assert!(largest.0 < largest.1 + 1e-5, "{name} from {start}: {largest:?}");
        }
    }
}

/// One light on its way past a receiver: from touching distance to afar, rising through the horizon and turning.
fn light_on_its_way(way: f64) -> [Vec3; 3] {
    let distance = 0.05 * 4000f64.powf(way);
    let (turn, height) = (6.0 * way, distance * (4.0 * way).sin());
    let centre = DVec3::new(distance * turn.cos(), distance * turn.sin(), height);
    let facing = -centre.normalize_or_zero();
    let side = facing.any_orthonormal_vector();
    let up = facing.cross(side);
    [(-0.5, -0.3), (0.5, -0.3), (0.1, 0.6)].map(|(u, v)| (centre + side * u + up * v).as_vec3())
}

#[test]
fn a_light_on_its_way_does_not_jump() {
    for (name, eps) in [("exact", 0.0), ("within 1e-3", 1e-3), ("within 1e-2", 1e-2)] {
        let bound = ErrorBound::new(eps);
        let (mut worst, mut crossings) = (0.0f64, 0);
        for window in 0..4000 {
            let mut before: Option<(f64, f64)> = None;
            for step in 0..12 {
                let way = f64::from(window) / 4000.0 + 1e-6 * f64::from(step);
                let case = Case { corners: light_on_its_way(way), x: Vec3::ZERO, n: Vec3::Z };
                let Some(truth) = truth(&case).filter(|t| t.uncosined > 0.0) else { continue };
                let now = form_factor_within(&case.light(), case.x, case.n, &bound);
                let now = (f64::from(now) / truth.uncosined, truth.form_factor / truth.uncosined);
                if let Some(last) = before {
                    worst = worst.max((now.0 - last.0).abs() - (now.1 - last.1).abs());
                }
                crossings += u32::from(truth.crosses);
                before = Some(now);
            }
        }
        assert!(crossings > 1000, "{crossings}");
        // A fade from one form to the next spans 30 % of tau^2, so a step of 1e-6 moves it by less than 1e-4 of eps.
        assert!(worst < 2e-6 + 1e-4 * f64::from(eps), "{name}: {worst:.1e} of U");
    }
}

#[test]
fn an_abrupt_switch_would_be_seen() {
    let bound = ErrorBound::new(1e-2);
    let [near, far] = [0.999_999, 1.000_001].map(|stretch| {
        let corners = light_on_its_way(0.5).map(|v| v * stretch);
        let case = Case { corners, x: Vec3::ZERO, n: Vec3::Z };
        (form_factor(&case.light(), case.x, case.n), centroid_form_factor(&case.light(), case.x, case.n))
    });
    let jump = f64::from((near.0 - far.1).abs() / near.0);
    assert!(jump > 2e-6 + 1e-4 * f64::from(bound.centroid), "{jump}");
}

#[test]
fn blocks_keep_the_error_of_sums_where_a_plain_sum_loses_it() {
    let triangles = sphere(6);
    let lights = LightSet {
        geometry: lights(&triangles),
        tags: vec![0; triangles.len()],
        emission: vec![Vec3::ZERO; triangles.len()],
        sample_starts: vec![0; triangles.len() + 1],
        samples: Vec::new(),
    };
    let receiver =
        Receiver { position: Vec3::new(0.3, 0.2, -0.1), normal: Vec3::Z, geometric_normal: Vec3::Z, tag: 0 };
    let each: Vec<f32> =
        lights.geometry.iter().map(|light| form_factor(light, receiver.position, receiver.normal)).collect();
    let exact: f64 = each.iter().map(|&f| f64::from(f)).sum();
    let plain = f64::from(each.iter().sum::<f32>()) - exact;
    let list: Vec<u32> = (0..triangles.len() as u32).collect();
    let radiosity = vec![Vec3::ONE; triangles.len()];
    let together = gather_together(&lights, &radiosity, &list, &[receiver]);
    let blocks = f64::from(together[0].irradiance.x) - exact;
    println!("{} lights: plain sum off by {plain:.1e}, blocks by {blocks:.1e}", triangles.len());
    assert!((exact - 1.0).abs() < 1e-5, "{exact}");
    assert!(blocks.abs() < 2e-6, "{blocks}");
    assert!(plain.abs() > 2.0 * blocks.abs(), "blocks would not be needed: {plain} {blocks}");
}

#[test]
fn cheap_forms_keep_their_bound() {
    for eps in [1e-2, 1e-3, 1e-4] {
        let bound = ErrorBound::new(eps);
        let mut worst = 0.0f64;
        for index in 0..400_000 {
            let (kind, case) = vlm_tests::form_factor::generate::generate(index);
            if kind != vlm_tests::form_factor::generate::Kind::Anywhere || case.aspect() > 10.0 {
                continue;
            }
            let Some(truth) =
                truth(&case).filter(|t| t.uncosined > 0.0 && case.distance() > 0.5 * case.size())
            else {
                continue;
            };
            let cheap = form_factor_within(&case.light(), case.x, case.n, &bound);
            worst = worst.max((f64::from(cheap) - truth.form_factor).abs() / truth.uncosined);
        }
        assert!(worst < f64::from(eps), "{eps}: {worst}");
        assert!(worst > 0.05 * f64::from(eps), "{eps}: {worst}: the bound is never used");
    }
}

#[test]
fn lanes_agree_with_the_scalar_form() {
    let triangles = sphere(1);
    let receivers: Vec<(Vec3, Vec3)> = (0..1003)
        .map(|i| {
            let x = Vec3::new((i * 37 % 101) as f32, (i * 53 % 97) as f32, (i * 29 % 89) as f32) / 101.0
                * 12.0
                - 6.0;
            (x, Vec3::new(x.y, 1.0 - x.z, x.x).normalize_or_zero())
        })
        .collect();
    let soa = Receivers::new(receivers.iter().copied());
    let mut lanes = vec![f32::NAN; soa.len()];
    let mut worst = 0.0f32;
    for light in lights(&triangles) {
        form_factors(&light, &soa, &mut lanes);
        for (i, &(x, n)) in receivers.iter().enumerate() {
            let scalar = form_factor(&light, x, n);
            assert!((0.0..=1.0).contains(&lanes[i]), "receiver {i}");
            // Closer to the sphere, roundings of the receiver's place are worth more than that.
            if x.length() < 4.0 {
                worst = worst.max((scalar - lanes[i]).abs());
            }
        }
    }
    assert!(worst < 1e-6, "{worst}");
    let [a, b] = [&lights(&triangles)[0], &lights(&triangles)[1]];
    form_factors(a, &soa, &mut lanes);
    assert!(receivers.iter().zip(&lanes).any(|(&(x, n), f)| (form_factor(b, x, n) - f).abs() > 1e-3));
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn sums_on_the_gpu_are_whole() {
    let triangles = sphere(5);
    let gpu =
        GpuFormFactor::sums().expect("a Vulkan adapter: VLM_REQUIRE_GPU is set or a driver is installed");
    let points = [(Vec3::ZERO, Vec3::Z), (Vec3::new(1.0, -2.0, 3.0), Vec3::new(0.6, 0.0, -0.8))];
    let (sums, _) = gpu.measure_sums(&lights(&triangles), &points).expect("results from the GPU");
    for sum in sums {
        assert!((sum - 1.0).abs() < 2e-5, "{sum}");
    }
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn cheap_forms_on_the_gpu_are_those_of_the_cpu() {
    let gpu =
        GpuFormFactor::new().expect("a Vulkan adapter: VLM_REQUIRE_GPU is set or a driver is installed");
    let cases: Vec<Case> = (0..200_000)
        .map(vlm_tests::form_factor::generate::generate)
        .filter(|(kind, case)| {
            let is_plain = *kind == vlm_tests::form_factor::generate::Kind::Anywhere;
            is_plain && case.aspect() < 10.0 && case.distance() > 0.1 * case.size()
        })
        .map(|(_, case)| case)
        .collect();
    let bound = ErrorBound::new(1e-3);
    let on_gpu = gpu.evaluate_within(&cases, &bound).expect("results from the GPU");
    let mut cheap = 0;
    for (case, gpu) in cases.iter().zip(on_gpu) {
        let Some(truth) = truth(case).filter(|t| t.uncosined > 0.0) else { continue };
        let cpu = form_factor_within(&case.light(), case.x, case.n, &bound);
        let difference = f64::from((cpu - gpu).abs()) / truth.uncosined;
        assert!(difference < 2e-5, "{case:?}: {cpu} {gpu}");
        cheap += u32::from((f64::from(cpu) - truth.form_factor).abs() / truth.uncosined > 1e-5);
    }
    assert!(cheap > 100, "the bound is never used: {cheap}");
}
