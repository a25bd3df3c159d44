//! The emulated line that `fieldarm probe ethercat-sim` looks at.

use std::prelude::v1::*;

use clap::{Args, ValueEnum};

use crate::bus::ethercat::meca500::{Meca500Application, Meca500Settings};
use crate::cli::emulated_robot::{Presentation, emulated, refuse_unknown_pdos};
use crate::cli::exit::Failure;
use crate::cli::order::OrderName;
use crate::cli::run_program::RevisionName;
use crate::cli::sim::parse_pdo;
use crate::cli::virtual_robot::ToolName;
use crate::link::ethercat::memory::MemoryWire;
use crate::sim::meca500::{CyclicBus, RobotSettings, VirtualRobot};
use crate::wire::meca500::image::FirmwareLayout;
use crate::wire::meca500::image::pdo::PdoLayout;

/// Serial number of the first robot; those behind it count up.
const FIRST_SERIAL: u32 = 87_654_321;

/// How the emulated robots are built. A list is for one robot after the other; its last value is for
/// all that follow.
#[derive(Args, Clone, Debug, Default, PartialEq)]
#[command(next_help_heading = "Virtual robots (ethercat-sim)")]
pub(super) struct LineArgs {
    /// Number of robots in a row: 1 to 16; without it 1.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=16))]
    robots: Option<u8>,
    /// Byte order of their images; without it little.
    #[arg(long, value_enum, value_name = "ORDER", value_delimiter = ',')]
    sim_byte_order: Vec<OrderName>,
    /// Firmware whose process image they have; without it 11.3.
    #[arg(long, value_enum, value_name = "FIRMWARE", value_delimiter = ',')]
    sim_layout: Vec<LayoutName>,
    /// Tool on their flanges; without it megp25e.
    #[arg(long, value_enum, value_name = "TOOL", value_delimiter = ',')]
    sim_tool: Vec<ToolName>,
    /// Hardware revision; without it R3.
    #[arg(long, value_enum, ignore_case = true, value_name = "REVISION", value_delimiter = ',')]
    sim_revision: Vec<RevisionName>,
    /// PDOs that all leave unassigned at power-up, e.g. 1A08.
    #[arg(long, value_name = "PDO", value_delimiter = ',', value_parser = parse_pdo)]
    sim_unassigned: Vec<u16>,
    /// All refuse SAFE-OP until the PDO assignment is written.
    #[arg(long)]
    sim_demand_assignment: bool,
    /// Robots without distributed clocks.
    #[arg(long)]
    sim_no_dc: bool,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum LayoutName {
    /// Firmware 11.3, the programming manual.
    #[default]
    #[value(name = "11.3")]
    V11_3,
    /// Firmware 11.3, objects numbered as the manual prints them.
    #[value(name = "11.3-printed")]
    V11_3Printed,
    /// Firmware 10.2.
    #[value(name = "10.2")]
    V10_2,
    /// Firmware 9.3, whose image lacks the safety signals.
    #[value(name = "9.3")]
    V9_3,
}

impl LayoutName {
    const fn pdos(self) -> PdoLayout {
        match self {
            Self::V11_3 => PdoLayout::V11_3,
            Self::V11_3Printed => PdoLayout::V11_3Printed,
            Self::V10_2 => PdoLayout::V10_2,
            Self::V9_3 => PdoLayout::V9_3,
        }
    }
}

/// The value for the robot with this number.
fn of<T: Copy>(list: &[T], number: usize, default: T) -> T {
    list.get(number).or(list.last()).copied().unwrap_or(default)
}

impl LineArgs {
    /// Whether anything was said about virtual robots.
    pub(super) fn is_given(&self) -> bool {
        *self != Self::default()
    }

    /// The line, and the wire to it.
    pub(super) fn wire(&self) -> Result<MemoryWire<Meca500Application<VirtualRobot>>, Failure> {
        let count = usize::from(self.robots.unwrap_or(1));
        let layout_of = |number| of(&self.sim_layout, number, LayoutName::V11_3);
        let layouts: Vec<_> = (0..count).map(|number| layout_of(number).pdos()).collect();
        refuse_unknown_pdos("--sim-unassigned", &self.sim_unassigned, &layouts)?;
        // The process ends soon after its robots.
        let unassigned: &'static [u16] = self.sim_unassigned.clone().leak();
        let robot = |number: usize| {
            let serial = FIRST_SERIAL + u32::try_from(number).unwrap_or(0);
            let revision = of(&self.sim_revision, number, RevisionName::R3);
            let layout = layout_of(number);
            let (image, firmware, software_version) = match layout {
                LayoutName::V11_3 | LayoutName::V11_3Printed => {
                    (FirmwareLayout::V11_3, [11, 3, 84, 0], "11.3.84")
                }
                LayoutName::V10_2 => (FirmwareLayout::V10_2, [10, 2, 0, 0], "10.2"),
                LayoutName::V9_3 => (FirmwareLayout::V10_2, [9, 3, 0, 0], "9.3"),
            };
            let robot = VirtualRobot::new(RobotSettings {
                revision: revision.into(),
                firmware,
                serial_number: serial,
                byte_order: of(&self.sim_byte_order, number, OrderName::Little).into(),
                layout: image,
                bus: CyclicBus::EtherCat,
                tool: of(&self.sim_tool, number, ToolName::Megp25e).into(),
                ..RobotSettings::default()
            });
            let settings = Meca500Settings {
                serial,
                layout: layout.pdos(),
                hardware_version: match revision {
                    RevisionName::R3 => "R3",
                    RevisionName::R4 => "R4",
                },
                software_version,
                unassigned_at_power_up: unassigned,
                assignment_must_be_written: self.sim_demand_assignment,
            };
            let presentation =
                Presentation { alias: 0, distributed_clock: !self.sim_no_dc, pdos_in_sii: false };
            emulated(robot, settings, presentation)
        };
        Ok(MemoryWire::new((0..count).map(robot).collect::<Result<_, _>>()?))
    }
}
