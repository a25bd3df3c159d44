//! A whole explicit message from encapsulation header to the last byte, as the sum of its layers.

use core::net::SocketAddrV4;

use fieldarm::wire::enip::connection::*;
use fieldarm::wire::enip::cpf::Unconnected;
use fieldarm::wire::enip::encapsulation::{
    Command, EncapsulationStatus, Header, Packet, PacketWriter,
};
use fieldarm::wire::enip::message::{Request, Response, Service};
use fieldarm::wire::enip::path::{ConnectionPath, ObjectPath};
use fieldarm::wire::enip::status::GeneralStatus;
use fieldarm::wire::enip::{DecodeError, NoRoom};

use super::harness::Message;

/// A message in SendRRData.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Explicit<'a> {
    pub(crate) header: Header,
    pub(crate) timeout_s: u16,
    pub(crate) o2t_address: Option<SocketAddrV4>,
    pub(crate) t2o_address: Option<SocketAddrV4>,
    pub(crate) body: Body<'a>,
}

/// What the unconnected data item holds.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Body<'a> {
    Open { object: &'a [u8], is_large: bool, open: ForwardOpen<'a>, path: ConnectionPath<'a> },
    Opened { is_large: bool, reply: ForwardOpenReply<'a> },
    Close { object: &'a [u8], close: ForwardClose<'a>, path: ConnectionPath<'a> },
    Closed { reply: ForwardCloseReply<'a> },
    Refused { service: Service, status: GeneralStatus, words: &'a [u8], refusal: ConnectionRefusal },
    Ask { request: Request<'a>, object: ObjectPath },
    Answer { response: Response<'a> },
}

/// The header of SendRRData with these lengths and handles.
pub(crate) fn header(length: u16, session: u32, context: &[u8; 8]) -> Header {
    Header {
        command: Command::SEND_RR_DATA,
        length,
        session,
        status: EncapsulationStatus::SUCCESS,
        context: *context,
        options: 0,
    }
}

fn read_body(message: &[u8]) -> Result<Body<'_>, DecodeError> {
    if message.first().is_some_and(|first| first & 0x80 != 0) {
        let response = Response::read(message)?;
        let (service, status, data) = (response.service, response.status, response.data);
        let is_large = service == Service::LARGE_FORWARD_OPEN;
        let opens = is_large || service == Service::FORWARD_OPEN;
        let is_success = status == GeneralStatus::SUCCESS;
        return match (is_success && response.additional.is_empty(), opens) {
            (true, true) => Ok(Body::Opened { is_large, reply: ForwardOpenReply::read(data)? }),
            (true, false) if service == Service::FORWARD_CLOSE => {
                Ok(Body::Closed { reply: ForwardCloseReply::read(data)? })
            }
            (false, _) if !is_success && (opens || service == Service::FORWARD_CLOSE) => {
                let refusal = ConnectionRefusal::read(data)?;
                Ok(Body::Refused { service, status, words: response.additional, refusal })
            }
            _ => Ok(Body::Answer { response }),
        };
    }
    let request = Request::read(message)?;
    let object = ObjectPath::read(request.path)?;
    let is_large = request.service == Service::LARGE_FORWARD_OPEN;
    let (path, data) = (request.path, request.data);
    if object == ObjectPath::CONNECTION_MANAGER {
        if is_large || request.service == Service::FORWARD_OPEN {
            let open = ForwardOpen::read(data, is_large)?;
            let points = ConnectionPath::read(open.path)?;
            return Ok(Body::Open { object: path, is_large, open, path: points });
        }
        if request.service == Service::FORWARD_CLOSE {
            let close = ForwardClose::read(data)?;
            return Ok(Body::Close {
                object: path,
                close,
                path: ConnectionPath::read(close.path)?,
            });
        }
    }
    Ok(Body::Ask { request, object })
}

fn write_body(body: &Body<'_>, room: &mut [u8]) -> Result<usize, NoRoom> {
    let mut inner = [0; 1024];
    let manager = |service, path, data| Request { service, path, data };
    let open_service =
        |is_large| if is_large { Service::LARGE_FORWARD_OPEN } else { Service::FORWARD_OPEN };
    match body {
        Body::Open { object, is_large, open, .. } => {
            let len = open.write(&mut inner, *is_large)?;
            manager(open_service(*is_large), *object, &inner[..len]).write(room)
        }
        Body::Close { object, close, .. } => {
            let len = close.write(&mut inner)?;
            manager(Service::FORWARD_CLOSE, *object, &inner[..len]).write(room)
        }
        Body::Opened { is_large, reply } => {
            let len = reply.write(&mut inner)?;
            Response::success(open_service(*is_large), &inner[..len]).write(room)
        }
        Body::Closed { reply } => {
            let len = reply.write(&mut inner)?;
            Response::success(Service::FORWARD_CLOSE, &inner[..len]).write(room)
        }
        Body::Refused { service, status, words, refusal } => {
            let data = &refusal.to_bytes();
            Response { service: *service, status: *status, additional: words, data }.write(room)
        }
        Body::Ask { request, .. } => request.write(room),
        Body::Answer { response } => response.write(room),
    }
}

pub(crate) struct SendRrData;

impl Message for SendRrData {
    type Value<'a> = Explicit<'a>;

    fn read(bytes: &[u8]) -> Result<Explicit<'_>, DecodeError> {
        let packet = Packet::from_datagram(bytes)?;
        if packet.header.command != Command::SEND_RR_DATA {
            return Err(DecodeError::Value {
                message: "encapsulation header",
                field: "command",
                found: packet.header.command.0.into(),
                allowed: "SendRRData",
            });
        }
        let Unconnected { timeout_s, message, o2t_address, t2o_address } =
            Unconnected::read(packet.data)?;
        let body = read_body(message)?;
        Ok(Explicit { header: packet.header, timeout_s, o2t_address, t2o_address, body })
    }

    /// A message written otherwise may also be shorter.
    fn meaning(value: &Explicit<'_>) -> String {
        let header = Header { length: 0, ..value.header };
        format!("{:?}", Explicit { header, ..value.clone() })
    }

    fn write(value: &Explicit<'_>, room: &mut [u8]) -> Result<usize, NoRoom> {
        let mut inner = [0; 1024];
        let len = write_body(&value.body, &mut inner)?;
        let unconnected = Unconnected {
            timeout_s: value.timeout_s,
            message: &inner[..len],
            o2t_address: value.o2t_address,
            t2o_address: value.t2o_address,
        };
        let mut packet = PacketWriter::new(room, value.header);
        unconnected.put(&mut packet);
        packet.finish()
    }
}
