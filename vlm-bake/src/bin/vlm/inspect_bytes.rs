//! What each part of the Virtual Light Meshes costs, in the file and in memory.

use schemars::JsonSchema;
use serde::Serialize;
use vlm_format::{GltfFile, VlmAsset};

/// The arrays of the lights and of the samples, by their names in the file.
const LIGHTS: [&str; 5] = ["positions", "indices", "albedo", "emission", "tags"];
const SAMPLES: [&str; 4] = ["starts", "positions", "normals", "reflectance"];

/// Bytes of all parts.
#[derive(Serialize, JsonSchema)]
pub struct Bytes {
    /// Of the file and the buffers beside it.
    file: u64,
    /// Of the Virtual Light Meshes in it.
    stored: u64,
    /// Of the Virtual Light Meshes in memory.
    memory: u64,
    /// `stored` over `file`.
    share: f64,
    parts: Vec<Part>,
}

/// Bytes of one part.
#[derive(Serialize, JsonSchema)]
struct Part {
    part: &'static str,
    /// In memory; 0 for JSON.
    memory: u64,
    /// In the file: less where it is compressed, a third more in a data URI.
    stored: u64,
    /// `stored` over the file.
    share: f64,
}

impl Bytes {
    /// Of an asset and the file that it was read from.
    pub fn of(file: &GltfFile, asset: &VlmAsset) -> Self {
        let arrays = |group: &str, names: &[&str]| -> u64 {
            names.iter().map(|name| file.stored_vlm_bytes(&format!("{group}/{name}"))).sum()
        };
        let grid = asset.grid.as_ref();
        let grid_names: Vec<&str> =
            grid.map(|grid| grid.sizes().map(|(name, _)| name).to_vec()).unwrap_or_default();
        let parts = [
            ("lights", light_bytes(asset), arrays("lights", &LIGHTS)),
            ("samples", sample_bytes(asset), arrays("samples", &SAMPLES)),
            ("tags", tag_bytes(asset), file.stored_triangle_tag_bytes()),
            ("grid", grid.map_or(0, |grid| grid.byte_len()), arrays("grid", &grid_names)),
        ];
        let total = file.total_bytes();
        let part =
            |part, memory, stored| Part { part, memory, stored, share: stored as f64 / total.max(1) as f64 };
        let base64 = |bytes: u64| if file.has_embedded_vlm() { (4 * bytes).div_ceil(3) } else { bytes };
        let mut parts: Vec<Part> =
            parts.map(|(name, memory, stored)| part(name, memory as u64, base64(stored))).into();
        parts.push(part("json", 0, file.vlm_json_bytes()));
        let stored: u64 = parts.iter().map(|part| part.stored).sum();
        let memory = parts.iter().map(|part| part.memory).sum();
        Self { file: total, stored, memory, share: stored as f64 / total.max(1) as f64, parts }
    }

    /// The part of the report that a person reads.
    pub fn lines(&self) -> Vec<String> {
        let kilobytes = |bytes: u64| bytes as f64 / 1e3;
        let mut lines = vec![format!(
            "size      {:.1} kB of the file's {:.1} kB ({:.1} %), {:.1} kB in memory",
            kilobytes(self.stored),
            kilobytes(self.file),
            100.0 * self.share,
            kilobytes(self.memory)
        )];
        lines.extend(self.parts.iter().map(|part| {
            format!(
                "part      {:<15} {:>9.1} kB, {:>9.1} kB in the file ({:.1} %)",
                part.part,
                kilobytes(part.memory),
                kilobytes(part.stored),
                100.0 * part.share
            )
        }));
        lines
    }
}

fn light_bytes(asset: &VlmAsset) -> usize {
    size_of_val(&*asset.positions)
        + size_of_val(&*asset.triangles)
        + size_of_val(&*asset.albedo)
        + size_of_val(&*asset.emission)
        + size_of_val(&*asset.tags)
}

fn sample_bytes(asset: &VlmAsset) -> usize {
    size_of_val(&*asset.sample_starts) + size_of_val(&*asset.samples)
}

/// Of tags by triangle: those of nodes and primitives stand in the JSON.
fn tag_bytes(asset: &VlmAsset) -> usize {
    asset.triangle_tags.iter().map(|entry| size_of_val(&*entry.tags)).sum()
}
