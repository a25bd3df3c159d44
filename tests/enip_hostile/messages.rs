//! Good messages of scanners and of targets.

use std::net::{Ipv4Addr, SocketAddrV4};

use fieldarm::wire::enip::connection::*;
use fieldarm::wire::enip::cpf::Unconnected;
use fieldarm::wire::enip::encapsulation::*;
use fieldarm::wire::enip::io::IoFrame;
use fieldarm::wire::enip::message::{Request, Response, Service};
use fieldarm::wire::enip::parameters::*;
use fieldarm::wire::enip::path::*;
use fieldarm::wire::enip::session::Registration;
use fieldarm::wire::enip::status::GeneralStatus;
use fieldarm::wire::meca500::adapter::IDENTITY;

use crate::choices::Choices;

/// A whole packet.
pub(crate) fn packet(header: Header, data: impl FnOnce(&mut PacketWriter<'_>)) -> Vec<u8> {
    let mut room = vec![0; 2_048];
    let mut writer = PacketWriter::new(&mut room, header);
    data(&mut writer);
    let len = writer.finish().expect("good messages fit");
    room.truncate(len);
    room
}

/// A part of a message, written into room that suffices.
fn part<E: std::fmt::Debug>(write: impl FnOnce(&mut [u8]) -> Result<usize, E>) -> Vec<u8> {
    let mut room = vec![0; 1_024];
    let len = write(&mut room).expect("good messages fit");
    room.truncate(len);
    room
}

fn send_rr_data(header: Header, unconnected: &Unconnected<'_>) -> Vec<u8> {
    packet(header, |writer| unconnected.put(writer))
}

/// What a scanner may send: with few different numbers, so that they meet.
pub(crate) fn request(session: u32, choices: &mut Choices<'_>) -> Vec<u8> {
    let command = match choices.below(12) {
        0 | 1 => Command::REGISTER_SESSION,
        2 => choices.pick(&[
            Command::NOP,
            Command::LIST_SERVICES,
            Command::LIST_IDENTITY,
            Command::LIST_INTERFACES,
            Command::UNREGISTER_SESSION,
            Command::SEND_UNIT_DATA,
        ]),
        _ => Command::SEND_RR_DATA,
    };
    let header = Header { context: [choices.byte(); 8], ..Header::new(command, session) };
    match command {
        Command::REGISTER_SESSION => {
            let header = Header { session: 0, ..header };
            packet(header, |writer| writer.put(&Registration::default().to_bytes()))
        }
        Command::SEND_RR_DATA => {
            let message = explicit_request(choices);
            let t2o_address = choices
                .one_in(4)
                .then(|| SocketAddrV4::new(Ipv4Addr::from(choices.double_word()), choices.word()));
            send_rr_data(header, &Unconnected { t2o_address, ..Unconnected::new(&message) })
        }
        _ => packet(header, |_| ()),
    }
}

fn explicit_request(choices: &mut Choices<'_>) -> Vec<u8> {
    let (service, object, data) = match choices.below(8) {
        0..=3 => {
            let is_large = choices.one_in(4);
            let service =
                if is_large { Service::LARGE_FORWARD_OPEN } else { Service::FORWARD_OPEN };
            (service, ObjectPath::CONNECTION_MANAGER, forward_open(is_large, choices))
        }
        4 => {
            let close = ForwardClose {
                priority_tick: 10,
                timeout_ticks: 14,
                triad: triad(choices),
                path: &part(|room| points(choices).write(room)),
            };
            let data = part(|room| close.write(room));
            (Service::FORWARD_CLOSE, ObjectPath::CONNECTION_MANAGER, data)
        }
        _ => {
            let class = choices.pick(&[1, 2, 4, 6, 0x48, 0xF5, 0xF6, 0x300]);
            let instance = choices.pick(&[0, 1, 2, 100, 150, 151, 70_000]);
            let attribute = (choices.below(4) > 0).then(|| u32::from(choices.byte() % 20));
            let services = [0x01, 0x02, 0x03, 0x04, 0x05, 0x0A, 0x0E, 0x10, 0x18, 0x52, 0x56, 0x7F];
            let service = Service(choices.pick(&services));
            (service, ObjectPath { class, instance, attribute }, choices.some(64).to_vec())
        }
    };
    let path = part(|room| object.write(room));
    part(|room| Request { service, path: &path, data: &data }.write(room))
}

fn triad(choices: &mut Choices<'_>) -> Triad {
    Triad {
        connection_serial: choices.byte().into(),
        vendor: choices.pick(&[1, 0x539]),
        originator_serial: choices.pick(&[7, 8]),
    }
}

fn points(choices: &mut Choices<'_>) -> ConnectionPath<'static> {
    let key = choices.one_in(4).then(|| ElectronicKey {
        vendor: choices.pick(&[0, 1565, 1]),
        device_type: choices.pick(&[0, 43]),
        product_code: choices.pick(&[0, 500]),
        major: choices.pick(&[0, 11, 12]),
        minor: choices.pick(&[0, 3, 4]),
        is_compatible: choices.one_in(2),
    });
    let config = choices.pick(&[None, Some(151), Some(151), Some(9)]);
    let o2t = Some(choices.pick(&[150, 150, 238, 237, 100]));
    let data = if choices.one_in(8) { &[1, 2, 3, 4][..] } else { &[] };
    ConnectionPath { key, config, o2t, t2o: Some(choices.pick(&[100, 100, 100, 101])), data }
}

fn forward_open(is_large: bool, choices: &mut Choices<'_>) -> Vec<u8> {
    let mut points = points(choices);
    if choices.below(2) == 0 {
        (points.key, points.config) = (None, Some(151));
        (points.t2o, points.data) = (Some(100), &[]);
    }
    let fitting = if points.o2t == Some(150) { 66 } else { 2 };
    let parameters = |connection_type, size| NetworkParameters {
        connection_type,
        size,
        ..NetworkParameters::default()
    };
    let o2t_type = choices.pick(&[
        ConnectionType::PointToPoint,
        ConnectionType::PointToPoint,
        ConnectionType::PointToPoint,
        ConnectionType::Null,
        ConnectionType::Multicast,
    ]);
    let t2o_type = choices.pick(&[
        ConnectionType::PointToPoint,
        ConnectionType::Multicast,
        ConnectionType::PointToPoint,
        ConnectionType::Multicast,
        ConnectionType::Reserved,
    ]);
    let intervals = [10_000, 10_000, 20_000, 50_000, 1, 0, 1_000_000, u32::MAX];
    let mut open = ForwardOpen {
        priority_tick: 10,
        timeout_ticks: 14,
        o2t_id: 0,
        t2o_id: choices.double_word(),
        triad: triad(choices),
        multiplier: TimeoutMultiplier::from_wire(choices.byte() % 8).expect("0 to 7"),
        o2t_rpi_us: choices.pick(&intervals),
        o2t: parameters(o2t_type, choices.pick(&[fitting, fitting, fitting, 0, 511])),
        t2o_rpi_us: choices.pick(&intervals),
        t2o: parameters(t2o_type, choices.pick(&[254, 254, 254, 2, 511])),
        transport: Transport(choices.pick(&[1, 1, 1, 1, 0x21, 0xA3])),
        path: &part(|room| points.write(room)),
    };
    // Mostly such that it is granted, if the time is right for it.
    if choices.below(4) > 0 {
        open.o2t = parameters(ConnectionType::PointToPoint, fitting);
        let multicast = choices.below(2) == 0 || points.o2t == Some(237);
        let t2o_type =
            if multicast { ConnectionType::Multicast } else { ConnectionType::PointToPoint };
        open.t2o = parameters(t2o_type, 254);
        open.transport = Transport::CLASS_1_CYCLIC;
        (open.o2t_rpi_us, open.t2o_rpi_us) = (10_000, choices.pick(&[10_000, 20_500]));
    }
    part(|room| open.write(room, is_large))
}

/// A class 1 frame with `len` bytes of data behind a run/idle header, if `run` says so.
pub(crate) fn frame(connection_id: u32, count: u32, run: Option<bool>, data: &[u8]) -> Vec<u8> {
    let frame = IoFrame { connection_id, sequence: count, data_sequence: count as u16, data };
    part(|room| frame.write(run, room))
}

/// What a target may answer to `request`, which a scanner wrote; `None` where none is due.
pub(crate) fn answer(request: &[u8], choices: &mut Choices<'_>) -> Option<Vec<u8>> {
    let asked = Packet::from_datagram(request).expect("a scanner writes whole packets");
    let status = match choices.below(16) {
        15 => EncapsulationStatus(choices.pick(&[1, 2, 3, 0x64, 0x65, 0x69, 0x6A, 99])),
        _ => EncapsulationStatus::SUCCESS,
    };
    let header = asked.header.answer(status);
    match asked.header.command {
        Command::REGISTER_SESSION => {
            let header = Header { session: choices.pick(&[7, 8, 0xFFFF_FFFF, 0]), ..header };
            Some(packet(header, |writer| writer.put(asked.data)))
        }
        Command::SEND_RR_DATA => {
            let unconnected = Unconnected::read(asked.data).expect("a scanner writes good items");
            let asked = Request::read(unconnected.message).expect("a scanner writes good requests");
            let (message, o2t_address, t2o_address) = explicit_answer(&asked, choices);
            let message = Unconnected { timeout_s: 0, message: &message, o2t_address, t2o_address };
            Some(send_rr_data(header, &message))
        }
        _ => None,
    }
}

type Answer = (Vec<u8>, Option<SocketAddrV4>, Option<SocketAddrV4>);

fn explicit_answer(asked: &Request<'_>, choices: &mut Choices<'_>) -> Answer {
    let service = asked.service;
    let (mut o2t_address, mut t2o_address) = (None, None);
    let is_refused = choices.one_in(5);
    let (data, additional) = match service {
        Service::FORWARD_OPEN | Service::LARGE_FORWARD_OPEN => {
            let is_large = service == Service::LARGE_FORWARD_OPEN;
            let open = ForwardOpen::read(asked.data, is_large).expect("a scanner opens well");
            if open.t2o.connection_type == ConnectionType::Multicast || choices.one_in(8) {
                let group = choices.pick(&[
                    Ipv4Addr::new(239, 192, 1, 32),
                    Ipv4Addr::new(239, 192, 1, 33),
                    Ipv4Addr::new(10, 0, 0, 1),
                    Ipv4Addr::UNSPECIFIED,
                ]);
                t2o_address = Some(SocketAddrV4::new(group, choices.pick(&[2_222, 2_222, 0])));
            }
            if choices.one_in(4) {
                let address = choices.pick(&[Ipv4Addr::UNSPECIFIED, Ipv4Addr::new(10, 0, 0, 9)]);
                o2t_address = Some(SocketAddrV4::new(address, choices.pick(&[2_222, 2_300, 0])));
            }
            if is_refused {
                let refusal = ConnectionRefusal { triad: open.triad, remaining_path_words: 0 };
                let numbers =
                    [0x0100, 0x0106, 0x0107, 0x0109, 0x0111, 0x0113, 0x0117, 0x0127, 0x0315];
                let number: u16 = choices.pick(&numbers);
                (refusal.to_bytes().to_vec(), number.to_le_bytes().to_vec())
            } else {
                let reply = ForwardOpenReply {
                    o2t_id: choices.double_word(),
                    t2o_id: open.t2o_id,
                    triad: open.triad,
                    o2t_api_us: choices.pick(&[open.o2t_rpi_us, open.o2t_rpi_us, 0, 1, u32::MAX]),
                    t2o_api_us: choices.pick(&[open.t2o_rpi_us, open.t2o_rpi_us, 0, 1, u32::MAX]),
                    application: &[],
                };
                (part(|room| reply.write(room)), Vec::new())
            }
        }
        Service::FORWARD_CLOSE => {
            let close = ForwardClose::read(asked.data).expect("a scanner closes well");
            let reply = ForwardCloseReply { triad: close.triad, application: &[] };
            (part(|room| reply.write(room)), Vec::new())
        }
        _ => (part(|room| IDENTITY.write(room)), Vec::new()),
    };
    let status = match (is_refused, additional.is_empty()) {
        (true, true) => GeneralStatus(choices.byte()),
        (true, false) => GeneralStatus::CONNECTION_FAILURE,
        (false, _) => GeneralStatus::SUCCESS,
    };
    let response = Response { service, status, additional: &additional, data: &data };
    (part(|room| response.write(room)), o2t_address, t2o_address)
}
