//! The built-in virtual robot, as the command line sets it up.

use std::prelude::v1::*;

use clap::{Args, ValueEnum};

use super::order::OrderName;
use crate::sim::meca500::{FittedTool, RobotSettings, VirtualRobot};
use crate::wire::meca500::revision::Revision;

/// How the virtual robot is built.
#[derive(Args, Debug)]
#[command(next_help_heading = "Virtual robot (--link sim)")]
pub(super) struct SimArgs {
    /// Byte order that the virtual robot speaks.
    #[arg(long, value_enum, default_value_t = OrderName::Big, value_name = "ORDER")]
    sim_byte_order: OrderName,
    /// Tool on its flange.
    #[arg(long, value_enum, default_value_t = ToolName::Megp25e, value_name = "TOOL")]
    sim_tool: ToolName,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum ToolName {
    /// None.
    None,
    /// Electric gripper MEGP 25E, opens 6 mm.
    Megp25e,
    /// Electric gripper MEGP 25LS, opens 48 mm.
    Megp25ls,
    /// Pneumatic module MPM500 with two valves.
    Mpm500,
}

impl From<ToolName> for FittedTool {
    fn from(name: ToolName) -> Self {
        match name {
            ToolName::None => Self::None,
            ToolName::Megp25e => Self::Megp25E,
            ToolName::Megp25ls => Self::Megp25Ls,
            ToolName::Mpm500 => Self::Mpm500,
        }
    }
}

/// A virtual robot that has booted, deactivated and not homed.
pub(super) fn new(args: &SimArgs, revision: Revision) -> VirtualRobot {
    VirtualRobot::new(RobotSettings {
        revision,
        byte_order: args.sim_byte_order.into(),
        tool: args.sim_tool.into(),
        ..RobotSettings::default()
    })
}
