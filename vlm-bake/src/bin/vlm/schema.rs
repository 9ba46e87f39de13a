//! `vlm schema`: the JSON Schemas of the reports that the commands print or write.

use clap::Args;
use schemars::generate::SchemaSettings;
use schemars::transform::transform_subschemas;
use schemars::{JsonSchema, Schema};
use serde_json::{Map, Value, json};
use vlm_bake::render::RenderReport;
use vlm_bake::report::Report;

use crate::check;
use crate::error::CliError;
use crate::inspect;
use crate::output::{print, print_json};

/// Every report in JSON: its name, which command makes it, and its schema. A new report is one more line.
const REPORTS: &[(&str, &str, fn() -> Schema)] = &[
    ("bake", "vlm bake --report FILE.json", schema_of::<Report>),
    ("check", "vlm check --json", schema_of::<Vec<check::Finding>>),
    ("inspect", "vlm inspect --json", schema_of::<inspect::Content>),
    ("render", "vlm render --json", schema_of::<RenderReport>),
];

/// Flags of `vlm schema`.
#[derive(Args)]
pub struct SchemaArgs {
    /// Name of a report; without one, the names are listed
    name: Option<String>,
}

/// Runs the command.
///
/// # Errors
/// If there is no report of that name.
pub fn run(args: &SchemaArgs) -> Result<(), CliError> {
    let Some(name) = &args.name else {
        let lines: Vec<String> =
            REPORTS.iter().map(|(name, command, _)| format!("{name:<9} {command}")).collect();
        return print(&lines);
    };
    match REPORTS.iter().find(|(known, ..)| known == name) {
        Some((name, command, schema)) => print_json(&named(name, command, schema())),
        None => {
            let names: Vec<&str> = REPORTS.iter().map(|(name, ..)| *name).collect();
            Err(CliError::usage(format!("`{name}` is no report; ask for one of {}", names.join(", "))))
        }
    }
}

/// The schema of what a type serialises to. It allows no other properties, so that a forgotten or renamed one shows.
fn schema_of<T: JsonSchema>() -> Schema {
    SchemaSettings::draft2020_12()
        .for_serialize()
        .with_transform(close)
        .into_generator()
        .into_root_schema_for::<T>()
}

/// Forbids further properties in every object whose properties are listed.
fn close(schema: &mut Schema) {
    transform_subschemas(&mut close, schema);
    let closes = schema.get("properties").is_some() && schema.get("additionalProperties").is_none();
    if closes {
        schema.insert(String::from("additionalProperties"), Value::Bool(false));
    }
}

/// Says which report it is of, in place of the type's name, which is no one else's business.
fn named(name: &str, command: &str, schema: Schema) -> Value {
    let mut all = Map::new();
    all.insert(String::from("$id"), json!(format!("{name}.schema.json")));
    all.extend(schema.to_value().as_object().cloned().unwrap_or_default());
    all.insert(String::from("title"), json!(format!("Report of {command}")));
    Value::Object(all)
}
