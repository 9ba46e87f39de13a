//! The f64 reference's own error, against the textbook sum in 384 bits: another formula, so that no slip is shared.

use astro_float::{BigFloat, Consts, RoundingMode};
use vlm_tests::form_factor::case::Case;
use vlm_tests::form_factor::generate::{Kind, generate};
use vlm_tests::form_factor::reference::truth;

/// Enough for size / distance of 1e-8, where the sum cancels 24 digits, and 80 more.
const BITS: usize = 384;
const ROUND: RoundingMode = RoundingMode::ToEven;

type Vector = [BigFloat; 3];

fn add(a: &BigFloat, b: &BigFloat) -> BigFloat {
    a.add(b, BITS, ROUND)
}

fn sub(a: &BigFloat, b: &BigFloat) -> BigFloat {
    a.sub(b, BITS, ROUND)
}

fn mul(a: &BigFloat, b: &BigFloat) -> BigFloat {
    a.mul(b, BITS, ROUND)
}

fn div(a: &BigFloat, b: &BigFloat) -> BigFloat {
    a.div(b, BITS, ROUND)
}

fn dot(a: &Vector, b: &Vector) -> BigFloat {
    add(&add(&mul(&a[0], &b[0]), &mul(&a[1], &b[1])), &mul(&a[2], &b[2]))
}

fn cross(a: &Vector, b: &Vector) -> Vector {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| sub(&mul(&a[i], &b[j]), &mul(&a[j], &b[i])))
}

fn length(a: &Vector) -> BigFloat {
    dot(a, a).sqrt(BITS, ROUND)
}

fn is_positive(x: &BigFloat) -> bool {
    !x.is_zero() && !x.is_negative()
}

fn big(v: glam::Vec3) -> Vector {
    v.to_array().map(|c| BigFloat::from_f64(f64::from(c), BITS))
}

/// `acos(p . q) n . unit(p x q)` summed over the clipped polygon.
fn textbook_sum(case: &Case, constants: &mut Consts) -> BigFloat {
    let (x, n) = (big(case.x), big(case.n));
    let corners = case.corners.map(|v| {
        let v = big(v);
        [0, 1, 2].map(|i| sub(&v[i], &x[i]))
    });
    let heights = corners.each_ref().map(|r| dot(&n, r));
    let mut polygon: Vec<Vector> = Vec::new();
    for (i, j) in [(0, 1), (1, 2), (2, 0)] {
        if is_positive(&heights[i]) {
            polygon.push(corners[i].clone());
        }
        if is_positive(&heights[i]) != is_positive(&heights[j]) {
            let t = div(&heights[i], &sub(&heights[i], &heights[j]));
            polygon
                .push([0, 1, 2].map(|k| add(&corners[i][k], &mul(&t, &sub(&corners[j][k], &corners[i][k])))));
        }
    }
    let mut sum = BigFloat::new(BITS);
    for (i, p) in polygon.iter().enumerate() {
        let q = &polygon[(i + 1) % polygon.len()];
        let c = cross(p, q);
        let c_length = length(&c);
        if !c_length.is_zero() {
            let cosine = div(&dot(p, q), &mul(&length(p), &length(q)));
            let theta = cosine.acos(BITS, ROUND, constants);
            sum = add(&sum, &div(&mul(&theta, &dot(&n, &c)), &c_length));
        }
    }
    let tau = mul(&constants.pi(BITS, ROUND), &BigFloat::from_f64(-2.0, BITS));
    div(&sum, &tau)
}

#[test]
fn reference_errs_by_less_than_1e_11_of_the_uncosined_form_factor() {
    let mut constants = Consts::new().expect("constants");
    let mut worst = [(0.0f64, 0); 2];
    let mut checked = 0;
    for index in (0..400_000).step_by(37) {
        let (kind, case) = generate(index);
        // A result clamped to 1 says nothing; thin lights beyond what the gates measure are rounded in f64 too.
        if matches!(kind, Kind::Broken | Kind::NormalLength) || case.aspect() > 100.0 {
            continue;
        }
        let Some(truth) = truth(&case).filter(|truth| truth.uncosined > 0.0 && truth.form_factor > 0.0)
        else {
            continue;
        };
        let difference =
            sub(&textbook_sum(&case, &mut constants), &BigFloat::from_f64(truth.form_factor, BITS));
        let difference: f64 = difference.to_string().parse().expect("a number");
        let error = difference.abs() / truth.uncosined;
        checked += 1;
        let touches = usize::from(case.distance() < 1e-3 * case.size());
        if error > worst[touches].0 {
            worst[touches] = (error, index);
        }
    }
    println!("{checked} cases, worst {worst:?}");
    assert!(checked > 1000);
    assert!(worst[0].0 < 1e-11, "{worst:?}");
    assert!(worst[1].0 < 1e-7, "touching the light, where no gate applies: {worst:?}");
}
