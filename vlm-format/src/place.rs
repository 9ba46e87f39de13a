//! Where in a file a field of a [`crate::VlmAsset`] stands: what is wrong with a file is told by pointers into its JSON.

use crate::error::Issue;
use crate::strip::EXTENSION;

/// An issue of an asset as one of the file that it was read from. Elements of arrays are in binary data: the message names them, and the
/// pointer their array.
pub(crate) fn in_file(issue: Issue) -> Issue {
    let mut parts = issue.pointer.split('/').skip(1);
    let (field, next) = (parts.next().unwrap_or_default(), parts.next());
    let (place, element) = match field {
        "vlms" | "settings" => (issue.pointer.trim_start_matches('/').to_owned(), None),
        "positions" | "albedo" | "emission" | "tags" => (format!("lights/{field}"), next),
        "triangles" => (String::from("lights/indices"), next),
        "sample_starts" => (String::from("samples/starts"), next),
        "samples" => (String::from("samples"), next),
        "grid" => {
            (next.map_or(String::from("grid"), |array| format!("grid/{}", camel_case(array))), parts.next())
        }
        // Tags stand in nodes and primitives.
        _ => (String::new(), None),
    };
    let message = match element {
        Some(element) => format!("element {element}: {}", issue.message),
        None => issue.message,
    };
    let slash = if place.is_empty() { "" } else { "/" };
    Issue { pointer: format!("/extensions/{EXTENSION}{slash}{place}"), message, ..issue }
}

/// `row_starts` is `rowStarts` in the file.
fn camel_case(name: &str) -> String {
    let mut parts = name.split('_');
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |name, part| {
        let mut letters = part.chars();
        letters
            .next()
            .map_or(name.clone(), |letter| format!("{name}{}{}", letter.to_uppercase(), letters.as_str()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Code;

    #[test]
    fn fields_become_places() {
        for (field, place, message) in [
            ("/vlms/2/lights", "/vlms/2/lights", "bad"),
            ("/vlms", "/vlms", "bad"),
            ("/triangles/7", "/lights/indices", "element 7: bad"),
            ("/albedo", "/lights/albedo", "bad"),
            ("/sample_starts/1", "/samples/starts", "element 1: bad"),
            ("/grid", "/grid", "bad"),
            ("/grid/near_form_factors", "/grid/nearFormFactors", "bad"),
            ("/grid/cells/3", "/grid/cells", "element 3: bad"),
            ("/node_tags/3", "", "bad"),
        ] {
            let issue = in_file(Issue::error(Code::VlmIndex, field, "bad"));
            assert_eq!(issue.pointer, format!("/extensions/{EXTENSION}{place}"), "{field}");
            assert_eq!(issue.message, message, "{field}");
        }
    }
}
