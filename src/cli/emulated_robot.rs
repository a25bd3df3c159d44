//! A virtual robot with an emulated ESC in front of it: what stands on an EtherCAT segment.

use std::prelude::v1::*;

use super::exit::Failure;
use crate::bus::ethercat::meca500::{Meca500Application, Meca500Settings};
use crate::bus::ethercat::{Settings, SubDevice};
use crate::cycle::CyclicDevice;
use crate::wire::ethercat::coe::info::DataType;
use crate::wire::ethercat::sii::{Pdo, PdoDirection, PdoEntry, SiiImage};
use crate::wire::meca500::image::FieldType;
use crate::wire::meca500::image::pdo::{PdoLayout, Pdos, input_pdos, output_pdos};
use crate::wire::meca500::subdevice::DESCRIPTION;

/// How a robot presents itself on the segment, beside what [`Meca500Settings`] says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Presentation {
    /// Second station address, 0 for none.
    pub(super) alias: u16,
    /// Whether its ESC has a distributed clock.
    pub(super) distributed_clock: bool,
    /// Whether its SII holds PDO categories, which that of a real robot does not.
    pub(super) pdos_in_sii: bool,
}

/// Refuses PDOs that none of the layouts has; `option` is where they were given.
pub(super) fn refuse_unknown_pdos(
    option: &str,
    pdos: &[u16],
    layouts: &[PdoLayout],
) -> Result<(), Failure> {
    let indices = |direction: fn(PdoLayout) -> Pdos| {
        let of_one = move |layout: &PdoLayout| direction(*layout).map(|pdo| pdo.index);
        let mut indices: Vec<u16> = layouts.iter().flat_map(of_one).collect();
        indices.sort_unstable();
        indices.dedup();
        indices
    };
    let known = [indices(output_pdos), indices(input_pdos)].concat();
    match pdos.iter().find(|pdo| !known.contains(pdo)) {
        None => Ok(()),
        Some(unknown) => {
            let known: Vec<String> = known.iter().map(|pdo| format!("{pdo:04X}")).collect();
            Err(Failure::usage(format!(
                "{option}: no PDO {unknown:04X} in this firmware's image; there are {}",
                known.join(", ")
            )))
        }
    }
}

/// `robot` behind an ESC whose power has just come.
pub(super) fn emulated<D: CyclicDevice>(
    robot: D,
    settings: Meca500Settings,
    presentation: Presentation,
) -> Result<SubDevice<Meca500Application<D>>, Failure> {
    let mut description = DESCRIPTION;
    description.serial = settings.serial;
    description.alias = presentation.alias;
    if !presentation.distributed_clock {
        description.dc = None;
    }
    let too_long = |error| Failure::internal(format!("the SII of a robot: {error}"));
    let mut sii = SiiImage::new(&description).map_err(too_long)?;
    if presentation.pdos_in_sii {
        let layout = settings.layout;
        let outputs = in_sii(output_pdos(layout), OUTPUT_SYNC_MANAGER);
        sii.push_pdos(PdoDirection::Outputs, outputs).map_err(too_long)?;
        let inputs = in_sii(input_pdos(layout), INPUT_SYNC_MANAGER);
        sii.push_pdos(PdoDirection::Inputs, inputs).map_err(too_long)?;
    }
    let esc = Settings { distributed_clock: presentation.distributed_clock, ..Settings::default() };
    let application = Meca500Application::new(robot, settings);
    Ok(SubDevice::new(application, &description, sii, esc))
}

const OUTPUT_SYNC_MANAGER: u8 = 2;
const INPUT_SYNC_MANAGER: u8 = 3;

/// PDOs as the SII's categories list them.
fn in_sii(
    pdos: Pdos,
    sync_manager: u8,
) -> impl Iterator<Item = Pdo<impl Iterator<Item = PdoEntry>>> {
    pdos.map(move |pdo| Pdo {
        index: pdo.index,
        sync_manager,
        entries: pdo.entries().map(|entry| PdoEntry {
            index: entry.object,
            sub_index: entry.sub_index,
            data_type: data_type(entry.field_type),
            bits: entry.bits,
        }),
    })
}

/// The low byte of the CoE data type: the SII has no room for more, and basic types need none.
const fn data_type(field_type: FieldType) -> u8 {
    let data_type = match field_type {
        FieldType::Bool => DataType::BOOLEAN,
        FieldType::U8 => DataType::UNSIGNED8,
        FieldType::I8 => DataType::INTEGER8,
        FieldType::U16 => DataType::UNSIGNED16,
        FieldType::U32 => DataType::UNSIGNED32,
        FieldType::F32 => DataType::REAL32,
        FieldType::Reserved => DataType::NONE,
    };
    data_type.0 as u8
}
