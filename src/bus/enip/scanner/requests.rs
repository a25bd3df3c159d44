//! The requests that open and close a connection, as bytes.

use core::net::{Ipv4Addr, SocketAddrV4};

use super::settings::rpi_us;
use super::{ConfigPath, ConnectionSettings, T2oType};
use crate::time::Duration;
use crate::wire::enip::connection::{ForwardClose, ForwardOpen, Transport, Triad};
use crate::wire::enip::cpf::Unconnected;
use crate::wire::enip::encapsulation::{Command, Header, PROTOCOL_VERSION, PacketWriter};
use crate::wire::enip::message::{Request, Service};
use crate::wire::enip::parameters::{ConnectionType, MAX_SMALL_SIZE, NetworkParameters};
use crate::wire::enip::path::{ConnectionPath, ObjectPath};
use crate::wire::enip::{IO_PORT, NoRoom};

/// A path with a key, three 32-bit numbers and a class takes 30 bytes.
const PATH_LEN: usize = 40;
/// Everything of a Large Forward Open in front of its path takes 39 bytes.
const OPEN_LEN: usize = 48 + PATH_LEN;
/// Service, path and the longest data of a request.
const MESSAGE_LEN: usize = 20 + super::explicit::DATA_LEN;
/// Tick of a request's time limit: 2 to the power of 10 ms.
const TICK_LOG2_MS: u8 = 10;

/// The identity object of the target.
pub(super) const IDENTITY: ObjectPath = ObjectPath { class: 1, instance: 1, attribute: None };

/// Writes RegisterSession: version 1, no options.
pub(super) fn register_session(context: [u8; 8], room: &mut [u8]) -> Result<usize, NoRoom> {
    let header = Header { context, ..Header::new(Command::REGISTER_SESSION, 0) };
    let mut packet = PacketWriter::new(room, header);
    packet.put(&PROTOCOL_VERSION.to_le_bytes());
    packet.put(&[0, 0]);
    packet.finish()
}

/// Writes UnRegisterSession.
pub(super) fn unregister_session(session: u32, room: &mut [u8]) -> Result<usize, NoRoom> {
    PacketWriter::new(room, Header::new(Command::UNREGISTER_SESSION, session)).finish()
}

/// Session handle and sender context of a request.
#[derive(Clone, Copy, Debug)]
pub(super) struct Envelope {
    pub(super) session: u32,
    pub(super) context: [u8; 8],
}

/// Writes an unconnected request.
pub(super) fn unconnected(
    envelope: Envelope,
    (service, path): (Service, ObjectPath),
    data: &[u8],
    t2o_address: Option<SocketAddrV4>,
    room: &mut [u8],
) -> Result<usize, NoRoom> {
    let mut path_bytes = [0; PATH_LEN];
    let path_len = path.write(&mut path_bytes)?;
    let mut message = [0; MESSAGE_LEN];
    let path = path_bytes.get(..path_len).unwrap_or(&[]);
    let len = Request { service, path, data }.write(&mut message)?;
    let Envelope { session, context } = envelope;
    let header = Header { context, ..Header::new(Command::SEND_RR_DATA, session) };
    let mut packet = PacketWriter::new(room, header);
    let message = message.get(..len).unwrap_or(&[]);
    Unconnected { t2o_address, ..Unconnected::new(message) }.put(&mut packet);
    packet.finish()
}

/// Ticks that a request may take, so that the target does not work on one that is no longer waited for.
fn ticks(limit: Duration) -> u8 {
    u8::try_from(limit.as_millis().div_ceil(1 << TICK_LOG2_MS)).unwrap_or(u8::MAX).max(1)
}

fn connection_path(
    settings: &ConnectionSettings,
    config: ConfigPath,
    room: &mut [u8],
) -> Result<usize, NoRoom> {
    let (o2t, t2o) = (Some(settings.o2t_assembly), Some(settings.t2o_assembly));
    ConnectionPath { key: settings.key, config: config.number(), o2t, t2o, data: &[] }.write(room)
}

/// Service of a Forward Open with these settings: the large one only where a size needs it.
pub(super) const fn open_service(settings: &ConnectionSettings) -> Service {
    if settings.o2t_size() > MAX_SMALL_SIZE || settings.t2o_size() > MAX_SMALL_SIZE {
        Service::LARGE_FORWARD_OPEN
    } else {
        Service::FORWARD_OPEN
    }
}

/// Writes a Forward Open.
pub(super) fn forward_open(
    settings: &ConnectionSettings,
    envelope: Envelope,
    triad: Triad,
    t2o_id: u32,
    config: ConfigPath,
    room: &mut [u8],
) -> Result<usize, NoRoom> {
    let mut path = [0; PATH_LEN];
    let path_len = connection_path(settings, config, &mut path)?;
    let parameters = |connection_type, size| NetworkParameters {
        is_redundant_owner: false,
        connection_type,
        priority: settings.priority,
        is_variable: false,
        size,
    };
    let t2o_type = match settings.t2o_type {
        T2oType::Unicast => ConnectionType::PointToPoint,
        T2oType::Multicast => ConnectionType::Multicast,
    };
    let open = ForwardOpen {
        priority_tick: TICK_LOG2_MS,
        timeout_ticks: ticks(settings.step_limit),
        o2t_id: 0,
        t2o_id,
        triad,
        multiplier: settings.multiplier,
        o2t_rpi_us: rpi_us(settings.o2t_rpi).unwrap_or(u32::MAX),
        o2t: parameters(ConnectionType::PointToPoint, settings.o2t_size()),
        t2o_rpi_us: rpi_us(settings.t2o_rpi).unwrap_or(u32::MAX),
        t2o: parameters(t2o_type, settings.t2o_size()),
        transport: Transport::CLASS_1_CYCLIC,
        path: path.get(..path_len).unwrap_or(&[]),
    };
    let service = open_service(settings);
    let mut data = [0; OPEN_LEN];
    let len = open.write(&mut data, service == Service::LARGE_FORWARD_OPEN)?;
    let address = SocketAddrV4::new(Ipv4Addr::UNSPECIFIED, settings.io_port);
    let t2o_address = (settings.io_port != IO_PORT).then_some(address);
    let data = data.get(..len).unwrap_or(&[]);
    unconnected(envelope, (service, ObjectPath::CONNECTION_MANAGER), data, t2o_address, room)
}

/// Writes a Forward Close.
pub(super) fn forward_close(
    settings: &ConnectionSettings,
    envelope: Envelope,
    triad: Triad,
    config: ConfigPath,
    room: &mut [u8],
) -> Result<usize, NoRoom> {
    let mut path = [0; PATH_LEN];
    let path_len = connection_path(settings, config, &mut path)?;
    let close = ForwardClose {
        priority_tick: TICK_LOG2_MS,
        timeout_ticks: ticks(settings.step_limit),
        triad,
        path: path.get(..path_len).unwrap_or(&[]),
    };
    let mut data = [0; OPEN_LEN];
    let len = close.write(&mut data)?;
    let data = data.get(..len).unwrap_or(&[]);
    unconnected(
        envelope,
        (Service::FORWARD_CLOSE, ObjectPath::CONNECTION_MANAGER),
        data,
        None,
        room,
    )
}
