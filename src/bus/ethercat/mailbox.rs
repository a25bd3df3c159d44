//! The firmware's side of the mailbox: sync manager 0 in, sync manager 1 out, and the repeat that
//! a main device asks for when an answer was lost on the way.

use crate::wire::ethercat::al::AlState;
use crate::wire::ethercat::register::{SYNC_MANAGER, SYNC_MANAGER_LEN, SyncManagerActivation};

use super::application::Application;
use super::controller::Controller;

/// Longest mailbox in bytes: what fits one datagram of a frame.
const MAX_MAILBOX: usize = 1_486;
/// Shortest mailbox in bytes: a mailbox header, a CoE header and an expedited SDO.
const MIN_MAILBOX: usize = 16;

/// What the firmware remembers of the mailbox.
#[derive(Clone, Debug)]
pub(super) struct Mailbox {
    /// The datagram that was read last; while one is repeated, the one it has displaced.
    last: [u8; MAX_MAILBOX],
    /// Whether `last` holds one that was read.
    has_last: bool,
    /// A datagram is being repeated and the next one waits in `last`.
    displaced: bool,
}

impl Mailbox {
    /// Sync manager that the main device writes.
    const RECEIVE: usize = 0;
    /// Sync manager that the main device reads.
    pub(super) const SEND: usize = 1;

    pub(super) const fn new() -> Self {
        Self { last: [0; MAX_MAILBOX], has_last: false, displaced: false }
    }

    /// Whether both sync managers are as a mailbox needs them.
    pub(super) fn is_set_up(controller: &Controller) -> bool {
        let [receive, send, ..] = &controller.sync_managers;
        let fits = |length: usize| (MIN_MAILBOX..=MAX_MAILBOX).contains(&length);
        receive.is_usable()
            && send.is_usable()
            && receive.is_mailbox()
            && send.is_mailbox()
            && receive.is_output()
            && !send.is_output()
            && fits(receive.length())
            && fits(send.length())
            && (receive.end() <= usize::from(send.start())
                || send.end() <= usize::from(receive.start()))
    }

    /// Takes what came, repeats what was asked for, and gives out what the application has.
    /// `was_read` says that the main device has emptied the send mailbox.
    pub(super) fn serve<A: Application>(
        &mut self,
        controller: &mut Controller,
        application: &mut A,
        state: AlState,
        was_read: bool,
    ) {
        if was_read {
            self.remember(controller);
        }
        self.repeat(controller);
        let Controller { memory, sync_managers: [receive, send, ..], .. } = controller;
        if receive.is_usable()
            && receive.has_unread()
            && let Some(datagram) = memory.get(receive.start(), receive.length())
        {
            application.receive_mailbox(state, datagram);
            receive.take();
        }
        if send.is_usable()
            && !send.has_unread()
            && let Some(room) = memory.get_mut(send.start(), send.length())
            && application.next_mailbox(room).is_some()
        {
            send.put();
        }
        controller.show_sync_manager(Self::RECEIVE);
        controller.show_sync_manager(Self::SEND);
    }

    /// Keeps what was read; puts back what a repeat has displaced.
    fn remember(&mut self, controller: &mut Controller) {
        let Controller { memory, sync_managers: [_, send, ..], .. } = controller;
        let length = send.length();
        let buffer = memory.get_mut(send.start(), length);
        let (Some(buffer), Some(last)) = (buffer, self.last.get_mut(..length)) else { return };
        if self.displaced {
            buffer.swap_with_slice(last);
            self.displaced = false;
            send.put();
        } else {
            last.copy_from_slice(buffer);
        }
        self.has_last = true;
    }

    /// Puts the last datagram into the mailbox again if the repeat bit was toggled.
    fn repeat(&mut self, controller: &mut Controller) {
        let base = SYNC_MANAGER + SYNC_MANAGER_LEN * Self::SEND as u16;
        let Controller { memory, sync_managers: [_, send, ..], .. } = controller;
        let requested = memory.u8(base + 6) & SyncManagerActivation::REPEAT.bits();
        if requested == memory.u8(base + 7) & SyncManagerActivation::REPEAT.bits() {
            return;
        }
        let length = send.length();
        if let (true, false, Some(buffer), Some(last)) = (
            self.has_last,
            self.displaced,
            memory.get_mut(send.start(), length),
            self.last.get_mut(..length),
        ) {
            if send.has_unread() {
                buffer.swap_with_slice(last);
                self.displaced = true;
            } else {
                buffer.copy_from_slice(last);
                send.put();
            }
        }
        memory.set_u8(base + 7, requested);
    }
}
