//! Multicast groups: joined once however many targets send to them, left with the last.

use core::net::Ipv4Addr;

use super::{Target, Transmit};

/// What a target has to do with a group.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Membership {
    /// The group that its open connection needs.
    pub(super) wanted: Option<Ipv4Addr>,
    /// The group that was joined for it.
    pub(super) joined: Option<Ipv4Addr>,
}

fn has_joined(targets: &[Target], group: Ipv4Addr) -> bool {
    targets.iter().any(|target| target.membership().joined == Some(group))
}

/// The next group to join or leave. Joins come first, so that a group that goes from one target to another is
/// not left in between.
pub(super) fn poll(targets: &mut [Target]) -> Option<Transmit> {
    // Twice: a target that goes from one group to another joins after it has left.
    for _ in 0..2 {
        let transmit = join(targets).or_else(|| leave(targets));
        if transmit.is_some() {
            return transmit;
        }
    }
    None
}

fn join(targets: &mut [Target]) -> Option<Transmit> {
    for index in 0..targets.len() {
        let Membership { wanted, joined } = targets.get(index)?.membership();
        let Some(group) = wanted.filter(|_| joined.is_none()) else { continue };
        let is_shared = has_joined(targets, group);
        targets.get_mut(index)?.set_joined(Some(group));
        if !is_shared {
            return Some(Transmit::JoinGroup { group });
        }
    }
    None
}

fn leave(targets: &mut [Target]) -> Option<Transmit> {
    for index in 0..targets.len() {
        let Membership { wanted, joined } = targets.get(index)?.membership();
        let Some(group) = joined.filter(|_| joined != wanted) else { continue };
        targets.get_mut(index)?.set_joined(None);
        if !has_joined(targets, group) {
            return Some(Transmit::LeaveGroup { group });
        }
    }
    None
}
