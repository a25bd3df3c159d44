//! The motion queue: space, order, checkpoints, discards, delays, pause, clear, resume, error mode.
#![cfg(feature = "sim")]

mod sim_support;

use fieldarm::sim::meca500::RobotEvent;
use fieldarm::sim::meca500::readings::*;
use fieldarm::wire::meca500::code::Code;
use fieldarm::wire::meca500::image::{MotionControlFlags, MotionStatusFlags, RobotControlFlags};
use sim_support::Cell;

const PAUSE: MotionControlFlags = MotionControlFlags::PAUSE_MOTION;
const CLEAR: MotionControlFlags = MotionControlFlags::CLEAR_MOTION;
const PAUSED: MotionStatusFlags = MotionStatusFlags::PAUSED;
const CLEARED: MotionStatusFlags = MotionStatusFlags::CLEARED;
const EOM: MotionStatusFlags = MotionStatusFlags::EOM;
const EOB: MotionStatusFlags = MotionStatusFlags::EOB;

fn paused_cell(change: impl FnOnce(&mut Readings)) -> Cell {
    let mut cell = Cell::ready_with(|settings| change(&mut settings.readings));
    cell.motion(PAUSE, true);
    cell.until("paused", |cell| cell.has(PAUSED));
    cell
}

#[test]
fn a_full_queue_ignores_commands_and_answers_as_the_reading_says() {
    for (reading, acknowledged) in
        [(FullQueue::NotAcknowledged, false), (FullQueue::AcknowledgedAndLost, true)]
    {
        let mut cell = paused_cell(|readings| readings.full_queue = reading);
        for n in 0..13_000_u32 {
            assert_eq!(u32::from(cell.fifo_space()), 13_000 - n);
            cell.sent(17, &[1.0]);
        }
        assert_eq!(cell.fifo_space(), 0);
        assert_eq!(cell.send(17, &[77.0]), acknowledged);
        assert_eq!(cell.fifo_space(), 0);
        cell.motion(PAUSE, false);
        cell.resume();
        cell.until("all done", |cell| cell.has(EOB));
        assert_eq!(cell.reached(), if acknowledged { 1 } else { 77 });
    }
}

#[test]
fn compiled_commands_take_space_as_the_reading_says() {
    for (reading, space) in
        [(CompiledCommands::Counted, 12_900), (CompiledCommands::NotCounted, 12_925)]
    {
        let mut cell = Cell::ready_with(|settings| settings.readings.compiled_commands = reading);
        cell.sent(6, &[1000.0]);
        cell.cycle();
        for _ in 0..100 {
            cell.sent(17, &[1.0]);
        }
        cell.cycles(20);
        assert_eq!(cell.fifo_space(), space);
        assert_eq!(cell.robot.pending_commands(), 75, "GetCmdPendingCount leaves out 25");
    }
}

#[test]
fn queued_commands_run_first_in_first_out() {
    let mut cell = Cell::ready();
    for (n, target) in [(1.0, 5.0), (2.0, -5.0), (3.0, 9.0)] {
        cell.sent(1, &[target]);
        cell.sent(6, &[0.05]);
        cell.sent(17, &[n]);
    }
    for (n, target) in [(1, 5.0), (2, -5.0), (3, 9.0)] {
        cell.until("a checkpoint", |cell| cell.reached() == n);
        assert!(cell.is_at([target, 0.0, 0.0, 0.0, 0.0, 0.0]));
    }
}

#[test]
fn settings_take_effect_in_their_turn() {
    let mut cell = Cell::ready();
    cell.sent(13, &[0.0, 0.0, 10.0]);
    cell.sent(1, &[20.0]);
    cell.sent(13, &[0.0, 0.0, 99.0]);
    cell.cycles(5);
    assert_eq!(cell.inputs.target_trf.values().z, 10.0);
    cell.finish(1);
    assert_eq!(cell.inputs.target_trf.values().z, 99.0);
}

#[test]
fn a_checkpoint_is_reached_when_the_motion_before_it_is_done() {
    let mut cell = Cell::ready();
    cell.sent(1, &[20.0]);
    cell.sent(17, &[12.0]);
    let mut moved = 0;
    while cell.reached() != 12 {
        assert!(!cell.is_at([20.0, 0.0, 0.0, 0.0, 0.0, 0.0]) || moved > 0);
        moved += 1;
        cell.cycle();
    }
    assert!(cell.is_at([20.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
    assert!(cell.has(EOB | EOM), "the last checkpoint comes along with EOB");
    cell.sent(17, &[12.0]);
    cell.sent(17, &[12.0]);
    cell.cycles(2);
    let again = cell.events().iter().filter(|e| **e == RobotEvent::CheckpointReached(12)).count();
    assert_eq!(again, 3, "the same number may be used many times");
    cell.cycles(100);
    assert_eq!(cell.reached(), 12);
}

#[test]
fn a_checkpoint_between_blended_moves_is_reached_along_the_blending() {
    let mut cell = Cell::ready();
    cell.sent(1, &[30.0]);
    cell.sent(17, &[4.0]);
    cell.sent(1, &[30.0, 30.0]);
    cell.sent(17, &[5.0]);
    cell.until("the first checkpoint", |cell| cell.reached() == 4);
    assert!(!cell.has(EOM) && !cell.has(EOB), "the robot does not stop for it");
    let at = cell.joints();
    assert!(at[0] > 20.0 && at[0] < 29.999, "where the corner begins to be rounded: {at:?}");
    assert!(at[1] < 1.0, "{at:?}");
    cell.until("the last checkpoint", |cell| cell.reached() == 5);
    assert!(cell.has(EOB | EOM), "the last one comes with the stop");
    assert!(cell.is_at([30.0, 30.0, 0.0, 0.0, 0.0, 0.0]));
    // Without blending it is reached in the corner.
    cell.sent(7, &[0.0]);
    cell.sent(1, &[0.0, 30.0]);
    cell.sent(17, &[6.0]);
    cell.sent(1, &[0.0; 6]);
    cell.until("the checkpoint", |cell| cell.reached() == 6);
    assert!((cell.joints()[0]).abs() < 1e-3, "{:?}", cell.joints());
}

#[test]
fn the_last_checkpoint_reached_and_discarded_stay_until_another_is() {
    let mut cell = Cell::ready();
    let clear_with = |cell: &mut Cell, n: f32| {
        cell.sent(6, &[10.0]);
        cell.sent(17, &[n]);
        cell.motion(CLEAR, true);
        cell.cycles(3);
        cell.motion(CLEAR, false);
        cell.resume();
    };
    cell.finish(3);
    assert_eq!((cell.reached(), cell.discarded()), (3, 0));
    clear_with(&mut cell, 7.0);
    assert_eq!((cell.reached(), cell.discarded()), (3, 7));
    cell.cycles(500);
    assert_eq!((cell.reached(), cell.discarded()), (3, 7), "time changes neither");
    cell.sent(17, &[4.0]);
    cell.until("reached", |cell| cell.reached() == 4);
    assert_eq!(cell.discarded(), 7, "nor does the other one");
    cell.motion(CLEAR, true);
    cell.cycles(3);
    cell.motion(CLEAR, false);
    cell.resume();
    assert_eq!((cell.reached(), cell.discarded()), (4, 7), "an empty queue discards none");
    clear_with(&mut cell, 9.0);
    assert_eq!((cell.reached(), cell.discarded()), (4, 9));
}

#[test]
fn a_pause_begins_within_five_milliseconds() {
    let step_of = |cell: &mut Cell| {
        let before = cell.joints()[0];
        cell.cycle();
        cell.joints()[0] - before
    };
    let mut cell = Cell::ready();
    cell.sent(1, &[90.0]);
    cell.cycles(500);
    let mut last = step_of(&mut cell);
    let full = last;
    assert!((full - step_of(&mut cell)).abs() < 1e-4, "steady before the pause");
    cell.motion(PAUSE, true);
    // The cycle that carries the bit, and five milliseconds.
    cell.cycle();
    for _ in 0..5 {
        let step = step_of(&mut cell);
        assert!(step < last - 1e-4, "{last} {step}");
        last = step;
    }
    assert!(last > 0.0 && last < 0.95 * full, "{full} {last}");
}

#[test]
fn eob_waits_for_a_delay_and_eom_does_not() {
    let mut cell = Cell::ready();
    cell.sent(1, &[5.0]);
    cell.sent(6, &[0.5]);
    cell.until("at rest", |cell| cell.has(EOM));
    assert!(!cell.has(EOB));
    let waited = cell.until("the end", |cell| cell.has(EOB));
    assert!((495..=505).contains(&waited), "{waited}");
}

#[test]
fn pause_keeps_the_trajectory_and_resume_takes_it_up() {
    let mut cell = Cell::ready();
    cell.sent(1, &[60.0]);
    cell.sent(17, &[5.0]);
    cell.cycles(300);
    cell.motion(PAUSE, true);
    cell.cycle();
    let first = cell.joints()[0];
    cell.until("paused and at rest", |cell| cell.has(PAUSED | EOM));
    let at = cell.joints();
    assert!(at[0] > first && at[0] < 60.0, "slowed down along the path");
    assert!(!cell.has(EOB) && !cell.has(CLEARED));
    cell.cycles(500);
    assert_eq!(cell.joints(), at);
    cell.resume_edge();
    assert!(cell.has(PAUSED), "PauseMotion is still 1");
    cell.motion(PAUSE, false);
    cell.cycles(100);
    assert!(cell.has(PAUSED), "only ResumeMotion ends a pause");
    cell.resume();
    cell.until("the checkpoint", |cell| cell.reached() == 5);
    assert!(cell.is_at([60.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
}

#[test]
fn resume_acts_on_its_rising_edge_only() {
    let mut cell = Cell::ready();
    cell.motion(MotionControlFlags::RESUME_MOTION, true);
    cell.cycles(10);
    cell.motion(PAUSE, true);
    cell.cycles(2);
    cell.motion(PAUSE, false);
    cell.cycles(200);
    assert!(cell.has(PAUSED), "a held bit resumes nothing");
    cell.motion(MotionControlFlags::RESUME_MOTION, false);
    cell.cycle();
    cell.resume();
}

#[test]
fn commands_sent_while_paused_are_added_at_the_end() {
    let mut cell = Cell::ready();
    cell.sent(1, &[30.0]);
    cell.cycles(100);
    cell.motion(PAUSE, true);
    cell.cycles(100);
    cell.sent(1, &[-10.0]);
    cell.sent(17, &[2.0]);
    cell.motion(PAUSE, false);
    let mut furthest: f32 = 0.0;
    cell.resume();
    cell.until("the checkpoint", |cell| {
        furthest = furthest.max(cell.joints()[0]);
        cell.reached() == 2
    });
    // Blending rounds the corner, but the first move was gone along.
    assert!(furthest > 25.0, "{furthest}");
}

#[test]
fn clear_empties_the_queue_discards_checkpoints_and_needs_resume() {
    let mut cell = Cell::ready();
    cell.sent(1, &[60.0]);
    for n in [5.0, 6.0, 7.0] {
        cell.sent(17, &[n]);
    }
    cell.cycles(200);
    cell.motion(CLEAR, true);
    cell.until("cleared", |cell| cell.has(CLEARED | PAUSED));
    assert_eq!(cell.fifo_space(), 13_000);
    assert_eq!(cell.discarded(), 7);
    let discarded: Vec<_> = cell
        .events()
        .into_iter()
        .filter_map(|event| match event {
            RobotEvent::CheckpointDiscarded(n) => Some(n),
            _ => None,
        })
        .collect();
    assert_eq!(discarded, [5, 6, 7]);
    cell.cycles(100);
    let at = cell.joints();
    assert!(at[0] < 60.0);
    cell.motion(CLEAR, false);
    cell.sent(1, &[0.0]);
    cell.cycles(200);
    assert_eq!(cell.joints(), at, "nothing moves until resumed");
    assert!(cell.has(CLEARED | PAUSED));
    cell.resume();
    assert!(!cell.has(CLEARED));
    cell.finish(9);
    assert!(cell.is_at([0.0; 6]));
}

#[test]
fn a_held_clear_bit_follows_the_reading() {
    for (reading, kept) in [(HeldClearMotion::EachCycle, false), (HeldClearMotion::Once, true)] {
        let mut cell = Cell::ready_with(|settings| settings.readings.held_clear_motion = reading);
        cell.motion(CLEAR, true);
        cell.cycles(3);
        cell.sent(17, &[1.0]);
        cell.cycles(3);
        assert_eq!(cell.fifo_space() == 12_999, kept);
    }
}

#[test]
fn pause_and_clear_need_a_robot_ready_for_motion() {
    let mut cell = Cell::new(fieldarm::sim::meca500::RobotSettings::default());
    cell.cycle();
    cell.motion(PAUSE | CLEAR, true);
    cell.cycles(3);
    assert!(!cell.motion_status().intersects(PAUSED | CLEARED));
    assert_eq!(cell.robot.pause_motion(), Err(Code::NOT_ACTIVATED));
    assert_eq!(cell.robot.resume_motion(), Err(Code::NOT_ACTIVATED));
    cell.motion(PAUSE | CLEAR, false);
    cell.activate();
    assert_eq!(cell.robot.clear_motion(), Err(Code::NOT_HOMED));
}

#[test]
fn an_error_clears_the_queue_and_refuses_until_reset_and_resume() {
    let mut cell = Cell::ready();
    cell.sent(1, &[10.0]);
    cell.sent(17, &[1.0]);
    cell.sent(1, &[200.0]);
    cell.sent(17, &[2.0]);
    cell.sent(1, &[-10.0]);
    cell.until("the error", |cell| cell.error() == 1007);
    assert_eq!(cell.reached(), 1, "what stood before the bad move was executed");
    assert_eq!(cell.discarded(), 2);
    assert_eq!(cell.fifo_space(), 13_000);
    assert!(cell.has(PAUSED));
    assert!(cell.is_at([10.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
    cell.events();
    cell.send(1, &[0.0]);
    assert!(cell.events().contains(&RobotEvent::Refused(Code::IN_ERROR)));
    cell.resume_edge();
    assert!(cell.has(PAUSED), "no resuming in error mode");
    cell.reset_error();
    cell.sent(1, &[0.0]);
    assert_eq!(cell.fifo_space(), 12_999, "commands are accumulated");
    cell.cycles(200);
    assert!(cell.is_at([10.0, 0.0, 0.0, 0.0, 0.0, 0.0]), "but not executed");
    assert!(cell.has(PAUSED));
    cell.resume();
    cell.finish(3);
    assert!(cell.is_at([0.0; 6]));
}

#[test]
fn what_any_state_allows_is_taken_or_refused_in_error_mode() {
    for (reading, taken) in
        [(AnyStateInErrorMode::Taken, true), (AnyStateInErrorMode::Refused, false)]
    {
        let mut cell =
            Cell::ready_with(|settings| settings.readings.any_state_in_error_mode = reading);
        cell.robot.create_variable(10_000, &[1.0]).expect("free");
        cell.sent(1, &[200.0]);
        cell.until("the error", |cell| cell.error() == 1007);
        cell.events();
        cell.sent(48, &[50.0]);
        cell.sent(10_000, &[7.0]);
        let refusals =
            cell.events().iter().filter(|e| **e == RobotEvent::Refused(Code::IN_ERROR)).count();
        assert_eq!(refusals, if taken { 0 } else { 2 });
        assert_eq!(cell.read(54)[0], if taken { 50.0 } else { 100.0 });
        assert_eq!(cell.robot.variable(10_000), Some(&[if taken { 7.0 } else { 1.0 }][..]));
        assert_eq!(cell.error(), 1007, "the error stays the first one");
        cell.reset_error();
        cell.sent(48, &[25.0]);
        assert_eq!(cell.read(54)[0], 25.0);
    }
}

#[test]
fn an_error_while_paused_clears_the_motion() {
    let mut cell = Cell::ready();
    cell.sent(1, &[60.0]);
    cell.sent(17, &[5.0]);
    cell.cycles(300);
    cell.motion(PAUSE, true);
    cell.cycles(100);
    let at = cell.joints();
    cell.robot.panel().break_drives();
    cell.cycle();
    assert_eq!(cell.error(), 3006);
    assert_eq!((cell.fifo_space(), cell.discarded()), (13_000, 5));
    cell.motion(PAUSE, false);
    cell.deactivate();
    cell.cycles(500);
    assert_eq!(cell.joints(), at, "the trajectory is not resumed");
}

#[test]
fn paused_in_error_mode_follows_the_reading() {
    for (reading, shown) in [(PausedInErrorMode::Set, true), (PausedInErrorMode::Clear, false)] {
        let mut cell =
            Cell::ready_with(|settings| settings.readings.paused_in_error_mode = reading);
        cell.sent(1, &[200.0]);
        cell.until("the error", |cell| cell.error() == 1007);
        assert_eq!(cell.has(PAUSED), shown);
        cell.reset_error();
        assert_eq!(cell.has(PAUSED), shown);
        cell.sent(1, &[5.0]);
        cell.cycles(100);
        assert!(cell.is_at([0.0; 6]), "resume is needed either way");
        cell.resume_edge();
        cell.finish(1);
    }
}

#[test]
fn an_error_before_the_robot_is_ready_follows_the_reading() {
    for (reading, resets) in [(ResetBeforeReady::Allowed, true), (ResetBeforeReady::Refused, false)]
    {
        let mut settings = fieldarm::sim::meca500::RobotSettings::default();
        settings.readings.reset_before_ready = reading;
        let mut cell = Cell::new(settings);
        cell.cycle();
        cell.activate();
        cell.robot.panel().block_joint(1, true);
        cell.control(RobotControlFlags::HOME, true);
        cell.cycles(2);
        assert_eq!(cell.error(), 1014);
        cell.control(RobotControlFlags::HOME, false);
        cell.robot.panel().block_joint(1, false);
        cell.control(RobotControlFlags::RESET_ERROR, true);
        cell.cycles(2);
        assert_eq!(cell.error() == 0, resets);
        cell.control(RobotControlFlags::RESET_ERROR, false);
        cell.deactivate();
        assert_eq!(cell.error(), 0, "deactivation always helps");
    }
}

#[test]
fn some_errors_cannot_be_reset() {
    let mut cell = Cell::ready();
    cell.robot.panel().break_drives();
    cell.control(RobotControlFlags::RESET_ERROR, true);
    cell.cycles(3);
    assert_eq!(cell.error(), 3006);
    assert_eq!(cell.robot.reset_error(), Err(Code::RESET_IMPOSSIBLE));
    cell.control(RobotControlFlags::RESET_ERROR, false);
    cell.deactivate();
    assert_eq!(cell.error(), 3006);
    cell.write(200, &[]);
    cell.cycle();
    cell.motion(MotionControlFlags::SET_POINT, false);
    cell.until("booted", |cell| cell.robot.is_online() && cell.error() == 0);
}

#[test]
fn resuming_while_the_cleared_path_is_left_does_not_take_it_up() {
    let mut cell = Cell::ready();
    cell.sent(8, &[100.0]);
    cell.sent(1, &[90.0]);
    cell.cycles(400);
    cell.motion(CLEAR, true);
    cell.cycle();
    cell.motion(CLEAR, false);
    cell.resume();
    cell.cycles(500);
    assert!(cell.joints()[0] < 80.0, "{:?}", cell.joints());
    cell.sent(1, &[0.0]);
    cell.finish(1);
    assert!(cell.is_at([0.0; 6]));
}
