//! `fieldarm decode`: an image in hex becomes names, values and units.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::prelude::v1::*;
use std::{fs, io};

use clap::Args;
use serde_json::Value;

use super::exit::Failure;
use super::grid::{Format, Grid, print, real};
use super::hex;
use super::order::OrderName;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::command::MotionCommandId;
use crate::wire::meca500::dynamic::{DynamicType, DynamicTypeSpec};
use crate::wire::meca500::image::{
    Field, FieldType, FieldValue, INPUT_FIELDS, INPUT_LEN, OUTPUT_FIELDS, OUTPUT_LEN,
};
use crate::wire::order::ByteOrder;

/// Decode a process image from hex: every field with its name, value and unit.
///
/// The text may have blanks, line ends, commas, colons and 0x between bytes, and # comments. Which
/// image it is follows from its length: 60 bytes are an output image, 252 an input image. Reserved
/// bits are shown only when they are not zero.
#[derive(Args, Debug)]
pub(super) struct DecodeArgs {
    /// File with the hex text; standard input when left out or `-`.
    file: Option<PathBuf>,
    /// The bytes are an input image: what the PLC receives, 252 bytes.
    #[arg(long, conflicts_with = "output")]
    input: bool,
    /// The bytes are an output image: what the PLC sends, 60 bytes.
    #[arg(long)]
    output: bool,
    /// Byte order of integers and Reals.
    #[arg(long, value_enum, default_value_t = OrderName::Big)]
    byte_order: OrderName,
    /// Comma-separated values, with a header line.
    #[arg(long, conflicts_with = "json")]
    csv: bool,
    /// JSON: an array with one object a field.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &DecodeArgs) -> Result<(), Failure> {
    let (source, text) = read(args.file.as_deref())?;
    let image = hex::parse(&text).map_err(|error| Failure::usage(format!("{source}: {error}")))?;
    let fields = fields_of(args, image.len())
        .map_err(|message| Failure::usage(format!("{source}: {message}")))?;
    let order = ByteOrder::from(args.byte_order);
    if let Some(hint) = other_order_hint(fields, &image, order) {
        eprintln!("{source}: note: {hint}");
    }
    print(&decode(fields, &image, order).render(Format::from_flags(args.csv, args.json))?)
}

/// The text and the name of where it came from.
fn read(file: Option<&Path>) -> Result<(String, String), Failure> {
    match file.filter(|file| *file != Path::new("-")) {
        Some(file) => match fs::read_to_string(file) {
            Ok(text) => Ok((file.display().to_string(), text)),
            Err(error) if error.kind() == io::ErrorKind::InvalidData => Err(Failure::usage(
                format!("{}: not a text; decode takes bytes written in hex", file.display()),
            )),
            Err(error) => {
                Err(Failure::internal(format!("cannot read {}: {error}", file.display())))
            }
        },
        None => {
            let mut text = String::new();
            match io::stdin().lock().read_to_string(&mut text) {
                Ok(_) => Ok(("standard input".into(), text)),
                Err(error) if error.kind() == io::ErrorKind::InvalidData => Err(Failure::usage(
                    "standard input: not a text; decode takes bytes written in hex",
                )),
                Err(error) => {
                    Err(Failure::internal(format!("cannot read standard input: {error}")))
                }
            }
        }
    }
}

fn fields_of(args: &DecodeArgs, found: usize) -> Result<&'static [Field], String> {
    let bytes = if found == 1 { "1 byte".into() } else { format!("{found} bytes") };
    match (args.output, args.input, found) {
        (true, _, OUTPUT_LEN) | (false, false, OUTPUT_LEN) => Ok(OUTPUT_FIELDS),
        (_, true, INPUT_LEN) | (false, false, INPUT_LEN) => Ok(INPUT_FIELDS),
        (true, ..) => Err(format!("an output image has {OUTPUT_LEN} bytes, found {bytes}")),
        (_, true, _) => Err(format!("an input image has {INPUT_LEN} bytes, found {bytes}")),
        _ => Err(format!(
            "found {bytes}, but an output image has {OUTPUT_LEN} and an input image {INPUT_LEN}"
        )),
    }
}

/// FifoSpace is never above 13,000: in the wrong byte order it nearly always is.
fn other_order_hint(fields: &[Field], image: &[u8], order: ByteOrder) -> Option<String> {
    const LARGEST: u32 = 13_000;
    let field = fields.iter().find(|field| field.name == "FifoSpace")?;
    let other =
        if order.integers == ByteOrder::BIG.integers { ByteOrder::LITTLE } else { ByteOrder::BIG };
    match (field.read(image, order)?, field.read(image, other)?) {
        (FieldValue::Unsigned(found), FieldValue::Unsigned(swapped))
            if found > LARGEST && swapped <= LARGEST =>
        {
            Some(format!(
                "FifoSpace {found} is impossible (at most {LARGEST}), with --byte-order {other} it \
                 is {swapped}"
            ))
        }
        _ => None,
    }
}

fn decode(fields: &[Field], image: &[u8], order: ByteOrder) -> Grid<7> {
    let mut context = Context::default();
    let row = |field: &Field| {
        let value = field.read(image, order)?;
        let Annotation { value: shown, unit, note } = context.annotate(field, value);
        if field.field_type == FieldType::Reserved && value == FieldValue::Unsigned(0) {
            return None;
        }
        let is_bit = matches!(field.field_type, FieldType::Bool | FieldType::Reserved);
        Some([
            ("byte", field.byte_offset.into()),
            ("bit", is_bit.then_some(field.bit).into()),
            ("section", field.section.into()),
            ("name", field.name.into()),
            ("value", shown),
            ("unit", if unit.is_empty() { Value::Null } else { unit.into() }),
            ("note", if note.is_empty() { Value::Null } else { note.into() }),
        ])
    };
    fields.iter().filter_map(row).collect()
}

/// What fields before this one tell about it.
#[derive(Default)]
struct Context {
    command: MotionCommandId,
    slot: Option<DynamicType>,
    /// Position of the next argument, or of the next value of a slot.
    position: usize,
}

struct Annotation {
    value: Value,
    unit: &'static str,
    note: String,
}

impl Context {
    fn annotate(&mut self, field: &Field, value: FieldValue) -> Annotation {
        let unit = field.unit;
        match (field.name, value) {
            ("ErrorCode", FieldValue::Unsigned(code)) if code != 0 => {
                let code = u16::try_from(code).unwrap_or(u16::MAX);
                let text = Code(code).describe().map_or("not in the manual", |info| info.text);
                Annotation { value: code.into(), unit, note: text.into() }
            }
            ("MotionCommandID", FieldValue::Unsigned(id)) => {
                (self.command, self.position) = (MotionCommandId(id), 0);
                let name = self.command.spec().map_or("not in the manual", |spec| spec.name);
                Annotation { value: id.into(), unit, note: name.into() }
            }
            ("DynamicType", FieldValue::Unsigned(id)) => {
                (self.slot, self.position) = (Some(DynamicType(id)), 0);
                Annotation { value: id.into(), unit, note: type_name(DynamicType(id)) }
            }
            (name, FieldValue::Unsigned(id)) if name.starts_with("DynamicDataTypeID") => {
                Annotation { value: id.into(), unit, note: type_name(DynamicType(id)) }
            }
            (name, FieldValue::Real(value)) if name.starts_with("Argument") => {
                let argument =
                    self.command.spec().and_then(|spec| spec.arguments.get(self.position));
                self.position += 1;
                match argument {
                    Some(argument) => Annotation {
                        value: real(value),
                        unit: argument.unit.symbol(),
                        note: argument.name.into(),
                    },
                    None => Annotation { value: real(value), unit, note: String::new() },
                }
            }
            (name, FieldValue::Real(value)) if name.starts_with("ValueIdx") => {
                let spec = self.slot.and_then(DynamicType::spec);
                let meaning = spec.and_then(|spec| spec.values.get(self.position));
                let is_integer =
                    self.slot == Some(DynamicType::SERIAL_NUMBER) && self.position == 1;
                self.position += 1;
                Annotation {
                    value: if is_integer { value.to_bits().into() } else { real(value) },
                    unit: meaning.map_or("", |meaning| meaning.unit.symbol()),
                    note: meaning.map_or_else(String::new, |meaning| meaning.name.into()),
                }
            }
            (_, value) => Annotation { value: plain(value), unit, note: String::new() },
        }
    }
}

fn type_name(ty: DynamicType) -> String {
    ty.spec().map_or("not in the manual", |spec: &DynamicTypeSpec| spec.name).to_string()
}

fn plain(value: FieldValue) -> Value {
    match value {
        FieldValue::Bool(value) => u8::from(value).into(),
        FieldValue::Unsigned(value) => value.into(),
        FieldValue::Signed(value) => value.into(),
        FieldValue::Real(value) => real(value),
    }
}
