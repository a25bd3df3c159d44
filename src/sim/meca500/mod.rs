//! The virtual Meca500.
//!
//! Read first: [`VirtualRobot`], then [`RobotSettings`] and [`Readings`].
//!
//! ```text
//!   cyclic images --> cyclic --.                       .--> inputs, dynamic --> cyclic images
//!                              |--> receive --> queue  |
//!   text lines ----> text -----'      |           |    |
//!                                     v           v    |
//!   person --> panel --> lifecycle, safety, halt --> executor --> motion --> kinematics
//! ```
//!
//! It shares only the codec with the PLC's side, so that a misreading on one side shows on the other.
//! Where the manual is open there is a switch ([`Readings`]); where it is silent on a figure there
//! is a documented choice.
//!
//! Leaves out: gravity (an arm with released brakes stays where it is), heat, wear, calibration (it is
//! a robot that was never calibrated).

mod compile;
mod cyclic;
mod dynamic;
mod dynamic_values;
mod event;
mod executor;
mod halt;
mod handshake;
mod inputs;
pub mod kinematics;
mod lifecycle;
pub mod motion;
mod motion_settings;
mod panel;
pub mod pose;
mod queue;
pub mod readings;
mod receive;
mod robot;
mod safety;
mod settings;
mod standing;
mod store;
mod text;
mod tool;
mod torque;
mod variables;
mod velocity;
mod zones;

pub use event::RobotEvent;
pub use lifecycle::{HOMING_TRAVEL_DEG, Lifecycle};
pub use motion_settings::MotionSettings;
pub use panel::Panel;
pub use readings::Readings;
pub use receive::Verdict;
pub use robot::VirtualRobot;
pub use safety::Signal;
pub use settings::{
    CyclicBus, FieldbusMode, FittedTool, LifecycleTimes, NetworkSettings, PStop2Mode,
    PersistentSettings, RecoveryCaps, RobotSettings, SimulationType,
};
pub use standing::Standing;
pub use store::StoreError;
pub use text::{Controller, LogKind, LogLine, ProtocolSettings};
pub use tool::{GripperState, Part};
pub use variables::SavedVariable;
