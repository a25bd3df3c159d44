//! Tools and objects that dynamic data speaks of.

use crate::wire::meca500::command::coded;

coded! {
    /// What is mounted on the tool port, or simulated there. Source: PM L6219.
    ExternalTool {
        /// Nothing.
        None = 0,
        /// The gripper MEGP 25E, up to 6 mm.
        Megp25E = 10,
        /// The gripper MEGP 25LS, up to 48 mm.
        Megp25Ls = 11,
        /// The pneumatic module MPM500.
        Mpm500 = 20,
    }
}

impl ExternalTool {
    /// Which of the two layouts of dynamic type 53 the tool reports with.
    #[must_use]
    pub const fn eoat(self) -> Eoat {
        match self {
            Self::None => Eoat::None,
            Self::Megp25E | Self::Megp25Ls => Eoat::Gripper,
            Self::Mpm500 => Eoat::Valves,
        }
    }
}

/// The end-of-arm tooling as far as it decides how dynamic type 53 is read. The slot itself does not
/// tell; type 52 does. Source: PM Table 12, ID 53.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Eoat {
    /// None, or not known.
    #[default]
    None,
    /// A gripper of the family MEGP 25.
    Gripper,
    /// The pneumatic module MPM500.
    Valves,
}

/// Values of dynamic type 53. Source: PM Table 12, ID 53.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EoatStatus {
    /// A gripper of the family MEGP 25.
    Gripper {
        /// The fingers press on something.
        holding_part: bool,
        /// The last commanded opening was reached.
        desired_opening_reached: bool,
        /// The opening counts as closed.
        closed: bool,
        /// The opening counts as open.
        open: bool,
        /// Grip force, signed, in percent of about 40 N.
        force_percent: f32,
        /// Opening of the fingers.
        opening_mm: f32,
    },
    /// The pneumatic module: whether valves 1 and 2 are open.
    Valves([bool; 2]),
}

coded! {
    /// Kind of object that collides or leaves the work zone. Source: PM L5829.
    ObjectGroup {
        /// A part of the robot: 0 is the base, 1 link 1, and so on.
        Links = 0,
        /// The flange center point.
        FlangeCenterPoint = 1,
        /// The tool: 0 is the tool sphere, 10000 the MPM500.
        Tool = 2,
    }
}

/// An object that collides or leaves the work zone. Source: PM L5829.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CollisionObject {
    /// Its kind.
    pub group: ObjectGroup,
    /// Its number within the kind.
    pub id: u16,
}
