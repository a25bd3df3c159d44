//! The message router: unconnected requests to the adapter's objects.
//!
//! Status of what cannot be done: 04 a path that is no class, instance and attribute in this order, or
//! lacks or has an attribute that the service does or does not take; 05 no such class; 16 no such
//! instance; 14 no such attribute; 08 no such service; 0E an attribute that can only be read (all of
//! them: outputs come from an owner under its watchdog, and settings from elsewhere); 13 and 15 too few
//! and too many data; 11 more than fits into an answer; 20 a kind of reset that does not exist.
//!
//! An Unconnected Send without a route is unwrapped, once; there is no port to route through: 01/0311.

use core::net::SocketAddrV4;

use super::objects::Object;
use super::target::Target;
use super::{AdapterEvent, MAX_DATA_LEN, StreamId};
use crate::time::Instant;
use crate::wire::enip::bytes::{Reader, Writer};
use crate::wire::enip::message::{Request, Response, Service};
use crate::wire::enip::path::ObjectPath;
use crate::wire::enip::status::{ExtendedStatus, GeneralStatus};
use crate::wire::enip::{DecodeError, NoRoom};

/// Some attributes of a list could not be read.
const ATTRIBUTE_LIST_ERROR: GeneralStatus = GeneralStatus(0x0A);
/// A parameter of the service is wrong.
const INVALID_PARAMETER: GeneralStatus = GeneralStatus(0x20);
/// A route names a port that does not exist.
const NO_SUCH_PORT: ExtendedStatus = ExtendedStatus(0x0311);
/// Bytes of the longest CIP response: what is left of a packet behind the items of SendRRData.
pub(super) const MAX_MESSAGE_LEN: usize = MAX_DATA_LEN - 36;
/// Bytes of a response in front of its data: service, status, two words of additional status.
const RESPONSE_HEAD_LEN: usize = 8;

/// Where a request comes from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Origin {
    pub(super) peer: SocketAddrV4,
    pub(super) stream: StreamId,
    /// Where it wants T->O frames.
    pub(super) t2o_address: Option<SocketAddrV4>,
}

/// What came of a request; data are in the room given.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outcome {
    pub(super) status: GeneralStatus,
    pub(super) extended: [Option<u16>; 2],
    /// Bytes of data.
    pub(super) len: usize,
    /// Where T->O frames come from, if that is to be told.
    pub(super) t2o_address: Option<SocketAddrV4>,
}

impl Outcome {
    pub(super) const fn success(len: usize) -> Self {
        Self { status: GeneralStatus::SUCCESS, extended: [None; 2], len, t2o_address: None }
    }

    pub(super) const fn refusal(status: GeneralStatus) -> Self {
        Self { status, ..Self::success(0) }
    }

    pub(super) const fn written(written: Result<usize, NoRoom>) -> Self {
        match written {
            Ok(len) => Self::success(len),
            Err(NoRoom { .. }) => Self::refusal(GeneralStatus::REPLY_TOO_LARGE),
        }
    }
}

/// An answer that has been written.
#[derive(Clone, Copy, Debug)]
pub(super) struct Answer {
    pub(super) len: usize,
    pub(super) t2o_address: Option<SocketAddrV4>,
}

impl Target {
    /// Does what `message` asks and writes the response into `room`; `None` if it is not a request at all.
    pub(super) fn answer(
        &mut self,
        now: Instant,
        origin: Origin,
        message: &[u8],
        room: &mut [u8; MAX_MESSAGE_LEN],
    ) -> Option<Answer> {
        self.answer_wrapped(now, origin, message, room, false)
    }

    fn answer_wrapped(
        &mut self,
        now: Instant,
        origin: Origin,
        message: &[u8],
        room: &mut [u8; MAX_MESSAGE_LEN],
        is_wrapped: bool,
    ) -> Option<Answer> {
        // The bit that marks a response.
        let service = *message.first().filter(|service| **service < 0x80)?;
        let mut data = [0; MAX_MESSAGE_LEN - RESPONSE_HEAD_LEN];
        let outcome = match Request::read(message) {
            Err(_) => Outcome::refusal(GeneralStatus::PATH_SEGMENT_ERROR),
            Ok(request) => {
                if let Some(inner) = wrapped_message(&request).filter(|_| !is_wrapped) {
                    return self.answer_wrapped(now, origin, inner, room, true);
                }
                self.serve(now, origin, &request, is_wrapped, &mut data)
            }
        };
        let mut additional = [0; 4];
        let mut words = Writer::new(&mut additional);
        for word in outcome.extended.into_iter().flatten() {
            words.u16(word);
        }
        let additional_len = words.finish().unwrap_or(0);
        let response = Response {
            service: Service(service),
            status: outcome.status,
            additional: additional.get(..additional_len).unwrap_or_default(),
            data: data.get(..outcome.len).unwrap_or_default(),
        };
        let len = response.write(room).ok()?;
        Some(Answer { len, t2o_address: outcome.t2o_address })
    }

    fn serve(
        &mut self,
        now: Instant,
        origin: Origin,
        request: &Request<'_>,
        is_wrapped: bool,
        room: &mut [u8],
    ) -> Outcome {
        let Ok(path) = ObjectPath::read(request.path) else {
            return Outcome::refusal(GeneralStatus::PATH_SEGMENT_ERROR);
        };
        let Some(object) = Object::of_class(path.class) else {
            return Outcome::refusal(GeneralStatus::PATH_DESTINATION_UNKNOWN);
        };
        if path.instance != 0 && !object.has_instance(self, path.instance) {
            return Outcome::refusal(GeneralStatus::OBJECT_DOES_NOT_EXIST);
        }
        let done = match (request.service, object, path.instance) {
            (Service::GET_ATTRIBUTE_SINGLE, ..) => {
                self.get_single(object, path, request.data, room)
            }
            (Service::SET_ATTRIBUTE_SINGLE, ..) => Err(self.refuse_to_set(object, path, room)),
            _ if path.attribute.is_some() => Err(GeneralStatus::PATH_SEGMENT_ERROR),
            (Service::GET_ATTRIBUTE_LIST, ..) => {
                return self.get_list(object, path.instance, request.data, room);
            }
            (Service::GET_ATTRIBUTES_ALL, _, 1..) => {
                self.get_all(object, path.instance, request.data, room)
            }
            (Service::RESET, Object::Identity, 1) => self.reset(request.data),
            (Service::FORWARD_OPEN, Object::ConnectionManager, 1) => {
                return self.forward_open(now, origin, request.data, false, room);
            }
            (Service::LARGE_FORWARD_OPEN, Object::ConnectionManager, 1) => {
                return self.forward_open(now, origin, request.data, true, room);
            }
            (Service::FORWARD_CLOSE, Object::ConnectionManager, 1) => {
                return self.forward_close(request.data, room);
            }
            (Service::UNCONNECTED_SEND, Object::ConnectionManager, 1) if !is_wrapped => {
                return refuse_to_route(request.data, room);
            }
            _ => Err(GeneralStatus::SERVICE_NOT_SUPPORTED),
        };
        match done {
            Ok(len) => Outcome::success(len),
            Err(status) => Outcome::refusal(status),
        }
    }

    fn get_single(
        &self,
        object: Object,
        path: ObjectPath,
        data: &[u8],
        room: &mut [u8],
    ) -> Result<usize, GeneralStatus> {
        let attribute = path.attribute.ok_or(GeneralStatus::PATH_SEGMENT_ERROR)?;
        nothing_more(data)?;
        let mut writer = Writer::new(room);
        if !object.put_attribute(self, path.instance, attribute, &mut writer) {
            return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED);
        }
        writer.finish().map_err(|_| GeneralStatus::REPLY_TOO_LARGE)
    }

    fn refuse_to_set(&self, object: Object, path: ObjectPath, room: &mut [u8]) -> GeneralStatus {
        match self.get_single(object, path, &[], room) {
            Ok(_) => GeneralStatus::ATTRIBUTE_NOT_SETTABLE,
            Err(status) => status,
        }
    }

    fn get_all(
        &self,
        object: Object,
        instance: u32,
        data: &[u8],
        room: &mut [u8],
    ) -> Result<usize, GeneralStatus> {
        let attributes = object.all_attributes();
        if attributes.is_empty() {
            return Err(GeneralStatus::SERVICE_NOT_SUPPORTED);
        }
        nothing_more(data)?;
        let mut writer = Writer::new(room);
        for attribute in attributes {
            object.put_attribute(self, instance, *attribute, &mut writer);
        }
        writer.finish().map_err(|_| GeneralStatus::REPLY_TOO_LARGE)
    }

    /// The number of attributes, then number, status and value of each.
    fn get_list(&self, object: Object, instance: u32, data: &[u8], room: &mut [u8]) -> Outcome {
        let mut status = GeneralStatus::SUCCESS;
        let mut writer = Writer::new(room);
        let mut put_all = || {
            let mut reader = Reader::new("GetAttributeList", data);
            let count = reader.u16("number of attributes")?;
            writer.u16(count);
            for _ in 0..count {
                let attribute = reader.u16("attribute")?;
                let start = writer.len();
                writer.u16(attribute);
                writer.u16(0);
                if !object.put_attribute(self, instance, attribute.into(), &mut writer) {
                    let missing = GeneralStatus::ATTRIBUTE_NOT_SUPPORTED.0;
                    writer.replace(start + 2, &u16::from(missing).to_le_bytes());
                    status = ATTRIBUTE_LIST_ERROR;
                }
            }
            reader.end()
        };
        if let Err(error) = put_all() {
            return Outcome::refusal(too_short_or_long(error));
        }
        match writer.finish() {
            Ok(len) => Outcome { status, ..Outcome::success(len) },
            Err(NoRoom { .. }) => Outcome::refusal(GeneralStatus::REPLY_TOO_LARGE),
        }
    }

    /// Type 0, a power cycle, also when none is given, or 1, factory settings: both are told as one event.
    fn reset(&mut self, data: &[u8]) -> Result<usize, GeneralStatus> {
        match data {
            [] | [0 | 1] => {
                self.events.push(AdapterEvent::ResetRequested);
                Ok(0)
            }
            [_] => Err(INVALID_PARAMETER),
            _ => Err(GeneralStatus::TOO_MUCH_DATA),
        }
    }
}

const fn nothing_more(data: &[u8]) -> Result<(), GeneralStatus> {
    if data.is_empty() { Ok(()) } else { Err(GeneralStatus::TOO_MUCH_DATA) }
}

const fn too_short_or_long(error: DecodeError) -> GeneralStatus {
    match error {
        DecodeError::Trailing { .. } => GeneralStatus::TOO_MUCH_DATA,
        DecodeError::Truncated { .. } | DecodeError::Value { .. } => GeneralStatus::NOT_ENOUGH_DATA,
    }
}

/// An Unconnected Send: the message to be passed on, and the path to where.
fn read_unconnected_send(data: &[u8]) -> Result<(&[u8], &[u8]), DecodeError> {
    let mut reader = Reader::new("Unconnected Send", data);
    reader.take("priority and timeout", 2)?;
    let len = usize::from(reader.u16("message length")?);
    let message = reader.take("message", len)?;
    reader.take("padding", len % 2)?;
    let words = reader.u8("route size")?;
    reader.u8("reserved byte")?;
    let route = reader.take("route", 2 * usize::from(words))?;
    reader.end()?;
    Ok((message, route))
}

/// The message in an Unconnected Send that goes no further.
fn wrapped_message<'a>(request: &Request<'a>) -> Option<&'a [u8]> {
    let path = ObjectPath::read(request.path).ok()?;
    if (request.service, path) != (Service::UNCONNECTED_SEND, ObjectPath::CONNECTION_MANAGER) {
        return None;
    }
    let (message, route) = read_unconnected_send(request.data).ok()?;
    // What is no request is refused as the Unconnected Send that it came in.
    let is_request = message.first().is_some_and(|service| *service < 0x80);
    (route.is_empty() && is_request).then_some(message)
}

fn refuse_to_route(data: &[u8], room: &mut [u8]) -> Outcome {
    let route = match read_unconnected_send(data) {
        Ok((_, [])) => return Outcome::refusal(GeneralStatus::NOT_ENOUGH_DATA),
        Ok((_, route)) => route,
        Err(error) => return Outcome::refusal(too_short_or_long(error)),
    };
    let mut writer = Writer::new(room);
    writer.u8(u8::try_from(route.len() / 2).unwrap_or(u8::MAX));
    Outcome {
        extended: [Some(NO_SUCH_PORT.0), None],
        status: GeneralStatus::CONNECTION_FAILURE,
        ..Outcome::written(writer.finish())
    }
}
