//! Changes to binary data: numbers that are none, too large or equal to others; indices; single bits.

use serde_json::Value;

use super::Draw;

/// Single-precision numbers at which geometry breaks.
const FLOATS: [f32; 14] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::MIN_POSITIVE,
    1e-45,
    1e-20,
    1e10,
    1e30,
    f32::MAX,
    1e-4,
];

/// Bytes of a number.
const WORD: usize = 4;

/// Changes one thing.
pub fn change(bin: &mut Vec<u8>, json: &Value, draw: &mut Draw) {
    match draw.below(12) {
        0 if !bin.is_empty() => {
            let at = draw.below(bin.len());
            bin[at] ^= 1 << draw.below(8);
        }
        1 if draw.one_in(4) => bin.truncate(draw.below(bin.len() + 1)),
        0..4 => change_word(bin, draw),
        _ => change_element(bin, json, draw),
    }
}

/// Any number of four bytes.
fn change_word(bin: &mut [u8], draw: &mut Draw) {
    let at = WORD * draw.below(bin.len() / WORD);
    let Some(old) = word(bin, at) else { return };
    let new = new_float(f32::from_le_bytes(old), draw).to_le_bytes();
    put(bin, at, &new);
}

fn new_float(old: f32, draw: &mut Draw) -> f32 {
    match draw.below(6) {
        0 => -old,
        1 => old * 1.000_001,
        2 => old + (draw.below(2001) as f32 - 1000.0) * 1e-3,
        3 => old * [1e-3, 0.5, 2.0, 1e3][draw.below(4)],
        _ => draw.of(&FLOATS).copied().unwrap_or_default(),
    }
}

/// An element of an accessor, as a whole: another's value, or a change of one component.
fn change_element(bin: &mut [u8], json: &Value, draw: &mut Draw) {
    let Some(run) = run(json, draw) else { return };
    let (to, from) = (run.start(draw.below(run.count)), run.start(draw.below(run.count)));
    if run.component == WORD && !draw.one_in(3) {
        let at = to + WORD * draw.below(run.bytes / WORD);
        let Some(old) = word(bin, at) else { return };
        let new = if run.is_float {
            new_float(f32::from_le_bytes(old), draw).to_le_bytes()
        } else {
            (draw.below(run.count + 2) as u32).to_le_bytes()
        };
        return put(bin, at, &new);
    }
    if run.component < WORD && draw.one_in(2) {
        let new = (draw.below(40) as u16).to_le_bytes();
        return put(bin, to, &new[..run.component]);
    }
    if let Some(value) = bin.get(from..from + run.bytes).map(<[u8]>::to_vec) {
        put(bin, to, &value);
    }
}

/// The elements of an accessor within the data.
struct Run {
    first: usize,
    stride: usize,
    count: usize,
    /// Bytes of an element and of each of its components.
    bytes: usize,
    component: usize,
    is_float: bool,
}

impl Run {
    fn start(&self, element: usize) -> usize {
        self.first.saturating_add(self.stride.saturating_mul(element))
    }
}

/// The data of an accessor, as far as its properties make sense.
fn run(json: &Value, draw: &mut Draw) -> Option<Run> {
    let accessor = draw.of(json.get("accessors")?.as_array()?)?;
    let number = |value: &Value, key: &str| {
        value.get(key).and_then(Value::as_u64).and_then(|number| usize::try_from(number).ok())
    };
    let view = json.get("bufferViews")?.get(number(accessor, "bufferView")?)?;
    let component = match number(accessor, "componentType")? {
        5120 | 5121 => 1,
        5122 | 5123 => 2,
        _ => WORD,
    };
    let components = match accessor.get("type")?.as_str()? {
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" => 4,
        "MAT4" => 16,
        _ => 1,
    };
    let offset = |value| number(value, "byteOffset").unwrap_or_default();
    Some(Run {
        first: offset(view).saturating_add(offset(accessor)),
        stride: number(view, "byteStride").unwrap_or(components * component),
        count: number(accessor, "count")?,
        bytes: components * component,
        component,
        is_float: number(accessor, "componentType") == Some(5126),
    })
}

fn word(bin: &[u8], at: usize) -> Option<[u8; WORD]> {
    bin.get(at..at.checked_add(WORD)?)?.try_into().ok()
}

fn put(bin: &mut [u8], at: usize, bytes: &[u8]) {
    if let Some(place) = at.checked_add(bytes.len()).and_then(|end| bin.get_mut(at..end)) {
        place.copy_from_slice(bytes);
    }
}
