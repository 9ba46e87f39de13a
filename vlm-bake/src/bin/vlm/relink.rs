//! `vlm relink`: attaches Virtual Light Meshes again that another tool dropped or renumbered.

use std::path::{Path, PathBuf};

use clap::Args;
use glam::Vec3;
use vlm_bake::bvh::Bvh;
use vlm_bake::scene::{LoadOptions, Scene, load};
use vlm_format::{
    Code, Donor, GltfFile, Issue, RelinkOptions, Relinked, Sample, WriteOptions, read_vlm_recovered, relink,
    write_vlm_with,
};

use crate::error::CliError;
use crate::geometry::prove;
use crate::input::{is_pipe, open};
use crate::output::{check_folder, deliver, print, target};

/// Flags of `vlm relink`.
#[derive(Args)]
pub struct RelinkArgs {
    /// glTF file (.glb or .gltf) that another tool wrote, or - for standard input (.glb)
    input: PathBuf,
    /// File to write (.glb or .gltf), or - for standard output (.glb)
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Where the Virtual Light Meshes are: the file as it was baked, or its sidecar [default: in the input itself, with renumbered accessors]
    #[arg(long, visible_alias = "sidecar", value_name = "BAKED|SIDECAR")]
    from: Option<PathBuf>,
    /// Also where geometry or colours of an object changed, if its lights and samples still lie behind and on its surface
    #[arg(long, requires = "from")]
    force: bool,
    /// Compress the lights and the grid, as `vlm bake --compress` does
    #[arg(long)]
    compress: bool,
}

/// Runs the command.
///
/// # Errors
/// If an object is gone, changed, moved or new; if the lights of a changed one are no longer behind its surface.
pub fn run(args: &RelinkArgs) -> Result<(), CliError> {
    let target = target(&args.output)?;
    check_folder(&args.output)?;
    let file = open(&args.input)?;
    let found = match &args.from {
        Some(from) => attach(&file, from, args.force)?,
        None => recover(&file)?,
    };
    let options = WriteOptions { compress: args.compress };
    deliver(&args.output, &write_vlm_with(&file, &found.asset, &target, &options)?)?;
    found.changed.iter().for_each(|path| {
        eprintln!("note: `{path}` changed since the bake; its lights still lie behind it, their colours are the old ones");
    });
    if is_pipe(&args.output) { Ok(()) } else { print(&lines(args, &found)) }
}

/// The Virtual Light Meshes of another file.
fn attach(file: &GltfFile, from: &Path, force: bool) -> Result<Relinked, CliError> {
    let donor = Donor::of(&open(from)?)?;
    let found = relink(file, &donor, &RelinkOptions { changed: force })?;
    if !found.changed.is_empty() {
        let scene = load(file, &LoadOptions::default())?;
        let proof = prove(&found.asset, &scene).map_err(|issue| CliError::check(file.name(), issue))?;
        if let Some(summary) = proof.summary(file.name()) {
            return Err(CliError::Check(summary));
        }
        samples_lie_on(&scene, &found).map_err(|issue| CliError::check(file.name(), issue))?;
    }
    Ok(found)
}

/// How far samples may lie from a surface that changed, as a share of their extent: more than quantisation to 14 bits moves it, and less than
/// anyone sees. Higher values attach lights to another shape.
const ON_SURFACE: f32 = 1e-3;

/// The proof sees lights that would light their surface. Whether there still is a surface for them, their samples tell.
fn samples_lie_on(scene: &Scene, found: &Relinked) -> Result<(), Issue> {
    let bvh = Bvh::new(&scene.positions, &scene.triangles);
    let changed = scene.objects.iter().filter(|object| found.changed.contains(&object.path));
    for object in changed {
        for vlm in found.asset.vlms.iter().filter(|vlm| vlm.node == object.node) {
            let starts = [vlm.lights[0], vlm.lights[0] + vlm.lights[1]]
                .map(|light| found.asset.sample_starts[light as usize] as usize);
            let samples = &found.asset.samples[starts[0]..starts[1]];
            let world = |sample: &Sample| object.world_from_node.transform_point3(sample.position.as_dvec3());
            let points: Vec<Vec3> = samples.iter().map(|sample| world(sample).as_vec3()).collect();
            let (least, most) = points
                .iter()
                .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(least, most), &p| (least.min(p), most.max(p)));
            let reach = ON_SURFACE * most.distance(least);
            let lost = points.iter().filter(|&&p| bvh.closest(p, reach, |_| true).is_none()).count();
            if lost > 0 {
                let message = format!(
                    "`{}` changed: {lost} of {} samples of its lights no longer lie on a surface",
                    object.path,
                    points.len()
                );
                return Err(Issue::error(Code::Stale, format!("/nodes/{}", object.node), message));
            }
        }
    }
    Ok(())
}

/// The Virtual Light Meshes of the file itself, wherever its arrays are now.
fn recover(file: &GltfFile) -> Result<Relinked, CliError> {
    let missing = || {
        let message = "the file has no Virtual Light Mesh; name the file that was baked with --from";
        CliError::from(Issue::error(Code::NoVlm, "/extensions", message).in_file(file.name()))
    };
    let lost = |error: vlm_format::Error| match error {
        vlm_format::Error::Stale { .. } => {
            CliError::Check(format!("{error}; or name the file that was baked, or its sidecar, with --from"))
        }
        other => other.into(),
    };
    let asset = read_vlm_recovered(file).map_err(lost)?.ok_or_else(missing)?;
    Ok(Relinked { asset, renamed: Vec::new(), changed: Vec::new() })
}

fn lines(args: &RelinkArgs, found: &Relinked) -> Vec<String> {
    let (lights, objects) = (found.asset.triangles.len(), found.asset.vlms.len());
    let mut lines =
        vec![format!("relinked  {}: {lights} lights of {objects} objects", args.output.display())];
    lines.extend(found.renamed.iter().map(|(old, new)| format!("renamed   `{old}` is now `{new}`")));
    lines
}
