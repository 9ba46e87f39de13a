//! What a batch bakes: files, the glTF files below folders, and those that globs match.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

use globset::GlobBuilder;
use walkdir::{DirEntry, WalkDir};

/// A file, and where its output goes below the output folder.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Input {
    /// As it was named or found.
    pub path: PathBuf,
    /// Mirrors the tree below the folder, or below the part of the glob before its first wildcard.
    pub relative: PathBuf,
}

/// Why the inputs cannot be found.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InputsError {
    /// Nothing is there.
    #[error("{}: there is no such file or folder; check the path", path.display())]
    Missing {
        /// As it was named.
        path: PathBuf,
    },
    /// A glob that is none.
    #[error("{}: {message}", glob.display())]
    Glob {
        /// As it was written.
        glob: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// Nothing to bake.
    #[error("{}: no .glb or .gltf file is there; name another folder or glob", path.display())]
    Nothing {
        /// As it was named.
        path: PathBuf,
    },
    /// Two inputs would write one output.
    #[error(
        "{} and {} would both be written to {}; bake them in separate runs or to separate folders",
        first.display(), second.display(), relative.display()
    )]
    Clash {
        /// One input.
        first: PathBuf,
        /// The other.
        second: PathBuf,
        /// Their output below the output folder.
        relative: PathBuf,
    },
}

/// The inputs that these names mean, ascending by output. Folders called `.something` and those in `except` are not entered.
///
/// # Errors
/// [`InputsError`] if a name means nothing, or two inputs have one output.
pub fn inputs(names: &[PathBuf], except: &[&Path]) -> Result<Vec<Input>, InputsError> {
    let mut found: BTreeMap<PathBuf, PathBuf> = BTreeMap::new();
    for name in names {
        let some = named(name, except)?;
        if some.is_empty() {
            return Err(InputsError::Nothing { path: name.clone() });
        }
        for Input { path, relative } in some {
            match found.get(&relative) {
                Some(first) if !same_file(first, &path) => {
                    return Err(InputsError::Clash { first: first.clone(), second: path, relative });
                }
                _ => found.insert(relative, path),
            };
        }
    }
    Ok(found.into_iter().map(|(relative, path)| Input { path, relative }).collect())
}

fn named(name: &Path, except: &[&Path]) -> Result<Vec<Input>, InputsError> {
    if name.is_dir() {
        return Ok(below(name, except, |_| true));
    }
    if name.is_file() {
        let relative = PathBuf::from(name.file_name().unwrap_or_default());
        return Ok(vec![Input { path: name.to_owned(), relative }]);
    }
    if !is_glob(name) {
        return Err(InputsError::Missing { path: name.to_owned() });
    }
    let broken =
        |error: globset::Error| InputsError::Glob { glob: name.to_owned(), message: error.to_string() };
    let glob = GlobBuilder::new(&name.to_string_lossy()).literal_separator(true).build().map_err(broken)?;
    let matcher = glob.compile_matcher();
    Ok(below(&before_wildcards(name), except, |path| matcher.is_match(path)))
}

/// True for a name with wildcards.
fn is_glob(name: &Path) -> bool {
    name.to_string_lossy().contains(['*', '?', '[', '{'])
}

/// The folders of a glob before its first wildcard.
fn before_wildcards(glob: &Path) -> PathBuf {
    let plain: PathBuf = glob.components().take_while(|part| !is_glob(part.as_ref())).collect();
    if plain.as_os_str().is_empty() { PathBuf::from(".") } else { plain }
}

/// The glTF files below a folder that are wanted, ascending.
fn below(folder: &Path, except: &[&Path], wanted: impl Fn(&Path) -> bool) -> Vec<Input> {
    let except: Vec<PathBuf> = except.iter().map(|path| (*path).to_owned()).collect();
    let files = walk(folder, &except).filter(|entry| entry.file_type().is_file());
    let input = |entry: DirEntry| {
        let path = if folder == Path::new(".") { without_dot(entry.path()) } else { entry.path().to_owned() };
        let relative = entry.path().strip_prefix(folder).ok()?.to_owned();
        (is_gltf(&path) && wanted(&path)).then_some(Input { path, relative })
    };
    files.filter_map(input).collect()
}

/// Everything below a folder, itself first, but for what is hidden, and the folders in `except`.
pub(crate) fn walk(folder: &Path, except: &[PathBuf]) -> impl Iterator<Item = DirEntry> + use<> {
    let except: Vec<PathBuf> = except.iter().filter_map(|path| path.canonicalize().ok()).collect();
    let enters = move |entry: &DirEntry| {
        let is_hidden = entry.depth() > 0 && entry.file_name().as_encoded_bytes().starts_with(b".");
        let is_except = !except.is_empty()
            && entry.file_type().is_dir()
            && entry.path().canonicalize().is_ok_and(|path| except.contains(&path));
        !is_hidden && !is_except
    };
    let entries = WalkDir::new(folder).follow_links(true).sort_by_file_name().into_iter();
    entries.filter_entry(enters).flatten()
}

fn without_dot(path: &Path) -> PathBuf {
    path.components().filter(|part| *part != Component::CurDir).collect()
}

/// True for the names of glTF files.
#[must_use]
pub fn is_gltf(path: &Path) -> bool {
    let extension = path.extension().and_then(|extension| extension.to_str());
    extension.is_some_and(|e| e.eq_ignore_ascii_case("glb") || e.eq_ignore_ascii_case("gltf"))
}

/// True if both names lead to one file.
#[must_use]
pub fn same_file(a: &Path, b: &Path) -> bool {
    a == b || a.canonicalize().is_ok_and(|a| b.canonicalize().is_ok_and(|b| a == b))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn tree() -> tempfile::TempDir {
        let tree = tempfile::tempdir().unwrap();
        for file in
            ["a.glb", "in/b.gltf", "in/b.bin", "in/deep/C.GLB", ".git/d.glb", "out/e.glb", "in/.f.glb"]
        {
            let path = tree.path().join(file);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, "").unwrap();
        }
        tree
    }

    fn relative(names: &[PathBuf], except: &[&Path]) -> Vec<String> {
        let inputs = inputs(names, except).unwrap();
        inputs.into_iter().map(|input| input.relative.display().to_string()).collect()
    }

    #[test]
    fn folders_are_mirrored_but_for_what_is_hidden_or_output() {
        let tree = tree();
        let out = tree.path().join("out");
        let found = relative(&[tree.path().to_owned()], &[&out]);
        assert_eq!(found, ["a.glb", "in/b.gltf", "in/deep/C.GLB"]);
    }

    #[test]
    fn globs_mirror_what_lies_below_their_first_wildcard() {
        let tree = tree();
        assert_eq!(relative(&[tree.path().join("in/**/*.{glb,GLB}")], &[]), ["deep/C.GLB"]);
        assert_eq!(relative(&[tree.path().join("*/*.g*")], &[]), ["in/b.gltf", "out/e.glb"]);
        assert_eq!(
            relative(&[tree.path().join("a.glb"), tree.path().join("in")], &[]),
            ["a.glb", "b.gltf", "deep/C.GLB"]
        );
    }

    #[test]
    fn what_means_nothing_or_clashes_is_refused() {
        let tree = tree();
        let path = |name: &str| tree.path().join(name);
        assert_eq!(inputs(&[path("x.glb")], &[]), Err(InputsError::Missing { path: path("x.glb") }));
        assert_eq!(inputs(&[path("x/*.glb")], &[]), Err(InputsError::Nothing { path: path("x/*.glb") }));
        assert!(matches!(inputs(&[path("[")], &[]), Err(InputsError::Glob { .. })));
        fs::copy(path("a.glb"), path("in/a.glb")).unwrap();
        let clash = inputs(&[path("a.glb"), path("in")], &[]);
        assert!(matches!(clash, Err(InputsError::Clash { .. })), "{clash:?}");
        assert_eq!(relative(&[path("a.glb"), path("a.glb")], &[]), ["a.glb"]);
    }
}
