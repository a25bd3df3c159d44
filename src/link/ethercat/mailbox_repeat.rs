//! Fetching a mailbox answer again whose frame was lost on its way back.
//!
//! A read empties the mailbox, also when the frame that carried the answer never arrives; reading
//! again finds nothing. For this an ESC keeps the last answer: toggle the repeat bit of the mailbox's
//! sync manager, wait for the acknowledgement, and the answer is there again. `ethercrab` does not
//! know this; a start of a thousand frames would fail with the first lost one.
//!
//! Source: ETG.1000 part 4.

use super::driver::Driver;
use super::wire::Wire;
use crate::time::Duration;
use crate::wire::ethercat::command::Command;
use crate::wire::ethercat::frame::{FrameBuilder, datagrams};
use crate::wire::ethercat::register::{
    RAM_START, SYNC_MANAGER, SYNC_MANAGER_LEN, SyncManagerActivation,
};

/// Source address of our own frames; that of `ethercrab`'s, with another last byte.
const SOURCE: [u8; 6] = [0x10, 0x10, 0x10, 0x10, 0x10, 0x11];
/// Sync managers that are looked through.
const SYNC_MANAGERS: u16 = 4;
/// Bytes of a sync manager: where its activation and the device's own control stand.
const ACTIVATION: u16 = 6;
const DEVICE_CONTROL: u16 = 7;
/// How long one answer is waited for, and how often it is asked for.
const PATIENCE: Duration = Duration::from_millis(25);
const TRIES: u32 = 4;
/// Looks at the acknowledgement before the subdevice counts as unable.
const LOOKS: u32 = 50;

/// The read of a mailbox that found it empty although the answer had been there: its station and
/// address.
pub(super) fn lost_answer(sent: &[u8], back: &[u8]) -> Option<(u16, u16)> {
    let mut asked = datagrams(sent).ok()?;
    let only = asked.next().filter(|_| asked.next().is_none())?;
    let answer = datagrams(back).ok()?.next()?;
    match only.command() {
        Some(Command::Fprd { station, register })
            if register >= RAM_START && answer.working_counter == 0 =>
        {
            Some((station, register))
        }
        _ => None,
    }
}

impl<W: Wire> Driver<W> {
    /// Lets the subdevice put its last answer into the mailbox at `address` again; whether it did.
    pub(super) fn repeat_mailbox(&mut self, station: u16, address: u16) -> bool {
        self.try_repeat(station, address).is_some()
    }

    fn try_repeat(&mut self, station: u16, address: u16) -> Option<()> {
        let manager = (0..SYNC_MANAGERS).find_map(|number| {
            let register = SYNC_MANAGER + number * SYNC_MANAGER_LEN;
            let start = self.ask(Command::Fprd { station, register }, &[0, 0])?;
            (start == address.to_le_bytes()).then_some(register)
        })?;
        let activation = Command::Fprd { station, register: manager + ACTIVATION };
        let [now] = self.ask(activation, &[0])?;
        let repeat = SyncManagerActivation::REPEAT.bits();
        let toggle = Command::Fpwr { station, register: manager + ACTIVATION };
        self.ask(toggle, &[now ^ repeat])?;
        let control = Command::Fprd { station, register: manager + DEVICE_CONTROL };
        (0..LOOKS).find_map(|_| {
            let [acknowledged] = self.ask(control, &[0])?;
            ((acknowledged ^ now) & repeat != 0).then_some(())
        })
    }

    /// One datagram there and back; its data. `None` when nobody took it, or it was lost too often.
    fn ask<const LEN: usize>(&mut self, command: Command, data: &[u8; LEN]) -> Option<[u8; LEN]> {
        let mut frame = [0; 60];
        let mut builder = FrameBuilder::new(&mut frame, SOURCE).ok()?;
        builder.push(command, 0, data).ok()?;
        let len = builder.finish();
        let frame = frame.get(..len)?;
        (0..TRIES).find_map(|_| {
            let back = self.own_round_trip(frame, PATIENCE)?;
            let answer = datagrams(back).ok()?.next()?;
            let data = answer.data.try_into().ok()?;
            (answer.working_counter == 1).then_some(data)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn read(station: u16, register: u16, counter: u8) -> Vec<u8> {
        let mut frame = [0; 60];
        let mut builder = FrameBuilder::new(&mut frame, SOURCE).unwrap();
        builder.push(Command::Fprd { station, register }, 3, &[0; 16]).unwrap();
        let len = builder.finish();
        let mut frame = frame[..len].to_vec();
        frame[len - 2] = counter;
        frame
    }

    #[test]
    fn only_an_empty_mailbox_is_worth_asking_again() {
        let sent = read(0x1001, 0x1080, 0);
        assert_eq!(lost_answer(&sent, &read(0x1001, 0x1080, 0)), Some((0x1001, 0x1080)));
        assert_eq!(lost_answer(&sent, &read(0x1001, 0x1080, 1)), None);
        let register = read(0x1001, 0x0130, 0);
        assert_eq!(lost_answer(&register, &register), None);
    }
}
