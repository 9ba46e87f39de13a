//! Changes JSON text as little as a changed value demands: what did not change keeps its spaces, numbers and escapes as they were written.
//!
//! What is added stands at the end of its list or object, set off as its neighbour is, and what is taken from the end takes that with it. So
//! taking out what was added gives back the text, byte by byte.

use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use serde::ser::Serialize;
use serde_json::ser::{PrettyFormatter, Serializer};
use serde_json::value::RawValue;
use serde_json::{Map, Value};

/// The result of [`patch`].
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Patched {
    /// JSON that parses to the new value.
    pub text: String,
    /// Where spaces may be added that are gone when the additions are: before the first addition. `None` if there is none.
    pub gap: Option<usize>,
}

/// Turns text into that of another value. `indent` is what each level of the text is indented by; `None` for JSON on one line.
pub(crate) fn patch(text: &str, value: &Value, indent: Option<&str>) -> Patched {
    let newline = if text.contains("\r\n") { "\r\n" } else { "\n" };
    let mut patcher = Patcher { out: String::with_capacity(text.len()), indent, newline, gap: None };
    patcher.value(text, value);
    Patched { text: patcher.out, gap: patcher.gap }
}

/// JSON as it is written where there is no text to follow.
pub(crate) fn fresh(json: &Value, indent: Option<&str>) -> String {
    let Some(indent) = indent else { return json.to_string() };
    let mut text = Vec::new();
    let style = PrettyFormatter::with_indent(indent.as_bytes());
    let written = json.serialize(&mut Serializer::with_formatter(&mut text, style));
    match (written, String::from_utf8(text)) {
        (Ok(()), Ok(text)) => text,
        _ => json.to_string(),
    }
}

/// A value of an object or list in its text.
struct Item<'a> {
    /// From the end of the value before, or the opening bracket, to this value: comma, spaces, key and colon.
    lead: &'a str,
    text: &'a str,
}

struct Patcher<'a> {
    out: String,
    indent: Option<&'a str>,
    newline: &'a str,
    gap: Option<usize>,
}

impl Patcher<'_> {
    fn value(&mut self, text: &str, new: &Value) {
        let done = match new {
            Value::Object(map) => self.object(text, map),
            Value::Array(list) => self.list(text, list),
            _ => self.scalar(text, new),
        };
        if !done {
            self.fresh(new, self.indent.is_some());
        }
    }

    fn scalar(&mut self, text: &str, new: &Value) -> bool {
        let same = serde_json::from_str::<Value>(text).is_ok_and(|old| old == *new);
        if same {
            self.out.push_str(text);
        }
        same
    }

    /// False, and nothing written, if the text is no object, or its keys stand in another order.
    fn object(&mut self, text: &str, new: &Map<String, Value>) -> bool {
        let Ok(Members(members)) = serde_json::from_str(text) else { return false };
        let raws: Vec<&RawValue> = members.iter().map(|(_, raw)| *raw).collect();
        let (items, tail) = items(text, &raws);
        let kept: Vec<usize> = (0..items.len()).filter(|&i| new.contains_key(&members[i].0)).collect();
        let same_order = kept.iter().map(|&i| &members[i].0).eq(new.keys().take(kept.len()));
        // What stands first has no comma before it; removing it alone is not worth a rule of its own.
        if !same_order || kept.first().is_some_and(|&first| first != 0) {
            return false;
        }
        self.out.push('{');
        for &i in &kept {
            self.out.push_str(items[i].lead);
            self.value(items[i].text, &new[&members[i].0]);
        }
        let model = kept.last().map(|&i| items[i].lead);
        for (i, (key, value)) in new.iter().enumerate().skip(kept.len()) {
            self.add(i > 0, Some(key), value, model);
        }
        self.out.push_str(tail);
        true
    }

    /// False, and nothing written, if the text is no list.
    fn list(&mut self, text: &str, new: &[Value]) -> bool {
        let Ok(raws) = serde_json::from_str::<Vec<&RawValue>>(text) else { return false };
        let (items, tail) = items(text, &raws);
        self.out.push('[');
        for (item, value) in items.iter().zip(new) {
            self.out.push_str(item.lead);
            self.value(item.text, value);
        }
        let kept = items.len().min(new.len());
        let model = kept.checked_sub(1).map(|last| items[last].lead);
        for (i, value) in new.iter().enumerate().skip(kept) {
            self.add(i > 0, None, value, model);
        }
        self.out.push_str(tail);
        true
    }

    /// Adds a value behind others, set off as that with the lead `model` is.
    fn add(&mut self, comma: bool, key: Option<&str>, value: &Value, model: Option<&str>) {
        if comma {
            self.out.push(',');
        }
        self.gap.get_or_insert(self.out.len());
        let space = model.map_or("", before_key);
        self.out.push_str(space);
        if let Some(key) = key {
            self.out.push_str(&Value::from(key).to_string());
            self.out.push(':');
            self.out.push_str(model.map_or("", after_colon));
        }
        self.fresh(value, self.indent.is_some() && space.contains('\n'));
    }

    fn fresh(&mut self, value: &Value, on_lines: bool) {
        let text = fresh(value, self.indent.filter(|_| on_lines));
        let line = self.out.rsplit('\n').next().unwrap_or_default();
        let margin = &line[..line.len() - line.trim_start().len()];
        let text = text.replace('\n', &format!("{}{margin}", self.newline));
        self.out.push_str(&text);
    }
}

/// The spaces after the comma of a lead.
fn before_key(lead: &str) -> &str {
    let rest = lead.trim_start().strip_prefix(',').unwrap_or(lead);
    &rest[..rest.len() - rest.trim_start().len()]
}

/// The spaces after the colon of a lead.
fn after_colon(lead: &str) -> &str {
    &lead[lead.trim_end().len()..]
}

/// The values of an object or list with what leads to them, and what follows the last of them.
fn items<'a>(text: &'a str, values: &[&'a RawValue]) -> (Vec<Item<'a>>, &'a str) {
    let mut end = 1;
    let mut items = Vec::new();
    for value in values {
        // Values are borrowed from the text.
        let start = value.get().as_ptr().addr() - text.as_ptr().addr();
        items.push(Item { lead: &text[end..start], text: value.get() });
        end = start + value.get().len();
    }
    (items, &text[end..])
}

/// The members of an object in the order of the text; keys may repeat.
struct Members<'a>(Vec<(String, &'a RawValue)>);

impl<'de> Deserialize<'de> for Members<'de> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct InOrder;
        impl<'de> Visitor<'de> for InOrder {
            type Value = Members<'de>;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut members = Vec::new();
                while let Some(member) = map.next_entry()? {
                    members.push(member);
                }
                Ok(Members(members))
            }
        }
        deserializer.deserialize_map(InOrder)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    /// Odd spaces, numbers and escapes.
    const TEXTS: [(&str, Option<&str>); 6] = [
        (r#"{"a":[1.0,2.50e1],"b":{"c\/d":"\u00e9"},"n":0}"#, None),
        ("{ \"a\" : [ 1 , 2 ] , \"b\" : { \"c\" :3}, \"n\": 0 }", None),
        ("{\n  \"a\": [\n    1,\n    2\n  ],\n  \"b\": {\n    \"c\": 3\n  },\n  \"n\": 0\n}", Some("  ")),
        ("{\r\n\t\"a\":[1,2],\r\n\t\"b\":{\r\n\t\t\"c\":3 },\r\n\t\"n\":0}", Some("\t")),
        (r#"{"b":{"c":1},"a":[1],"n":0,"z":[ ]}"#, None),
        (r#"{"a":[{"x":1}, {"x":2}],"b":{"c":1,"c":2},"n":0}"#, None),
    ];

    fn added(text: &str) -> Value {
        let mut value: Value = serde_json::from_str(text).unwrap();
        value["a"].as_array_mut().unwrap().push(json!({ "x": [1, { "y": 2 }] }));
        value["b"]["new"] = json!([]);
        value["n"] = json!(17);
        value["last"] = json!({ "deep": { "deeper": ["text, with: marks\n"] } });
        value
    }

    #[test]
    fn what_is_added_and_taken_out_leaves_the_text() {
        for (text, indent) in TEXTS {
            let (before, after) = (serde_json::from_str(text).unwrap(), added(text));
            let patched = patch(text, &after, indent);
            assert_eq!(serde_json::from_str::<Value>(&patched.text).unwrap(), after, "{}", patched.text);
            let padded =
                [&patched.text[..patched.gap.unwrap()], "   ", &patched.text[patched.gap.unwrap()..]]
                    .concat();
            for changed in [patched.text, padded] {
                let back = patch(&changed, &before, indent).text;
                let doubled_key = text.contains("\"c\":1,\"c\"");
                assert_eq!(back == text, !doubled_key, "{changed}\n{back}");
                assert_eq!(serde_json::from_str::<Value>(&back).unwrap(), before);
            }
        }
    }

    #[test]
    fn the_unchanged_stays_and_the_new_is_set_as_its_neighbours() {
        let text = TEXTS[2].0;
        let patched = patch(text, &added(text), Some("  ")).text;
        for line in
            ["    2,\n    {\n      \"x\": [\n        1,", "  \"n\": 17,\n  \"last\": {\n    \"deep\": {\n"]
        {
            assert!(patched.contains(line), "{line} in {patched}");
        }
        let text = TEXTS[0].0;
        assert!(
            patch(text, &added(text), None)
                .text
                .starts_with(r#"{"a":[1.0,2.50e1,{"x":[1,{"y":2}]}],"b":{"c\/d":"\u00e9","#)
        );
        let same: Value = serde_json::from_str(text).unwrap();
        assert_eq!(patch(text, &same, None), Patched { text: text.to_owned(), gap: None });
    }

    #[test]
    fn other_orders_and_kinds_are_written_anew() {
        for (text, value) in [
            (r#"{"a":1,"b":2}"#, json!({ "b": 2, "a": 1 })),
            (r#"{"a":1, "b":2}"#, json!({ "b": 2 })),
            (r#"{"a":[1,2]}"#, json!({ "a": { "b": 1 } })),
            (r#"{"a":[]}"#, json!({ "a": [1] })),
            (r#"{"a":[1]}"#, json!({})),
        ] {
            let patched = patch(text, &value, None).text;
            assert_eq!(
                serde_json::from_str::<Value>(&patched).unwrap().to_string(),
                value.to_string(),
                "{patched}"
            );
        }
    }
}
