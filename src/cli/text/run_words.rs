//! What people read about the end of a run over TCP, where it differs from one over a bus.

use std::prelude::v1::*;

use crate::cli::exit::Exit;
use crate::cli::wording::{exit_of, message, place, reason};
use crate::run::outcome::{End, LinkMessage, Outcome, Stop};
use crate::run::program::Program;
use crate::run::record::{StepEnd, StepRecord};
use crate::run::runner::STOP_LIMIT;

/// How a run ended: the exit code, and what to say on standard error (nothing after a good run). `lost`
/// is what was said when the connection was lost, if it was.
pub(super) fn outcome(
    outcome: &Outcome,
    file: &str,
    program: &Program,
    records: &[StepRecord],
    lost: Option<LinkMessage>,
) -> (Exit, String) {
    let exit = exit_of(&outcome.end);
    let place = outcome.step.and_then(|step| place(file, program, step));
    let stop = stopped(outcome.stop);
    let (what, remedy) = match outcome.end {
        End::Completed => return (exit, String::new()),
        End::Interrupted => {
            let place = place.map(|place| format!(" at {place}")).unwrap_or_default();
            let stop = stop.unwrap_or_else(|| "Nothing was moving.".into());
            return (exit, format!("interrupted{place}\n  {stop}"));
        }
        End::ConnectionLost => connection_lost(program, records, lost),
        End::NotConnected => (
            "the robot does not answer".into(),
            "look at the network, and whether the port is the robot's control port.".into(),
        ),
        end => reason(end),
    };
    let mut message = message(place, file, &what, &remedy);
    if let Some(stop) = stop {
        message.push_str("\n  ");
        message.push_str(&stop);
    }
    (exit, message)
}

/// What was done to stop the robot; nothing where there was no need.
fn stopped(stop: Stop) -> Option<String> {
    Some(match stop {
        Stop::NotNeeded => return None,
        Stop::Confirmed => {
            "Motion was paused and cleared, both confirmed by the robot; the connection is closed."
                .into()
        }
        Stop::Deactivated => {
            "The robot was being activated or homed and was deactivated, which it \
                              confirmed."
                .into()
        }
        Stop::NotActivated => "The robot is not activated; nothing had to be stopped.".into(),
        Stop::LinkLost => {
            "The connection was lost before the robot confirmed that it had stopped. Look \
                           at the robot before going near it."
                .into()
        }
        Stop::Unconfirmed => format!(
            "The robot did not confirm within {} s that it had stopped; the connection was closed, upon \
             which a moving robot stops. Look at the robot before going near it.",
            STOP_LIMIT.as_secs()
        ),
    })
}

/// What is known of a line when the connection is lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fate {
    Done,
    Taken,
    Sent,
    NeverSent,
}

impl Fate {
    /// Nothing for a line that was dropped before.
    fn of(record: &StepRecord) -> Option<Self> {
        match record.end {
            StepEnd::Done => Some(Self::Done),
            StepEnd::Unknown if record.accepted.is_some() => Some(Self::Taken),
            StepEnd::Unknown => Some(Self::Sent),
            StepEnd::Open | StepEnd::Aborted(_) => {
                record.submitted.is_none().then_some(Self::NeverSent)
            }
        }
    }
}

/// What is known of the lines, and what to do.
fn connection_lost(
    program: &Program,
    records: &[StepRecord],
    lost: Option<LinkMessage>,
) -> (String, String) {
    let why = lost.map(|lost| format!(": {}", lost.as_str())).unwrap_or_default();
    let mut what = format!("connection lost{why}");
    let fates = [
        (Fate::Done, "done"),
        (Fate::Taken, "taken by the robot, not known to be done"),
        (Fate::Sent, "sent, not known to be taken"),
        (Fate::NeverSent, "never sent"),
    ];
    for (fate, name) in fates {
        let steps = program.steps().iter().zip(records);
        let mut lines =
            steps.filter(|(_, record)| Fate::of(record) == Some(fate)).map(|(step, _)| step.line);
        let Some(first) = lines.next() else { continue };
        what += &match lines.next_back() {
            None => format!("\n  line {first}: {name}"),
            Some(last) => format!("\n  lines {first} to {last}: {name}"),
        };
    }
    let remedy = "look at cable, power and controller, and at where the robot stands: one that moves stops \
                  when its connection breaks (PM section 4), and the next run clears what it still has \
                  queued.";
    (what, remedy.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::Instant;
    use crate::wire::meca500::revision::Revision;

    #[test]
    fn a_lost_connection_says_what_is_known_of_which_line() {
        let text = "Delay(1)\nDelay(1)\n\nDelay(1)\nDelay(1)\nDelay(1)\n";
        let program = Program::parse(text, Revision::R3).expect("good");
        let at = Some(Instant::ZERO);
        let sent = StepRecord { submitted: at, end: StepEnd::Unknown, ..StepRecord::default() };
        let records = [
            StepRecord { submitted: at, accepted: at, end: StepEnd::Done, ..StepRecord::default() },
            StepRecord { accepted: at, ..sent },
            StepRecord { accepted: at, ..sent },
            sent,
            StepRecord::default(),
        ];
        let lost = Some(LinkMessage::of(&"the robot closed the connection"));
        let ended = Outcome { end: End::ConnectionLost, step: Some(1), stop: Stop::NotNeeded };
        let (exit, said) = outcome(&ended, "p.txt", &program, &records, lost);
        assert_eq!(exit, Exit::Link);
        let expected = "p.txt:2: Delay(1)\n  connection lost: the robot closed the connection\n  \
                        line 1: done\n  lines 2 to 4: taken by the robot, not known to be done\n  \
                        line 5: sent, not known to be taken\n  line 6: never sent\n  Remedy: ";
        assert!(said.starts_with(expected), "{said}");
    }
}
