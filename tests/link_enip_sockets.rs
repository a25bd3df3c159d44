//! The scanner's sockets over loopback: what arrives, what is kept, what a peer's misfortune does not stop.
#![cfg(all(feature = "enip", target_os = "linux"))]

#[path = "support/loopback.rs"]
mod loopback;

use std::io::{Read, Write};
use std::net::{Ipv4Addr, SocketAddrV4, TcpListener, TcpStream, UdpSocket};

use fieldarm::link::enip::network::{Arrival, Network, ROOM};
use fieldarm::link::enip::sockets::{OpenError, SocketNetwork, SocketSettings};
use fieldarm::time::{Duration, Instant};
use loopback::address;
use socket2::SockRef;

const PATIENCE: Duration = Duration::from_secs(10);

fn open(bind: Ipv4Addr) -> SocketNetwork {
    let settings = SocketSettings { bind: Some(bind), ..SocketSettings::default() };
    SocketNetwork::open(settings, &[]).unwrap()
}

/// The next arrival and its bytes.
fn next(network: &mut SocketNetwork) -> (Arrival, Vec<u8>) {
    let mut room = [0; ROOM];
    let deadline = network.now() + PATIENCE;
    let arrival = network.receive(&mut room, deadline).unwrap().expect("something arrives");
    let len = match arrival {
        Arrival::Stream { len, .. } | Arrival::Datagram { len, .. } => len,
        Arrival::Connected { .. } | Arrival::Disconnected { .. } => 0,
    };
    (arrival, room[..len].to_vec())
}

fn nothing(network: &mut SocketNetwork) {
    let mut room = [0; ROOM];
    let deadline = network.now() + Duration::from_millis(30);
    assert_eq!(network.receive(&mut room, deadline).unwrap(), None);
    assert!(network.now() >= deadline, "it came back before the deadline");
}

fn listener() -> (TcpListener, SocketAddrV4) {
    let at = SocketAddrV4::new(address(), 44_818);
    (TcpListener::bind(at).unwrap(), at)
}

fn connected(network: &mut SocketNetwork, target: usize) -> (TcpStream, SocketAddrV4) {
    let (listener, at) = listener();
    network.connect(target, at).unwrap();
    assert_eq!(next(network).0, Arrival::Connected { target });
    (listener.accept().unwrap().0, at)
}

#[test]
fn a_stream_comes_up_carries_bytes_both_ways_and_ends() {
    let bind = address();
    let mut network = open(bind);
    let (mut peer, _) = connected(&mut network, 3);
    assert_eq!(peer.peer_addr().unwrap().ip(), bind, "it comes from the address bound to");
    network.send_stream(3, b"question").unwrap();
    let mut asked = [0; 8];
    peer.read_exact(&mut asked).unwrap();
    assert_eq!(&asked, b"question");
    peer.write_all(b"answer").unwrap();
    assert_eq!(next(&mut network), (Arrival::Stream { target: 3, len: 6 }, b"answer".to_vec()));
    peer.write_all(b"last words").unwrap();
    drop(peer);
    assert_eq!(next(&mut network).1, b"last words");
    assert_eq!(next(&mut network).0, Arrival::Disconnected { target: 3 });
    nothing(&mut network);
    assert!(network.send_stream(3, b"too late").is_err());
}

#[test]
fn nobody_listening_is_a_disconnection() {
    let mut network = open(address());
    let nobody = SocketAddrV4::new(address(), 44_818);
    if network.connect(0, nobody).is_ok() {
        assert_eq!(next(&mut network).0, Arrival::Disconnected { target: 0 });
    }
    nothing(&mut network);
    assert!(network.send_stream(0, b"x").is_err());
}

#[test]
fn a_reset_ends_one_stream_and_no_other() {
    let mut network = open(address());
    let (reset, _) = connected(&mut network, 0);
    let (mut other, _) = connected(&mut network, 1);
    SockRef::from(&reset).set_linger(Some(Duration::ZERO)).unwrap();
    drop(reset);
    assert_eq!(next(&mut network).0, Arrival::Disconnected { target: 0 });
    other.write_all(b"alive").unwrap();
    assert_eq!(next(&mut network), (Arrival::Stream { target: 1, len: 5 }, b"alive".to_vec()));
}

#[test]
fn nothing_of_a_closed_stream_arrives() {
    let mut network = open(address());
    let (mut old, at) = connected(&mut network, 0);
    old.write_all(b"old").unwrap();
    network.disconnect(0);
    nothing(&mut network);
    drop(old);
    // A new one in its place is another one.
    let listener = TcpListener::bind(at).unwrap_or_else(|_| {
        // The old connection may hold the port for a while.
        let socket =
            socket2::Socket::new(socket2::Domain::IPV4, socket2::Type::STREAM, None).unwrap();
        socket.set_reuse_address(true).unwrap();
        socket.bind(&at.into()).unwrap();
        socket.listen(1).unwrap();
        socket.into()
    });
    network.connect(0, at).unwrap();
    assert_eq!(next(&mut network).0, Arrival::Connected { target: 0 });
    let mut new = listener.accept().unwrap().0;
    new.write_all(b"new").unwrap();
    assert_eq!(next(&mut network).1, b"new");
}

#[test]
fn what_a_peer_does_not_take_is_kept_in_order_and_not_without_bound() {
    let mut network = open(address());
    let (mut peer, _) = connected(&mut network, 0);
    let mut sent = Vec::new();
    let chunk = |number: u32| -> Vec<u8> {
        (0..256).flat_map(|i| (number * 256 + i).to_le_bytes()).collect()
    };
    let mut number = 0;
    // Until the peer's and the system's buffers are full and ours holds some.
    let refused = loop {
        let bytes = chunk(number);
        match network.send_stream(0, &bytes) {
            Ok(()) => sent.extend(bytes),
            Err(error) => break error,
        }
        number += 1;
        assert!(number < 100_000, "it keeps without bound");
    };
    assert_eq!(refused.kind(), std::io::ErrorKind::TimedOut);
    assert!(network.send_stream(0, b"x").is_err(), "the connection is closed");
    // What the system had taken arrives in order.
    let mut arrived = Vec::new();
    peer.set_read_timeout(Some(PATIENCE)).unwrap();
    let _ = peer.read_to_end(&mut arrived);
    assert!(!arrived.is_empty());
    assert_eq!(arrived, sent[..arrived.len()]);
}

#[test]
fn a_burst_waits_in_the_systems_buffer() {
    let bind = address();
    let mut network = open(bind);
    let sender = UdpSocket::bind((address(), 0)).unwrap();
    for number in 0..256_u32 {
        let mut frame = [0; 272];
        frame[..4].copy_from_slice(&number.to_le_bytes());
        sender.send_to(&frame, network.io_address()).unwrap();
    }
    let mut room = [0; ROOM];
    for number in 0..256_u32 {
        let arrival = network.receive(&mut room, Instant::ZERO).unwrap();
        let Some(Arrival::Datagram { from, len: 272 }) = arrival else { panic!("{arrival:?}") };
        assert_eq!(std::net::SocketAddr::V4(from), sender.local_addr().unwrap());
        assert_eq!(room[..4], number.to_le_bytes());
    }
    assert_eq!(network.receive(&mut room, Instant::ZERO).unwrap(), None);
}

#[test]
fn a_stream_is_heard_in_a_flood_of_datagrams() {
    let mut network = open(address());
    let (mut peer, _) = connected(&mut network, 0);
    let sender = UdpSocket::bind((address(), 0)).unwrap();
    for _ in 0..200 {
        sender.send_to(&[0; 84], network.io_address()).unwrap();
    }
    peer.write_all(b"here").unwrap();
    let before = (0..200).take_while(|_| !matches!(next(&mut network).0, Arrival::Stream { .. }));
    let before = before.count();
    assert!(before < 100, "{before} datagrams went first");
}

#[test]
fn a_closed_port_of_a_peer_is_no_failure() {
    let mut network = open(address());
    let gone = UdpSocket::bind((address(), 0)).unwrap();
    let std::net::SocketAddr::V4(to) = gone.local_addr().unwrap() else { unreachable!() };
    drop(gone);
    for _ in 0..5 {
        network.send_datagram(to, &[1, 2, 3]).unwrap();
        nothing(&mut network);
    }
    let there = UdpSocket::bind((address(), 0)).unwrap();
    there.set_read_timeout(Some(PATIENCE)).unwrap();
    let std::net::SocketAddr::V4(to) = there.local_addr().unwrap() else { unreachable!() };
    network.send_datagram(to, &[4]).unwrap();
    let mut room = [0; 8];
    let (len, from) = there.recv_from(&mut room).unwrap();
    assert_eq!((&room[..len], from), (&[4][..], network.io_address().into()));
}

#[test]
fn a_taken_port_is_replaced_and_told() {
    let bind = address();
    let first = open(bind);
    assert_eq!((first.io_port(), first.is_other_port()), (2_222, false));
    let mut second = open(bind);
    assert!(second.is_other_port());
    assert_ne!(second.io_port(), 2_222);
    assert_eq!(*second.io_address().ip(), bind);
    let sender = UdpSocket::bind((address(), 0)).unwrap();
    sender.send_to(b"to the second", second.io_address()).unwrap();
    assert_eq!(next(&mut second).1, b"to the second");
}

#[test]
fn an_address_of_another_machine_is_refused_in_words() {
    let foreign = Ipv4Addr::new(192, 0, 2, 77);
    let settings = SocketSettings { bind: Some(foreign), ..SocketSettings::default() };
    let error = SocketNetwork::open(settings, &[]).unwrap_err();
    assert!(matches!(error, OpenError::Bind { address, port: 2_222, .. } if address == foreign));
    let words = error.to_string();
    assert!(words.contains("192.0.2.77") && words.contains("bind to an address"), "{words}");
}

#[test]
fn without_an_address_the_one_that_faces_the_target_is_taken() {
    let target = SocketAddrV4::new(address(), 44_818);
    let settings = SocketSettings { bind: None, io_port: 0 };
    let network = SocketNetwork::open(settings, &[target]).unwrap();
    assert!(network.io_address().ip().is_loopback());
    assert!(!network.is_other_port(), "any port was asked for");
}

/// Sends `bytes` to `group` as a target with the address `from` does.
fn send_to_group(from: Ipv4Addr, group: Ipv4Addr, bytes: &[u8]) {
    let socket = UdpSocket::bind((from, 0)).unwrap();
    SockRef::from(&socket).set_multicast_if_v4(&from).unwrap();
    socket.send_to(bytes, (group, 2_222)).unwrap();
}

/// A group of this process.
fn group() -> Ipv4Addr {
    let [_, b, c, d] = address().octets();
    Ipv4Addr::new(239, b, c, d)
}

#[test]
fn a_group_is_heard_from_joining_to_leaving() {
    let (mut network, target, group) = (open(address()), address(), group());
    send_to_group(target, group, b"before");
    nothing(&mut network);
    network.join_group(group).unwrap();
    network.join_group(group).unwrap();
    send_to_group(target, group, b"frame");
    let (arrival, bytes) = next(&mut network);
    assert!(matches!(arrival, Arrival::Datagram { from, .. } if *from.ip() == target));
    assert_eq!(bytes, b"frame");
    nothing(&mut network);
    network.leave_group(group);
    send_to_group(target, group, b"after");
    nothing(&mut network);
}

#[test]
fn two_scanners_of_a_machine_hear_one_group_on_whatever_port() {
    let (target, group) = (address(), group());
    let bind = address();
    let mut first = open(bind);
    let mut second = open(bind);
    assert!(second.is_other_port());
    for network in [&mut first, &mut second] {
        network.join_group(group).unwrap();
    }
    send_to_group(target, group, b"to all");
    assert_eq!(next(&mut first).1, b"to all");
    assert_eq!(next(&mut second).1, b"to all");
}

#[test]
fn what_is_no_group_cannot_be_joined() {
    let mut network = open(address());
    assert!(network.join_group(Ipv4Addr::new(10, 0, 0, 1)).is_err());
}

#[test]
fn sending_and_receiving_frames_takes_no_memory() {
    let mut network = open(address());
    let (mut peer, _) = connected(&mut network, 0);
    let socket = UdpSocket::bind((address(), 0)).unwrap();
    let std::net::SocketAddr::V4(to) = socket.local_addr().unwrap() else { unreachable!() };
    let group = group();
    network.join_group(group).unwrap();
    let mut room = [0; ROOM];
    let io_address = network.io_address();
    let taken = allocation_counter::measure(|| {
        for _ in 0..100 {
            network.send_datagram(to, &[7; 84]).unwrap();
            socket.send_to(&[8; 272], io_address).unwrap();
            peer.write_all(&[9; 30]).unwrap();
            let soon = network.now() + Duration::from_millis(1);
            let mut arrived = 0;
            while network.receive(&mut room, soon).unwrap().is_some() {
                arrived += 1;
            }
            assert_eq!(arrived, 2);
        }
    });
    assert_eq!(taken.count_total, 0);
}
