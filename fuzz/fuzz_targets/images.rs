//! Arbitrary bytes as images, in every byte order: nothing panics, and what was read writes the
//! same bytes again.
#![no_main]

use std::fmt::{Debug, Write};

use fieldarm::wire::meca500::command::{MotionCommand, MotionCommandId};
use fieldarm::wire::meca500::dynamic::{DynamicType, DynamicValue, Eoat};
use fieldarm::wire::meca500::image::{
    Field, FirmwareLayout, INPUT_FIELDS, INPUT_LEN, InputImage, OUTPUT_FIELDS, OUTPUT_LEN,
    OutputImage,
};
use fieldarm::wire::order::{
    Big, BigIntLittleReal, ByteOrder, ImageOrder, Little, LittleIntBigReal,
};
use libfuzzer_sys::fuzz_target;

/// Counts what is shown, so that showing costs no memory.
struct Shown(usize);

impl Write for Shown {
    fn write_str(&mut self, text: &str) -> std::fmt::Result {
        self.0 += text.len();
        Ok(())
    }
}

fn show(value: &impl Debug) {
    let mut shown = Shown(0);
    write!(shown, "{value:?}").unwrap();
    assert!(shown.0 > 0);
}

fn read_fields(fields: &[Field], image: &[u8], order: ByteOrder) {
    for field in fields {
        let end = (usize::from(field.byte_offset) * 8
            + usize::from(field.bit)
            + usize::from(field.size_bits))
        .div_ceil(8);
        let value = field.read(image, order);
        assert_eq!(value.is_some(), image.len() >= end, "{}", field.name);
        if let Some(value) = value {
            let mut shown = Shown(0);
            write!(shown, "{value}").unwrap();
        }
    }
}

/// The image, if there are enough bytes, through every decoder and back.
fn outputs<O: ImageOrder>(bytes: &[u8]) {
    let Ok(image) = OutputImage::<O>::from_bytes(bytes) else {
        assert_ne!(bytes.len(), OUTPUT_LEN);
        return;
    };
    let values = image.values();
    let mut copy = *image;
    copy.set_values(&values);
    assert_eq!(copy.as_bytes(), bytes);
    show(image);
    show(&values);

    let id = MotionCommandId(values.motion_command.motion_command_id);
    let arguments = values.motion_command_args.argument;
    let command = MotionCommand::decode(id, arguments);
    let (same_id, encoded) = command.encode();
    assert_eq!(same_id, id);
    let again = MotionCommand::decode(same_id, encoded).encode();
    assert_eq!(again.0, id);
    assert_eq!(again.1.map(f32::to_bits), encoded.map(f32::to_bits));
    show(&command);
}

fn inputs<O: ImageOrder>(bytes: &[u8]) {
    let Ok(image) = InputImage::<O>::from_bytes(bytes) else {
        assert_ne!(bytes.len(), INPUT_LEN);
        return;
    };
    let values = image.values();
    let mut copy = *image;
    copy.set_values(&values);
    assert_eq!(copy.as_bytes(), bytes);
    show(image);
    show(&values);
    for layout in [FirmwareLayout::V11_3, FirmwareLayout::V10_2] {
        show(&image.motion_status.checkpoints(layout));
    }
    for slot in &image.dynamic_data {
        let ty = DynamicType(slot.dynamic_type.get());
        let value =
            DynamicValue::from_values(ty, slot.value_idx.each_ref().map(|value| value.get()));
        for eoat in [Eoat::None, Eoat::Gripper, Eoat::Valves] {
            show(&value.view(eoat));
        }
    }
}

fn in_order<O: ImageOrder>(data: &[u8]) {
    outputs::<O>(data);
    inputs::<O>(data);
    if let Some(bytes) = data.first_chunk::<OUTPUT_LEN>() {
        outputs::<O>(bytes);
    }
    if let Some(bytes) = data.last_chunk::<INPUT_LEN>() {
        inputs::<O>(bytes);
    }
    read_fields(OUTPUT_FIELDS, data, O::VALUE);
    read_fields(INPUT_FIELDS, data, O::VALUE);
}

fuzz_target!(|data: &[u8]| {
    in_order::<Big>(data);
    in_order::<Little>(data);
    in_order::<BigIntLittleReal>(data);
    in_order::<LittleIntBigReal>(data);
});
