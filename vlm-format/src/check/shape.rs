//! The vocabulary of shapes that JSON can have, and the walk that compares a file with them.

use serde_json::{Map, Value};

use super::Report;
use crate::error::Code;

/// What a JSON value must look like.
#[derive(Clone, Copy)]
pub(super) enum Shape {
    Bool,
    Text,
    /// A number that is finite in single precision.
    Number,
    /// A whole number, 0 or more.
    Count,
    /// A whole number of 32 bits, above 0.
    Tag,
    /// Exactly so many finite numbers; 0 for any number of them.
    Numbers(usize),
    /// Exactly so many whole numbers of 32 bits.
    Small(usize),
    /// An index into the root array at this JSON pointer.
    Index(&'static str),
    /// A list of such indices.
    Indices(&'static str),
    /// One of these whole numbers.
    OneOf(&'static [u64]),
    /// One of these words.
    Word(&'static [&'static str]),
    /// A list of texts.
    Texts,
    Object(&'static [Field]),
    /// An object with at least one of these properties.
    SomeOf(&'static [Field]),
    /// An object with exactly one of these properties.
    OneField(&'static [Field]),
    Objects(&'static [Field]),
    /// An object whose values all have this shape.
    Map(&'static Shape),
    /// A list whose elements all have this shape.
    List(&'static Shape),
}

/// A property of an object.
#[derive(Clone, Copy)]
pub(super) struct Field {
    name: &'static str,
    shape: Shape,
    required: bool,
}

pub(super) const fn must(name: &'static str, shape: Shape) -> Field {
    Field { name, shape, required: true }
}

pub(super) const fn may(name: &'static str, shape: Shape) -> Field {
    Field { name, shape, required: false }
}

use Shape::{
    Bool, Count, Index, Indices, List, Map as MapOf, Number, Numbers, Object, Objects, OneField, OneOf,
    Small, SomeOf, Tag, Text, Texts, Word,
};

/// Compares a value, the whole file, with a table. Indices must lead into its own arrays.
pub(super) fn compare(root: &Value, fields: &'static [Field], report: &mut Report) {
    let mut walk = Walk { root, pointer: String::new(), report };
    walk.value(root, Object(fields));
}

struct Walk<'a, 'r> {
    root: &'a Value,
    /// JSON pointer of the value at hand.
    pointer: String,
    report: &'r mut Report,
}

impl Walk<'_, '_> {
    fn value(&mut self, value: &Value, shape: Shape) {
        match shape {
            Bool => self.require(value.is_boolean(), value, "true or false"),
            Text => self.require(value.is_string(), value, "a text"),
            Number => self.number(value),
            Count => self.require(value.is_u64(), value, "a whole number, 0 or more"),
            Tag => {
                let fits = value.as_u64().is_some_and(|tag| tag > 0 && u32::try_from(tag).is_ok());
                self.require(fits, value, "a tag: a whole number of 32 bits, above 0");
            }
            Index(array) => self.index(value, array),
            OneOf(allowed) => self.one_of(value, allowed),
            Word(allowed) => self.word(value, allowed),
            Object(fields) => self.object(value, fields),
            SomeOf(fields) => self.choice(value, fields, fields.len()),
            OneField(fields) => self.choice(value, fields, 1),
            MapOf(shape) => self.map(value, *shape),
            List(shape) => self.list(value, *shape),
            Objects(fields) => self.list(value, Object(fields)),
            Indices(array) => self.list(value, Index(array)),
            Texts => self.list(value, Text),
            Small(count) => {
                let fits = |value: &Value| value.as_u64().is_some_and(|number| u32::try_from(number).is_ok());
                let list = value.as_array().is_some_and(|list| list.len() == count && list.iter().all(fits));
                self.require(list, value, "a list of whole numbers of the right length");
            }
            Numbers(count) => {
                if count > 0 && value.as_array().is_some_and(|list| list.len() != count) {
                    self.wrong(Code::WrongType, format!("must be a list of {count} numbers"));
                }
                self.list(value, Number);
            }
        }
    }

    fn object(&mut self, value: &Value, fields: &[Field]) {
        let Some(object) = self.as_object(value) else { return };
        for field in fields {
            match object.get(field.name) {
                Some(value) => self.inside(field.name, |walk| walk.value(value, field.shape)),
                None if field.required => self.wrong(Code::Missing, format!("`{}` is missing", field.name)),
                None => {}
            }
        }
    }

    /// An object that has some of the properties, at most so many.
    fn choice(&mut self, value: &Value, fields: &[Field], most: usize) {
        self.object(value, fields);
        let present = fields.iter().filter(|field| value.get(field.name).is_some()).count();
        if value.is_object() && !(1..=most).contains(&present) {
            let names: Vec<String> = fields.iter().map(|field| format!("`{}`", field.name)).collect();
            let (code, says) = if present == 0 {
                (Code::Missing, "is missing")
            } else {
                (Code::WrongValue, "may stand alone only")
            };
            self.wrong(code, format!("{} {says}", names.join(" or ")));
        }
    }

    fn map(&mut self, value: &Value, shape: Shape) {
        let Some(object) = self.as_object(value) else { return };
        for (key, value) in object {
            self.inside(key, |walk| walk.value(value, shape));
        }
    }

    fn list(&mut self, value: &Value, shape: Shape) {
        let Value::Array(list) = value else {
            return self.require(false, value, "a list");
        };
        for (index, value) in list.iter().enumerate() {
            self.inside(&index.to_string(), |walk| walk.value(value, shape));
        }
    }

    fn number(&mut self, value: &Value) {
        match value.as_f64() {
            Some(number) if !(number as f32).is_finite() => {
                self.wrong(Code::NumberRange, format!("{number:e} is beyond single precision"));
            }
            number => self.require(number.is_some(), value, "a number"),
        }
    }

    fn index(&mut self, value: &Value, array: &str) {
        let Some(index) = value.as_u64() else {
            return self.require(false, value, "a whole number, 0 or more");
        };
        let length = self.root.pointer(array).and_then(Value::as_array).map_or(0, Vec::len);
        if index >= length as u64 {
            self.wrong(
                Code::IndexOutOfRange,
                format!("{index} is no index into {array}, which has {length}"),
            );
        }
    }

    fn one_of(&mut self, value: &Value, allowed: &[u64]) {
        if !value.as_u64().is_some_and(|number| allowed.contains(&number)) {
            self.wrong(Code::WrongValue, format!("{} is none of {allowed:?}", shorten(value)));
        }
    }

    fn word(&mut self, value: &Value, allowed: &[&str]) {
        if !value.as_str().is_some_and(|word| allowed.contains(&word)) {
            self.wrong(Code::WrongValue, format!("{} is none of {}", shorten(value), allowed.join(", ")));
        }
    }

    fn as_object<'v>(&mut self, value: &'v Value) -> Option<&'v Map<String, Value>> {
        self.require(value.is_object(), value, "an object");
        value.as_object()
    }

    fn require(&mut self, holds: bool, value: &Value, expected: &str) {
        if !holds {
            self.wrong(Code::WrongType, format!("{} is not {expected}", shorten(value)));
        }
    }

    fn wrong(&mut self, code: Code, message: String) {
        self.report.error(code, self.pointer.clone(), message);
    }

    /// Runs a check one level deeper, with the key appended to the pointer.
    fn inside(&mut self, key: &str, check: impl FnOnce(&mut Self)) {
        let length = self.pointer.len();
        self.pointer.push('/');
        self.pointer.push_str(&key.replace('~', "~0").replace('/', "~1"));
        check(self);
        self.pointer.truncate(length);
    }
}

/// The value for a message: whole when short, else its kind.
fn shorten(value: &Value) -> String {
    match value {
        Value::Object(_) => String::from("an object"),
        Value::Array(_) => String::from("a list"),
        other => {
            let text = other.to_string();
            if text.chars().count() > 40 {
                format!("{}...", text.chars().take(40).collect::<String>())
            } else {
                text
            }
        }
    }
}
