//! `fieldarm table`: the tables the codec is made of.

use std::prelude::v1::*;

use clap::{Args, ValueEnum};
use serde_json::{Map, Value};

use super::exit::Failure;
use super::grid::{Format, Grid, pretty, print};
use crate::wire::meca500::code::{Code, CodeKind, Resettable};
use crate::wire::meca500::command::{ArgumentRange, COMMANDS, CommandKind, CommandSpec};
use crate::wire::meca500::dynamic::DYNAMIC_TYPES;
use crate::wire::meca500::image::{Field, INPUT_FIELDS, OUTPUT_FIELDS};
use crate::wire::meca500::revision::Revision;

/// Print the tables of the Meca500: images, commands, dynamic data, errors.
#[derive(Args, Debug)]
pub(super) struct TableArgs {
    /// Which table; all of them when left out.
    table: Option<TableName>,
    /// Comma-separated values, with a header line.
    #[arg(long, conflicts_with = "json", requires = "table")]
    csv: bool,
    /// JSON: an array of objects, or an object of arrays when no table is named.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum TableName {
    /// The 60-byte image to the robot.
    Output,
    /// The 252-byte image from the robot.
    Input,
    /// Motion-related commands with their arguments, units and ranges.
    Commands,
    /// Dynamic data types with their six values.
    Dynamic,
    /// Errors and safety codes with text and remedy.
    Errors,
}

impl TableName {
    const fn name(self) -> &'static str {
        match self {
            Self::Output => "output",
            Self::Input => "input",
            Self::Commands => "commands",
            Self::Dynamic => "dynamic",
            Self::Errors => "errors",
        }
    }

    const fn title(self) -> &'static str {
        match self {
            Self::Output => "Output image: what the PLC sends, 60 bytes",
            Self::Input => "Input image: what the PLC receives, 252 bytes",
            Self::Commands => "Motion-related commands (MotionCommandID), ranges for a Meca500 R3",
            Self::Dynamic => "Dynamic data types (DynamicTypeID)",
            Self::Errors => "Errors and safety codes (ErrorCode)",
        }
    }

    fn grid(self) -> Grid {
        match self {
            Self::Output => fields(OUTPUT_FIELDS),
            Self::Input => fields(INPUT_FIELDS),
            Self::Commands => commands(),
            Self::Dynamic => dynamic(),
            Self::Errors => errors(),
        }
    }
}

pub(super) fn run(args: &TableArgs) -> Result<(), Failure> {
    let format = Format::from_flags(args.csv, args.json);
    let text = match (args.table, format) {
        (Some(table), format) => table.grid().render(format)?,
        (None, Format::Json) => {
            let tables = TableName::value_variants().iter();
            let tables = tables.map(|table| (table.name().to_string(), table.grid().to_json()));
            pretty(&Value::Object(tables.collect::<Map<_, _>>()))?
        }
        (None, _) => TableName::value_variants()
            .iter()
            .map(|table| format!("{}\n\n{}\n", table.title(), table.grid().to_text()))
            .collect(),
    };
    print(&text)
}

fn fields(fields: &[Field]) -> Grid {
    let mut grid = Grid::new(&[
        "byte", "bit", "bits", "type", "section", "name", "unit", "meca500", "object", "sub",
        "pdo", "table", "meaning",
    ]);
    for field in fields {
        grid.push(vec![
            field.byte_offset.into(),
            field.bit.into(),
            field.size_bits.into(),
            field.field_type.name().into(),
            field.section.into(),
            field.name.into(),
            or_null(field.unit),
            or_null(field.support.name()),
            format!("{:04X}h", field.object).into(),
            field.sub_index.into(),
            format!("{:04X}h", field.pdo).into(),
            field.table.into(),
            field.doc.into(),
        ]);
    }
    grid
}

fn commands() -> Grid {
    let mut grid = Grid::new(&[
        "id",
        "last_id",
        "name",
        "kind",
        "meca500",
        "arguments",
        "needs",
        "persistent",
    ]);
    for spec in COMMANDS {
        grid.push(vec![
            spec.id.0.into(),
            (spec.last_id != spec.id).then_some(spec.last_id.0).into(),
            spec.name.into(),
            kind(spec.kind).into(),
            spec.available.into(),
            spec.requires.text().into(),
            spec.persistent.into(),
            or_null(&arguments(spec)),
        ]);
    }
    grid
}

const fn kind(kind: CommandKind) -> &'static str {
    match kind {
        CommandKind::NoMovement => "none",
        CommandKind::Queued => "queued",
        CommandKind::Instantaneous => "instantaneous",
        CommandKind::Velocity => "velocity",
        CommandKind::Variable => "variable",
        CommandKind::Unknown => "not stated",
    }
}

/// `theta1 deg [-175 to 175], theta2 deg [-70 to 90]`
fn arguments(spec: &CommandSpec) -> String {
    let arguments = spec.arguments.iter().map(|argument| {
        let range = match &argument.range {
            ArgumentRange::Any => String::new(),
            ArgumentRange::OneOf(choices) => {
                let choices = choices.iter().map(|choice| match choice.meaning {
                    "" => choice.value.to_string(),
                    meaning => format!("{}={meaning}", choice.value),
                });
                format!(" [{}]", choices.collect::<Vec<_>>().join(" | "))
            }
            range => match (range.min(), range.max(Revision::R3)) {
                (Some(min), Some(max)) => {
                    let on_r4 = range.max(Revision::R4).filter(|on_r4| *on_r4 != max);
                    let on_r4 = on_r4.map(|max| format!(", R4 to {max}")).unwrap_or_default();
                    format!(" [{min} to {max}{on_r4}]")
                }
                (Some(min), None) => format!(" [{min} or more]"),
                _ => String::new(),
            },
        };
        format!("{}{}{range}", argument.name, argument.unit.suffix())
    });
    arguments.collect::<Vec<_>>().join(", ")
}

fn dynamic() -> Grid {
    let mut grid = Grid::new(&["id", "last_id", "name", "meca500", "in_rotation", "values"]);
    for spec in DYNAMIC_TYPES {
        let values =
            spec.values.iter().map(|value| format!("{}{}", value.name, value.unit.suffix()));
        grid.push(vec![
            spec.id.0.into(),
            (spec.last_id != spec.id).then_some(spec.last_id.0).into(),
            spec.name.into(),
            spec.available.into(),
            spec.in_rotation.into(),
            or_null(&values.collect::<Vec<_>>().join(", ")),
        ]);
    }
    grid
}

fn errors() -> Grid {
    let mut grid = Grid::new(&["code", "kind", "resettable", "text", "remedy"]);
    for info in Code::all() {
        let kind = match info.kind {
            CodeKind::Error => "error",
            CodeKind::Safety => "safety",
            CodeKind::Response | CodeKind::Monitoring => continue,
        };
        let resettable = match info.resettable {
            Resettable::Yes => Value::Bool(true),
            Resettable::No => Value::Bool(false),
            Resettable::NotStated => Value::Null,
        };
        grid.push(vec![
            info.code.0.into(),
            kind.into(),
            resettable,
            info.text.into(),
            or_null(info.remedy),
        ]);
    }
    grid
}

/// An empty text is an empty cell.
fn or_null(text: &str) -> Value {
    if text.is_empty() { Value::Null } else { text.into() }
}
