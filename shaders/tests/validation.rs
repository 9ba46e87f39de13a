//! Every shader parses, validates and keeps within WebGPU's default limits, without a GPU.

use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use vlm_shaders::wgsl::{self, Gathering};

/// Storage buffers per stage by WebGPU's default limits.
const MOST_STORAGE_BUFFERS: usize = 8;

fn parse(source: &str) -> Result<(naga::Module, ModuleInfo), String> {
    let module = naga::front::wgsl::parse_str(source).map_err(|error| error.emit_to_string(source))?;
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
    let info = validator.validate(&module).map_err(|error| format!("{error:?}"))?;
    Ok((module, info))
}

#[test]
fn every_shader_validates() {
    for (name, source) in wgsl::all() {
        parse(&source).unwrap_or_else(|error| panic!("{name}: {error}"));
    }
    for gathering in Gathering::ALL {
        parse(&gathering.deferred(false, true)).unwrap_or_else(|error| panic!("{gathering:?}: {error}"));
        let forward = gathering.forward(2);
        assert!(!forward.contains("@group(0)") && !forward.contains("@group(1)"));
        parse(&forward).unwrap_or_else(|error| panic!("{gathering:?}: {error}"));
    }
    assert!(
        parse(&wgsl::form_factor_cases().replace("let cut_b", "let cut_d")).is_err(),
        "the check can fail"
    );
}

#[test]
fn no_built_in_inverse_trigonometry() {
    for name in ["acos(", "asin(", "atan(", "atan2("] {
        for (shader, source) in wgsl::all() {
            assert!(!source.contains(name), "{shader}: {name} errs by up to 4096 ulp in WGSL");
        }
    }
}

/// The storage buffers that the only entry point of a shader uses, as group and binding.
fn storage_buffers(source: &str) -> Vec<(u32, u32)> {
    let (module, info) = parse(source).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(module.entry_points.len(), 1);
    let used = info.get_entry_point(0);
    let buffer = |(handle, variable): (naga::Handle<naga::GlobalVariable>, &naga::GlobalVariable)| {
        let is_used = !used[handle].is_empty();
        let is_storage = matches!(variable.space, naga::AddressSpace::Storage { .. });
        let place = variable.binding.filter(|_| is_used && is_storage)?;
        Some((place.group, place.binding))
    };
    module.global_variables.iter().filter_map(buffer).collect()
}

#[test]
fn passes_keep_within_the_default_limits() {
    for (name, source) in wgsl::all() {
        let mut buffers = storage_buffers(&source);
        assert!(buffers.len() <= MOST_STORAGE_BUFFERS, "{name}: {buffers:?}");
        assert!(buffers.len() > 1 && buffers.iter().all(|(group, _)| *group < 4), "{name}: {buffers:?}");
        buffers.sort_unstable();
        buffers.dedup();
        assert_eq!(buffers.len(), storage_buffers(&source).len(), "{name}: one binding, one buffer");
    }
    let one_more = wgsl::refresh()
        .replace("irradiance * (row_scale", "f32(more[0]) * irradiance * (row_scale")
        + "@group(2) @binding(0) var<storage, read> more: array<u32>;";
    assert_eq!(storage_buffers(&one_more).len(), 9, "the check can fail");
}
