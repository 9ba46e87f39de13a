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

#[test]
fn light_geometry_has_the_layout_of_its_mirror() {
    let module = parse(&wgsl::form_factor_cases()).unwrap_or_else(|error| panic!("{error}"));
    let (_, light) = module.types.iter().find(|(_, t)| t.name.as_deref() == Some("LightGeometry")).unwrap();
    let naga::TypeInner::Struct { members, span } = &light.inner else { panic!("not a struct") };
    let found: Vec<_> =
        members.iter().map(|m| (m.name.as_deref().unwrap_or(""), m.offset as usize)).collect();
    macro_rules! offsets {
        ($($field:ident),*) => { [$((stringify!($field), offset_of!(LightGeometry, $field))),*] };
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
    assert_eq!(found, expected);
    assert_eq!(*span as usize, size_of::<LightGeometry>());
}
