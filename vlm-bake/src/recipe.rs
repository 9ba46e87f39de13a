//! All that decides which bytes a bake writes: two bakes with the same recipe make the same files.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::references::references;
use crate::settings::BakeSettings;
use crate::write::GENERATOR;

/// What goes into a bake.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Recipe {
    /// The tool, its version, and a number that changes with its sources.
    pub tool: String,
    /// The wishes, as `key` and `value`.
    pub settings: Vec<(String, String)>,
    /// Container of the output, and its name where files beside it are named for it.
    pub output: String,
    /// BLAKE3 of the glTF file.
    pub source: String,
    /// BLAKE3 of the files beside it that it refers to, by their paths relative to it; `None` for those that are missing.
    pub files: BTreeMap<String, Option<String>>,
}

impl Recipe {
    /// What a bake of `input` to `output` takes. Files that cannot be read count as missing: what that means is for the bake to say.
    ///
    /// # Errors
    /// If the glTF file itself cannot be read.
    pub fn of(input: &Path, output: &Path, settings: &BakeSettings) -> io::Result<Self> {
        let wishes = BakeSettings { skip: None, ..*settings };
        let mut recipe = Self {
            tool: format!("{GENERATOR} ({}, {})", env!("VLM_BUILD"), std::env::consts::ARCH),
            settings: wishes.wishes(),
            output: container(output),
            source: hash(input)?,
            files: BTreeMap::new(),
        };
        let folder = input.parent().unwrap_or(Path::new(""));
        for file in references(input).iter().skip(1) {
            let relative = file.strip_prefix(folder).unwrap_or(file).display().to_string();
            recipe.files.insert(relative, hash(file).ok());
        }
        Ok(recipe)
    }

    /// A name for what it makes: 64 hexadecimal digits.
    #[must_use]
    pub fn key(&self) -> String {
        // A struct of strings cannot fail to be JSON.
        let json = serde_json::to_vec(self).unwrap_or_default();
        blake3::hash(&json).to_hex().to_string()
    }

    /// What changed since another, for people to read. Empty if nothing did.
    #[must_use]
    pub fn changes_since(&self, before: &Self) -> Vec<String> {
        let mut changes = Vec::new();
        if self.source != before.source {
            changes.push("the file changed".to_owned());
        }
        let files = |a: &Self, b: &Self| -> Vec<String> {
            a.files
                .iter()
                .filter(|(name, hash)| b.files.get(*name) != Some(hash))
                .map(|(n, _)| n.clone())
                .collect()
        };
        let mut changed = files(self, before);
        changed.extend(files(before, self));
        changed.sort();
        changed.dedup();
        changes.extend(changed.iter().map(|name| format!("{name} changed")));
        if self.settings != before.settings || self.output != before.output {
            let shown = |recipe: &Self| match recipe.settings.as_slice() {
                [] => "none".to_owned(),
                some => some.iter().map(|(k, v)| format!("{k} {v}")).collect::<Vec<_>>().join(", "),
            };
            changes.push(format!("the options changed from {} to {}", shown(before), shown(self)));
        }
        if self.tool != before.tool {
            changes.push("vlm itself changed".to_owned());
        }
        changes
    }
}

/// Files beside a .gltf are named for it; a .glb has its name nowhere in it.
fn container(output: &Path) -> String {
    let is_glb = output.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("glb"));
    let name = output.file_name().unwrap_or_default().to_string_lossy();
    if is_glb { "glb".to_owned() } else { name.into_owned() }
}

/// BLAKE3 of a regular file: anything else might never end.
fn hash(path: &Path) -> io::Result<String> {
    if !fs::metadata(path)?.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "not a regular file"));
    }
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(fs::File::open(path)?)?;
    Ok(hasher.finalize().to_hex().to_string())
}
