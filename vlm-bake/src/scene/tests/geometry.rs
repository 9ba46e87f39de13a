use super::*;
use glam::{Vec3, vec3};

/// Twice the area of each triangle along its front.
fn fronts(scene: &Scene) -> Vec<Vec3> {
    let normal = |t| scene.corners(t).map(|[a, b, c]| (b - a).cross(c - a)).unwrap();
    (0..scene.triangles.len()).map(normal).collect()
}

#[test]
fn mirrored_nodes_keep_their_fronts() {
    for scale in [[1.0, 1.0, 1.0], [-1.0, 1.0, 1.0], [2.0, -3.0, 1.0], [-1.0, -1.0, 1.0], [1.0, 1.0, -1.0]] {
        let mut builder = Builder::new(&CORNERS);
        let normals = builder.floats(&[[0.0, 0.0, 1.0]; 3]);
        builder.primitive()["attributes"]["NORMAL"] = normals;
        builder.node()["scale"] = json!(scale);
        let scene = builder.load().unwrap();
        // The front shows along +z in the mesh; mirroring z alone turns it around in the world.
        let expected = Vec3::Z * scale[2];
        assert_eq!(fronts(&scene)[0].normalize_or_zero(), expected, "{scale:?}");
        assert_eq!(scene.vertex_normals, vec![expected; 3], "{scale:?}");
    }
}

#[test]
fn normals_turn_with_the_inverse_transpose() {
    let mut builder = Builder::new(&CORNERS);
    let diagonal = vec3(1.0, 1.0, 0.0).normalize_or_zero();
    let normals = builder.floats(&[diagonal.to_array(); 3]);
    builder.primitive()["attributes"]["NORMAL"] = normals;
    builder.node()["scale"] = json!([4.0, 1.0, 1.0]);
    let expected = vec3(0.25, 1.0, 0.0).normalize_or_zero();
    assert!(builder.load().unwrap().vertex_normals[0].abs_diff_eq(expected, 1e-6));
}

#[test]
fn parents_move_their_children() {
    let mut builder = Builder::new(&CORNERS);
    builder.json["nodes"] = json!([
        { "name": "Room", "translation": [0.0, 0.0, 5.0], "children": [1] },
        { "mesh": 0, "matrix": [0,1,0,0, -1,0,0,0, 0,0,1,0, 1,0,0,1] },
    ]);
    let scene = builder.load().unwrap();
    assert_eq!(scene.positions, [vec3(1.0, 0.0, 5.0), vec3(1.0, 1.0, 5.0), vec3(0.0, 0.0, 5.0)]);
    assert_eq!(scene.objects[0].path, "Room/node 1");
    assert_eq!(scene.objects[0].node, 1);
}

#[test]
fn lists_strips_and_fans_of_a_square_wind_alike() {
    let square = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
    for (mode, indices) in [(4, &[0, 1, 2, 2, 1, 3][..]), (5, &[0, 1, 2, 3]), (6, &[0, 1, 3, 2])] {
        let mut builder = Builder::new(&square);
        let indices = builder.indices(indices);
        builder.primitive()["indices"] = indices;
        builder.primitive()["mode"] = json!(mode);
        assert_eq!(fronts(&builder.load().unwrap()), [Vec3::Z; 2], "mode {mode}");
    }
}

#[test]
fn missing_normals_shade_flat() {
    let roof = [[-1.0, 0.0, 0.0], [0.0, 1.0, 1.0], [0.0, 1.0, -1.0], [1.0, 0.0, 0.0]];
    let mut builder = Builder::new(&roof);
    let indices = builder.indices(&[0, 1, 2, 3, 2, 1]);
    builder.primitive()["indices"] = indices;
    let scene = builder.load().unwrap();
    assert_eq!(scene.positions.len(), 6, "no vertex is shared");
    for (t, front) in fronts(&scene).into_iter().enumerate() {
        for v in scene.triangles[t] {
            assert!(scene.vertex_normals[v as usize].abs_diff_eq(front.normalize_or_zero(), 1e-6));
        }
    }
}

#[test]
fn triangles_without_area_are_left_out_with_a_note() {
    // Far from the origin, the needle's height is a rounding error; near it, the same height is meant.
    let needle = |y: f32, tip: f32| [[0.0, y, 0.0], [1.0, y, 0.0], [0.5, tip, 0.0]];
    let far = needle(1000.0, 1000.0_f32.next_up());
    let none = [CORNERS[0], CORNERS[1], CORNERS[1]];
    let scene = Builder::new(&[CORNERS, needle(0.0, 1e-4), far, none].concat()).load().unwrap();
    assert_eq!((scene.triangles.len(), scene.degenerate_triangles), (2, 2));
    assert!(scene.notes.iter().any(|note| note.contains("2 triangles without area")), "{:?}", scene.notes);
}

#[test]
fn triangles_keep_their_number_as_drawn() {
    // 1---3---5   As a list: three of the strip's triangles, and between them one without area. As a strip: the doubled
    // | \ | \ |   corner 2 gives two triangles without area. As a fan round 0: one, for the doubled corner 3.
    // 0---2---4
    let ladder = [0.0, 1.0, 2.0].map(|x| [[x, 0.0, 0.0], [x, 1.0, 0.0]]).concat();
    let cases: [(u32, &[u16], &[u32], u32); 4] = [
        (4, &[0, 2, 1, 1, 2, 2, 1, 2, 3, 2, 4, 3], &[0, 2, 3], 4),
        (5, &[0, 2, 2, 1, 3, 4], &[2, 3], 4),
        (5, &[0, 2, 1, 3], &[0, 1], 2),
        (6, &[0, 2, 3, 3, 1], &[0, 2], 3),
    ];
    for (mode, corners, numbers, drawn) in cases {
        for mirrored in [false, true] {
            let mut builder = Builder::new(&ladder);
            let indices = builder.indices(corners);
            builder.primitive()["indices"] = indices;
            builder.primitive()["mode"] = json!(mode);
            builder.json["nodes"] = json!([{ "mesh": 0 }, { "mesh": 0, "translation": [0, 0, 1] }]);
            builder.json["scenes"][0]["nodes"] = json!([0, 1]);
            if mirrored {
                builder.node()["scale"] = json!([-1, 1, 1]);
            }
            let scene = builder.load().unwrap();
            assert_eq!(scene.triangle_in_primitive, [numbers, numbers].concat(), "mode {mode}");
            assert!(
                scene.primitives.iter().all(|primitive| primitive.drawn_triangles == drawn),
                "mode {mode}"
            );
            // The number leads back to the corners, in whatever order the winding takes them.
            for (t, &number) in scene.triangle_in_primitive.iter().enumerate() {
                let at = |i: u32| ladder[corners[i as usize] as usize];
                let file = match mode {
                    4 => [at(3 * number), at(3 * number + 1), at(3 * number + 2)],
                    5 => [at(number), at(number + 1), at(number + 2)],
                    _ => [at(0), at(number + 1), at(number + 2)],
                };
                let x_sign = if mirrored && t < numbers.len() { -1.0 } else { 1.0 };
                let flat = |[x, y]: [f32; 2]| (x as i32, y as i32);
                let mut expected = file.map(|[x, y, _]| flat([x * x_sign, y]));
                let mut found = scene.corners(t).unwrap().map(|p| flat([p.x, p.y]));
                expected.sort_unstable();
                found.sort_unstable();
                assert_eq!(found, expected, "mode {mode}, triangle {number}");
            }
        }
    }
}

#[test]
fn vertices_beyond_single_precision_are_refused_with_their_place() {
    let mut builder = Builder::new(&CORNERS);
    builder.json["nodes"] =
        json!([{ "scale": [1e30, 1, 1], "children": [1] }, { "scale": [1e30, 1, 1], "mesh": 0 }]);
    let error = builder.load().unwrap_err();
    assert!(
        matches!(&error, Error::TooFar { pointer, .. } if pointer == "/meshes/0/primitives/0"),
        "{error}"
    );
}

#[test]
fn instances_are_placed_one_by_one() {
    let mut builder = Builder::new(&CORNERS);
    let translations = builder.floats(&[[0.0, 0.0, 0.0], [0.0, 0.0, 7.0]]);
    let scales = builder.floats(&[[1.0, 1.0, 1.0], [-2.0, 2.0, 2.0]]);
    builder.json["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    builder.node()["extensions"] = json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": translations, "SCALE": scales } } });
    let scene = builder.load().unwrap();
    assert_eq!(fronts(&scene), [Vec3::Z, 4.0 * Vec3::Z]);
    assert_eq!((scene.primitives.len(), scene.objects.len()), (2, 1));
    assert!(scene.positions[3..].iter().all(|p| p.z == 7.0));
}

#[test]
fn morph_targets_take_the_weights_of_the_node_before_those_of_the_mesh() {
    let mut builder = Builder::new(&CORNERS);
    let target = builder.floats(&[[0.0, 0.0, 1.0]; 3]);
    builder.primitive()["targets"] = json!([{ "POSITION": target }]);
    builder.json["meshes"][0]["weights"] = json!([1.0]);
    builder.json["nodes"] = json!([{ "mesh": 0 }, { "mesh": 0, "weights": [0.5] }]);
    builder.json["scenes"][0]["nodes"] = json!([0, 1]);
    let scene = builder.load().unwrap();
    assert_eq!([scene.positions[0].z, scene.positions[3].z], [1.0, 0.5]);
}

#[test]
fn skins_follow_their_joints_and_not_their_node() {
    let mut builder = Builder::new(&CORNERS);
    let joints = builder.accessor(&[0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0], 3, "VEC4", 5121);
    let weights = builder.floats(&[[0.5, 0.5, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]]);
    builder.primitive()["attributes"]["JOINTS_0"] = joints;
    builder.primitive()["attributes"]["WEIGHTS_0"] = weights;
    builder.json["skins"] = json!([{ "joints": [1, 2] }]);
    builder.json["nodes"] = json!([
        { "mesh": 0, "skin": 0, "translation": [100, 0, 0] },
        { "translation": [0, 0, 2] },
        { "translation": [0, 0, 4] },
    ]);
    builder.json["scenes"][0]["nodes"] = json!([0, 1, 2]);
    let scene = builder.load().unwrap();
    assert_eq!(scene.positions, [vec3(0.0, 0.0, 3.0), vec3(1.0, 0.0, 2.0), vec3(0.0, 1.0, 2.0)]);
}

#[test]
fn the_default_scene_is_drawn_without_its_hidden_nodes() {
    let mut builder = Builder::new(&CORNERS);
    let hidden = json!({ "KHR_node_visibility": { "visible": false } });
    builder.json["nodes"] = json!([
        { "mesh": 0 },
        { "mesh": 0, "translation": [0, 0, 1] },
        { "mesh": 0, "extensions": hidden, "children": [3] },
        { "mesh": 0 },
    ]);
    builder.json["scenes"] = json!([{ "nodes": [0] }, { "nodes": [1, 2] }]);
    builder.json["scene"] = json!(1);
    let scene = builder.load().unwrap();
    assert_eq!(scene.objects.iter().map(|object| object.node).collect::<Vec<_>>(), [1]);
    assert!(scene.notes.iter().any(|note| note.starts_with("/scenes/1")), "{:?}", scene.notes);
}

#[test]
fn scenes_without_triangles_are_refused_with_the_reason() {
    let points = {
        let mut builder = Builder::new(&CORNERS);
        builder.primitive()["mode"] = json!(0);
        builder
    };
    let flat = {
        let mut builder = Builder::new(&CORNERS);
        builder.node()["scale"] = json!([0, 0, 0]);
        builder
    };
    let authored = {
        let mut builder = Builder::new(&CORNERS);
        builder.node()["name"] = json!("VLM_all");
        builder
    };
    let empty = {
        let mut builder = Builder::new(&CORNERS);
        builder.json["nodes"] = json!([{}]);
        builder
    };
    for (builder, expected) in
        [(points, "points or lines"), (flat, "area"), (authored, "authored"), (empty, "no node places")]
    {
        let error = builder.load().unwrap_err();
        assert!(matches!(&error, Error::NoTriangles { reason, .. } if reason.contains(expected)), "{error}");
    }
}
