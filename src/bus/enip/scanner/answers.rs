//! What the target answers, and whether it is an answer to what was asked.

use core::net::{Ipv4Addr, SocketAddrV4};

use super::session::Pending;
use super::{Step, T2oType, Trouble};
use crate::time::Duration;
use crate::wire::enip::connection::{ConnectionRefusal, ForwardCloseReply, ForwardOpenReply};
use crate::wire::enip::cpf::Unconnected;
use crate::wire::enip::encapsulation::{
    Command, EncapsulationStatus, Header, PROTOCOL_VERSION, Packet,
};
use crate::wire::enip::message::{Response, Service};
use crate::wire::enip::status::GeneralStatus;
use crate::wire::enip::{DecodeError, IO_PORT};

/// Whether a packet answers the request that is waited for. A late one, or one for somebody else, does not: its
/// sender context, command or session differs.
pub(super) fn belongs_to(header: &Header, pending: &Pending, session: Option<u32>) -> bool {
    let (command, is_session_right) = match pending.step {
        Step::RegisterSession => (Command::REGISTER_SESSION, true),
        _ => (Command::SEND_RR_DATA, Some(header.session) == session),
    };
    header.command == command
        && header.context == pending.context
        && is_session_right
        && header.options == 0
}

/// The handle of a session that was registered.
pub(super) fn session_handle(packet: &Packet<'_>) -> Result<u32, DecodeError> {
    const MESSAGE: &str = "RegisterSession answer";
    let wrong =
        |field, found, allowed| DecodeError::Value { message: MESSAGE, field, found, allowed };
    match *packet.data {
        [low, high, _, _] => {
            let version = u16::from_le_bytes([low, high]);
            if version != PROTOCOL_VERSION {
                return Err(wrong("protocol version", u32::from(version), "1"));
            }
        }
        _ => return Err(wrong("length", u32::from(packet.header.length), "4")),
    }
    match packet.header.session {
        0 => Err(wrong("session handle", 0, "anything else")),
        handle => Ok(handle),
    }
}

/// An answer to an unconnected request.
#[derive(Clone, Copy, Debug)]
pub(super) struct Answer<'a> {
    pub(super) response: Response<'a>,
    pub(super) o2t_address: Option<SocketAddrV4>,
    pub(super) t2o_address: Option<SocketAddrV4>,
    /// What is wrong with an address that it has and that cannot be read.
    pub(super) flaw: Option<DecodeError>,
}

/// Reads an answer; `None` if it answers another service.
pub(super) fn answer<'a>(
    packet: &Packet<'a>,
    service: Service,
) -> Result<Option<Answer<'a>>, DecodeError> {
    let (unconnected, flaw) = Unconnected::read_answer(packet.data)?;
    let response = Response::read(unconnected.message)?;
    let Unconnected { o2t_address, t2o_address, .. } = unconnected;
    let answer = Answer { response, o2t_address, t2o_address, flaw };
    Ok((response.service == service).then_some(answer))
}

/// Whether a refusal names another connection. Some targets name none: then it counts.
pub(super) fn is_about_another(response: &Response<'_>, pending: &Pending) -> bool {
    response.status != GeneralStatus::SUCCESS
        && ConnectionRefusal::read(response.data)
            .is_ok_and(|refusal| refusal.triad != pending.triad)
}

/// Whether an answer to a Forward Close names another connection.
pub(super) fn is_about_another_close(response: &Response<'_>, pending: &Pending) -> bool {
    if response.status == GeneralStatus::SUCCESS {
        return ForwardCloseReply::read(response.data)
            .is_ok_and(|reply| reply.triad != pending.triad);
    }
    is_about_another(response, pending)
}

/// What a Forward Open brought.
#[derive(Clone, Copy, Debug)]
pub(super) struct Agreed {
    pub(super) o2t_id: u32,
    pub(super) t2o_id: u32,
    pub(super) o2t_api: Duration,
    pub(super) t2o_api: Duration,
    pub(super) o2t_to: SocketAddrV4,
    pub(super) group: Option<Ipv4Addr>,
}

fn api(field: &'static str, us: u32) -> Result<Duration, DecodeError> {
    if us == 0 {
        let (message, allowed) = ("Forward Open reply", "1 us or more");
        return Err(DecodeError::Value { message, field, found: 0, allowed });
    }
    Ok(Duration::from_micros(u64::from(us)))
}

/// Where O->T frames go: what the answer says, of which a zero address is the TCP peer's and a zero port 2222.
fn destination(peer: Ipv4Addr, told: Option<SocketAddrV4>) -> SocketAddrV4 {
    let Some(told) = told else { return SocketAddrV4::new(peer, IO_PORT) };
    let address = if told.ip().is_unspecified() { peer } else { *told.ip() };
    SocketAddrV4::new(address, if told.port() == 0 { IO_PORT } else { told.port() })
}

/// The group of a multicast connection: what the answer says and nothing else.
fn group(t2o_type: T2oType, answer: &Answer<'_>) -> Result<Option<Ipv4Addr>, DecodeError> {
    const MESSAGE: &str = "Forward Open reply";
    if t2o_type == T2oType::Unicast {
        return Ok(None);
    }
    let field = "T->O socket address item (the group)";
    let missing = answer.flaw.unwrap_or(DecodeError::Truncated { message: MESSAGE, field });
    let group = *answer.t2o_address.ok_or(missing)?.ip();
    if !group.is_multicast() {
        let (found, allowed) = (u32::from(group), "224.0.0.0 to 239.255.255.255");
        return Err(DecodeError::Value { message: MESSAGE, field, found, allowed });
    }
    Ok(Some(group))
}

/// Reads what a Forward Open brought; `None` if it is about another connection.
pub(super) fn agreed(
    answer: &Answer<'_>,
    pending: &Pending,
    peer: Ipv4Addr,
    t2o_type: T2oType,
) -> Result<Option<Agreed>, DecodeError> {
    let reply = ForwardOpenReply::read_answer(answer.response.data)?;
    if reply.triad != pending.triad {
        return Ok(None);
    }
    Ok(Some(Agreed {
        o2t_id: reply.o2t_id,
        t2o_id: reply.t2o_id,
        o2t_api: api("O->T API", reply.o2t_api_us)?,
        t2o_api: api("T->O API", reply.t2o_api_us)?,
        o2t_to: destination(peer, answer.o2t_address),
        group: group(t2o_type, answer)?,
    }))
}

/// The trouble of an encapsulation status, if it is one.
pub(super) fn encapsulation_trouble(header: &Header, step: Step) -> Option<Trouble> {
    (header.status != EncapsulationStatus::SUCCESS)
        .then_some(Trouble::Encapsulation { step, status: header.status })
}
