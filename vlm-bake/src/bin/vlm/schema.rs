//! `vlm schema`: the JSON Schemas of the reports that the commands print or write.

use clap::Args;
use schemars::generate::SchemaSettings;
use schemars::transform::transform_subschemas;
use schemars::{JsonSchema, Schema};
use serde_json::{Map, Value, json};
use vlm_bake::render::RenderReport;
use vlm_bake::report::Report;

use crate::batch;
use crate::check;
use crate::diff;
use crate::error::CliError;
use crate::inspect;
use crate::output::{print, print_json};
use crate::watch;

/// A report in JSON.
struct Kind {
    /// What `vlm schema` knows it by.
    name: &'static str,
    /// The command that makes it.
    command: &'static str,
    schema: fn() -> Schema,
}

/// Every report in JSON. A new report is one more line here, and one in the tests that makes it.
const REPORTS: &[Kind] = &[
    Kind { name: "bake", command: "vlm bake --report FILE.json", schema: schema_of::<Report> },
    Kind {
        name: "batch",
        command: "vlm bake --out-dir DIR, with --json or --report FILE.json",
        schema: schema_of::<batch::BatchReport>,
    },
    Kind { name: "watch", command: "vlm watch --json, each line", schema: schema_of::<watch::WatchEvent> },
    Kind { name: "check", command: "vlm check --json", schema: schema_of::<Vec<check::Finding>> },
    Kind { name: "inspect", command: "vlm inspect --json", schema: schema_of::<inspect::Content> },
    Kind { name: "diff", command: "vlm diff --json", schema: schema_of::<diff::DiffReport> },
    Kind { name: "render", command: "vlm render --json", schema: schema_of::<RenderReport> },
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
        let line = |kind: &Kind| format!("{:<9} {}", kind.name, kind.command);
        return print(&REPORTS.iter().map(line).collect::<Vec<_>>());
    };
    match REPORTS.iter().find(|kind| kind.name == name) {
        Some(kind) => print_json(&kind.document()),
        None => {
            let names: Vec<&str> = REPORTS.iter().map(|kind| kind.name).collect();
            Err(CliError::usage(format!("`{name}` is no report; ask for one of {}", names.join(", "))))
        }
    }
}

impl Kind {
    /// The schema, named for the report in place of the type, which is no one else's business.
    fn document(&self) -> Value {
        let mut all = Map::new();
        all.insert(String::from("$id"), json!(format!("{}.schema.json", self.name)));
        all.extend((self.schema)().to_value().as_object().cloned().unwrap_or_default());
        all.insert(String::from("title"), json!(format!("Report of {}", self.command)));
        Value::Object(all)
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
