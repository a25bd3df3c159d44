//! One bus cycle: all groups under way at once, and what came back judged.
//!
//! Each group has a frame of its own; all are sent before the first answer is awaited. The futures of
//! `ethercrab` live on the stack of [`exchange_groups`], chained by recursion, because nothing may be
//! allocated here.

use core::future::Future;
use core::pin::{Pin, pin};
use core::task::{Context, Poll};

use ethercrab::error::Error;

use super::driver::{Driver, LongTask, Turn};
use super::group::{GROUP_ROBOTS, GroupReply, RobotGroup};
use super::settings::MAX_ROBOTS;
use super::wire::Wire;
use crate::time::Instant;
use crate::wire::ethercat::al::AlState;

/// Groups that a segment can have.
pub(super) const MAX_GROUPS: usize = MAX_ROBOTS / GROUP_ROBOTS;
/// What a robot in OP adds to the working counter of an LRW: 1 for inputs, 2 for outputs.
pub(super) const PER_ROBOT: u16 = 3;

/// What came back for each group; `None` where no frame did.
pub(super) type Replies = [Option<GroupReply>; MAX_GROUPS];

/// The cycle of one group, and those before it.
struct Chained<'a, F> {
    future: Pin<&'a mut F>,
    reply: &'a mut Option<GroupReply>,
    is_done: bool,
    /// `None` once all have ended.
    others: Option<&'a mut dyn Turn>,
}

impl<F: Future<Output = Result<GroupReply, Error>>> Turn for Chained<'_, F> {
    fn poll(&mut self, context: &mut Context<'_>) -> bool {
        if !self.is_done
            && let Poll::Ready(reply) = self.future.as_mut().poll(context)
        {
            self.is_done = true;
            *self.reply = reply.ok();
        }
        if let Some(others) = &mut self.others
            && others.poll(context)
        {
            self.others = None;
        }
        self.is_done && self.others.is_none()
    }
}

/// Exchanges the process data of all groups until `deadline`, and lets `task` go one step further;
/// its outcome if it has ended.
pub(super) fn exchange_groups<W: Wire, T>(
    driver: &mut Driver<W>,
    groups: &[RobotGroup],
    replies: &mut Replies,
    deadline: Instant,
    task: &mut Option<LongTask<T>>,
) -> Option<T> {
    chain(driver, groups, 0, replies, deadline, None, task)
}

fn chain<W: Wire, T>(
    driver: &mut Driver<W>,
    groups: &[RobotGroup],
    number: usize,
    replies: &mut [Option<GroupReply>],
    deadline: Instant,
    others: Option<&mut dyn Turn>,
    task: &mut Option<LongTask<T>>,
) -> Option<T> {
    let (Some((group, groups)), Some((reply, replies))) =
        (groups.split_first(), replies.split_first_mut())
    else {
        return None;
    };
    let future = pin!(group.cycle(driver.cycle_device(number)?));
    let others = others.map(|others| -> &mut dyn Turn { others });
    let mut link = Chained { future, reply, is_done: false, others };
    if !groups.is_empty() {
        return chain(driver, groups, number + 1, replies, deadline, Some(&mut link), task);
    }
    let (has_ended, outcome) = driver.exchange(deadline, &mut link, task);
    if !has_ended {
        driver.give_up_cycle();
    }
    outcome
}

/// What a reply says about one robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// In OP, and its inputs are new.
    Fresh,
    /// In OP, but the working counter does not add up: some robot of the frame did not take part.
    Doubtful,
    /// It answers, in another state.
    NotInOp(Option<AlState>),
    /// It does not answer.
    Silent,
}

/// Judges a robot of a group of `len` by the group's reply.
///
/// A robot in OP adds 3 to the working counter. One that answers in another state adds up to 3: its ESC
/// may be set up already, or still. So the counter tells for certain only when all are in OP; a robot in
/// OP whose sync managers are in order always counts.
///
/// One case stays open, as all robots of a frame share one counter: of two robots the one in SAFE-OP
/// adds 1 with its inputs, and the one in OP adds 2 with its outputs alone. That makes 3, as much as a
/// robot in OP that is in order, and passes for fresh though its inputs are those of before.
pub(super) fn judge(reply: &GroupReply, member: usize, len: usize) -> Verdict {
    let state = reply.states.get(member).copied().unwrap_or(0);
    if state == 0 {
        return Verdict::Silent;
    }
    let state = AlState::from_wire(state);
    if state != Some(AlState::Op) {
        return Verdict::NotInOp(state);
    }
    let states = reply.states.iter().take(len);
    let (mut least, mut most) = (0, 0);
    for other in states.filter(|state| **state != 0) {
        most += PER_ROBOT;
        if AlState::from_wire(*other) == Some(AlState::Op) {
            least += PER_ROBOT;
        }
    }
    if (least..=most).contains(&reply.working_counter) { Verdict::Fresh } else { Verdict::Doubtful }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reply(working_counter: u16, states: [u8; 4]) -> GroupReply {
        GroupReply { working_counter, states, clock: None }
    }

    #[test]
    fn the_counter_must_add_up() {
        for wrong in [0, 1, 2, 4, 5, 6, 9] {
            assert_eq!(judge(&reply(wrong, [8, 0, 0, 0]), 0, 1), Verdict::Doubtful, "{wrong}");
        }
        assert_eq!(judge(&reply(3, [8, 0, 0, 0]), 0, 1), Verdict::Fresh);
        assert_eq!(judge(&reply(12, [8; 4]), 3, 4), Verdict::Fresh);
        assert_eq!(judge(&reply(11, [8; 4]), 3, 4), Verdict::Doubtful);
    }

    #[test]
    fn robots_beside_one_that_fell_or_left_go_on() {
        // The second robot is in SAFE-OP: it may count or not.
        for counter in 3..=6 {
            let reply = reply(counter, [8, 4, 0, 0]);
            assert_eq!(judge(&reply, 0, 2), Verdict::Fresh);
            assert_eq!(judge(&reply, 1, 2), Verdict::NotInOp(Some(AlState::SafeOp)));
        }
        assert_eq!(judge(&reply(2, [8, 4, 0, 0]), 0, 2), Verdict::Doubtful);
        let gone = reply(3, [8, 0, 0, 0]);
        assert_eq!(judge(&gone, 0, 2), Verdict::Fresh);
        assert_eq!(judge(&gone, 1, 2), Verdict::Silent);
        assert_eq!(judge(&reply(0, [2, 0, 0, 0]), 0, 1), Verdict::NotInOp(Some(AlState::PreOp)));
    }
}
