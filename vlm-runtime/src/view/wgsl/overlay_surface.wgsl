// What the grid and the tags say of the surface, over the picture. After shared/grid.wgsl and shared/view.wgsl.

struct Settings {
    view: View,
    // Where the picture begins in the target, pixels.
    origin: vec2f,
    // 0: tags, 1: cells.
    shows_cells: u32,
    // The largest number of near lights of a leaf.
    most: f32,
}

@group(1) @binding(0) var<uniform> settings: Settings;
@group(1) @binding(1) var depths: texture_2d<f32>;
@group(1) @binding(2) var tags: texture_2d<u32>;
// Near lights of all probes of each leaf.
@group(1) @binding(3) var<storage, read> counts: array<u32>;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(index % 2u) * 4.0 - 1.0, f32(index / 2u) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn fragment(@builtin(position) place: vec4f) -> @location(0) vec4f {
    let pixel = vec2u(place.xy - settings.origin);
    let depth = textureLoad(depths, pixel, 0).r;
    if depth == settings.view.empty_depth {
        discard;
    }
    if settings.shows_cells == 0u {
        return of_tag(textureLoad(tags, pixel, 0).r);
    }
    return of_leaf(leaf_at(position_at(settings.view, pixel, textureDimensions(depths), depth)));
}

fn of_tag(tag: u32) -> vec4f {
    if tag == 0u {
        discard;
    }
    return vec4f(hue(tag), 0.6);
}

// From blue (few) over green and yellow to red (most); black where nothing is stored. Neighbours differ a little, so that cells show.
fn of_leaf(leaf: u32) -> vec4f {
    if leaf == NO_LEAF || leaf >= arrayLength(&counts) {
        return vec4f(0.0, 0.0, 0.0, 0.6);
    }
    let share = f32(counts[leaf]) / max(settings.most, 1.0);
    let ramp = clamp(vec3f(3.0 * share - 1.0, 2.0 - abs(4.0 * share - 2.0), 1.5 - 3.0 * share), vec3f(0.0), vec3f(1.0));
    let shade = 0.75 + 0.25 * f32(scramble(leaf) & 0xffu) / 255.0;
    return vec4f(ramp * shade, 0.6);
}

// Mirror: `tag_color` in overlay.rs.
fn hue(tag: u32) -> vec3f {
    let bits = scramble(tag);
    let color = vec3f(vec3u(bits, bits >> 8u, bits >> 16u) & vec3u(0xffu)) / 255.0;
    return 0.25 + 0.75 * color;
}

fn scramble(number: u32) -> u32 {
    var bits = number * 0x9e3779b1u;
    bits = (bits ^ (bits >> 15u)) * 0x85ebca77u;
    return bits ^ (bits >> 13u);
}
