//! What a person beside the virtual robots does, by a line of a scenario or by a key: [`Deed`], and how
//! it is done to a [`Cell`].
//!
//! The words are those of the manual's safety chapter. Source: PM L886-922.

use std::prelude::v1::*;

use super::cell::{Cell, Mains};
use super::stage::Cable;
use crate::sim::meca500::{Lifecycle, Part, Standing};
use crate::wire::meca500::revision::Revision;

/// One thing done at one robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Deed {
    /// The E-Stop is pressed or pulled out. P-Stop 1 is the same to the Meca500.
    EStop { pressed: bool },
    /// P-Stop 2, also called SWStop, is opened or closed.
    PStop2 { pressed: bool },
    /// The Reset button.
    Reset,
    /// The redundant safety inputs disagree, or agree again.
    Mismatch { there: bool },
    /// The Start/Stop button on the base.
    Start,
    /// Something holds a joint, 1 to 6, or lets it go.
    Hold { joint: u8, held: bool },
    /// Somebody pushes on a joint, 1 to 6, in percent of its motor's largest torque; 0 lets go.
    Push { joint: u8, percent: f64 },
    /// A part is put between the fingers, or taken away.
    Part(Option<Part>),
    /// The gripper overheats or cools.
    Overheat { hot: bool },
    /// The communication with the drives breaks for good.
    BreakDrives,
    /// A cable is pulled or plugged.
    Cable { cable: Cable, plugged: bool },
    /// The robot's power.
    Mains(Mains),
}

/// Does it at one robot, counted from 0, and says in words what came of it.
pub(super) fn perform<C: Cell>(deed: Deed, cell: &mut C, number: usize) -> String {
    match deed {
        Deed::Cable { cable, plugged } => {
            let done = if plugged { "plugged" } else { "pulled" };
            let name = cable_name(cable);
            match cell.set_plugged(number, cable, plugged) {
                Ok(()) => format!("{name} {done}"),
                Err(why) => format!("{name} cannot be {done}: {why}"),
            }
        }
        Deed::Mains(mains) => {
            let was_off = cell.robot(number).lifecycle() == Lifecycle::Off;
            cell.switch(number, mains);
            match (mains, was_off) {
                (Mains::Off, true) => "power off; it was off before".into(),
                (Mains::Off, false) => "power off".into(),
                (Mains::On, true) => {
                    "power on: the robot boots; its motors get power once Reset is pressed".into()
                }
                (Mains::On, false) => "power on; it was on before".into(),
                (Mains::Cycle, _) => {
                    "power cut for a moment; Reset is pressed after the boot".into()
                }
            }
        }
        _ => at_robot(deed, cell, number),
    }
}

/// What needs nothing but the robot.
fn at_robot<C: Cell>(deed: Deed, cell: &mut C, number: usize) -> String {
    let mut robot = cell.robot(number);
    let before = robot.standing();
    match deed {
        Deed::EStop { pressed: true } => {
            robot.panel().press_e_stop();
            match robot.settings().revision {
                Revision::R3 => "E-Stop pressed: a revision 3 shuts down".into(),
                _ => "E-Stop pressed".into(),
            }
        }
        Deed::EStop { pressed: false } => {
            robot.panel().release_e_stop();
            match before.lifecycle {
                Lifecycle::Off => {
                    "E-Stop released; the robot stays off until its power is switched on".into()
                }
                _ => "E-Stop released; the Reset button resets it".into(),
            }
        }
        Deed::PStop2 { pressed: true } => {
            robot.panel().press_p_stop2();
            "P-Stop 2 pressed".into()
        }
        Deed::PStop2 { pressed: false } => {
            robot.panel().release_p_stop2();
            "P-Stop 2 released; ResumeMotion resets it".into()
        }
        Deed::Reset => {
            robot.panel().press_reset();
            reset_words(&before, &robot.standing()).into()
        }
        Deed::Mismatch { there } => {
            robot.panel().set_safety_mismatch(there);
            if there {
                "the redundant safety inputs disagree: a fault after one second".into()
            } else {
                "the redundant safety inputs agree again; a fault lasts until the next boot".into()
            }
        }
        Deed::Start => match robot.panel().press_start() {
            Ok(()) => "Start/Stop pressed".into(),
            Err(code) => match code.describe() {
                Some(info) => format!("Start/Stop pressed, refused: [{}] {}", code.0, info.message),
                None => format!("Start/Stop pressed, refused: [{}]", code.0),
            },
        },
        Deed::Hold { joint, held } => {
            robot.panel().block_joint(joint.into(), held);
            let place = robot.target_joints().get(usize::from(joint).wrapping_sub(1)).copied();
            match (held, place) {
                (true, Some(place)) => format!("joint {joint} is blocked at {place:.2} deg"),
                _ => format!("joint {joint} is free"),
            }
        }
        Deed::Push { joint, percent } => {
            robot.panel().push_joint(joint.into(), percent);
            if percent == 0.0 {
                format!("nobody pushes on joint {joint}")
            } else {
                format!("somebody pushes on joint {joint} with {percent} % of its largest torque")
            }
        }
        Deed::Part(part) => {
            robot.panel().place_part(part);
            match part {
                None => "no part between the fingers".into(),
                Some(Part::Outer(mm)) => format!("a part {mm} mm wide between the fingers"),
                Some(Part::Inner(mm)) => format!("a part {mm} mm wide around the fingers"),
            }
        }
        Deed::Overheat { hot } => {
            robot.panel().set_gripper_overheated(hot);
            if hot { "the gripper overheats".into() } else { "the gripper has cooled".into() }
        }
        Deed::BreakDrives => {
            robot.panel().break_drives();
            "the communication with the drives breaks; a boot mends it".into()
        }
        Deed::Cable { .. } | Deed::Mains(_) => String::new(),
    }
}

const fn cable_name(cable: Cable) -> &'static str {
    match cable {
        Cable::EtherCat => "the EtherCAT cable",
        Cable::EtherNetIp => "the EtherNet/IP cable",
        Cable::Tcp => "the TCP cable",
        Cable::All => "the cable",
    }
}

fn reset_words(before: &Standing, after: &Standing) -> &'static str {
    match (before.lifecycle, before.motor_power, after.motor_power) {
        (Lifecycle::Off, ..) => "Reset pressed without effect: the robot is off",
        (Lifecycle::Booting, ..) => "Reset pressed without effect: the robot boots",
        (_, true, _) => "Reset pressed; there was nothing to reset",
        (_, false, true) => "Reset pressed: the motors can be powered",
        (_, false, false) => "Reset pressed without effect: a safety signal is still there",
    }
}

#[cfg(test)]
mod tests {
    use super::super::cell::Bench;
    use super::*;
    use crate::time::Duration;

    fn words(bench: &mut Bench, deed: Deed) -> String {
        perform(deed, bench, 0)
    }

    #[test]
    fn reset_says_whether_it_did_something() {
        let mut bench = Bench::of(Revision::R4, 1);
        assert!(words(&mut bench, Deed::Reset).contains("nothing to reset"));
        assert_eq!(words(&mut bench, Deed::EStop { pressed: true }), "E-Stop pressed");
        assert!(words(&mut bench, Deed::Reset).contains("still there"));
        assert!(words(&mut bench, Deed::EStop { pressed: false }).contains("Reset button"));
        assert!(words(&mut bench, Deed::Reset).contains("can be powered"));
    }

    #[test]
    fn a_revision_3_shuts_down_and_comes_back_with_its_power() {
        let mut bench = Bench::of(Revision::R3, 1);
        assert!(words(&mut bench, Deed::EStop { pressed: true }).contains("shuts down"));
        assert_eq!(bench.robot(0).lifecycle(), Lifecycle::Off);
        assert!(words(&mut bench, Deed::EStop { pressed: false }).contains("stays off"));
        assert!(words(&mut bench, Deed::Reset).contains("is off"));
        assert!(words(&mut bench, Deed::Mains(Mains::On)).contains("boots"));
        assert!(words(&mut bench, Deed::Reset).contains("boots"));
        bench.pass(Duration::from_secs(6));
        assert!(words(&mut bench, Deed::Reset).contains("can be powered"));
    }

    #[test]
    fn the_start_button_tells_why_it_refuses() {
        let mut bench = Bench::of(Revision::R4, 1);
        let said = words(&mut bench, Deed::Start);
        assert!(said.contains("refused: [1005]"), "{said}");
    }

    #[test]
    fn a_cable_that_is_not_there_is_named() {
        let mut bench = Bench::of(Revision::R4, 1);
        let pull = |cable| Deed::Cable { cable, plugged: false };
        assert_eq!(words(&mut bench, pull(Cable::Tcp)), "the TCP cable pulled");
        let said = words(&mut bench, pull(Cable::EtherCat));
        assert!(said.starts_with("the EtherCAT cable cannot be pulled: "), "{said}");
    }
}
