//! The rules of the EtherCAT state machine, apart from what makes a device agree.
//!
//! ```text
//!  INIT <-> PRE-OP <-> SAFE-OP <-> OP      up one step at a time, down any number
//! ```
//!
//! Source: ETG.1000 part 6.

use crate::wire::ethercat::al::{AlState, AlStatusCode};

/// What the rules say about a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// It is there already.
    Same,
    /// One step up: to be checked.
    Up,
    /// Down, by one step or more.
    Down,
    /// Not allowed.
    Refused(AlStatusCode),
}

/// Judges a request for `to` in state `from`.
pub(super) const fn judge(from: AlState, to: AlState) -> Verdict {
    use AlState::{Bootstrap, Init, Op, PreOp, SafeOp};
    match (from, to) {
        (Init, Init) | (PreOp, PreOp) | (SafeOp, SafeOp) | (Op, Op) | (Bootstrap, Bootstrap) => {
            Verdict::Same
        }
        (Init, PreOp) | (PreOp, SafeOp) | (SafeOp, Op) => Verdict::Up,
        (PreOp | SafeOp | Op | Bootstrap, Init) | (SafeOp | Op, PreOp) | (Op, SafeOp) => {
            Verdict::Down
        }
        (Init, Bootstrap) => Verdict::Refused(AlStatusCode::BOOTSTRAP_NOT_SUPPORTED),
        _ => Verdict::Refused(AlStatusCode::INVALID_STATE_CHANGE),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pair() {
        use AlState::{Bootstrap, Init, Op, PreOp, SafeOp};
        let invalid = Verdict::Refused(AlStatusCode(0x0011));
        let states = [Init, PreOp, Bootstrap, SafeOp, Op];
        let expected = [
            [Verdict::Same, Verdict::Up, Verdict::Refused(AlStatusCode(0x0013)), invalid, invalid],
            [Verdict::Down, Verdict::Same, invalid, Verdict::Up, invalid],
            [Verdict::Down, invalid, Verdict::Same, invalid, invalid],
            [Verdict::Down, Verdict::Down, invalid, Verdict::Same, Verdict::Up],
            [Verdict::Down, Verdict::Down, invalid, Verdict::Down, Verdict::Same],
        ];
        for (from, row) in states.into_iter().zip(expected) {
            for (to, verdict) in states.into_iter().zip(row) {
                assert_eq!(judge(from, to), verdict, "{from} to {to}");
            }
        }
    }
}
