//! The viewer's shaders validate without a GPU, and what they read has the layout of its Rust twin.

use std::mem::{offset_of, size_of};

use naga::valid::{Capabilities, ValidationFlags, Validator};

use super::materials::Packed as Material;
use super::overlay::{LightSettings, SurfaceSettings};
use super::pixel_light::Packed as PixelLight;
use super::resolve::Packed as Resolve;
use super::scene_buffers::Vertex;
use super::shaders::{FILES, OVERLAY_SHARED, PIXEL_LIGHT_SHARED};
use super::surface::Packed as Camera;

fn source(name: &str) -> String {
    let own = FILES.iter().find(|(file, _)| *file == name).unwrap().1;
    let shared: &[&str] = match name {
        "pixel_light.wgsl" => &PIXEL_LIGHT_SHARED,
        "overlay_surface.wgsl" => &OVERLAY_SHARED,
        _ => &[],
    };
    [&[own], shared].concat().join("\n")
}

#[test]
fn every_shader_validates_without_capabilities() {
    for (name, _) in FILES {
        let module =
            naga::front::wgsl::parse_str(&source(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
        let validated = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module);
        validated.unwrap_or_else(|error| panic!("{name}: {error:?}"));
        assert!(!module.entry_points.is_empty(), "{name}");
    }
}

/// Names and offsets of a struct's members, and its size.
fn layout(file: &str, name: &str) -> (Vec<(String, usize)>, usize) {
    let module = naga::front::wgsl::parse_str(&source(file)).unwrap();
    let (_, found) = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name)).unwrap();
    let naga::TypeInner::Struct { members, span } = &found.inner else { panic!("{name} is no struct") };
    let member = |m: &naga::StructMember| (m.name.clone().unwrap_or_default(), m.offset as usize);
    (members.iter().map(member).collect(), *span as usize)
}

macro_rules! layout_of {
    ($twin:ident, $($field:ident),*) => {
        (vec![$((stringify!($field).to_owned(), offset_of!($twin, $field))),*], size_of::<$twin>())
    };
}

#[test]
fn twins_have_the_same_layout() {
    let camera = layout_of!(Camera, clip_from_world, eye, cuts_holes, forward, is_perspective);
    assert_eq!(layout("surface.wgsl", "Camera"), camera);
    assert_eq!(layout("surface.wgsl", "Vertex"), layout_of!(Vertex, position_u, normal_v, color_u, v));
    let light = layout_of!(PixelLight, view, first_light, end_light, leave_distance, node_count);
    assert_eq!(layout("pixel_light.wgsl", "Settings"), light);
    let resolve = layout_of!(Resolve, origin, exposure, shows_difference, shares, gain, padding);
    assert_eq!(layout("resolve.wgsl", "Settings"), resolve);
    let lights = layout_of!(
        LightSettings,
        clip_from_world,
        eye,
        opacity,
        forward,
        is_perspective,
        origin,
        depth_scale,
        reach
    );
    assert_eq!(layout("overlay_lights.wgsl", "Settings"), lights);
    let surface = layout_of!(SurfaceSettings, view, origin, shows_cells, most);
    assert_eq!(layout("overlay_surface.wgsl", "Settings"), surface);
    // Its padding is an array on one side, numbers on the other.
    let (members, size) = layout("surface.wgsl", "Material");
    assert_eq!((&members[..3], size), (&layout_of!(Material, base_color, emission, is_masked).0[..], 48));
    assert_eq!(size_of::<Material>(), 48);
}

#[test]
fn nodes_of_the_tree_have_the_same_layout() {
    use vlm_bake::bvh::FlatNode;
    assert_eq!(layout("pixel_light.wgsl", "Node"), layout_of!(FlatNode, least, count, most, first));
}
