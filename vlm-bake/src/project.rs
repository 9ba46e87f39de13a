//! `vlm.toml`: what a project asks of its bakes, for the whole tree and by glob.
//!
//! ```toml
//! preset = "game"
//!
//! [[files]]
//! glob = "props/**"
//! preset = "draft"
//! lights = 200
//!
//! [cache]
//! dir = ".vlm-cache"
//! size = "2 GiB"
//! ```

use std::fs;
use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};

use bytesize::ByteSize;
use globset::{GlobBuilder, GlobMatcher};
use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeTable, DeValue, ValueDeserializer};

use crate::settings::BakeSettings;

/// Name of the file.
pub const FILE_NAME: &str = "vlm.toml";

/// Names at most this unlike (0 to 1, Jaro-Winkler) what was written are suggested.
const LIKENESS: f64 = 0.75;

/// A project's file.
#[derive(Clone, Debug, Default)]
pub struct Project {
    /// The file, as an absolute path.
    pub path: PathBuf,
    /// Where the file lies; its globs and folders are relative to it.
    pub folder: PathBuf,
    /// Where bakes are kept.
    pub cache: CacheSettings,
    /// For all files.
    settings: BakeSettings,
    /// For some; later ones win.
    rules: Vec<(GlobMatcher, BakeSettings)>,
}

/// Where bakes are kept, and how many.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CacheSettings {
    /// The folder. Relative to the project's file.
    pub dir: Option<PathBuf>,
    /// Most bytes; those not used for longest go first.
    pub size: Option<ByteSize>,
}

/// Why a project's file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ProjectError {
    /// It cannot be read.
    #[error("{}: cannot be read: {source}; check the path and its permissions", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The operating system's answer.
        source: io::Error,
    },
    /// It does not say what such a file may say.
    #[error("{}:{line}:{column}: {message}", path.display())]
    Wrong {
        /// The file.
        path: PathBuf,
        /// From 1.
        line: usize,
        /// From 1.
        column: usize,
        /// What is wrong, and what to do.
        message: String,
    },
}

impl Project {
    /// The project's file of a folder: there, or in the nearest folder above it.
    #[must_use]
    pub fn find(folder: &Path) -> Option<PathBuf> {
        let folder = std::path::absolute(folder).ok()?;
        folder.ancestors().map(|folder| folder.join(FILE_NAME)).find(|path| path.is_file())
    }

    /// Reads a project's file.
    ///
    /// # Errors
    /// [`ProjectError`] names the place and what is wrong there: an unknown key is an error.
    pub fn read(path: &Path) -> Result<Self, ProjectError> {
        let io = |source| ProjectError::Io { path: path.to_owned(), source };
        let text = fs::read_to_string(path).map_err(io)?;
        let path = std::path::absolute(path).map_err(io)?;
        Self::parse(&text, &path)
    }

    fn parse(text: &str, path: &Path) -> Result<Self, ProjectError> {
        let source = Source { text, path };
        let mut table = DeTable::parse(text).map_err(|error| source.refuse(&error))?.into_inner();
        let cache = table.remove("cache").map(|cache| source.read(cache)).transpose()?;
        let rules = table.remove("files").map(|files| source.rules(files)).transpose()?;
        Ok(Self {
            path: path.to_owned(),
            folder: path.parent().unwrap_or(Path::new("")).to_owned(),
            cache: cache.unwrap_or_default(),
            settings: source.settings(Spanned::new(0..text.len(), table), ", `files`, `cache`")?,
            rules: rules.unwrap_or_default(),
        })
    }

    /// What the project asks of a file: the rules that match it, later ones first, then what holds for all.
    #[must_use]
    pub fn settings_of(&self, file: &Path) -> BakeSettings {
        let file = std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
        let relative = file.strip_prefix(&self.folder).unwrap_or(&file);
        let matching = self.rules.iter().filter(|(glob, _)| glob.is_match(relative));
        matching.fold(self.settings, |settings, (_, rule)| rule.over(settings))
    }

    /// The folder of the cache, if the project names one.
    #[must_use]
    pub fn cache_folder(&self) -> Option<PathBuf> {
        self.cache.dir.as_ref().map(|dir| self.folder.join(dir))
    }
}

/// The file's text, for messages.
struct Source<'a> {
    text: &'a str,
    path: &'a Path,
}

impl Source<'_> {
    fn read<T: for<'de> Deserialize<'de>>(&self, value: Spanned<DeValue>) -> Result<T, ProjectError> {
        self.read_beside(value, "")
    }

    /// Reads a value; `beside` are the names that may stand beside its own.
    fn read_beside<T: for<'de> Deserialize<'de>>(
        &self,
        value: Spanned<DeValue>,
        beside: &str,
    ) -> Result<T, ProjectError> {
        let span = value.span();
        let refuse = |error: toml::de::Error| {
            let message = error.message();
            let beside = if message.starts_with("unknown field") { beside } else { "" };
            self.wrong(&error.span().unwrap_or(span.clone()), advise(&format!("{message}{beside}")))
        };
        T::deserialize(ValueDeserializer::from(value)).map_err(refuse)
    }

    fn settings(&self, table: Spanned<DeTable>, beside: &str) -> Result<BakeSettings, ProjectError> {
        let keys: Vec<_> = table.as_ref().keys().map(|key| (key.as_ref().to_string(), key.span())).collect();
        let span = table.span();
        let table = Spanned::new(span.clone(), DeValue::Table(table.into_inner()));
        let settings: BakeSettings = self.read_beside(table, beside)?;
        settings.check().map_err(|error| {
            let key = keys.iter().find(|(key, _)| key == error.key);
            self.wrong(key.map_or(&span, |(_, span)| span), error.to_string())
        })?;
        Ok(settings)
    }

    fn rules(&self, files: Spanned<DeValue>) -> Result<Vec<(GlobMatcher, BakeSettings)>, ProjectError> {
        let span = files.span();
        let DeValue::Array(files) = files.into_inner() else {
            return Err(self.wrong(&span, "`files` is a list of tables: write `[[files]]`".to_owned()));
        };
        files.into_iter().map(|rule| self.rule(rule)).collect()
    }

    fn rule(&self, rule: Spanned<DeValue>) -> Result<(GlobMatcher, BakeSettings), ProjectError> {
        let span = rule.span();
        let DeValue::Table(mut table) = rule.into_inner() else {
            return Err(self.wrong(&span, "`files` is a list of tables: write `[[files]]`".to_owned()));
        };
        let Some(glob) = table.remove("glob") else {
            return Err(self.wrong(&span, "`glob` is missing: say to which files this applies".to_owned()));
        };
        let place = glob.span();
        let glob: String = self.read(glob)?;
        let glob = GlobBuilder::new(&glob).literal_separator(true).build();
        let glob = glob.map_err(|error| self.wrong(&place, error.to_string()))?;
        Ok((glob.compile_matcher(), self.settings(Spanned::new(span, table), ", `glob`")?))
    }

    fn refuse(&self, error: &toml::de::Error) -> ProjectError {
        self.wrong(&error.span().unwrap_or(0..0), advise(error.message()))
    }

    fn wrong(&self, span: &Range<usize>, message: String) -> ProjectError {
        let before = self.text.get(..span.start).unwrap_or_default();
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
        ProjectError::Wrong { path: self.path.to_owned(), line, column, message }
    }
}

/// Adds what may have been meant to a message about an unknown name: "unknown field `x`, expected one of `y`, `z`".
fn advise(message: &str) -> String {
    let mut names = message.split('`').skip(1).step_by(2);
    let (true, Some(written)) = (message.starts_with("unknown"), names.next()) else {
        return message.to_owned();
    };
    let likeness = |name: &&str| strsim::jaro_winkler(written, name);
    let likest = names.max_by(|a, b| likeness(a).total_cmp(&likeness(b)));
    match likest.filter(|name| likeness(name) >= LIKENESS) {
        Some(name) => format!("{message}; did you mean `{name}`?"),
        None => message.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::Preset;

    fn parse(text: &str) -> Result<Project, ProjectError> {
        Project::parse(text, Path::new("/project/vlm.toml"))
    }

    #[test]
    fn later_rules_win_where_they_match() {
        let project = parse(
            "preset = 'draft'\nlights = 10\n[[files]]\nglob = 'props/*'\nlights = 20\n[[files]]\nglob = '**/big.glb'\n\
             probes = 0\nlights = 30\n[cache]\ndir = '.cache'\nsize = '1 MiB'\n",
        )
        .unwrap();
        let of = |file: &str| {
            let settings = project.settings_of(&Path::new("/project").join(file));
            (settings.preset, settings.lights, settings.probes)
        };
        assert_eq!(of("a.glb"), (Some(Preset::Draft), Some(10), None));
        assert_eq!(of("props/a.glb"), (Some(Preset::Draft), Some(20), None));
        assert_eq!(of("props/in/a.glb"), (Some(Preset::Draft), Some(10), None));
        assert_eq!(of("props/big.glb"), (Some(Preset::Draft), Some(30), Some(0)));
        assert_eq!(project.cache_folder(), Some(PathBuf::from("/project/.cache")));
        assert_eq!(project.cache.size, Some(ByteSize::mib(1)));
    }

    #[test]
    fn what_is_wrong_is_named_with_its_place_and_what_was_meant() {
        for (text, place, words) in [
            ("\nlihgts = 3\n", "2:1", "unknown field `lihgts`"),
            ("\nlihgts = 3\n", "2:1", "did you mean `lights`?"),
            ("[[files]]\nglob = 'a'\nprest = 'game'\n", "3:1", "did you mean `preset`?"),
            ("lights = 0\n", "1:1", "from 1 to 1000000"),
            ("preset = 'gmae'\n", "1:10", "did you mean `game`?"),
            ("[cahce]\nsize = 3\n", "1:2", "did you mean `cache`?"),
            ("[cache]\nsise = 3\n", "2:1", "did you mean `size`?"),
            ("lights = 'many'\n", "1:10", "expected u32"),
            ("[[files]]\nglob = 'a['\n", "2:8", "unclosed character class"),
            ("[[files]]\nlights = 1\n", "1:1", "`glob` is missing"),
            ("lights = \n", "1:1", "value"),
        ] {
            let error = parse(text).unwrap_err().to_string();
            assert!(error.contains(words), "{text:?}: {error}");
            let found = error.split(": ").next().unwrap_or_default();
            assert!(text.contains("lights = \n") || found.ends_with(place), "{text:?}: {error}");
        }
    }
}
