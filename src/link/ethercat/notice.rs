//! What subdevices say in their mailboxes beyond answers, read off the frames that pass.
//!
//! `ethercrab` gives no abort code as a number, and asserts that no emergency comes where an answer is
//! expected; both are seen here before it sees the frame.

use crate::wire::ethercat::coe::sdo::COMMAND_ABORT;
use crate::wire::ethercat::coe::{CoeHeader, CoeService, Emergency};
use crate::wire::ethercat::command::Command;
use crate::wire::ethercat::frame::{
    DATAGRAM_HEADER, Datagram, ETHERCAT_HEADER, ETHERNET_HEADER, WORKING_COUNTER, datagrams,
};
use crate::wire::ethercat::mailbox::{MailboxHeader, MailboxProtocol};
use crate::wire::ethercat::register::RAM_START;

/// What a subdevice said.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct MailboxNotice {
    /// Station address of the subdevice.
    pub(super) station: u16,
    pub(super) kind: NoticeKind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NoticeKind {
    /// An emergency: its error code and the error register (1001h).
    Emergency { code: u16, register: u8 },
    /// A datagram of another protocol than CoE.
    Foreign,
    /// The abort of an SDO transfer.
    Abort { index: u16, sub_index: u8, code: u32 },
}

/// Looks for a notice in a frame that came back. An emergency is taken out: the read then looks
/// unanswered.
pub(super) fn take_notice(frame: &mut [u8]) -> Option<MailboxNotice> {
    let mut end = ETHERNET_HEADER + ETHERCAT_HEADER;
    let mut found = None;
    for datagram in datagrams(frame).ok()? {
        end += DATAGRAM_HEADER + datagram.data.len() + WORKING_COUNTER;
        found = notice_of(&datagram);
        if found.is_some() {
            break;
        }
    }
    let notice = found?;
    if let NoticeKind::Emergency { .. } | NoticeKind::Foreign = notice.kind {
        frame.get_mut(end - WORKING_COUNTER..end)?.fill(0);
    }
    Some(notice)
}

fn notice_of(datagram: &Datagram<'_>) -> Option<MailboxNotice> {
    let Some(Command::Fprd { station, register }) = datagram.command() else { return None };
    let (header, service_data) = MailboxHeader::split(datagram.data)?;
    let is_mailbox = register >= RAM_START && datagram.working_counter != 0;
    if !is_mailbox {
        return None;
    }
    let (coe, rest) = CoeHeader::split(service_data)?;
    let kind = match (coe.service, rest) {
        // `ethercrab` takes any protocol's datagram for CoE when it looks for emergencies.
        (CoeService::EMERGENCY, _) if header.protocol != MailboxProtocol::COE => {
            NoticeKind::Foreign
        }
        _ if header.protocol != MailboxProtocol::COE => return None,
        (CoeService::EMERGENCY, _) => {
            let Emergency { code, register, .. } = Emergency::from_bytes(rest)?;
            NoticeKind::Emergency { code, register }
        }
        (CoeService::SDO_REQUEST, &[COMMAND_ABORT, low, high, sub_index, a, b, c, d, ..]) => {
            NoticeKind::Abort {
                index: u16::from_le_bytes([low, high]),
                sub_index,
                code: u32::from_le_bytes([a, b, c, d]),
            }
        }
        _ => return None,
    };
    Some(MailboxNotice { station, kind })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec;

    #[test]
    fn an_emergency_is_taken_out_and_named() {
        let mut frame = vec![0xFF; 12];
        frame.extend([0x88, 0xA4, 0x1C, 0x10]);
        frame.extend([4, 7, 0x01, 0x10, 0x80, 0x10, 0x10, 0x00, 0, 0]);
        frame.extend([10, 0, 0, 0, 0, 0x13, 0, 0x10, 0x00, 0x82, 0x21, 1, 2, 3, 4, 5]);
        frame.extend([1, 0]);
        let kind = NoticeKind::Emergency { code: 0x8200, register: 0x21 };
        assert_eq!(take_notice(&mut frame), Some(MailboxNotice { station: 0x1001, kind }));
        assert_eq!(frame[42..], [0, 0]);
        assert_eq!(take_notice(&mut frame), None, "it looks unread now");
    }

    #[test]
    fn an_abort_is_named_and_left_in_place() {
        let mut frame = vec![0xFF; 12];
        frame.extend([0x88, 0xA4, 0x1C, 0x10]);
        frame.extend([4, 7, 0x02, 0x10, 0x80, 0x10, 0x10, 0x00, 0, 0]);
        frame.extend([10, 0, 0, 0, 0, 0x13, 0, 0x20, 0x80, 0x12, 0x1C, 3, 0x22, 0, 0, 8]);
        frame.extend([1, 0]);
        let before = frame.clone();
        let kind = NoticeKind::Abort { index: 0x1C12, sub_index: 3, code: 0x0800_0022 };
        assert_eq!(take_notice(&mut frame), Some(MailboxNotice { station: 0x1002, kind }));
        assert_eq!(frame, before);
    }
}
