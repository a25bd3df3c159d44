//! The contract: what a bus under test offers to the suite, and the list of what is tested.
//!
//! A new bus implements [`BusKind`] and [`Bus`] and calls [`link_contract!`](crate::link_contract)
//! once for each way it can be set up. What a bus cannot do it says in [`BusKind::inability`]; the
//! test then prints the reason, and the bus's own file pins the list, so that nothing is left out in
//! silence.

use core::fmt::{Debug, Display};

use fieldarm::cycle::CyclicLink;
use fieldarm::sim::meca500::RobotSettings;
use fieldarm::time::{Duration, Instant};

use crate::watched::WatchedRobot;

/// What not every bus can do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ability {
    /// Images can get lost between the PLC and the robot.
    LoseImages,
    /// They can get lost on one way only.
    LoseOneWay,
    /// The robot can be told to leave the bus.
    LeaveByCommand,
    /// That the robot did not get the outputs shows in the same cycle.
    NoticeLostOutputs,
}

impl Ability {
    pub(crate) const ALL: [Self; 4] =
        [Self::LoseImages, Self::LoseOneWay, Self::LeaveByCommand, Self::NoticeLostOutputs];
}

/// What becomes of the images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cable {
    /// They arrive.
    In,
    /// None arrives, and the PLC's end is told.
    Out,
    /// The robot's never reach the PLC.
    AnswersLost,
    /// The PLC's never reach the robot.
    OutputsLost,
}

/// How a PLC ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PlcEnd {
    /// In good order.
    Closed,
    /// Its process is gone in the middle of a cycle.
    Died,
}

/// A way to set a bus up.
pub(crate) trait BusKind: Copy + Debug {
    /// The bus, in operation.
    type Bus: Bus;

    /// Why the bus cannot do this; `None` if it can.
    fn inability(self, ability: Ability) -> Option<&'static str>;

    /// Cycles that a command takes at most in a stream without faults.
    fn cycles_per_command(self) -> u64;

    /// A robot that has booted, and a link to it that is up, or why it is not.
    fn open(self, robot: RobotSettings) -> Result<Self::Bus, String>;

    /// What a link says to a robot whose images it cannot use, and what it must name.
    fn refusal(self) -> (Result<(), String>, &'static [&'static str]);
}

/// A bus with a robot at one end and a link at the other.
pub(crate) trait Bus: Sized {
    /// The PLC's end.
    type Link: CyclicLink<Error: Display>;

    /// The PLC's end.
    fn link(&mut self) -> &mut Self::Link;

    /// The robot, to be acted upon as a person beside it would.
    fn robot(&mut self) -> &mut WatchedRobot;

    /// Changes the cable. Called only with what the bus can do.
    fn set_cable(&mut self, cable: Cable);

    /// By how much the next cycle should begin later, in ns.
    fn nudge_ns(&self) -> i64 {
        0
    }

    /// Ends the link at `now`, lets the robot be alone for `away`, and opens a new link to it.
    fn restart_plc(self, end: PlcEnd, now: Instant, away: Duration) -> Result<Self, String>;
}

/// Says that a test does not apply to a bus, and why.
pub(crate) fn cannot(kind: impl BusKind, ability: Ability) -> bool {
    let reason = kind.inability(ability);
    if let Some(reason) = reason {
        println!("{kind:?} has no {ability:?}: {reason}");
    }
    reason.is_some()
}

/// The suite for one [`BusKind`], as a module of tests.
#[macro_export]
macro_rules! link_contract {
    ($module:ident, $kind:expr) => {
        mod $module {
            $crate::link_contract!(@tests $kind;
                stream::the_engine_comes_up_and_brings_the_robot_up,
                stream::every_command_is_accepted_once_in_order_and_done,
                losses::a_few_lost_exchanges_are_stale_and_cost_nothing,
                losses::a_loss_in_any_cycle_of_a_handshake_has_a_true_verdict,
                losses::an_answer_that_is_lost_never_doubles_its_command,
                restarts::a_robot_that_loses_its_power_comes_back,
                restarts::a_robot_that_leaves_by_command_is_lost_until_it_is_switched_back,
                restarts::a_new_plc_finds_a_robot_without_a_queue,
                restarts::a_new_plc_finds_the_queue_of_the_old_one,
                layouts::the_byte_order_is_found_in_every_order,
                layouts::a_foreign_layout_is_refused_by_what_differs,
            );
        }
    };
    (@tests $kind:expr; $($file:ident::$name:ident,)+) => {
        $(
            #[test]
            fn $name() {
                $crate::$file::$name($kind);
            }
        )+
    };
}
