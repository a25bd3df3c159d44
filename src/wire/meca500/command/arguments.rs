//! Argument types of the motion commands: poses, choices, and the small records.

/// The integer that a Real holds exactly, within the 24 bits a Real can count without gaps.
pub(in crate::wire::meca500) fn exact_integer(value: f32) -> Option<i32> {
    const GAPLESS: f32 = 16_777_216.0;
    if !(-GAPLESS..=GAPLESS).contains(&value) {
        return None;
    }
    let integer = value as i32;
    (integer as f32 == value).then_some(integer)
}

/// Declares a choice among a few integers, with its numbers on the wire.
macro_rules! coded {
    (
        $(#[$meta:meta])*
        $name:ident { $($(#[$variant_meta:meta])* $variant:ident = $code:literal),+ $(,)? }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum $name {
            $($(#[$variant_meta])* $variant,)+
        }

        impl $name {
            /// The number on the wire.
            #[must_use]
            pub const fn code(self) -> i16 {
                match self {
                    $(Self::$variant => $code,)+
                }
            }

            /// The choice with this number; `None` for a number without a meaning.
            #[must_use]
            pub const fn from_code(code: i16) -> Option<Self> {
                match code {
                    $($code => Some(Self::$variant),)+
                    _ => None,
                }
            }

            /// The choice a Real holds; `None` unless it is exactly one of the numbers.
            #[must_use]
            pub fn from_real(value: f32) -> Option<Self> {
                $crate::wire::meca500::command::exact_integer(value)
                    .and_then(|integer| i16::try_from(integer).ok())
                    .and_then(Self::from_code)
            }

            /// The number on the wire as a Real.
            #[must_use]
            pub fn to_real(self) -> f32 {
                f32::from(self.code())
            }
        }
    };
}
pub(in crate::wire::meca500) use coded;

/// Position and orientation of one frame with respect to another, or a step of both.
///
/// Orientation is three Euler angles in the mobile XYZ convention: about x, then the new y, then
/// the new z. Any finite angle is accepted by the robot. Source: PM L153, L162.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// Position along x, in mm.
    pub x: f32,
    /// Position along y, in mm.
    pub y: f32,
    /// Position along z, in mm.
    pub z: f32,
    /// First Euler angle, about x, in degrees.
    pub alpha: f32,
    /// Second Euler angle, about y, in degrees.
    pub beta: f32,
    /// Third Euler angle, about z, in degrees.
    pub gamma: f32,
}

impl From<[f32; 6]> for Pose {
    fn from([x, y, z, alpha, beta, gamma]: [f32; 6]) -> Self {
        Self { x, y, z, alpha, beta, gamma }
    }
}

impl From<Pose> for [f32; 6] {
    fn from(pose: Pose) -> Self {
        [pose.x, pose.y, pose.z, pose.alpha, pose.beta, pose.gamma]
    }
}

coded! {
    /// One of the two branches of a posture parameter. Source: PM L2505.
    ConfSign {
        /// -1: shoulder back, elbow down, wrist flipped.
        Minus = -1,
        /// 1: shoulder front, elbow up, wrist not flipped.
        Plus = 1,
    }
}

/// Desired posture: which of the up to eight joint sets of a pose is meant. Source: PM L2505.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Conf {
    /// Shoulder: front (1) or back (-1).
    pub c_s: ConfSign,
    /// Elbow: up (1) or down (-1).
    pub c_e: ConfSign,
    /// Wrist: not flipped (1) or flipped (-1).
    pub c_w: ConfSign,
}

coded! {
    /// Argument of the gripper command. Source: PM Table 8, ID 18.
    GripperAction {
        /// GripperClose.
        Close = 0,
        /// GripperOpen.
        Open = 1,
    }
}

coded! {
    /// What happens to one valve of the MPM500. Source: PM L6672.
    ValveAction {
        /// The valve stays as it is; written `*` or `-1` in text.
        Keep = -1,
        /// The valve closes.
        Close = 0,
        /// The valve opens.
        Open = 1,
    }
}

coded! {
    /// How moves are timed. Source: PM L2768.
    MoveMode {
        /// As fast as the velocity limits allow.
        VelocityBased = 0,
        /// In the time given by SetMoveDuration.
        TimeBased = 1,
    }
}

coded! {
    /// What a breach leads to: of the work zone, of the collision zone, of the move duration.
    /// Source: PM L2727, L5949, L6013.
    Severity {
        /// Only written to the robot's log.
        Silent = 0,
        /// A warning.
        Warning = 1,
        /// A warning and error mode.
        Error = 4,
    }
}

coded! {
    /// What an exceeded torque limit leads to. Source: PM L2889.
    TorqueSeverity {
        /// Nothing.
        None = 0,
        /// A status message.
        Warning = 1,
        /// A status message, and motion pauses.
        Pause = 2,
        /// A status message and error 3029.
        Error = 4,
    }
}

coded! {
    /// What a torque limit is compared with. Source: PM L2894.
    TorqueDetection {
        /// The torque itself, always.
        Always = 0,
        /// The torque itself, except while joints accelerate or decelerate.
        ExceptAcceleration = 1,
        /// The difference between the torque and the calculated one.
        Deviation = 2,
    }
}

coded! {
    /// What must stay inside the work zone. Source: PM L6017.
    WorkZoneMode {
        /// The flange center point.
        FlangeCenterPoint = 1,
        /// The tool sphere, and the MPM500 where one is mounted.
        Tool = 2,
        /// The tool and every link.
        ToolAndLinks = 3,
    }
}

/// Mass at the flange. Source: PM L2800.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Payload {
    /// Mass of everything mounted on the flange, in kg.
    pub m: f32,
    /// Center of mass along x of the flange frame, in mm.
    pub c_x: f32,
    /// Center of mass along y of the flange frame, in mm.
    pub c_y: f32,
    /// Center of mass along z of the flange frame, in mm.
    pub c_z: f32,
}

/// A box parallel to the base frame. Source: PM L6037.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WorkZoneLimits {
    /// Lowest corner, x, in mm.
    pub x_min: f32,
    /// Lowest corner, y, in mm.
    pub y_min: f32,
    /// Lowest corner, z, in mm.
    pub z_min: f32,
    /// Highest corner, x, in mm.
    pub x_max: f32,
    /// Highest corner, y, in mm.
    pub y_max: f32,
    /// Highest corner, z, in mm.
    pub z_max: f32,
}

/// A sphere fixed to the flange. All zero means none. Source: PM L5969.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ToolSphere {
    /// Center along x of the flange frame, in mm.
    pub x: f32,
    /// Center along y of the flange frame, in mm.
    pub y: f32,
    /// Center along z of the flange frame, in mm.
    pub z: f32,
    /// Radius, in mm.
    pub r: f32,
}
