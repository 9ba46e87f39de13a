use super::*;
use glam::vec3;

/// Deterministic numbers in 0..1 (Weyl sequence through a 64-bit finaliser).
fn uniform(state: &mut u64) -> f32 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = (*state ^ (*state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 40) as f32 / (1_u64 << 24) as f32
}

fn point(state: &mut u64) -> Vec3 {
    vec3(uniform(state), uniform(state), uniform(state))
}

fn soup(count: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let mut state = 1;
    let positions = (0..count).flat_map(|_| {
        let centre = point(&mut state);
        [(); 3].map(|()| centre + (point(&mut state) - 0.5) * 0.1)
    });
    (positions.collect(), (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
}

/// A grid of quads in the plane z = 0, over 0..1: every ray down must hit it, shared edges included.
fn sheet(cells: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let side = cells + 1;
    let positions = (0..side * side).map(|i| vec3((i % side) as f32, (i / side) as f32, 0.0) / cells as f32);
    let triangles = (0..cells * cells).flat_map(|i| {
        let corner = i % cells + i / cells * side;
        [[corner, corner + 1, corner + side + 1], [corner, corner + side + 1, corner + side]]
    });
    (positions.collect(), triangles.collect())
}

/// Möller and Trumbore 1997, in double precision: distance and side.
fn exact_hit(corners: [Vec3; 3], origin: Vec3, direction: Vec3) -> Option<(f64, bool)> {
    let [a, b, c] = corners.map(|p| p.as_dvec3());
    let (origin, direction) = (origin.as_dvec3(), direction.as_dvec3());
    let (e1, e2, s) = (b - a, c - a, origin - a);
    let p = direction.cross(e2);
    let determinant = e1.dot(p);
    let (u, q) = (s.dot(p) / determinant, s.cross(e1));
    let (v, t) = (direction.dot(q) / determinant, e2.dot(q) / determinant);
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some((t, determinant > 0.0))
}

#[test]
fn hit_agrees_with_testing_every_triangle() {
    let (positions, triangles) = soup(500);
    let bvh = Bvh::new(&positions, &triangles);
    let mut state = 2;
    let mut hits = 0;
    for _ in 0..4000 {
        let (origin, direction) = (point(&mut state) * 2.0 - 0.5, point(&mut state) - 0.5);
        let corners = |t: &[u32; 3]| t.map(|i| positions[i as usize]);
        let expected = (triangles.iter().zip(0_u32..))
            .filter_map(|(t, i)| Some((exact_hit(corners(t), origin, direction)?, i)))
            .min_by(|a, b| a.partial_cmp(b).unwrap());
        let hit = bvh.hit(origin, direction, f32::INFINITY);
        assert_eq!(bvh.occluded(origin, direction, f32::INFINITY), expected.is_some());
        assert_eq!(hit.map(|h| (h.triangle, h.front)), expected.map(|((_, front), i)| (i, front)));
        let Some((hit, ((distance, _), _))) = hit.zip(expected) else { continue };
        hits += 1;
        assert!((f64::from(hit.distance) / distance - 1.0).abs() < 1e-4, "{} {distance}", hit.distance);
        let t = corners(&triangles[hit.triangle as usize]);
        let weighed = t[0] * hit.barycentric.x + t[1] * hit.barycentric.y + t[2] * hit.barycentric.z;
        assert!(weighed.distance(origin + direction * hit.distance) < 1e-5);
        assert!(!bvh.occluded(origin, direction, hit.distance), "nothing lies before the nearest hit");
    }
    assert!(hits > 50, "{hits} hits");
}

#[test]
fn closest_agrees_with_testing_every_triangle() {
    let (positions, triangles) = soup(500);
    let bvh = Bvh::new(&positions, &triangles);
    let corners: Vec<_> = triangles.iter().map(|t| t.map(|i| Vec3A::from(positions[i as usize]))).collect();
    let mut state = 3;
    let even = |i: u32| i.is_multiple_of(2);
    for _ in 0..500 {
        let p = point(&mut state) * 2.0 - 0.5;
        let expected = (corners.iter().zip(0_u32..))
            .filter(|&(_, i)| even(i))
            .map(|(c, i)| (nearest::closest_point(c, p.into()).distance_squared(p.into()), i))
            .min_by(|a, b| a.partial_cmp(b).unwrap())
            .unwrap();
        let nearest = bvh.closest(p, f32::INFINITY, even).unwrap();
        assert_eq!(nearest.triangle, expected.1);
        assert!((nearest.distance - expected.0.sqrt()).abs() < 1e-6);
        let short = bvh.closest(p, nearest.distance * 0.99, even);
        assert_eq!(short, None, "the limit holds");
    }
}

#[test]
fn no_ray_slips_through_shared_edges() {
    let (positions, triangles) = sheet(16);
    let offset = vec3(1000.1, -333.3, 77.7);
    let moved: Vec<_> = positions.iter().map(|p| p + offset).collect();
    let bvh = Bvh::new(&moved, &triangles);
    for i in 1..128 {
        for j in 1..128 {
            let target = vec3(i as f32, j as f32, 0.0) / 128.0 + offset;
            let origin = offset + vec3(0.3, 0.7, 2.0);
            assert!(bvh.hit(origin, target - origin, 1.5).is_some(), "{i} {j}");
        }
    }
}

#[test]
fn ties_go_to_the_lowest_index_and_sides_are_told_apart() {
    let (positions, mut triangles) = sheet(4);
    let copies = triangles.clone();
    triangles.extend(copies);
    let bvh = Bvh::new(&positions, &triangles);
    let above = bvh.hit(vec3(0.3, 0.4, 1.0), -Vec3::Z, f32::INFINITY).unwrap();
    let below = bvh.hit(vec3(0.3, 0.4, -1.0), Vec3::Z, f32::INFINITY).unwrap();
    assert!(above.front && !below.front);
    assert!(above.triangle < 32);
    let nearest = bvh.closest(vec3(0.3, 0.4, 1.0), f32::INFINITY, |_| true).unwrap();
    assert_eq!(nearest.triangle, above.triangle);
    let hit = bvh.hit_where(vec3(0.3, 0.4, 1.0), -Vec3::Z, f32::INFINITY, |h| h.triangle != above.triangle);
    assert_eq!(hit.unwrap().triangle, above.triangle + 32);
}

#[test]
fn a_ray_that_leaves_a_surface_does_not_meet_it() {
    let (positions, triangles) = sheet(3);
    let turn = glam::Mat3::from_euler(glam::EulerRot::XYZ, 0.3, 0.5, 0.7);
    let offset = vec3(30.0, -70.0, 11.0);
    let moved: Vec<_> = positions.iter().map(|&p| turn * p + offset).collect();
    let bvh = Bvh::new(&moved, &triangles);
    let mut state = 5;
    let mut naive = 0;
    for _ in 0..10_000 {
        let p = turn * vec3(uniform(&mut state), uniform(&mut state), 0.0) + offset;
        let direction = turn * (point(&mut state) - vec3(0.5, 0.5, -0.001));
        assert!(!bvh.occluded(bvh.leave(p, turn * Vec3::Z), direction, 10.0));
        naive += u32::from(bvh.occluded(p, direction, 10.0));
    }
    assert!(naive > 1000, "without leaving, {naive} rays meet the surface");
}

#[test]
fn odd_input_is_left_out() {
    let bvh = Bvh::new(&[], &[]);
    assert_eq!(bvh.hit(Vec3::ZERO, Vec3::X, f32::INFINITY), None);
    assert_eq!(bvh.closest(Vec3::ZERO, f32::INFINITY, |_| true), None);
    let positions = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::NAN];
    let bvh = Bvh::new(&positions, &[[0, 1, 3], [0, 1, 9], [0, 0, 0], [0, 1, 2]]);
    let hit = bvh.hit(vec3(0.2, 0.2, 1.0), -Vec3::Z, f32::INFINITY).unwrap();
    assert_eq!(hit.triangle, 3);
    assert_eq!(bvh.hit(Vec3::NAN, Vec3::X, f32::INFINITY), None);
    assert_eq!(bvh.hit(Vec3::ZERO, Vec3::ZERO, f32::INFINITY), None);
    assert_eq!(bvh.closest(Vec3::NAN, f32::INFINITY, |_| true), None);
}

#[test]
fn answers_do_not_depend_on_the_number_of_threads() {
    let (positions, triangles) = soup(5000);
    let with_threads = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let bvh = pool.install(|| Bvh::new(&positions, &triangles));
        let mut state = 9;
        let rays = (0..5000).map(|_| (point(&mut state), point(&mut state) - 0.5));
        rays.map(|(o, d)| bvh.hit(o, d, f32::INFINITY)).collect::<Vec<_>>()
    };
    assert_eq!(with_threads(1), with_threads(3));
}

#[test]
fn flat_trees_hold_every_triangle_once_and_skip_whole_subtrees() {
    let positions: Vec<Vec3> =
        (0..300).map(|i| Vec3::new((i * 37 % 101) as f32, (i * 53 % 97) as f32, i as f32)).collect();
    let triangles: Vec<[u32; 3]> = (0..100).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let bvh = Bvh::new(&positions, &triangles);
    let flat = bvh.flat();
    let mut seen = vec![0; flat.corners.len()];
    for (number, node) in flat.nodes.iter().enumerate() {
        if node.count > 0 {
            let own = node.first as usize..(node.first + node.count) as usize;
            seen[own.clone()].iter_mut().for_each(|times| *times += 1);
            let inside = |p: &Vec3| p.cmpge(node.least).all() && p.cmple(node.most).all();
            assert!(flat.corners[own].iter().flatten().all(inside));
        } else {
            let within = number + 1..node.first as usize;
            assert!(within.len() >= 2 && within.end <= flat.nodes.len());
            let inside = |n: &FlatNode| n.least.cmpge(node.least).all() && n.most.cmple(node.most).all();
            assert!(flat.nodes[within].iter().all(inside));
        }
    }
    assert!(seen.len() == 100 && seen.iter().all(|times| *times == 1));
    assert!(Bvh::new(&[], &[]).flat().nodes.is_empty());
}
