//! The built-in virtual robots, as the command line sets them up.

use std::prelude::v1::*;

use clap::{Args, ValueEnum};

use super::order::OrderName;
use crate::sim::meca500::{CyclicBus, FittedTool, RobotSettings, VirtualRobot};
use crate::wire::meca500::revision::Revision;

/// How the virtual robots are built; all of them alike.
#[derive(Args, Debug)]
#[command(next_help_heading = "Virtual robots (--link sim, ethercat-sim, enip-sim, tcp-sim)")]
pub(super) struct SimArgs {
    /// Byte order that the virtual robots speak; without it big behind sim, little behind
    /// ethercat-sim and enip-sim.
    #[arg(long, value_enum, value_name = "ORDER")]
    sim_byte_order: Option<OrderName>,
    /// Tool on their flanges; without it megp25e.
    #[arg(long, value_enum, value_name = "TOOL")]
    sim_tool: Option<ToolName>,
}

impl SimArgs {
    /// The first option that was given, if one was.
    pub(super) const fn given(&self) -> Option<&'static str> {
        match self {
            Self { sim_byte_order: Some(_), .. } => Some("--sim-byte-order"),
            Self { sim_tool: Some(_), .. } => Some("--sim-tool"),
            _ => None,
        }
    }
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

/// A virtual robot that has booted, deactivated and not homed. It speaks `order` unless it was told
/// another.
pub(super) fn new(
    args: &SimArgs,
    order: OrderName,
    revision: Revision,
    bus: CyclicBus,
) -> VirtualRobot {
    VirtualRobot::new(RobotSettings {
        revision,
        bus,
        byte_order: args.sim_byte_order.unwrap_or(order).into(),
        tool: args.sim_tool.unwrap_or(ToolName::Megp25e).into(),
        ..RobotSettings::default()
    })
}
