//! The robots that are served, before anybody serves them.

use std::prelude::v1::*;

use super::args::{ModeName, SimArgs};
use super::shared_robot::SharedRobot;
use crate::cli::enip::robots::FIRST_SERIAL;
use crate::sim::meca500::{CyclicBus, FieldbusMode, NetworkSettings, RobotSettings, VirtualRobot};

/// The robots that the command line wants, in the mode in which they boot.
pub(super) fn robots(args: &SimArgs) -> Vec<SharedRobot> {
    (0..u32::from(args.robots))
        .map(|number| {
            let mut robot = VirtualRobot::new(settings(args, FIRST_SERIAL + number));
            if args.mode() == ModeName::Ethercat {
                robot.switch_to_ethercat();
            }
            SharedRobot::new(robot)
        })
        .collect()
}

fn settings(args: &SimArgs, serial_number: u32) -> RobotSettings {
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
    settings.persistent.ethercat_enabled = args.mode() == ModeName::Ethercat;
    settings
}
