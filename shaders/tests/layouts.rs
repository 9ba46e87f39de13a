//! The structs that shaders read and write have the layout of their Rust twins: names, offsets, sizes, and strides in arrays.

use std::mem::{offset_of, size_of};

use naga::proc::Layouter;
use vlm_format::{Leaf, Probe, Sample, Uncovered};
use vlm_shaders::cpu::direct::{DirectHeader, PackedLight, Point, Span};
use vlm_shaders::cpu::form_factor::LightGeometry;
use vlm_shaders::cpu::free_light::FreeLight;
use vlm_shaders::cpu::gather::Receiver;
use vlm_shaders::cpu::refresh::{FarLight, FarSource};
use vlm_shaders::cpu::shadow::ShadowHeader;
use vlm_shaders::cpu::view::View;
use vlm_shaders::tables::{GridHeader, LightSurface};
use vlm_shaders::wgsl::{self, Gathering};

/// A struct's members (name, offset, size), its size, and the strides of the arrays that hold it.
#[derive(Debug, PartialEq)]
struct Layout {
    members: Vec<(String, usize, usize)>,
    size: usize,
    strides: Vec<usize>,
}

fn layout(source: &str, name: &str) -> Layout {
    let module = naga::front::wgsl::parse_str(source).expect("a valid shader");
    let mut layouter = Layouter::default();
    layouter.update(module.to_ctx()).expect("sized types");
    let found = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name));
    let (handle, found) = found.unwrap_or_else(|| panic!("no struct {name}"));
    let naga::TypeInner::Struct { members, span } = &found.inner else { panic!("{name} is no struct") };
    let member = |m: &naga::StructMember| {
        (m.name.clone().unwrap_or_default(), m.offset as usize, layouter[m.ty].size as usize)
    };
    let stride = |(_, t): (_, &naga::Type)| match t.inner {
        naga::TypeInner::Array { base, stride, .. } if base == handle => Some(stride as usize),
        _ => None,
    };
    Layout {
        members: members.iter().map(member).collect(),
        size: *span as usize,
        strides: module.types.iter().filter_map(stride).collect(),
    }
}

fn field_size<S, T>(_: fn(&S) -> &T) -> usize {
    size_of::<T>()
}

/// The layout of a Rust struct; `in_arrays` is how many kinds of arrays hold it.
macro_rules! layout_of {
    ($twin:ident, $in_arrays:expr, $($field:ident),*) => {
        Layout {
            members: vec![$((
                stringify!($field).to_owned(),
                offset_of!($twin, $field),
                field_size(|twin: &$twin| &twin.$field),
            )),*],
            size: size_of::<$twin>(),
            strides: (0..$in_arrays).map(|_| size_of::<$twin>()).collect(),
        }
    };
}

#[test]
fn light_geometry() {
    let expected = layout_of!(
        LightGeometry,
        1,
        v0,
        scale,
        base,
        before,
        altitude,
        after,
        normal,
        altitude_squared,
        v1,
        base_squared,
        v2,
        padding
    );
    for source in [wgsl::form_factor_cases(), wgsl::gather_static()] {
        assert_eq!(layout(&source, "LightGeometry"), expected);
    }
}

#[test]
fn the_grid() {
    let header = layout_of!(
        GridHeader,
        0,
        origin,
        cell_size,
        dimensions,
        surface_probes,
        leaves,
        leaf_probes,
        near_starts,
        near,
        row_starts,
        sample_starts,
        probe_count,
        near_count,
        light_count,
        sample_count,
        uncovered_count,
        light_tags,
        summed,
        injected,
        refreshed,
        padding
    );
    let leaf = layout_of!(Leaf, 0, probes, free_probes);
    for source in [wgsl::inject(), wgsl::refresh(), wgsl::gather_static()] {
        assert_eq!(layout(&source, "GridHeader"), header);
        assert_eq!(layout(&source, "Leaf"), leaf);
    }
    let probe = layout_of!(Probe, 1, position, row_scale, normal, reach_up, tangent, reach_down, reach);
    let far = layout_of!(FarLight, 1, by_normal, along, padding);
    for source in [wgsl::refresh(), wgsl::gather_static()] {
        assert_eq!(layout(&source, "Probe"), probe);
        assert_eq!(layout(&source, "FarLight"), far);
    }
    let free = layout_of!(FreeLight, 1, coefficients);
    for source in [wgsl::refresh_free(), wgsl::gather_free()] {
        assert_eq!(layout(&source, "FreeLight"), free);
    }
    let source = layout_of!(FarSource, 1, centroid, padding, normal, padding_2);
    assert_eq!(layout(&wgsl::refresh(), "FarSource"), source);
}

#[test]
fn surface_and_receivers() {
    let inject = wgsl::inject();
    assert_eq!(layout(&inject, "Sample"), layout_of!(Sample, 1, position, normal, reflectance));
    assert_eq!(layout(&inject, "LightSurface"), layout_of!(LightSurface, 1, emission, gain));
    let uncovered = layout_of!(
        Uncovered,
        1,
        position,
        area,
        normal,
        padding,
        reflectance,
        padding_2,
        emission,
        padding_3
    );
    assert_eq!(layout(&inject, "Uncovered"), uncovered);
    let receiver = layout_of!(Receiver, 1, position, normal, geometric_normal, tag);
    assert_eq!(layout(&wgsl::gather_static(), "Receiver"), receiver);
}

#[test]
fn direct_light_and_views() {
    let direct = wgsl::direct();
    let light = layout_of!(
        PackedLight,
        1,
        position,
        inverse_range,
        direction,
        directional,
        intensity,
        cone_scale,
        cone_offset,
        padding,
        padding_2,
        padding_3
    );
    assert_eq!(layout(&direct, "PunctualLight"), light);
    let header = layout_of!(DirectHeader, 0, light_count, point_count, span_count, has_visibility);
    assert_eq!(layout(&direct, "DirectHeader"), header);
    let shadow = wgsl::shadow();
    for source in [&direct, &shadow] {
        assert_eq!(layout(source, "Point"), layout_of!(Point, 1, position, padding, normal, padding_2));
    }
    let map = layout_of!(
        ShadowHeader,
        0,
        clip_from_world,
        light,
        normal_offset,
        depth_bias,
        is_reversed,
        first,
        point_count,
        is_first,
        padding,
        padding_2
    );
    assert_eq!(layout(&shadow, "ShadowHeader"), map);
    assert_eq!(layout(&direct, "Span"), layout_of!(Span, 1, first, count));
    let view = layout_of!(View, 0, world_from_clip, exposure, empty_depth, padding, padding_2);
    for gathering in Gathering::ALL {
        assert_eq!(layout(&gathering.deferred(false, false), "View"), view);
    }
}

#[test]
fn a_rename_a_swap_a_dropped_field_and_another_type_are_seen() {
    let source = wgsl::refresh();
    let right = layout(&source, "FarLight");
    for (from, to) in [
        ("by_normal: array", "by_normals: array"),
        ("by_normal: array<array<f32, 3>, 3>", "by_normal: array<vec3f, 3>"),
        (
            "    along: array<array<f32, 3>, 2>,\n    padding: f32,\n",
            "    padding: f32,\n    along: array<array<f32, 3>, 2>,\n",
        ),
        ("    padding: f32,\n}\n\nfn far_irradiance", "}\n\nfn far_irradiance"),
        ("padding: f32,\n}\n\nfn far", "padding: vec2f,\n}\n\nfn far"),
    ] {
        let changed = source.replace(from, to);
        assert_ne!(changed, source, "{from}");
        // Only the declaration counts: functions that use it may no longer fit.
        let declaration = |s: &str| {
            let start = s.find("struct FarLight").expect("the struct");
            let end = start + s[start..].find('}').expect("its end") + 1;
            format!("{}\n@group(0) @binding(0) var<storage> all: array<FarLight>;", &s[start..end])
        };
        assert_eq!(layout(&declaration(&source), "FarLight"), right);
        assert_ne!(layout(&declaration(&changed), "FarLight"), right, "{from} -> {to}");
    }
}
