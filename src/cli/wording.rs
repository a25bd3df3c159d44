//! What people read about a run: events on the way, and how it ended.

use std::prelude::v1::*;

use super::exit::Exit;
use crate::engine::meca500::{Action, Event, Fault, VelocityStop, WaitReason};
use crate::run::outcome::{End, Outcome, Stop};
use crate::run::program::Program;
use crate::run::runner::{STOP_LIMIT, is_lasting};
use crate::wire::meca500::code::Code;
use crate::wire::meca500::image::SafetySignals;
use crate::wire::order::ByteOrder;

/// `1 cycle`, `2 cycles`.
pub(super) fn counted(count: impl TryInto<u64>, what: &str) -> String {
    let count = count.try_into().unwrap_or(u64::MAX);
    let plural = if count == 1 { "" } else { "s" };
    format!("{count} {what}{plural}")
}

/// In how many exchanges frames were lost or late.
pub(super) fn not_back_in_time(count: u64, limit_us: u64) -> String {
    let remedy = if count == 0 { "" } else { "; --reply-limit-us sets it" };
    format!("{} not back in time (limit {limit_us} us{remedy})", counted(count, "exchange"))
}

/// The line a step stands in, as `square.txt:12: MoveLin(...)`.
pub(super) fn place(file: &str, program: &Program, step: usize) -> Option<String> {
    let line = program.steps().get(step)?.line;
    Some(format!("{file}:{line}: {}", program.line_text(line)))
}

/// One line about an event, if it is worth one; errors are left to the end of the run. `line` is the
/// line of the program that was current.
pub(super) fn event(event: &Event, line: Option<u32>) -> Option<String> {
    Some(match event {
        Event::Connected { again: false } => "connected".into(),
        Event::Connected { again: true } => "connected again".into(),
        Event::ByteOrderSettled(order) => format!("byte order found: {order}"),
        Event::Waiting(reason) if !is_lasting(*reason) => return None,
        Event::Waiting(reason) => format!("commands are held back: {}", waiting(*reason)),
        Event::CheckpointReached { number } => format!("checkpoint {number} reached"),
        Event::CheckpointDiscarded { number } => format!("checkpoint {number} discarded"),
        Event::ActionDone(Action::BringUp) => "robot is activated, homed and ready".into(),
        Event::ActionDone(action) => {
            let line = line.map(|line| format!("line {line}: ")).unwrap_or_default();
            format!("{line}{} confirmed", action_name(*action))
        }
        Event::RobotErrorCleared => "robot error cleared".into(),
        Event::SafetyStop { signals } => format!("safety signals: {}", signal_names(*signals)),
        Event::SafetyCleared => "safety signals cleared".into(),
        Event::RobotRebooted => "robot rebooted".into(),
        &Event::ConnectionLost { bad_cycles } => {
            format!(
                "connection lost after {} without fresh inputs",
                counted(u64::from(bad_cycles), "cycle")
            )
        }
        _ => return None,
    })
}

/// How a run ended: the exit code, and what to say on standard error (nothing after a good run).
/// `order` is the byte order that was set, if one was.
pub(super) fn outcome(
    outcome: &Outcome,
    file: &str,
    program: &Program,
    order: Option<ByteOrder>,
) -> (Exit, String) {
    let place = outcome.step.and_then(|step| place(file, program, step));
    let exit = exit_of(&outcome.end);
    let (what, remedy) = match outcome.end {
        End::Completed => return (exit, String::new()),
        End::Interrupted => return (exit, interrupted(outcome.stop, place)),
        End::ImplausibleInputs => implausible(order),
        end => reason(end),
    };
    let mut message = message(place, file, &what, &remedy);
    match outcome.stop {
        Stop::NotNeeded => {}
        Stop::Confirmed => message.push_str("\n  Motion was paused and cleared."),
        Stop::Deactivated => message.push_str("\n  The robot was deactivated."),
        Stop::NotActivated => {
            message.push_str("\n  The robot is not activated; nothing had to be stopped.")
        }
        Stop::LinkLost => {
            message.push_str("\n  ");
            message.push_str(LOST_WHILE_STOPPING);
        }
        Stop::Unconfirmed => {
            message.push_str("\n  ");
            message.push_str(&unconfirmed());
        }
    }
    (exit, message)
}

/// Where, what and what would be right, for a person.
pub(super) fn message(place: Option<String>, file: &str, what: &str, remedy: &str) -> String {
    let mut message = place.unwrap_or_else(|| file.to_string());
    message.push_str("\n  ");
    message.push_str(what);
    if !remedy.is_empty() {
        message.push_str("\n  Remedy: ");
        message.push_str(remedy);
    }
    message
}

pub(super) const fn exit_of(end: &End) -> Exit {
    match end {
        End::Completed => Exit::Done,
        End::Interrupted => Exit::Interrupted,
        End::RobotError(_)
        | End::SafetyStop(_)
        | End::ActionFailed(..)
        | End::VelocityStopped(VelocityStop::RobotState)
        | End::HeldBack(_)
        | End::MonitoringOnly
        | End::Rebooted => Exit::Robot,
        End::ConnectionLost
        | End::LinkFailed(_)
        | End::NotConnected
        | End::ImplausibleInputs
        | End::ByteOrderUndecidable
        | End::VelocityStopped(_)
        | End::RequestRefused(_)
        | End::Fault(_) => Exit::Link,
        End::Refused(_) => Exit::Internal,
    }
}

const LOST_WHILE_STOPPING: &str = "The connection was lost before the robot confirmed that it had stopped. Look at the robot before \
     going near it.";

fn unconfirmed() -> String {
    format!(
        "The robot did not confirm within {} s that it had stopped; outputs are all zero. Look at the \
         robot before going near it.",
        STOP_LIMIT.as_secs()
    )
}

fn interrupted(stop: Stop, place: Option<String>) -> String {
    let place = place.map(|place| format!(" at {place}")).unwrap_or_default();
    match stop {
        Stop::NotNeeded => {
            format!("interrupted{place}\n  Nothing was moving; outputs are all zero.")
        }
        Stop::Confirmed => format!(
            "interrupted{place}\n  Motion was paused and cleared, both confirmed by the robot; \
             outputs are all zero."
        ),
        Stop::Deactivated => format!(
            "interrupted{place}\n  The robot was being activated or homed and was deactivated, which \
             it confirmed; outputs are all zero."
        ),
        Stop::NotActivated => format!(
            "interrupted{place}\n  The robot was not activated, so nothing was moving; outputs are \
             all zero."
        ),
        Stop::LinkLost => format!("interrupted{place}\n  {LOST_WHILE_STOPPING}"),
        Stop::Unconfirmed => format!("interrupted{place}\n  {}", unconfirmed()),
    }
}

/// What happened and what to do about it.
pub(super) fn reason(end: End) -> (String, String) {
    let plain = |what: &str, remedy: &str| (what.to_string(), remedy.to_string());
    match end {
        End::Completed | End::Interrupted => plain("", ""),
        End::RobotError(code) => robot_error(code),
        End::SafetyStop(signals) => (
            format!("safety stop: {}", signal_names(signals)),
            "find out what triggered it, reset it at the robot, then run the program again.".into(),
        ),
        End::ActionFailed(action, fault) => {
            let (why, remedy) = match fault {
                Fault::WrongState => wrong_state(action),
                fault => fault_text(fault),
            };
            (format!("{} failed: {why}", action_name(action)), remedy)
        }
        End::VelocityStopped(VelocityStop::RobotState) => plain(
            "velocity motion ended: the robot is not ready for motion any more, or was paused",
            "look at the robot's state, then run the program again.",
        ),
        End::VelocityStopped(_) => plain(
            "velocity motion ended: inputs were bad, or cycles came too late",
            "look at the link and at the overruns in the summary.",
        ),
        End::HeldBack(reason) => (
            format!("the command cannot be sent: {}", waiting(reason)),
            held_back_remedy(reason).into(),
        ),
        End::MonitoringOnly => plain(
            "the robot grants this connection monitoring only, no control (MonitoringMode)",
            "end the other controlling connection, or allow control in the robot's settings.",
        ),
        End::Rebooted => plain(
            "the robot rebooted; what it had queued is lost",
            "bring the robot to a known position, then run the program again.",
        ),
        End::Refused(error) => (format!("the engine refused the command: {error}"), String::new()),
        End::RequestRefused(error) => {
            (format!("the engine refused the action: {error}"), String::new())
        }
        End::ConnectionLost => plain(
            "connection lost: no fresh inputs; the outputs went to zero",
            "look at cable, power and controller; what was queued on the robot may still be \
             executed.",
        ),
        End::LinkFailed(message) => (
            format!("the link failed: {message}"),
            "look at cable, power and controller; what was queued on the robot may still be executed."
                .into(),
        ),
        End::NotConnected => {
            plain("no connection: the robot sends no fresh inputs", "look at cable and power.")
        }
        End::ImplausibleInputs => implausible(None),
        End::ByteOrderUndecidable => fault_text(Fault::ByteOrderUndecidable),
        End::Fault(fault) => fault_text(fault),
    }
}

/// Inputs that are none in the order that was set.
fn implausible(order: Option<ByteOrder>) -> (String, String) {
    let (set, instead) = match order {
        Some(ByteOrder::BIG) => (" (big)", ", or --byte-order little"),
        Some(ByteOrder::LITTLE) => (" (little)", ", or --byte-order big"),
        _ => ("", ""),
    };
    (
        format!(
            "what the robot sends makes no sense in the byte order that was set{set}; nothing was sent \
             to it"
        ),
        format!("use --byte-order auto, which finds the order out{instead}."),
    )
}

fn robot_error(code: Code) -> (String, String) {
    match code.describe() {
        Some(info) => (format!("robot error {}: {}", code.0, info.text), info.remedy.into()),
        None => (
            format!("robot error {}, which the manual does not list", code.0),
            "look into the robot's log, then reset the error.".into(),
        ),
    }
}

/// Which state an action needs that the robot was not in.
fn wrong_state(action: Action) -> (String, String) {
    let (what, remedy) = match action {
        Action::Home => ("it needs an activated robot", "put ActivateRobot() before this line."),
        Action::Resume | Action::Recover => {
            ("it needs an activated robot", "put ActivateRobot() and Home() before this line.")
        }
        Action::BringUp => (
            "the robot was deactivated meanwhile",
            "find out what deactivated it, then run the program again.",
        ),
        Action::Simulation(_) | Action::Reboot | Action::ClearHoming | Action::Brakes { .. } => {
            ("it needs a deactivated robot", "put DeactivateRobot() before this line.")
        }
        _ => return fault_text(Fault::WrongState),
    };
    (what.into(), remedy.into())
}

fn fault_text(fault: Fault) -> (String, String) {
    let (what, remedy) = match fault {
        Fault::RobotError(code) => return robot_error(code),
        Fault::Timeout => (
            "the robot did not confirm it in time",
            "look at the robot's state; nothing was taken for granted.",
        ),
        Fault::AckTimeout => (
            "the robot did not acknowledge a command in time; whether it took it is unknown",
            "look at the link, and at where the robot stands, before running the program again.",
        ),
        Fault::SafetyStopPresent => (
            "a safety signal is present that cannot be reset from here",
            "release the emergency or protective stop and reset it at the robot.",
        ),
        Fault::WrongState => (
            "the robot is not in the state that is needed",
            "look at the order of ActivateRobot, Home and DeactivateRobot in the program.",
        ),
        Fault::Superseded => ("another action took its place", ""),
        Fault::LinkLost => ("the connection was lost", "look at cable, power and controller."),
        Fault::RobotRebooted => ("the robot rebooted meanwhile", "run the program again."),
        Fault::ByteOrderUndecidable => (
            "the byte order cannot be told from what the robot sends",
            "name it: --byte-order big or --byte-order little.",
        ),
        Fault::MonitoringOnly => (
            "the robot grants this connection monitoring only, no control",
            "end the other controlling connection.",
        ),
    };
    (what.into(), remedy.into())
}

const fn waiting(reason: WaitReason) -> &'static str {
    match reason {
        WaitReason::NotActivated => "the robot is not activated",
        WaitReason::NotHomed => "the robot is not homed",
        WaitReason::NotDeactivated => "the robot must be deactivated for it",
        WaitReason::RobotError => "the robot is in error",
        WaitReason::SafetyStop => "a safety signal is present or still to be reset",
        WaitReason::Cleared => "the queue was cleared and motion not resumed",
        WaitReason::ResumeNeeded => "the queue must be cleared before motion may go on",
        WaitReason::FifoFull => "the robot's queue is full",
        WaitReason::LedgerFull => "many commands are unfinished",
        WaitReason::EventsUnread => "events are waiting to be read",
        WaitReason::VelocityMode => "velocity mode is on",
        WaitReason::Undecided => "nobody knows whether the robot took the command before it",
    }
}

const fn held_back_remedy(reason: WaitReason) -> &'static str {
    match reason {
        WaitReason::NotActivated => "put ActivateRobot() and Home() before this line.",
        WaitReason::NotHomed => "put Home() before this line.",
        WaitReason::NotDeactivated => {
            "put DeactivateRobot() before this line, ActivateRobot() and Home() behind it."
        }
        WaitReason::RobotError => "put ResetError() and ResumeMotion() before this line.",
        WaitReason::Cleared | WaitReason::ResumeNeeded => "put ResumeMotion() before this line.",
        WaitReason::SafetyStop => "release the stop and reset it at the robot.",
        _ => "look at the robot's state.",
    }
}

/// An action as the manual calls it.
pub(super) const fn action_name(action: Action) -> &'static str {
    match action {
        Action::Activate => "ActivateRobot",
        Action::Deactivate => "DeactivateRobot",
        Action::Home => "Home",
        Action::ResetError => "ResetError",
        Action::Resume => "ResumeMotion",
        Action::Pause => "PauseMotion",
        Action::Clear => "ClearMotion",
        Action::Simulation(true) => "ActivateSim",
        Action::Simulation(false) => "DeactivateSim",
        Action::RecoveryMode(_) => "SetRecoveryMode",
        Action::Brakes { .. } => "BrakesControl",
        Action::HostTime(_) => "SetRtc",
        Action::Reboot => "RebootRobot",
        Action::ClearHoming => "clearing the homing",
        Action::BringUp => "bringing the robot up (activate, home, resume)",
        Action::Recover => "recovering (reset error, resume)",
        Action::DisableEtherCat => "DisableEtherCAT",
    }
}

fn signal_names(signals: SafetySignals) -> String {
    let names: Vec<&str> = signals.iter_names().map(|(name, _)| name).collect();
    if names.is_empty() { format!("{:#x}", signals.bits()) } else { names.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_of_a_thing_is_not_many() {
        assert_eq!(counted(0_u8, "cycle"), "0 cycles");
        assert_eq!(counted(1_u64, "cycle"), "1 cycle");
        assert_eq!(counted(2_usize, "robot"), "2 robots");
        let said = |bad_cycles| event(&Event::ConnectionLost { bad_cycles }, None).unwrap();
        assert_eq!(said(1), "connection lost after 1 cycle without fresh inputs");
        assert_eq!(said(10), "connection lost after 10 cycles without fresh inputs");
    }

    #[test]
    fn frames_that_were_late_are_told_with_the_limit_and_how_to_set_it() {
        assert_eq!(not_back_in_time(0, 750), "0 exchanges not back in time (limit 750 us)");
        assert_eq!(
            not_back_in_time(1, 5_000),
            "1 exchange not back in time (limit 5000 us; --reply-limit-us sets it)"
        );
    }

    #[test]
    fn the_order_to_try_is_named() {
        let remedy = |order| implausible(order).1;
        assert!(remedy(Some(ByteOrder::BIG)).ends_with(", or --byte-order little."));
        assert!(remedy(Some(ByteOrder::LITTLE)).ends_with(", or --byte-order big."));
        for order in [None, Some(ByteOrder::ALL[2]), Some(ByteOrder::ALL[3])] {
            assert_eq!(
                remedy(order),
                "use --byte-order auto, which finds the order out.",
                "{order:?}"
            );
        }
    }
}
