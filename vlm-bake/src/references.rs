//! What a file refers to, even if it is not valid: a watcher must see that the missing part arrives,
//! and a cache that a part has changed.

use std::fs;
use std::path::{Component, Path, PathBuf};

use serde_json::Value;

/// The file, then the files beside it that its buffers and images name; the file alone where it cannot be read so far.
#[must_use]
pub fn references(path: &Path) -> Vec<PathBuf> {
    let mut files = vec![path.to_owned()];
    let folder = path.parent().unwrap_or(Path::new(""));
    if let Some(json) = fs::read(path).ok().and_then(|bytes| json_of(&bytes)) {
        let lists = ["buffers", "images"].map(|name| json.get(name).and_then(Value::as_array));
        let uris = lists.into_iter().flatten().flatten().filter_map(|item| item.get("uri")?.as_str());
        let paths = uris.filter(|uri| !uri.starts_with("data:")).map(decoded);
        files.extend(paths.filter(|path| stays_inside(Path::new(path))).map(|path| folder.join(path)));
    }
    files
}

/// What leads out of the folder is refused by the format, so nobody waits for it.
fn stays_inside(path: &Path) -> bool {
    path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir))
}

/// The JSON of a .gltf file, or of a .glb file's first chunk.
fn json_of(bytes: &[u8]) -> Option<Value> {
    let text = if bytes.starts_with(b"glTF") {
        let length = u32::from_le_bytes(bytes.get(12..16)?.try_into().ok()?) as usize;
        bytes.get(20..20_usize.checked_add(length)?)?
    } else {
        bytes
    };
    serde_json::from_slice(text).ok()
}

/// Without percent-encoding (RFC 3986, section 2.1).
fn decoded(uri: &str) -> String {
    let hex = |text: Option<&[u8]>| u8::from_str_radix(std::str::from_utf8(text?).ok()?, 16).ok();
    let (bytes, mut decoded, mut at) = (uri.as_bytes(), Vec::new(), 0);
    while let Some(&byte) = bytes.get(at) {
        let code = if byte == b'%' { hex(bytes.get(at + 1..at + 3)) } else { None };
        decoded.push(code.unwrap_or(byte));
        at += if code.is_some() { 3 } else { 1 };
    }
    String::from_utf8_lossy(&decoded).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_that_are_not_valid_still_name_others() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.gltf");
        fs::write(
            &path,
            r#"{"buffers":[{"uri":"a%20b.bin"},{"uri":"data:x"},{},{"uri":"../c.bin"}],"images":[{"uri":"%zz.png"},{"uri":"/d.png"}]}"#,
        )
        .unwrap();
        let names = |files: Vec<PathBuf>| -> Vec<String> {
            files.iter().map(|f| f.file_name().unwrap().to_string_lossy().into_owned()).collect()
        };
        assert_eq!(names(references(&path)), ["a.gltf", "a b.bin", "%zz.png"]);
        fs::write(&path, r#"{"buffers":["#).unwrap();
        assert_eq!(names(references(&path)), ["a.gltf"]);
        fs::write(&path, b"glTF\x02\0\0\0\xff\0\0\0\xff\xff\xff\xffJSON{}").unwrap();
        assert_eq!(names(references(&path)), ["a.gltf"]);
    }
}
