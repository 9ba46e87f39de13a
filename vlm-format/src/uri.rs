//! URIs of buffers and images: data URIs, and files in the glTF's own folder; nothing else is followed.

use std::borrow::Cow;
use std::fs;
use std::path::{Component, Path, PathBuf};

use base64::Engine;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};

use crate::error::{Code, Issue};

/// Where the bytes of a URI are.
#[derive(Debug, PartialEq)]
pub(crate) enum Location<'a> {
    /// Inside the URI: the text after the comma.
    Data(&'a str),
    /// A path relative to the folder of the glTF; it does not leave that folder.
    Relative(PathBuf),
}

/// Sorts a URI into data or relative path. Other schemes, absolute paths and `..` are refused.
pub(crate) fn locate<'a>(uri: &'a str, pointer: &str) -> Result<Location<'a>, Issue> {
    let refuse = |why: &str| {
        let shown: String = uri.chars().take(80).collect();
        Issue::error(Code::UriUnsafe, pointer, format!("the URI `{shown}` {why}"))
    };
    if let Some(data) = strip_prefix_ignore_case(uri, "data:") {
        let base64 = data.split_once(',').filter(|(kind, _)| kind.to_ascii_lowercase().ends_with(";base64"));
        return match base64 {
            Some((_, text)) => Ok(Location::Data(text)),
            None => Err(Issue::error(Code::DataUri, pointer, "the data URI is not base64")),
        };
    }
    let path = percent_decode(uri).ok_or_else(|| refuse("is not valid UTF-8 once percent-decoded"))?;
    if path.is_empty() {
        return Err(refuse("is empty"));
    }
    if has_scheme(&path) {
        return Err(refuse("has a scheme other than `data:` (or a drive letter)"));
    }
    if path.contains('\\') || path.contains('\0') {
        return Err(refuse("contains a backslash or NUL"));
    }
    if path.starts_with('/') || Path::new(path.as_ref()).is_absolute() {
        return Err(refuse("is an absolute path"));
    }
    if path.split('/').any(|part| part == "..") {
        return Err(refuse("leaves the folder of the glTF through `..`"));
    }
    let plain = Path::new(path.as_ref()).components().filter(|part| *part != Component::CurDir).collect();
    Ok(Location::Relative(plain))
}

/// Reads what a URI names. `folder` is that of the glTF; without one (a pipe) only data URIs can be read.
pub(crate) fn load(uri: &str, folder: Option<&Path>, pointer: &str) -> Result<Vec<u8>, Issue> {
    match locate(uri, pointer)? {
        Location::Data(text) => decode_base64(text, pointer),
        Location::Relative(path) => match folder {
            Some(folder) => read_inside(folder, &path, pointer),
            None => Err(Issue::error(
                Code::UriNeedsFolder,
                pointer,
                format!("`{}` lies beside the glTF, but the glTF came without a folder", path.display()),
            )),
        },
    }
}

/// Reads a regular file below `folder`; links that lead out of it are refused.
fn read_inside(folder: &Path, path: &Path, pointer: &str) -> Result<Vec<u8>, Issue> {
    let unreadable = |why: &dyn std::fmt::Display| {
        Issue::error(Code::UriUnreadable, pointer, format!("cannot read `{}`: {why}", path.display()))
    };
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let home = folder.canonicalize().map_err(|error| unreadable(&error))?;
    let target = folder.join(path).canonicalize().map_err(|error| unreadable(&error))?;
    if !target.starts_with(&home) {
        let why = format!("`{}` is a link that leads out of the folder of the glTF", path.display());
        return Err(Issue::error(Code::UriUnsafe, pointer, why));
    }
    if !target.is_file() {
        return Err(unreadable(&"it is not a regular file"));
    }
    fs::read(&target).map_err(|error| unreadable(&error))
}

fn decode_base64(text: &str, pointer: &str) -> Result<Vec<u8>, Issue> {
    // Exporters differ on the padding; its absence is no ambiguity.
    const ENGINE: GeneralPurpose = GeneralPurpose::new(
        &base64::alphabet::STANDARD,
        GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
    );
    let decoded = percent_decode(text).and_then(|text| ENGINE.decode(text.as_bytes()).ok());
    decoded.ok_or_else(|| Issue::error(Code::DataUri, pointer, "the data URI is not valid base64"))
}

/// RFC 3986: `scheme:` is a letter followed by letters, digits, `+`, `-` or `.`.
fn has_scheme(path: &str) -> bool {
    path.split_once(':').is_some_and(|(scheme, _)| {
        scheme.starts_with(|c: char| c.is_ascii_alphabetic())
            && scheme.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '+' | '-' | '.'))
    })
}

fn strip_prefix_ignore_case<'a>(text: &'a str, prefix: &str) -> Option<&'a str> {
    let head = text.get(..prefix.len())?;
    if head.eq_ignore_ascii_case(prefix) { text.get(prefix.len()..) } else { None }
}

fn percent_decode(text: &str) -> Option<Cow<'_, str>> {
    if !text.contains('%') {
        return Some(Cow::Borrowed(text));
    }
    let bytes = text.as_bytes();
    let mut decoded = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while let Some(&byte) = bytes.get(at) {
        let escaped = (byte == b'%').then(|| bytes.get(at + 1..at + 3)).flatten();
        let hex = escaped.filter(|hex| hex.iter().all(u8::is_ascii_hexdigit));
        let value = hex.and_then(|hex| u8::from_str_radix(std::str::from_utf8(hex).ok()?, 16).ok());
        // A lone `%` is no escape: file names may contain it, and exporters forget to encode it.
        decoded.push(value.unwrap_or(byte));
        at += if value.is_some() { 3 } else { 1 };
    }
    String::from_utf8(decoded).ok().map(Cow::Owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_paths_inside_the_folder_are_followed() {
        for uri in [
            "../a.bin",
            "x/../../a.bin",
            "%2e%2e/a.bin",
            "/etc/passwd",
            "%2Fetc/passwd",
            "C:/a.bin",
            "c:a",
            "file:///etc/passwd",
            "http://example.org/a.bin",
            "a\\..\\b.bin",
            "x/%00",
            "",
        ] {
            assert_eq!(locate(uri, "/p").unwrap_err().code, Code::UriUnsafe, "{uri}");
        }
        for (uri, path) in
            [("a.bin", "a.bin"), ("./b/a%20b.bin", "b/a b.bin"), ("100%.bin", "100%.bin"), ("a..b", "a..b")]
        {
            assert_eq!(locate(uri, "/p"), Ok(Location::Relative(PathBuf::from(path))), "{uri}");
        }
    }

    #[test]
    fn data_uris_decode_with_or_without_padding() {
        for uri in ["data:application/octet-stream;base64,AQID", "data:;base64,AQID", "DATA:;BASE64,AQID"] {
            assert_eq!(load(uri, None, "/p"), Ok(vec![1, 2, 3]), "{uri}");
        }
        assert_eq!(load("data:;base64,AQI", None, "/p"), Ok(vec![1, 2]));
        assert_eq!(load("data:text/plain,abc", None, "/p").unwrap_err().code, Code::DataUri);
        assert_eq!(load("data:;base64,A*ID", None, "/p").unwrap_err().code, Code::DataUri);
        assert_eq!(load("a.bin", None, "/p").unwrap_err().code, Code::UriNeedsFolder);
    }
}
