//! The object dictionary of the Meca500.
//!
//! Process data, PDO mappings and their names come from the rows of the images; only the objects
//! of the communication area (1000h to 1018h, 1C00h to 1C33h) are spelled here.

use super::assignment::{Assignment, Direction};
use super::settings::Meca500Settings;
use super::sync::{MIN_CYCLE_NS, SyncParameters, TYPES_SUPPORTED};
use crate::bus::ethercat::coe::{Dictionary, Entry, Object, copy_bits};
use crate::wire::ethercat::coe::AbortCode;
use crate::wire::ethercat::coe::info::{DataType, ObjectAccess, ObjectCode};
use crate::wire::ethercat::identity::Identity;
use crate::wire::meca500::image::pdo::{Pdo, PdoEntry};
use crate::wire::meca500::image::{FieldType, INPUT_LEN, OUTPUT_LEN};

const DEVICE_TYPE: u16 = 0x1000;
const ERROR_REGISTER: u16 = 0x1001;
const DEVICE_NAME: u16 = 0x1008;
const HARDWARE_VERSION: u16 = 0x1009;
const SOFTWARE_VERSION: u16 = 0x100A;
const IDENTITY: u16 = 0x1018;
const SYNC_MANAGER_TYPES: u16 = 0x1C00;
const OUTPUT_ASSIGNMENT: u16 = 0x1C12;
const INPUT_ASSIGNMENT: u16 = 0x1C13;
const OUTPUT_SYNC: u16 = 0x1C32;
const INPUT_SYNC: u16 = 0x1C33;

/// The one object whose numbers have holes. Source: PM Table 21.
const SAFETY_STATUS: u16 = 0x6065;

/// The communication area.
const COMMUNICATION: [u16; 11] = [
    DEVICE_TYPE,
    ERROR_REGISTER,
    DEVICE_NAME,
    HARDWARE_VERSION,
    SOFTWARE_VERSION,
    IDENTITY,
    SYNC_MANAGER_TYPES,
    OUTPUT_ASSIGNMENT,
    INPUT_ASSIGNMENT,
    OUTPUT_SYNC,
    INPUT_SYNC,
];

/// Objects 6000h and 7000h hold inputs and outputs: the modular device profile. Source: choice.
const MODULAR_DEVICE: u32 = 5_001;

/// What the sync managers are for: mailbox out, mailbox in, outputs, inputs.
const SYNC_MANAGERS: [u8; 4] = [1, 2, 3, 4];

/// Everything that can be asked by SDO, with the images behind the process data.
#[derive(Debug)]
pub(super) struct Objects {
    settings: Meca500Settings,
    pub(super) outputs: [u8; OUTPUT_LEN],
    pub(super) inputs: [u8; INPUT_LEN],
    pub(super) output_assignment: Assignment,
    pub(super) input_assignment: Assignment,
    output_sync: SyncParameters,
    input_sync: SyncParameters,
    outputs_written: bool,
    inputs_written: bool,
}

/// What stands at an index.
#[derive(Clone, Copy)]
enum Place {
    Number(u32, &'static str),
    ErrorRegister,
    Text(&'static str, &'static str),
    Identity,
    SyncManagerTypes,
    Assignment(Direction),
    Sync(Direction),
    Mapping(Pdo),
    /// Process data; its highest sub-index and the first of its entries.
    Process(Direction, u8, PdoEntry),
}

impl Objects {
    pub(super) fn new(settings: Meca500Settings) -> Self {
        let assignment = |direction| {
            Assignment::new(direction, settings.layout, settings.unassigned_at_power_up)
        };
        Self {
            settings,
            outputs: [0; OUTPUT_LEN],
            inputs: [0; INPUT_LEN],
            output_assignment: assignment(Direction::Outputs),
            input_assignment: assignment(Direction::Inputs),
            output_sync: SyncParameters::new(Direction::Outputs),
            input_sync: SyncParameters::new(Direction::Inputs),
            outputs_written: false,
            inputs_written: false,
        }
    }

    pub(super) const fn settings(&self) -> &Meca500Settings {
        &self.settings
    }

    /// Whether the assignments are such that SAFE-OP may be entered.
    pub(super) const fn mapping_is_settled(&self) -> bool {
        !self.settings.assignment_must_be_written || self.outputs_written && self.inputs_written
    }

    const fn assignment(&self, direction: Direction) -> &Assignment {
        match direction {
            Direction::Outputs => &self.output_assignment,
            Direction::Inputs => &self.input_assignment,
        }
    }

    const fn sync(&self, direction: Direction) -> &SyncParameters {
        match direction {
            Direction::Outputs => &self.output_sync,
            Direction::Inputs => &self.input_sync,
        }
    }

    /// The entries of the process data of `direction`, gaps left out.
    fn mapped(&self, direction: Direction) -> impl Iterator<Item = PdoEntry> {
        direction
            .pdos(self.settings.layout)
            .flat_map(|pdo| pdo.entries())
            .filter(|entry| !entry.is_gap())
    }

    /// The entries of one object of the process data. Main devices wait for a mailbox as long as
    /// for any frame, so only the PDO that maps the object is looked through.
    fn process(&self, direction: Direction, index: u16) -> impl Iterator<Item = PdoEntry> {
        direction
            .pdos(self.settings.layout)
            .filter(move |pdo| pdo.objects().any(|object| object == index))
            .flat_map(|pdo| pdo.entries())
            .filter(move |entry| entry.object == index)
    }

    fn process_entry(&self, direction: Direction, index: u16, sub_index: u8) -> Option<PdoEntry> {
        self.process(direction, index).find(|entry| entry.sub_index == sub_index)
    }

    fn pdos(&self) -> impl Iterator<Item = Pdo> {
        let layout = self.settings.layout;
        Direction::Outputs.pdos(layout).chain(Direction::Inputs.pdos(layout))
    }

    fn place(&self, index: u16) -> Option<Place> {
        Some(match index {
            DEVICE_TYPE => Place::Number(MODULAR_DEVICE, "Device type"),
            ERROR_REGISTER => Place::ErrorRegister,
            DEVICE_NAME => Place::Text("Meca500", "Device name"),
            HARDWARE_VERSION => Place::Text(self.settings.hardware_version, "Hardware version"),
            SOFTWARE_VERSION => Place::Text(self.settings.software_version, "Software version"),
            IDENTITY => Place::Identity,
            SYNC_MANAGER_TYPES => Place::SyncManagerTypes,
            OUTPUT_ASSIGNMENT => Place::Assignment(Direction::Outputs),
            INPUT_ASSIGNMENT => Place::Assignment(Direction::Inputs),
            OUTPUT_SYNC => Place::Sync(Direction::Outputs),
            INPUT_SYNC => Place::Sync(Direction::Inputs),
            _ => {
                if let Some(pdo) = self.pdos().find(|pdo| pdo.index == index) {
                    return Some(Place::Mapping(pdo));
                }
                let process = |direction| {
                    let own = || self.process(direction, index);
                    let highest = own().map(|entry| entry.sub_index).max()?;
                    Some(Place::Process(direction, highest, own().next()?))
                };
                return process(Direction::Inputs).or_else(|| process(Direction::Outputs));
            }
        })
    }

    /// The bit of a fault: set while the robot reports an error code. Source: ETG.1000 part 6.
    fn error_register(&self) -> u8 {
        let code = self.mapped(Direction::Inputs).find(|entry| entry.name == "ErrorCode");
        let mut value = [0; 2];
        code.and_then(|entry| copy_bits(&self.inputs, entry.image_bit.into(), &mut value, 0, 16));
        u8::from(value != [0; 2])
    }

    const fn identity(&self) -> [u32; 4] {
        let Identity { vendor, product, revision, serial } =
            Identity::meca500(self.settings.serial);
        [vendor, product, revision, serial]
    }

    /// The value of a process data entry, in the byte order of the image.
    fn read_process(
        &self,
        direction: Direction,
        entry: PdoEntry,
        value: &mut [u8],
    ) -> Result<usize, AbortCode> {
        let image: &[u8] = match direction {
            Direction::Outputs => &self.outputs,
            Direction::Inputs => &self.inputs,
        };
        let (bits, len) = (usize::from(entry.bits), usize::from(entry.bits.div_ceil(8)));
        value.get_mut(..len).ok_or(AbortCode::OUT_OF_MEMORY)?.fill(0);
        copy_bits(image, entry.image_bit.into(), value, 0, bits).ok_or(AbortCode::GENERAL)?;
        Ok(len)
    }
}

impl Dictionary for Objects {
    fn next_index(&self, after: Option<u16>) -> Option<u16> {
        COMMUNICATION
            .into_iter()
            .chain(self.pdos().map(|pdo| pdo.index))
            .chain(self.pdos().flat_map(|pdo| pdo.objects()))
            .filter(|index| after.is_none_or(|after| *index > after))
            .min()
    }

    fn object(&self, index: u16) -> Option<Object> {
        let variable = |data_type, name| Object {
            code: ObjectCode::Variable,
            data_type,
            max_sub_index: 0,
            name,
        };
        let many =
            |code, data_type, max_sub_index, name| Object { code, data_type, max_sub_index, name };
        let (array, record) = (ObjectCode::Array, ObjectCode::Record);
        Some(match self.place(index)? {
            Place::Number(_, name) => variable(DataType::UNSIGNED32, name),
            Place::ErrorRegister => variable(DataType::UNSIGNED8, "Error register"),
            Place::Text(_, name) => variable(DataType::VISIBLE_STRING, name),
            Place::Identity => many(record, DataType::IDENTITY, 4, "Identity"),
            Place::SyncManagerTypes => many(array, DataType::UNSIGNED8, 4, "Sync manager types"),
            Place::Assignment(direction) => {
                let name = match direction {
                    Direction::Outputs => "RxPDO assignment",
                    Direction::Inputs => "TxPDO assignment",
                };
                many(array, DataType::UNSIGNED16, self.assignment(direction).capacity(), name)
            }
            Place::Sync(direction) => {
                let name = match direction {
                    Direction::Outputs => "Timing of the outputs",
                    Direction::Inputs => "Timing of the inputs",
                };
                many(record, DataType::SYNC_PARAMETER, 6, name)
            }
            Place::Mapping(pdo) => {
                let entries = u8::try_from(pdo.entries().count()).unwrap_or(u8::MAX);
                many(record, DataType::PDO_MAPPING, entries, pdo.name())
            }
            Place::Process(_, 0, entry) => variable(data_type(entry.field_type), entry.name),
            Place::Process(_, highest, entry) => {
                let name = entry.field.map_or("", |field| field.section);
                many(record, DataType::RECORD, highest, name)
            }
        })
    }

    fn entry(&self, index: u16, sub_index: u8) -> Option<Entry> {
        let read_only =
            |data_type, bits, name| Entry { data_type, bits, access: ObjectAccess::READ, name };
        let object = self.object(index)?;
        let place = self.place(index)?;
        if sub_index > object.max_sub_index {
            return None;
        }
        if sub_index == 0 && object.code != ObjectCode::Variable {
            let count = read_only(DataType::UNSIGNED8, 8, "Highest sub-index");
            return Some(match place {
                Place::Assignment(_) => Entry { access: WRITTEN_AT_START, ..count },
                _ => count,
            });
        }
        Some(match place {
            Place::Number(_, name) => read_only(DataType::UNSIGNED32, 32, name),
            Place::ErrorRegister => read_only(DataType::UNSIGNED8, 8, object.name),
            Place::Text(text, name) => {
                let bits = u16::try_from(text.len() * 8).unwrap_or(u16::MAX);
                read_only(DataType::VISIBLE_STRING, bits, name)
            }
            Place::Identity => {
                let names = ["Vendor ID", "Product code", "Revision number", "Serial number"];
                let name = names.get(usize::from(sub_index) - 1)?;
                read_only(DataType::UNSIGNED32, 32, name)
            }
            Place::SyncManagerTypes => read_only(DataType::UNSIGNED8, 8, "Type"),
            Place::Assignment(_) => {
                let entry = read_only(DataType::UNSIGNED16, 16, "PDO");
                Entry { access: WRITTEN_AT_START, ..entry }
            }
            Place::Sync(_) => {
                let (short, long) = (DataType::UNSIGNED16, DataType::UNSIGNED32);
                let written = |entry| Entry { access: WRITTEN_AT_START, ..entry };
                match sub_index {
                    1 => written(read_only(short, 16, "Synchronization type")),
                    2 => written(read_only(long, 32, "Cycle time")),
                    3 => read_only(long, 32, "Shift time"),
                    4 => read_only(short, 16, "Synchronization types supported"),
                    5 => read_only(long, 32, "Minimum cycle time"),
                    _ => read_only(long, 32, "Calculation and copy time"),
                }
            }
            Place::Mapping(pdo) => {
                let mapped = pdo.entries().nth(usize::from(sub_index) - 1)?;
                read_only(DataType::UNSIGNED32, 32, mapped.name)
            }
            Place::Process(direction, ..) => {
                let Some(mapped) = self.process_entry(direction, index, sub_index) else {
                    // Where 6065h leaves numbers out, each stands for one reserved bit.
                    return (index == SAFETY_STATUS).then(|| Entry::padding(1));
                };
                let mappable = match direction {
                    Direction::Outputs => ObjectAccess::RX_PDO,
                    Direction::Inputs => ObjectAccess::TX_PDO,
                };
                Entry {
                    data_type: data_type(mapped.field_type),
                    bits: mapped.bits.into(),
                    access: ObjectAccess::READ | mappable,
                    name: mapped.name,
                }
            }
        })
    }

    fn read(&self, index: u16, sub_index: u8, value: &mut [u8]) -> Result<usize, AbortCode> {
        let place = self.place(index).ok_or(AbortCode::NO_OBJECT)?;
        let object = self.object(index).ok_or(AbortCode::NO_OBJECT)?;
        let missing = AbortCode::NO_SUB_INDEX;
        if sub_index == 0 && object.code != ObjectCode::Variable {
            let highest = match place {
                Place::Assignment(direction) => self.assignment(direction).count(),
                _ => object.max_sub_index,
            };
            return put(value, &[highest]);
        }
        let nth = usize::from(sub_index).saturating_sub(1);
        match place {
            Place::Number(number, _) => put(value, &number.to_le_bytes()),
            Place::ErrorRegister => put(value, &[self.error_register()]),
            Place::Text(text, _) => put(value, text.as_bytes()),
            Place::Identity => put(value, &self.identity().get(nth).ok_or(missing)?.to_le_bytes()),
            Place::SyncManagerTypes => put(value, &[*SYNC_MANAGERS.get(nth).ok_or(missing)?]),
            Place::Assignment(direction) => {
                let pdo = self.assignment(direction).index_at(sub_index).ok_or(missing)?;
                put(value, &pdo.to_le_bytes())
            }
            Place::Sync(direction) => {
                let sync = self.sync(direction);
                match sub_index {
                    1 => put(value, &sync.sync_type.to_le_bytes()),
                    2 => put(value, &sync.cycle_ns.to_le_bytes()),
                    4 => put(value, &TYPES_SUPPORTED.to_le_bytes()),
                    5 => put(value, &MIN_CYCLE_NS.to_le_bytes()),
                    _ => put(value, &0_u32.to_le_bytes()),
                }
            }
            Place::Mapping(pdo) => {
                let entry = pdo.entries().nth(nth).ok_or(missing)?;
                put(value, &entry.mapping().to_le_bytes())
            }
            Place::Process(direction, ..) => {
                let entry = self.process_entry(direction, index, sub_index).ok_or(missing)?;
                self.read_process(direction, entry, value)
            }
        }
    }

    fn write(&mut self, index: u16, sub_index: u8, value: &[u8]) -> Result<(), AbortCode> {
        match (index, sub_index, value) {
            (OUTPUT_ASSIGNMENT, 0, [count]) => {
                self.output_assignment.set_count(*count)?;
                self.outputs_written |= *count > 0;
                Ok(())
            }
            (INPUT_ASSIGNMENT, 0, [count]) => {
                self.input_assignment.set_count(*count)?;
                self.inputs_written |= *count > 0;
                Ok(())
            }
            (OUTPUT_ASSIGNMENT, _, [low, high]) => {
                self.output_assignment.set_index(sub_index, u16::from_le_bytes([*low, *high]))
            }
            (INPUT_ASSIGNMENT, _, [low, high]) => {
                self.input_assignment.set_index(sub_index, u16::from_le_bytes([*low, *high]))
            }
            (OUTPUT_SYNC, 1, [low, high]) => {
                self.output_sync.set_type(u16::from_le_bytes([*low, *high]))
            }
            (INPUT_SYNC, 1, [low, high]) => {
                self.input_sync.set_type(u16::from_le_bytes([*low, *high]))
            }
            (OUTPUT_SYNC, 2, [a, b, c, d]) => {
                self.output_sync.set_cycle_ns(u32::from_le_bytes([*a, *b, *c, *d]))
            }
            (INPUT_SYNC, 2, [a, b, c, d]) => {
                self.input_sync.set_cycle_ns(u32::from_le_bytes([*a, *b, *c, *d]))
            }
            _ => Err(AbortCode::READ_ONLY),
        }
    }

    fn write_complete(&mut self, index: u16, first: u8, values: &[u8]) -> Result<(), AbortCode> {
        let counted = first == 0 && values.first().is_some_and(|count| *count > 0);
        match index {
            OUTPUT_ASSIGNMENT => {
                self.output_assignment.set_all(first, values)?;
                self.outputs_written |= counted;
                Ok(())
            }
            INPUT_ASSIGNMENT => {
                self.input_assignment.set_all(first, values)?;
                self.inputs_written |= counted;
                Ok(())
            }
            _ => Err(AbortCode::UNSUPPORTED_ACCESS),
        }
    }
}

/// What a main device sets up before it leaves PRE-OP.
const WRITTEN_AT_START: ObjectAccess =
    ObjectAccess::READ.union(ObjectAccess::WRITE_PRE_OP).union(ObjectAccess::SETTINGS);

/// Writes `bytes` to the front of `value`; returns their number.
fn put(value: &mut [u8], bytes: &[u8]) -> Result<usize, AbortCode> {
    let room = value.get_mut(..bytes.len()).ok_or(AbortCode::OUT_OF_MEMORY)?;
    room.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
    Ok(bytes.len())
}

/// The type of a field as a dictionary names it.
const fn data_type(field_type: FieldType) -> DataType {
    match field_type {
        FieldType::Bool => DataType::BOOLEAN,
        FieldType::U8 => DataType::UNSIGNED8,
        FieldType::I8 => DataType::INTEGER8,
        FieldType::U16 => DataType::UNSIGNED16,
        FieldType::U32 => DataType::UNSIGNED32,
        FieldType::F32 => DataType::REAL32,
        FieldType::Reserved => DataType::NONE,
    }
}
