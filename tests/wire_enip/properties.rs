//! What holds for any values and any bytes.

use std::fmt::Debug;
use std::net::{Ipv4Addr, SocketAddrV4};

use fieldarm::wire::enip::connection::*;
use fieldarm::wire::enip::cpf::{Unconnected, items, read_socket_address};
use fieldarm::wire::enip::encapsulation::*;
use fieldarm::wire::enip::identity::{Identity, ListedIdentity, ProductName};
use fieldarm::wire::enip::io::{IoFrame, is_later, is_newer};
use fieldarm::wire::enip::message::{Request, Response, Service};
use fieldarm::wire::enip::parameters::*;
use fieldarm::wire::enip::path::*;
use fieldarm::wire::enip::session::{ListedService, Registration};
use fieldarm::wire::enip::status::GeneralStatus;
use fieldarm::wire::enip::{DecodeError, NoRoom};
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;

/// Writes, reads back, and finds that no shorter room suffices.
fn round_trip<'a, T: Debug + PartialEq>(
    room: &'a mut [u8],
    write: impl Fn(&mut [u8]) -> Result<usize, NoRoom>,
    read: impl Fn(&'a [u8]) -> Result<T, DecodeError>,
    expected: T,
) -> Result<(), TestCaseError> {
    let len = write(room).unwrap();
    let short = len.saturating_sub(1);
    if len > 0 {
        prop_assert_eq!(write(&mut vec![0; short]), Err(NoRoom { room: short }));
    }
    prop_assert_eq!(read(&room[..len]), Ok(expected));
    Ok(())
}

fn put(
    room: &mut [u8],
    header: Header,
    data: impl Fn(&mut PacketWriter<'_>),
) -> Result<usize, NoRoom> {
    let mut packet = PacketWriter::new(room, header);
    data(&mut packet);
    packet.finish()
}

fn words(most: usize) -> impl Strategy<Value = Vec<u8>> {
    vec(any::<[u8; 2]>(), 0..=most).prop_map(|words| words.concat())
}

prop_compose! {
    fn triads()(connection_serial: u16, vendor: u16, originator_serial: u32) -> Triad {
        Triad { connection_serial, vendor, originator_serial }
    }
}

prop_compose! {
    fn addresses()(ip: u32, port: u16) -> SocketAddrV4 {
        SocketAddrV4::new(Ipv4Addr::from(ip), port)
    }
}

fn headers() -> impl Strategy<Value = Header> {
    (any::<u16>(), any::<u32>(), any::<u32>(), any::<[u8; 8]>(), any::<u32>()).prop_map(
        |(command, session, status, context, options)| Header {
            command: Command(command),
            length: 0,
            session,
            status: EncapsulationStatus(status),
            context,
            options,
        },
    )
}

fn parameters(most: u16) -> impl Strategy<Value = NetworkParameters> {
    use ConnectionType as Type;
    let types =
        prop::sample::select(vec![Type::Null, Type::Multicast, Type::PointToPoint, Type::Reserved]);
    let priorities = prop::sample::select(vec![
        Priority::Low,
        Priority::High,
        Priority::Scheduled,
        Priority::Urgent,
    ]);
    (any::<bool>(), types, priorities, any::<bool>(), 0..=most).prop_map(
        |(is_redundant_owner, connection_type, priority, is_variable, size)| NetworkParameters {
            is_redundant_owner,
            connection_type,
            priority,
            is_variable,
            size,
        },
    )
}

fn identities() -> impl Strategy<Value = Identity> {
    let numbers = any::<(u16, u16, u16, u8, u8, u16, u32)>();
    (numbers, vec(any::<u8>(), 0..=32)).prop_map(|(numbers, name)| {
        let (vendor, device_type, product_code, major, minor, status, serial) = numbers;
        let name = ProductName::new(&name);
        Identity { vendor, device_type, product_code, major, minor, status, serial, name }
    })
}

/// Numbers of all three formats.
fn numbers() -> impl Strategy<Value = u32> {
    prop_oneof![0..=255_u32, 256..=65_535_u32, 65_536..=u32::MAX]
}

fn keys() -> impl Strategy<Value = ElectronicKey> {
    any::<(u16, u16, u16, u8, u8, bool)>().prop_map(
        |(vendor, device_type, product_code, major, minor, is_compatible)| ElectronicKey {
            vendor,
            device_type,
            product_code,
            major: major & 0x7F,
            minor,
            is_compatible,
        },
    )
}

proptest! {
    #[test]
    fn packets(header in headers(), data in vec(any::<u8>(), 0..300)) {
        let mut room = [0xAA; 400];
        let expected = Header { length: data.len() as u16, ..header };
        let write = |room: &mut [u8]| put(room, header, |packet| packet.put(&data));
        let packet = Packet { header: expected, data: &data };
        round_trip(&mut room, write, Packet::from_datagram, packet)?;
        let len = HEADER_LEN + data.len();
        prop_assert_eq!(Packet::from_stream(&room), Some((packet, len)));
        prop_assert!((0..len).all(|len| Packet::from_stream(&room[..len]).is_none()));
    }

    /// However a stream is cut, the same packets come out of it.
    #[test]
    fn streams(
        packets in vec((headers(), vec(any::<u8>(), 0..60)), 1..6),
        cuts in vec(1..50_usize, 1..40),
    ) {
        let mut stream = Vec::new();
        for (header, data) in &packets {
            let mut room = [0; 100];
            let len = put(&mut room, *header, |packet| packet.put(data)).unwrap();
            stream.extend_from_slice(&room[..len]);
        }
        let (mut arrived, mut found) = (Vec::new(), Vec::new());
        let mut rest = stream.as_slice();
        for cut in cuts.iter().cycle() {
            let (part, behind) = rest.split_at((*cut).min(rest.len()));
            arrived.extend_from_slice(part);
            while let Some((packet, len)) = Packet::from_stream(&arrived) {
                found.push((Header { length: 0, ..packet.header }, packet.data.to_vec()));
                arrived.drain(..len);
            }
            rest = behind;
            if rest.is_empty() {
                break;
            }
        }
        prop_assert_eq!(found, packets);
        prop_assert!(arrived.is_empty());
    }

    #[test]
    fn registrations(version: u16, options: u16) {
        let registration = Registration { version, options };
        prop_assert_eq!(Registration::read(&registration.to_bytes()), Ok(registration));
    }

    #[test]
    fn services(version: u16, capabilities: u16, name: [u8; 16]) {
        let service = ListedService { version, capabilities, name };
        let header = Header::new(Command::LIST_SERVICES, 0);
        let write = |room: &mut [u8]| put(room, header, |packet| service.put(packet));
        let read = |bytes| ListedService::read(Packet::from_datagram(bytes)?.data);
        round_trip(&mut [0xAA; 64], write, read, service)?;
    }

    #[test]
    fn identity(identity in identities(), address in addresses(), state: u8) {
        round_trip(&mut [0xAA; 64], |room| identity.write(room), Identity::read, identity)?;
        let listed = ListedIdentity { address, identity, state };
        let header = Header::new(Command::LIST_IDENTITY, 0);
        let write = |room: &mut [u8]| put(room, header, |packet| listed.put(packet));
        let read = |bytes| ListedIdentity::read(Packet::from_datagram(bytes)?.data);
        round_trip(&mut [0xAA; 128], write, read, listed)?;
    }

    #[test]
    fn unconnected(
        timeout_s: u16,
        message in vec(any::<u8>(), 0..200),
        o2t_address in option::of(addresses()),
        t2o_address in option::of(addresses()),
    ) {
        let expected = Unconnected { timeout_s, message: &message, o2t_address, t2o_address };
        let header = Header::new(Command::SEND_RR_DATA, 0);
        let write = |room: &mut [u8]| put(room, header, |packet| expected.put(packet));
        let mut room = [0xAA; 300];
        let len = write(&mut room).unwrap();
        prop_assert_eq!(write(&mut vec![0; len - 1]), Err(NoRoom { room: len - 1 }));
        let packet = Packet::from_datagram(&room[..len]).unwrap();
        prop_assert_eq!(Unconnected::read(packet.data), Ok(expected));
    }

    #[test]
    fn requests(service in 0..=0x7F_u8, path in words(255), data in vec(any::<u8>(), 0..100)) {
        let request = Request { service: Service(service), path: &path, data: &data };
        let mut room = [0xAA; 700];
        let len = request.write(&mut room).unwrap();
        prop_assert_eq!(Request::read(&room[..len]), Ok(request));
    }

    #[test]
    fn responses(
        service in 0..=0x7F_u8,
        status: u8,
        additional in words(255),
        data in vec(any::<u8>(), 0..100),
    ) {
        let (service, status) = (Service(service), GeneralStatus(status));
        let response = Response { service, status, additional: &additional, data: &data };
        let mut room = [0xAA; 700];
        let len = response.write(&mut room).unwrap();
        prop_assert_eq!(Response::read(&room[..len]), Ok(response));
        let pairs: Vec<_> =
            additional.chunks(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect();
        let read: Vec<_> = (0..300).map_while(|index| response.additional_word(index)).collect();
        prop_assert_eq!(read, pairs);
    }

    #[test]
    fn opens(
        numbers: (u8, u8, u32, u32, u32, u32, u8),
        triad in triads(),
        multiplier in 0..=7_u8,
        small in (parameters(511), parameters(511)),
        large in (parameters(u16::MAX), parameters(u16::MAX)),
        path in words(255),
    ) {
        let (priority_tick, timeout_ticks, o2t_id, t2o_id, o2t_rpi_us, t2o_rpi_us, class) = numbers;
        let multiplier = TimeoutMultiplier::from_wire(multiplier).unwrap();
        for (is_large, (o2t, t2o)) in [(false, small), (true, large)] {
            let open = ForwardOpen {
                priority_tick,
                timeout_ticks,
                o2t_id,
                t2o_id,
                triad,
                multiplier,
                o2t_rpi_us,
                o2t,
                t2o_rpi_us,
                t2o,
                transport: Transport(class),
                path: &path,
            };
            let mut room = [0xAA; 700];
            let len = open.write(&mut room, is_large).unwrap();
            prop_assert_eq!(len, if is_large { 40 } else { 36 } + path.len());
            prop_assert!(open.write(&mut vec![0; len - 1], is_large).is_err());
            prop_assert_eq!(ForwardOpen::read(&room[..len], is_large), Ok(open));
        }
    }

    #[test]
    fn answers_to_opens(
        ids: (u32, u32, u32, u32),
        triad in triads(),
        application in words(255),
        remaining_path_words: u8,
    ) {
        let (o2t_id, t2o_id, o2t_api_us, t2o_api_us) = ids;
        let application = application.as_slice();
        let reply = ForwardOpenReply { o2t_id, t2o_id, triad, o2t_api_us, t2o_api_us, application };
        let mut room = [0xAA; 700];
        let len = reply.write(&mut room).unwrap();
        prop_assert_eq!(ForwardOpenReply::read(&room[..len]), Ok(reply));
        let reply = ForwardCloseReply { triad, application };
        let len = reply.write(&mut room).unwrap();
        prop_assert_eq!(ForwardCloseReply::read(&room[..len]), Ok(reply));
        let refusal = ConnectionRefusal { triad, remaining_path_words };
        prop_assert_eq!(ConnectionRefusal::read(&refusal.to_bytes()), Ok(refusal));
    }

    #[test]
    fn closes(priority_tick: u8, timeout_ticks: u8, triad in triads(), path in words(255)) {
        let close = ForwardClose { priority_tick, timeout_ticks, triad, path: &path };
        let mut room = [0xAA; 700];
        let len = close.write(&mut room).unwrap();
        prop_assert_eq!(ForwardClose::read(&room[..len]), Ok(close));
    }

    #[test]
    fn frames(
        connection_id: u32,
        sequence: u32,
        data_sequence: u16,
        data in vec(any::<u8>(), 0..600),
        run: Option<bool>,
    ) {
        let frame = IoFrame { connection_id, sequence, data_sequence, data: &data };
        let mut room = [0xAA; 700];
        let len = frame.write(run, &mut room).unwrap();
        prop_assert!(frame.write(run, &mut vec![0; len - 1]).is_err());
        let read = IoFrame::read(&room[..len]).unwrap();
        match run {
            None => prop_assert_eq!(read, frame),
            Some(run) => prop_assert_eq!(read.split_run_idle(), Ok((run, data.as_slice()))),
        }
        prop_assert_eq!((read.connection_id, read.sequence), (connection_id, sequence));
    }

    /// Of two different numbers one comes after the other, except half way round.
    #[test]
    fn order(a: u32, b: u32) {
        let half = a.wrapping_sub(b) == 1 << 31;
        prop_assert_eq!(is_later(a, b) != is_later(b, a), a != b && !half);
        let (a, b) = (a as u16, b as u16);
        let half = a.wrapping_sub(b) == 1 << 15;
        prop_assert_eq!(is_newer(a, b) != is_newer(b, a), a != b && !half);
    }

    #[test]
    fn words_of_parameters(word: u16, double_word: u32) {
        // Bit 12 of a word, bits 28 and 24 to 16 of a double word are reserved.
        prop_assert_eq!(NetworkParameters::from_word(word).to_word(), word & 0xEFFF);
        let large = NetworkParameters::from_double_word(double_word);
        prop_assert_eq!(large.to_double_word(), double_word & 0xEE00_FFFF);
    }

    #[test]
    fn object_paths(class in numbers(), instance in numbers(), attribute in option::of(numbers())) {
        let path = ObjectPath { class, instance, attribute };
        let mut room = [0xAA; 18];
        let len = path.write(&mut room).unwrap();
        prop_assert_eq!(len % 2, 0);
        prop_assert_eq!(ObjectPath::read(&room[..len]), Ok(path));
    }

    #[test]
    fn connection_paths(
        key in option::of(keys()),
        config in option::of(numbers()),
        points in option::of((numbers(), option::of(numbers()))),
        data in words(100),
    ) {
        let (o2t, t2o) = points.map_or((None, None), |(o2t, t2o)| (Some(o2t), t2o));
        let path = ConnectionPath { key, config, o2t, t2o, data: &data };
        let mut room = [0xAA; 300];
        let len = path.write(&mut room).unwrap();
        prop_assert_eq!(len % 2, 0);
        prop_assert!(data.len() + 34 >= len);
        prop_assert_eq!(ConnectionPath::read(&room[..len]), Ok(path));
    }

    /// Whatever the bytes, every reader comes back; what a strict one takes, it also writes.
    #[test]
    fn any_bytes(bytes in vec(any::<u8>(), 0..300)) {
        let _ = Header::read(&bytes);
        let _ = Packet::from_datagram(&bytes);
        let _ = Packet::from_stream(&bytes);
        let _ = items(&bytes).map(Iterator::count);
        let _ = read_socket_address(&bytes);
        let _ = Unconnected::read(&bytes);
        let _ = ListedIdentity::read(&bytes);
        let _ = ListedService::read(&bytes);
        let _ = Identity::read(&bytes);
        let _ = ObjectPath::read(&bytes);
        let _ = ConnectionPath::read(&bytes);
        let _ = IoFrame::read(&bytes);
        prop_assert!(segments(&bytes).count() <= bytes.len());
        let mut room = [0; 400];
        for is_large in [false, true] {
            if let Ok(open) = ForwardOpen::read(&bytes, is_large) {
                prop_assert_eq!(open.write(&mut room, is_large), Ok(bytes.len()));
            }
        }
        if let Ok(request) = Request::read(&bytes) {
            let len = request.write(&mut room).unwrap();
            prop_assert_eq!(&room[..len], bytes.as_slice());
        }
        if let Ok(response) = Response::read(&bytes) {
            let len = response.write(&mut room).unwrap();
            prop_assert_eq!(len, bytes.len());
            prop_assert_eq!(Response::read(&room[..len]), Ok(response));
        }
    }
}
