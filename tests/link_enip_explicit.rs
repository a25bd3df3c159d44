//! Questions to one device, and to all: what is made of devices that do not answer as they should.
#![cfg(all(feature = "enip", target_os = "linux"))]

#[path = "support/loopback.rs"]
mod loopback;

use std::io::{ErrorKind, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, TcpListener, TcpStream, UdpSocket};
use std::thread::{self, JoinHandle};

use fieldarm::link::enip::explicit::{ExplicitClient, ExplicitError};
use fieldarm::link::enip::list_identity::list_identity;
use fieldarm::time::Duration;
use fieldarm::wire::enip::cpf::Unconnected;
use fieldarm::wire::enip::encapsulation::{
    Command, EncapsulationStatus, Header, Packet, PacketWriter,
};
use fieldarm::wire::enip::identity::{Identity, ListedIdentity, ProductName};
use fieldarm::wire::enip::message::{Response, Service};
use fieldarm::wire::enip::path::ObjectPath;
use loopback::address;

const PATIENCE: Duration = Duration::from_secs(20);
const VENDOR: ObjectPath = ObjectPath { class: 1, instance: 1, attribute: Some(1) };

/// Takes one request: its header and data.
fn take(stream: &mut TcpStream) -> Option<(Header, Vec<u8>)> {
    let mut header = [0; 24];
    stream.read_exact(&mut header).ok()?;
    let header = Header::read(&header).unwrap();
    let mut data = vec![0; header.length.into()];
    stream.read_exact(&mut data).ok()?;
    Some((header, data))
}

fn packet(header: Header, data: &[u8]) -> Vec<u8> {
    let mut room = [0; 2_048];
    let mut writer = PacketWriter::new(&mut room, header);
    writer.put(data);
    let len = writer.finish().unwrap();
    room[..len].to_vec()
}

/// A successful answer to a SendRRData with `header`.
fn success(header: Header, service: Service, data: &[u8]) -> Vec<u8> {
    let (mut message, mut room) = ([0; 512], [0; 1_024]);
    let len = Response::success(service, data).write(&mut message).unwrap();
    let mut writer = PacketWriter::new(&mut room, header.answer(EncapsulationStatus::SUCCESS));
    Unconnected::new(&message[..len]).put(&mut writer);
    let len = writer.finish().unwrap();
    room[..len].to_vec()
}

/// A device that registers sessions and leaves the rest to `then`.
fn device(then: impl FnOnce(&mut TcpStream) + Send + 'static) -> (SocketAddrV4, JoinHandle<()>) {
    let at = SocketAddrV4::new(address(), 44_818);
    let listener = TcpListener::bind(at).unwrap();
    let thread = thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let (header, data) = take(&mut stream).unwrap();
        assert_eq!((header.command, &data[..]), (Command::REGISTER_SESSION, &[1, 0, 0, 0][..]));
        let header = Header { session: 0x5151, ..header.answer(EncapsulationStatus::SUCCESS) };
        stream.write_all(&packet(header, &data)).unwrap();
        then(&mut stream);
    });
    (at, thread)
}

fn connect(at: SocketAddrV4) -> ExplicitClient {
    ExplicitClient::connect(None, at, PATIENCE).unwrap()
}

#[test]
fn an_answer_may_come_in_pieces_behind_answers_to_others() {
    let (at, thread) = device(|stream| {
        let (header, _) = take(stream).unwrap();
        assert_eq!((header.command, header.session), (Command::SEND_RR_DATA, 0x5151));
        let foreign = Header { context: [0xFF; 8], ..header };
        let mut bytes = success(foreign, Service::GET_ATTRIBUTE_SINGLE, &[9, 9]);
        bytes.extend(success(header, Service::GET_ATTRIBUTE_SINGLE, &[0x1D, 0x06]));
        for byte in bytes {
            stream.write_all(&[byte]).unwrap();
        }
        // The session is ended when the client is dropped.
        assert_eq!(take(stream).unwrap().0.command, Command::UNREGISTER_SESSION);
    });
    let mut client = connect(at);
    assert_eq!(client.address(), at);
    assert_eq!(client.get_attribute(VENDOR).unwrap(), [0x1D, 0x06]);
    drop(client);
    thread.join().unwrap();
}

#[test]
fn silence_has_a_limit_and_ends_the_session() {
    let (at, thread) = device(|stream| {
        take(stream).unwrap();
        // Until the client is gone, without a request more.
        assert!(take(stream).is_none());
    });
    let limit = Duration::from_millis(300);
    let mut client = ExplicitClient::connect(None, at, limit).unwrap();
    let error = client.identity().unwrap_err();
    assert!(matches!(error, ExplicitError::NoAnswer { address, .. } if address == at), "{error}");
    assert!(error.is_transient() && error.to_string().contains("within 300 ms"), "{error}");
    let error = client.identity().unwrap_err();
    assert!(matches!(error, ExplicitError::Ended { kind: ErrorKind::NotConnected, .. }), "{error}");
    drop(client);
    thread.join().unwrap();
}

#[test]
fn an_end_in_the_middle_of_an_answer_is_told() {
    let (at, thread) = device(|stream| {
        let (header, _) = take(stream).unwrap();
        let bytes = success(header, Service::GET_ATTRIBUTES_ALL, &[0; 40]);
        stream.write_all(&bytes[..50]).unwrap();
    });
    let error = connect(at).identity().unwrap_err();
    assert!(matches!(error, ExplicitError::Ended { .. }), "{error}");
    assert!(error.is_transient());
    thread.join().unwrap();
}

#[test]
fn what_cannot_be_read_is_told_with_its_place() {
    type Answer = fn(Header) -> Vec<u8>;
    let cases: [(Answer, &str); 4] = [
        (
            |header| packet(header.answer(EncapsulationStatus::SUCCESS), &[0; 7]),
            "common packet format",
        ),
        (|header| success(header, Service::GET_ATTRIBUTES_ALL, &[0; 5]), "identity"),
        (|header| success(header, Service::RESET, &[]), "service"),
        (
            |header| packet(header.answer(EncapsulationStatus::INVALID_SESSION), &[]),
            "session handle unknown",
        ),
    ];
    for (answer, words) in cases {
        let (at, thread) = device(move |stream| {
            let (header, _) = take(stream).unwrap();
            stream.write_all(&answer(header)).unwrap();
        });
        let error = connect(at).identity().unwrap_err();
        let is_right =
            matches!(error, ExplicitError::Malformed { .. } | ExplicitError::Encapsulation { .. });
        assert!(is_right && !error.is_transient(), "{error}");
        assert!(error.to_string().contains(words), "{error}");
        thread.join().unwrap();
    }
}

#[test]
fn nobody_and_nothing_to_do_are_told() {
    let nobody = SocketAddrV4::new(address(), 44_818);
    let error = ExplicitClient::connect(None, nobody, PATIENCE).unwrap_err();
    assert!(
        matches!(error, ExplicitError::Unreachable { kind: ErrorKind::ConnectionRefused, .. }),
        "{error}"
    );
    let error = ExplicitClient::connect(None, nobody, Duration::ZERO).unwrap_err();
    assert_eq!(error, ExplicitError::NoTime);
    let (at, thread) = device(|stream| {
        take(stream).unwrap();
    });
    let mut client = connect(at);
    let error = client.set_attribute(VENDOR, &[0; 4_000]).unwrap_err();
    assert!(matches!(error, ExplicitError::TooLong(_)), "{error}");
    drop(client);
    thread.join().unwrap();
}

fn listed(address: SocketAddrV4, serial: u32) -> Vec<u8> {
    let identity = Identity {
        vendor: 1_565,
        device_type: 43,
        product_code: 500,
        major: 11,
        minor: 3,
        status: 0,
        serial,
        name: ProductName::new(b"Meca500"),
    };
    let mut room = [0; 512];
    let mut writer = PacketWriter::new(&mut room, Header::new(Command::LIST_IDENTITY, 0));
    ListedIdentity { address, identity, state: 3 }.put(&mut writer);
    let len = writer.finish().unwrap();
    room[..len].to_vec()
}

fn v4(socket: &UdpSocket) -> SocketAddrV4 {
    match socket.local_addr().unwrap() {
        SocketAddr::V4(address) => address,
        SocketAddr::V6(_) => unreachable!(),
    }
}

fn asked(socket: &UdpSocket) -> SocketAddr {
    socket.set_read_timeout(Some(PATIENCE)).unwrap();
    let mut room = [0; 256];
    let (len, from) = socket.recv_from(&mut room).unwrap();
    let packet = Packet::from_datagram(&room[..len]).unwrap();
    assert_eq!((packet.header.command, packet.data), (Command::LIST_IDENTITY, &[][..]));
    from
}

#[test]
fn each_device_is_listed_once_and_rubbish_is_counted() {
    let device = UdpSocket::bind((address(), 44_818)).unwrap();
    let other = UdpSocket::bind((address(), 44_818)).unwrap();
    let (to, beside) = (v4(&device), v4(&other));
    let thread = thread::spawn(move || {
        let from = asked(&device);
        let good = listed(beside, 5);
        let mut refusal = good.clone();
        refusal[8] = 1;
        for rubbish in [&b"rubbish"[..], &good[..good.len() - 1], &refusal, &[]] {
            other.send_to(rubbish, from).unwrap();
        }
        for _ in 0..3 {
            other.send_to(&good, from).unwrap();
        }
        device.send_to(&listed(to, 4), from).unwrap();
    });
    let listing = list_identity(None, to, PATIENCE).unwrap();
    thread.join().unwrap();
    assert_eq!(listing.malformed, 4);
    let mut found: Vec<_> =
        listing.found.iter().map(|found| (found.from, found.listed.identity.serial)).collect();
    found.sort_unstable();
    let mut expected = vec![(to, 4), (beside, 5)];
    expected.sort_unstable();
    assert_eq!(found, expected);
}

#[test]
fn a_broadcast_reaches_whoever_is_there_and_silence_is_an_empty_list() {
    let device = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).unwrap();
    let port = v4(&device).port();
    let all = SocketAddrV4::new(Ipv4Addr::new(127, 255, 255, 255), port);
    let at = address();
    let thread = thread::spawn(move || {
        let from = asked(&device);
        device.send_to(&listed(SocketAddrV4::new(at, 44_818), 6), from).unwrap();
    });
    let listing = list_identity(None, all, Duration::from_secs(1)).unwrap();
    thread.join().unwrap();
    let [found] = listing.found[..] else { panic!("{listing:?}") };
    assert_eq!(found.listed.address, SocketAddrV4::new(at, 44_818));

    let nobody = SocketAddrV4::new(address(), 44_818);
    let listing = list_identity(None, nobody, Duration::from_millis(50)).unwrap();
    assert!(listing.found.is_empty() && listing.malformed == 0);
}
