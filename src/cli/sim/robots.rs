//! The robots that are served, before anybody serves them.

use std::prelude::v1::*;

use super::args::{ModeName, SimArgs};
use super::labels::Labels;
use super::operator::Prepared;
use super::shared_robot::SharedRobot;
use crate::cli::enip::robots::FIRST_SERIAL;
use crate::cli::exit::Failure;
use crate::sim::meca500::{CyclicBus, FieldbusMode, NetworkSettings, RobotSettings};

/// The robots that the command line wants, in the mode in which they boot and with what they have kept;
/// `tell` hears what the command line overrules of that.
pub(super) fn robots(
    args: &SimArgs,
    prepared: &Prepared,
    tell: &mut dyn FnMut(String),
) -> Result<Vec<SharedRobot>, Failure> {
    let labels = Labels { are_several: args.robots > 1, is_mixed: false };
    (0..args.robots)
        .map(|number| {
            let serial_number = FIRST_SERIAL + u32::from(number);
            let number = usize::from(number);
            let mode = match prepared.was_in_ethercat_mode(number) {
                Some(true) => args.mode_when_left_in(ModeName::Ethercat),
                Some(false) => args.mode_when_left_in(ModeName::Tcp),
                None => args.mode(),
            };
            let settings = settings(args, mode, serial_number);
            let (mut robot, told) = prepared.robot(number, settings)?;
            if let Some(told) = told {
                tell(format!("{}{told}", labels.of(number)));
            }
            if mode == ModeName::Ethercat {
                robot.switch_to_ethercat();
            }
            Ok(SharedRobot::new(robot))
        })
        .collect()
}

fn settings(args: &SimArgs, mode: ModeName, serial_number: u32) -> RobotSettings {
    let mut settings = RobotSettings {
        serial_number,
        revision: args.revision.into(),
        byte_order: args.byte_order.into(),
        layout: args.layout.into(),
        tool: args.tool.into(),
        bus: match (&args.enip, &args.ethercat) {
            (Some(_), _) => CyclicBus::EtherNetIp,
            (None, Some(_)) => CyclicBus::EtherCat,
            (None, None) => CyclicBus::Direct,
        },
        network: NetworkSettings {
            // Whoever serves it has enabled it before.
            ethernet_ip: match args.enip {
                None => FieldbusMode::Disabled,
                Some(_) if args.monitoring_only => FieldbusMode::MonitoringOnly,
                Some(_) => FieldbusMode::Enabled,
            },
            ..NetworkSettings::default()
        },
        ..RobotSettings::default()
    };
    settings.persistent.ethercat_enabled = mode == ModeName::Ethercat;
    settings
}
