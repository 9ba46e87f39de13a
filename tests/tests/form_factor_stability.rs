//! What a player sees: sums of many form factors while something moves by a millionth of the scene at a time.

use glam::{DVec3, Vec3};
use vlm_shaders::cpu::form_factor::{
    ErrorBound, LightGeometry, Receivers, form_factor, form_factor_within, form_factors,
};
use vlm_tests::form_factor::case::Case;
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
