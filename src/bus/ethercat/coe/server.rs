//! The subdevice's mailbox: headers, counters, errors, and whose turn it is.

use super::dictionary::Dictionary;
use super::info_server::{InfoServer, TooShort};
use super::sdo_server::{SdoReply, SdoServer, put};
use crate::wire::ethercat::al::AlState;
use crate::wire::ethercat::coe::info::InfoHeader;
use crate::wire::ethercat::coe::sdo::{SDO_LEN, SdoRequest};
use crate::wire::ethercat::coe::{COE_HEADER_LEN, CoeHeader, CoeService, Emergency};
use crate::wire::ethercat::mailbox::{
    MAILBOX_HEADER_LEN, MailboxError, MailboxHeader, MailboxProtocol, next_counter,
};

/// Longest datagram that can wait while an answer is not fetched, in bytes.
const MAX_WAITING: usize = 256;

/// Emergencies that can wait at once.
pub const MAX_EMERGENCIES: usize = 8;

/// Shortest mailbox any answer fits into: headers and the shortest SDO.
const SHORTEST_ROOM: usize = MAILBOX_HEADER_LEN + COE_HEADER_LEN + SDO_LEN;

/// More emergencies than [`MAX_EMERGENCIES`] wait to be fetched: this one is lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{MAX_EMERGENCIES} emergencies wait already; the main device does not fetch them")]
pub struct EmergencyQueueFull;

/// The mailbox of a subdevice that speaks CoE and nothing else.
///
/// One answer is under way at a time. A request that comes before the answer was fetched waits;
/// of a second one, only the fact is kept and answered with
/// [`MailboxError::NO_MORE_MEMORY`]. Emergencies go out when no answer waits.
#[derive(Debug)]
pub struct CoeServer {
    sdo: SdoServer,
    info: InfoServer,
    reply: Option<Reply>,
    waiting: Waiting,
    overflow: bool,
    emergencies: [Option<Emergency>; MAX_EMERGENCIES],
    /// Counter of the last datagram received; 0 before the first, and of a sender that does not
    /// count.
    received: u8,
    /// Counter of the last datagram sent.
    sent: u8,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reply {
    Error(MailboxError),
    Sdo(SdoReply),
    Info,
}

/// A datagram that came too early.
#[derive(Debug)]
struct Waiting {
    datagram: [u8; MAX_WAITING],
    len: Option<usize>,
    state: AlState,
}

impl Default for CoeServer {
    fn default() -> Self {
        Self::new()
    }
}

impl CoeServer {
    /// A mailbox in which nothing waits.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            sdo: SdoServer::new(),
            info: InfoServer::new(),
            reply: None,
            waiting: Waiting { datagram: [0; MAX_WAITING], len: None, state: AlState::Init },
            overflow: false,
            emergencies: [None; MAX_EMERGENCIES],
            received: 0,
            sent: 0,
        }
    }

    /// Forgets everything that is under way, emergencies included.
    pub fn reset(&mut self) {
        self.sdo.reset();
        (self.reply, self.waiting.len, self.overflow) = (None, None, false);
        self.emergencies = [None; MAX_EMERGENCIES];
        (self.received, self.sent) = (0, 0);
    }

    /// Reports a fault when the mailbox is next free.
    ///
    /// # Errors
    ///
    /// [`EmergencyQueueFull`]: too many wait already.
    pub fn queue_emergency(&mut self, emergency: Emergency) -> Result<(), EmergencyQueueFull> {
        let slot = self.emergencies.iter_mut().find(|slot| slot.is_none());
        *slot.ok_or(EmergencyQueueFull)? = Some(emergency);
        Ok(())
    }

    /// Takes a datagram of the main device.
    pub fn receive(&mut self, dictionary: &mut impl Dictionary, state: AlState, datagram: &[u8]) {
        if self.reply.is_none() && self.waiting.len.is_none() {
            self.handle(dictionary, state, datagram);
            return;
        }
        // A mailbox is longer than most datagrams: only what the header counts has to wait.
        let used = MailboxHeader::split(datagram).map_or(datagram.len(), |(header, _)| {
            datagram.len().min(MAILBOX_HEADER_LEN + usize::from(header.length))
        });
        let used = datagram.get(..used).unwrap_or(datagram);
        if self.waiting.len.is_some() || used.len() > MAX_WAITING {
            self.overflow = true;
            return;
        }
        let len = put(&mut self.waiting.datagram, used);
        (self.waiting.len, self.waiting.state) = (Some(len), state);
    }

    /// Writes the next datagram for the main device into `room` and returns its length.
    pub fn next(&mut self, dictionary: &mut impl Dictionary, room: &mut [u8]) -> Option<usize> {
        if room.len() < SHORTEST_ROOM {
            return None;
        }
        if self.reply.is_none()
            && let Some(len) = self.waiting.len.take()
        {
            let waiting = self.waiting.datagram;
            let datagram = waiting.get(..len).unwrap_or(&waiting);
            self.handle(dictionary, self.waiting.state, datagram);
        }
        if self.reply.is_none() && core::mem::take(&mut self.overflow) {
            self.reply = Some(Reply::Error(MailboxError::NO_MORE_MEMORY));
        }
        let (head, body) = room.split_at_mut_checked(MAILBOX_HEADER_LEN)?;
        let (protocol, len) = match self.reply.take() {
            Some(Reply::Error(error)) => (MailboxProtocol::ERROR, put(body, &error.to_bytes())),
            Some(Reply::Sdo(reply)) => {
                let (coe_head, sdo) = body.split_at_mut_checked(COE_HEADER_LEN)?;
                let (service, len) = self.sdo.write(reply, sdo);
                (MailboxProtocol::COE, put(coe_head, &CoeHeader::new(service).to_bytes()) + len)
            }
            Some(Reply::Info) => {
                let (coe_head, info) = body.split_at_mut_checked(COE_HEADER_LEN)?;
                let (len, last) = self.info.write(info);
                if !last {
                    self.reply = Some(Reply::Info);
                }
                let header = CoeHeader::new(CoeService::SDO_INFORMATION);
                (MailboxProtocol::COE, put(coe_head, &header.to_bytes()) + len)
            }
            None => {
                let emergency = self.emergencies.first_mut()?.take()?;
                self.emergencies.rotate_left(1);
                let (coe_head, data) = body.split_at_mut_checked(COE_HEADER_LEN)?;
                let header = CoeHeader::new(CoeService::EMERGENCY);
                let len = put(coe_head, &header.to_bytes()) + put(data, &emergency.to_bytes());
                (MailboxProtocol::COE, len)
            }
        };
        self.sent = next_counter(self.sent);
        let header = MailboxHeader {
            length: u16::try_from(len).unwrap_or(u16::MAX),
            address: 0,
            channel: 0,
            priority: 0,
            protocol,
            counter: self.sent,
        };
        Some(put(head, &header.to_bytes()) + len)
    }

    /// Carries out one datagram; its answer, if any, is `reply`.
    fn handle(&mut self, dictionary: &mut impl Dictionary, state: AlState, datagram: &[u8]) {
        let Some((header, rest)) = MailboxHeader::split(datagram) else {
            self.reply = Some(Reply::Error(MailboxError::SYNTAX));
            return;
        };
        // A counter that repeats is the same datagram again: its answer is under way or gone, and
        // carrying it out twice would be wrong.
        if header.counter != 0 && header.counter == self.received {
            return;
        }
        self.received = header.counter;
        let Some(data) = rest.get(..usize::from(header.length)) else {
            self.reply = Some(Reply::Error(MailboxError::INVALID_SIZE));
            return;
        };
        self.reply = match header.protocol {
            // An error reply is not answered, or two ends could go on for ever.
            MailboxProtocol::ERROR => None,
            MailboxProtocol::COE => {
                self.handle_coe(dictionary, state, data).unwrap_or_else(|e| Some(Reply::Error(e)))
            }
            _ => Some(Reply::Error(MailboxError::UNSUPPORTED_PROTOCOL)),
        };
    }

    fn handle_coe(
        &mut self,
        dictionary: &mut impl Dictionary,
        state: AlState,
        data: &[u8],
    ) -> Result<Option<Reply>, MailboxError> {
        let (header, data) = CoeHeader::split(data).ok_or(MailboxError::SIZE_TOO_SHORT)?;
        match header.service {
            CoeService::SDO_REQUEST => {
                let request = SdoRequest::read(data).ok_or(MailboxError::SIZE_TOO_SHORT)?;
                Ok(self.sdo.request(dictionary, state, request).map(Reply::Sdo))
            }
            CoeService::SDO_INFORMATION => {
                let (header, data) = InfoHeader::split(data).ok_or(MailboxError::SIZE_TOO_SHORT)?;
                self.info
                    .request(dictionary, header, data)
                    .map_err(|TooShort| MailboxError::SIZE_TOO_SHORT)?;
                Ok(Some(Reply::Info))
            }
            service if service < CoeService::EMERGENCY => Err(MailboxError::INVALID_HEADER),
            service if service > CoeService::SDO_INFORMATION => Err(MailboxError::INVALID_HEADER),
            _ => Err(MailboxError::SERVICE_NOT_SUPPORTED),
        }
    }
}
