//! Every shader parses and validates without a GPU, and the shared structs have the layout of their Rust twins.

use std::mem::{offset_of, size_of};

use naga::valid::{Capabilities, ValidationFlags, Validator};
use vlm_shaders::cpu::form_factor::LightGeometry;
use vlm_shaders::wgsl;

fn parse(source: &str) -> Result<naga::Module, String> {
    let module = naga::front::wgsl::parse_str(source).map_err(|error| error.emit_to_string(source))?;
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
    validator.validate(&module).map_err(|error| format!("{error:?}"))?;
    Ok(module)
}

#[test]
fn every_shader_validates() {
    for source in [wgsl::form_factor_cases(), wgsl::form_factor_sums()] {
        parse(&source).unwrap_or_else(|error| panic!("{error}"));
    }
    assert!(
        parse(&wgsl::form_factor_cases().replace("let cut_b", "let cut_d")).is_err(),
        "the check can fail"
    );
}

#[test]
fn no_built_in_inverse_trigonometry() {
    for name in ["acos(", "asin(", "atan(", "atan2("] {
        for source in [wgsl::form_factor_cases(), wgsl::form_factor_sums()] {
            assert!(!source.contains(name), "{name} errs by up to 4096 ulp in WGSL");
        }
    }
}

/// Names and offsets of a shader's `LightGeometry`, and its size.
fn layout(source: &str) -> (Vec<(String, usize)>, usize) {
    let module = parse(source).unwrap_or_else(|error| panic!("{error}"));
    let (_, light) =
        module.types.iter().find(|(_, t)| t.name.as_deref() == Some("LightGeometry")).expect("the struct");
    let naga::TypeInner::Struct { members, span } = &light.inner else { panic!("not a struct") };
    let member = |m: &naga::StructMember| (m.name.clone().unwrap_or_default(), m.offset as usize);
    (members.iter().map(member).collect(), *span as usize)
}

#[test]
fn light_geometry_has_the_layout_of_its_mirror() {
    macro_rules! offsets {
        ($($field:ident),*) => { vec![$((stringify!($field).to_owned(), offset_of!(LightGeometry, $field))),*] };
    }
    let expected = offsets!(
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
    assert_eq!(layout(&wgsl::form_factor_cases()), (expected, size_of::<LightGeometry>()));
}

#[test]
fn a_rename_a_swap_and_a_dropped_field_are_seen() {
    let source = "struct LightGeometry { v0: vec3f, scale: f32, base: vec3f, before: f32 }
        @group(0) @binding(0) var<uniform> light: LightGeometry;";
    let right = layout(source);
    for (from, to) in
        [("scale", "scales"), ("v0: vec3f, scale: f32", "scale: f32, v0: vec3f"), (", before: f32", "")]
    {
        assert_ne!(layout(&source.replace(from, to)), right, "{from} -> {to}");
    }
}
