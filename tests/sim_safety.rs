//! E-Stop, P-Stop 2, the Reset button, connection loss, redundancy.
#![cfg(feature = "sim")]

mod sim_support;

use fieldarm::sim::meca500::readings::*;
use fieldarm::sim::meca500::{FittedTool, Lifecycle, PStop2Mode, RobotEvent};
use fieldarm::wire::meca500::image::{
    MotionStatusFlags, RobotControlFlags, RobotStatusFlags, SafetyPower, SafetyResettable,
    SafetySignals,
};
use fieldarm::wire::meca500::revision::Revision;
use sim_support::Cell;

const PAUSED: MotionStatusFlags = MotionStatusFlags::PAUSED;
const CLEARED: MotionStatusFlags = MotionStatusFlags::CLEARED;

fn moving(cell: &mut Cell) {
    cell.sent(1, &[60.0]);
    cell.sent(17, &[5.0]);
    cell.cycles(200);
}

#[test]
fn p_stop2_in_clear_mode_clears_and_refuses_until_resumed() {
    let mut cell = Cell::ready();
    moving(&mut cell);
    cell.robot.panel().press_p_stop2();
    cell.cycle();
    assert!(cell.signals().contains(SafetySignals::P_STOP2));
    assert!(cell.has(PAUSED | CLEARED | MotionStatusFlags::P_STOP2));
    assert!(!cell.resettable().contains(SafetyResettable::P_STOP2));
    assert_eq!(cell.discarded(), 5);
    cell.until("at rest", |cell| cell.has(MotionStatusFlags::EOM));
    assert!(cell.is(RobotStatusFlags::ACTIVATED), "motors stay active");
    cell.send(1, &[0.0]);
    assert_eq!(cell.fifo_space(), 13_000, "ignored");
    cell.resume_edge();
    assert!(cell.has(PAUSED), "the signal is still present");
    cell.robot.panel().release_p_stop2();
    cell.cycle();
    assert!(cell.signals().contains(SafetySignals::P_STOP2), "1 while resettable");
    assert!(cell.resettable().contains(SafetyResettable::P_STOP2));
    assert!(!cell.has(MotionStatusFlags::P_STOP2), "the deprecated bit follows the signal");
    cell.send(1, &[0.0]);
    assert_eq!(cell.fifo_space(), 13_000, "ignored until reset");
    cell.resume();
    assert!(cell.signals().is_empty() && cell.resettable().is_empty());
    assert!(!cell.has(CLEARED));
    cell.sent(1, &[0.0]);
    cell.finish(1);
}

#[test]
fn p_stop2_in_pause_mode_keeps_the_queue_and_takes_commands() {
    let mut cell = Cell::ready_with(|settings| settings.persistent.p_stop2 = PStop2Mode::Pause);
    moving(&mut cell);
    cell.robot.panel().press_p_stop2();
    cell.cycles(100);
    assert!(cell.has(PAUSED | MotionStatusFlags::EOM) && !cell.has(CLEARED));
    let at = cell.joints();
    cell.sent(17, &[6.0]);
    assert_eq!(cell.fifo_space(), 12_998);
    cell.robot.panel().release_p_stop2();
    cell.cycles(100);
    assert_eq!(cell.joints(), at);
    cell.resume();
    cell.until("the rest", |cell| cell.reached() == 6);
    assert!(cell.is_at([60.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
}

#[test]
fn paused_cleared_and_deprecated_bits_follow_the_readings() {
    let mut cell = Cell::ready_with(|settings| {
        settings.readings.p_stop2_paused = PStop2Paused::Unchanged;
        settings.readings.p_stop2_cleared = PStop2Cleared::Unchanged;
        settings.readings.deprecated_bits = DeprecatedBits::PresentOrResettable;
    });
    cell.robot.panel().press_p_stop2();
    cell.cycle();
    assert!(!cell.motion_status().intersects(PAUSED | CLEARED));
    cell.robot.panel().release_p_stop2();
    cell.cycle();
    assert!(cell.has(MotionStatusFlags::P_STOP2));
}

#[test]
fn resume_after_a_safety_stop_needs_one_edge_or_two() {
    for (reading, edges) in
        [(ResumeAfterSafetyStop::ResetsAndResumes, 1), (ResumeAfterSafetyStop::ResetsOnly, 2)]
    {
        let mut cell =
            Cell::ready_with(|settings| settings.readings.resume_after_safety_stop = reading);
        cell.robot.panel().press_p_stop2();
        cell.cycle();
        cell.robot.panel().release_p_stop2();
        cell.cycle();
        let mut needed = 0;
        while cell.has(PAUSED) {
            cell.resume_edge();
            assert!(cell.signals().is_empty());
            needed += 1;
        }
        assert_eq!(needed, edges);
    }
}

#[test]
fn e_stop_on_revision_4_stops_cuts_power_and_deactivates() {
    let mut cell = Cell::ready();
    moving(&mut cell);
    let before = cell.joints()[0];
    cell.robot.panel().press_e_stop();
    cell.cycle();
    assert!(cell.is(RobotStatusFlags::ACTIVATED | RobotStatusFlags::E_STOP), "still decelerating");
    cell.until("deactivated", |cell| !cell.is(RobotStatusFlags::ACTIVATED));
    assert!(cell.joints()[0] > before, "decelerated along the path");
    assert!(cell.is(RobotStatusFlags::BRAKES_ENGAGED | RobotStatusFlags::HOMED));
    assert!(cell.has(CLEARED));
    assert_eq!(cell.discarded(), 5);
    assert!(cell.power().is_empty());
    let events = cell.events();
    assert!(events.contains(&RobotEvent::MotionCleared));
    assert!(events.contains(&RobotEvent::Deactivated));
    cell.control(RobotControlFlags::ACTIVATE_ROBOT, true);
    cell.cycles(500);
    assert!(!cell.is(RobotStatusFlags::ACTIVATED));
    cell.robot.panel().press_reset();
    cell.cycle();
    assert!(cell.power().is_empty(), "the E-Stop is still pressed");
    cell.robot.panel().release_e_stop();
    cell.cycle();
    assert!(cell.resettable().contains(SafetyResettable::E_STOP));
    assert!(cell.signals().contains(SafetySignals::E_STOP));
    assert_eq!(cell.power(), SafetyPower::RESET_READY);
    assert!(!cell.is(RobotStatusFlags::E_STOP));
    cell.cycles(500);
    assert!(!cell.is(RobotStatusFlags::ACTIVATED));
    cell.robot.panel().press_reset();
    cell.cycle();
    assert!(cell.signals().is_empty());
    assert_eq!(cell.power(), SafetyPower::V_MOTOR_ON);
    cell.until("activated", |cell| cell.is(RobotStatusFlags::ACTIVATED));
    assert!(cell.is(RobotStatusFlags::HOMED), "homing is not needed again");
}

#[test]
fn after_an_e_stop_a_gripper_is_homed_again_alone() {
    let mut cell = Cell::ready_with(|settings| settings.tool = FittedTool::Megp25E);
    cell.robot.panel().press_e_stop();
    cell.until("deactivated", |cell| !cell.is(RobotStatusFlags::ACTIVATED));
    cell.robot.panel().release_e_stop();
    cell.robot.panel().press_reset();
    cell.activate();
    assert!(!cell.is(RobotStatusFlags::HOMED));
    let at = cell.joints();
    cell.control(RobotControlFlags::HOME, true);
    cell.until("homed", |cell| {
        assert_eq!(cell.joints(), at, "only the gripper moves");
        cell.is(RobotStatusFlags::HOMED)
    });
}

#[test]
fn e_stop_on_revision_3_shuts_down() {
    let mut cell = Cell::ready_with(|settings| settings.revision = Revision::R3);
    cell.robot.panel().press_e_stop();
    cell.cycles(3);
    assert_eq!(cell.robot.lifecycle(), Lifecycle::Off);
    assert!(!cell.robot.is_online());
    cell.robot.panel().release_e_stop();
    cell.robot.panel().switch_on();
    cell.until("booted", |cell| cell.robot.is_online());
    cell.robot.panel().press_reset();
    cell.cycle();
    assert!(!cell.is(RobotStatusFlags::HOMED));
    assert!(!cell.power().contains(SafetyPower::RESET_READY));
    cell.activate();
}

#[test]
fn a_redundancy_mismatch_of_a_second_needs_a_reboot() {
    let mut cell = Cell::ready_with(|settings| {
        settings.readings.redundancy_signal = RedundancySignal::Reported
    });
    cell.robot.panel().set_safety_mismatch(true);
    cell.cycles(900);
    cell.robot.panel().set_safety_mismatch(false);
    cell.cycles(200);
    assert!(cell.is(RobotStatusFlags::ACTIVATED), "less than a second");
    cell.robot.panel().set_safety_mismatch(true);
    cell.cycles(1100);
    assert!(!cell.is(RobotStatusFlags::ACTIVATED));
    assert!(cell.signals().contains(SafetySignals::REDUNDANCY_FAULT));
    assert!(cell.resettable().is_empty());
    cell.robot.panel().set_safety_mismatch(false);
    cell.robot.panel().press_reset();
    cell.cycle();
    assert!(!cell.power().contains(SafetyPower::V_MOTOR_ON));
    cell.robot.panel().switch_off();
    cell.robot.panel().switch_on();
    cell.until("booted", |cell| cell.robot.is_online());
    cell.robot.panel().press_reset();
    cell.cycle();
    assert!(cell.power().contains(SafetyPower::V_MOTOR_ON));
}

#[test]
fn losing_the_connection_follows_the_reading() {
    for (reading, stops) in
        [(CyclicConnectionLoss::Stops, true), (CyclicConnectionLoss::Ignored, false)]
    {
        let mut cell =
            Cell::ready_with(|settings| settings.readings.cyclic_connection_loss = reading);
        moving(&mut cell);
        for _ in 0..5 {
            cell.lost_cycle();
        }
        assert_eq!(cell.signals().contains(SafetySignals::CONNECTION_DROPPED), stops);
        assert!(cell.resettable().is_empty());
        for _ in 0..3000 {
            cell.lost_cycle();
        }
        assert_eq!(cell.reached() == 5, !stops);
        cell.cycle();
        assert_eq!(cell.resettable().contains(SafetyResettable::CONNECTION_DROPPED), stops);
        cell.resume_edge();
        assert!(cell.signals().is_empty());
        cell.until("the checkpoint", |cell| cell.reached() == 5);
    }
}

#[test]
fn losing_the_connection_at_rest_changes_nothing() {
    let mut cell = Cell::ready();
    for _ in 0..100 {
        cell.lost_cycle();
    }
    cell.cycle();
    assert!(cell.signals().is_empty() && !cell.has(PAUSED));
}
