//! `vlm inspect`: what is in a file's Virtual Light Meshes.

use std::collections::BTreeSet;
use std::path::PathBuf;

use clap::Args;
use glam::Vec3;
use schemars::JsonSchema;
use serde::Serialize;
use vlm_bake::grid_content::GridContent;
use vlm_format::{GltfFile, Settings, VlmAsset, read_vlm_unchecked};

use crate::error::CliError;
use crate::input::open;
use crate::inspect_bytes::Bytes;
use crate::inspect_grid::lines as grid_lines;
use crate::output::{print, print_json};

/// Flags of `vlm inspect`.
#[derive(Args)]
pub struct InspectArgs {
    /// glTF file (.glb or .gltf), or - for standard input (.glb)
    file: PathBuf,
    /// Report as JSON
    #[arg(long)]
    json: bool,
}

/// The content of an asset in numbers.
#[derive(Serialize, JsonSchema)]
pub struct Content {
    file: String,
    generator: String,
    #[schemars(with = "SettingsShape")]
    settings: Settings,
    vlms: Vec<VlmContent>,
    lights: usize,
    emitting_lights: usize,
    tagged_lights: usize,
    vertices: usize,
    samples: usize,
    /// Distinct tags of lights.
    tags: BTreeSet<u32>,
    /// Visible primitives that carry a tag as wholes.
    tagged_primitives: usize,
    /// Triangles with a tag of their own.
    tagged_triangles: usize,
    /// Primitives to which those triangles belong.
    partly_tagged_primitives: usize,
    /// Visible nodes that carry a tag as wholes.
    tagged_nodes: usize,
    /// What each part costs.
    bytes: Bytes,
    grid: Option<GridContent>,
}

#[derive(Serialize, JsonSchema)]
struct VlmContent {
    id: String,
    node: u32,
    lights: u32,
    vertices: u32,
    authored: bool,
}

/// The shape of [`Settings`], whose crate knows no schemas: games link it.
#[derive(JsonSchema)]
#[schemars(rename = "Settings", rename_all = "camelCase")]
#[expect(dead_code, reason = "only its schema is used")]
struct SettingsShape {
    preset: String,
    lights: u32,
    cell_size: f32,
    probes: u32,
    rays: u32,
    near: u32,
    samples: u32,
}

/// Runs the command. Stale files may be looked into; that is what `vlm check` is for.
///
/// # Errors
/// If the file cannot be read, or has no Virtual Light Mesh.
pub fn run(args: &InspectArgs) -> Result<(), CliError> {
    let file = open(&args.file)?;
    let Some(asset) = read_vlm_unchecked(&file)? else {
        return Err(CliError::check(
            file.name(),
            "/extensions: the file has no Virtual Light Mesh; bake it first",
        ));
    };
    let content = Content::of(&file, &asset);
    if args.json { print_json(&content) } else { print(&content.lines()) }
}

impl Content {
    fn of(file: &GltfFile, asset: &VlmAsset) -> Self {
        let tags = asset.tags.iter().copied().filter(|&tag| tag != 0);
        Self {
            file: file.name().to_owned(),
            generator: asset.generator.clone(),
            settings: asset.settings.clone(),
            vlms: asset.vlms.iter().map(VlmContent::of).collect(),
            lights: asset.triangles.len(),
            emitting_lights: asset.emission.iter().filter(|&&e| e != Vec3::ZERO).count(),
            tagged_lights: tags.clone().count(),
            vertices: asset.positions.len(),
            samples: asset.samples.len(),
            tags: tags.collect(),
            tagged_primitives: asset.primitive_tags.len(),
            tagged_triangles: asset
                .triangle_tags
                .iter()
                .flat_map(|t| &t.tags)
                .filter(|&&tag| tag != 0)
                .count(),
            partly_tagged_primitives: asset.triangle_tags.len(),
            tagged_nodes: asset.node_tags.len(),
            bytes: Bytes::of(file, asset),
            grid: asset.grid.as_ref().map(|grid| GridContent::of(grid).stored_in(file)),
        }
    }

    fn lines(&self) -> Vec<String> {
        let s = &self.settings;
        let mut lines = vec![
            format!("file      {}", self.file),
            format!("made by   {}, preset {}, {} lights asked", self.generator, s.preset, s.lights),
            format!(
                "lights    {} ({} emit, {} tagged), {} vertices, {} samples",
                self.lights, self.emitting_lights, self.tagged_lights, self.vertices, self.samples
            ),
            format!(
                "tags      {} of lights; tagged {} nodes, {} primitives, {} triangles of {} more primitives",
                self.tags.len(),
                self.tagged_nodes,
                self.tagged_primitives,
                self.tagged_triangles,
                self.partly_tagged_primitives
            ),
        ];
        lines.extend(self.bytes.lines());
        lines.extend(self.vlms.iter().map(VlmContent::line));
        lines.extend(self.grid.as_ref().map_or_else(|| vec!["grid      none".to_owned()], grid_lines));
        lines
    }
}

impl VlmContent {
    fn of(vlm: &vlm_format::Vlm) -> Self {
        Self {
            id: vlm.id.clone(),
            node: vlm.node,
            lights: vlm.lights[1],
            vertices: vlm.vertices[1],
            authored: vlm.authored,
        }
    }

    fn line(&self) -> String {
        let origin = if self.authored { "authored" } else { "derived" };
        format!("vlm       {} (node {}): {} lights, {origin}", self.id, self.node, self.lights)
    }
}
