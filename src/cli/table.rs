//! `fieldarm table`: the tables the codec is made of.

use std::prelude::v1::*;

use clap::{Args, ValueEnum};
use serde_json::{Map, Value};

use super::exit::Failure;
use super::grid::{Format, Grid, pretty, print};
use crate::wire::meca500::code::{Code, CodeInfo, CodeKind, Resettable};
use crate::wire::meca500::command::{ArgumentRange, COMMANDS, CommandKind, CommandSpec};
use crate::wire::meca500::dynamic::{DYNAMIC_TYPES, DynamicTypeSpec};
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

    fn render(self, format: Format) -> Result<String, Failure> {
        match self {
            Self::Output => fields(OUTPUT_FIELDS).render(format),
            Self::Input => fields(INPUT_FIELDS).render(format),
            Self::Commands => commands().render(format),
            Self::Dynamic => dynamic().render(format),
            Self::Errors => errors().render(format),
        }
    }

    fn to_json(self) -> Value {
        match self {
            Self::Output => fields(OUTPUT_FIELDS).to_json(),
            Self::Input => fields(INPUT_FIELDS).to_json(),
            Self::Commands => commands().to_json(),
            Self::Dynamic => dynamic().to_json(),
            Self::Errors => errors().to_json(),
        }
    }
}

pub(super) fn run(args: &TableArgs) -> Result<(), Failure> {
    let format = Format::from_flags(args.csv, args.json);
    let text = match (args.table, format) {
        (Some(table), format) => table.render(format)?,
        (None, Format::Json) => {
            let tables = TableName::value_variants().iter();
            let tables = tables.map(|table| (table.name().to_string(), table.to_json()));
            pretty(&Value::Object(tables.collect::<Map<_, _>>()))?
        }
        (None, _) => TableName::value_variants()
            .iter()
            .map(|table| Ok(format!("{}\n\n{}\n", table.title(), table.render(Format::Text)?)))
            .collect::<Result<_, Failure>>()?,
    };
    print(&text)
}

fn fields(fields: &[Field]) -> Grid<13> {
    let row = |field: &Field| {
        [
            ("byte", field.byte_offset.into()),
            ("bit", field.bit.into()),
            ("bits", field.size_bits.into()),
            ("type", field.field_type.name().into()),
            ("section", field.section.into()),
            ("name", field.name.into()),
            ("unit", or_null(field.unit)),
            ("meca500", or_null(field.support.name())),
            ("object", format!("{:04X}h", field.object).into()),
            ("sub", field.sub_index.into()),
            ("pdo", format!("{:04X}h", field.pdo).into()),
            ("table", field.table.into()),
            ("meaning", field.doc.into()),
        ]
    };
    fields.iter().map(row).collect()
}

fn commands() -> Grid<8> {
    let row = |spec: &CommandSpec| {
        [
            ("id", spec.id.0.into()),
            ("last_id", (spec.last_id != spec.id).then_some(spec.last_id.0).into()),
            ("name", spec.name.into()),
            ("kind", kind(spec.kind).into()),
            ("meca500", spec.available.into()),
            ("needs", spec.requires.text().into()),
            ("persistent", spec.persistent.into()),
            ("arguments", or_null(&arguments(spec))),
        ]
    };
    COMMANDS.iter().map(row).collect()
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

fn dynamic() -> Grid<6> {
    let row = |spec: &DynamicTypeSpec| {
        let values =
            spec.values.iter().map(|value| format!("{}{}", value.name, value.unit.suffix()));
        [
            ("id", spec.id.0.into()),
            ("last_id", (spec.last_id != spec.id).then_some(spec.last_id.0).into()),
            ("name", spec.name.into()),
            ("meca500", spec.available.into()),
            ("in_rotation", spec.in_rotation.into()),
            ("values", or_null(&values.collect::<Vec<_>>().join(", "))),
        ]
    };
    DYNAMIC_TYPES.iter().map(row).collect()
}

fn errors() -> Grid<5> {
    let row = |info: &CodeInfo| {
        let kind = match info.kind {
            CodeKind::Error => "error",
            CodeKind::Safety => "safety",
            CodeKind::Response | CodeKind::Monitoring => return None,
        };
        let resettable = match info.resettable {
            Resettable::Yes => Value::Bool(true),
            Resettable::No => Value::Bool(false),
            Resettable::NotStated => Value::Null,
        };
        Some([
            ("code", info.code.0.into()),
            ("kind", kind.into()),
            ("resettable", resettable),
            ("text", info.text.into()),
            ("remedy", or_null(info.remedy)),
        ])
    };
    Code::all().filter_map(row).collect()
}

/// An empty text is an empty cell.
fn or_null(text: &str) -> Value {
    if text.is_empty() { Value::Null } else { text.into() }
}
