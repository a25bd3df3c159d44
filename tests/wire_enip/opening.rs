//! Forward Open, small and large, and what a target answers.

use std::net::{Ipv4Addr, SocketAddrV4};

use fieldarm::wire::enip::connection::*;
use fieldarm::wire::enip::message::Service;
use fieldarm::wire::enip::parameters::*;
use fieldarm::wire::enip::path::{ConnectionPath, ElectronicKey};
use fieldarm::wire::enip::status::{ExtendedStatus, GeneralStatus};

use super::explicit::{Body, Explicit, SendRrData, header};
use super::harness::{check, vector};

/// Path of the connection manager: class 6, instance 1.
const MANAGER: &[u8] = &[0x20, 0x06, 0x24, 0x01];
const TRIAD: Triad =
    Triad { connection_serial: 0x1234, vendor: 0x0539, originator_serial: 0xCAFE_F00D };

/// Point-to-point, scheduled, of fixed size: what nearly all I/O is.
const fn fixed(connection_type: ConnectionType, size: u16) -> NetworkParameters {
    NetworkParameters {
        is_redundant_owner: false,
        connection_type,
        priority: Priority::Scheduled,
        is_variable: false,
        size,
    }
}

fn owner(path: &[u8]) -> ForwardOpen<'_> {
    ForwardOpen {
        priority_tick: 0x0A,
        timeout_ticks: 0x0E,
        o2t_id: 0,
        t2o_id: 0x5566_7788,
        triad: TRIAD,
        multiplier: TimeoutMultiplier::from_factor(16).unwrap(),
        o2t_rpi_us: 10_000,
        o2t: fixed(ConnectionType::PointToPoint, 66),
        t2o_rpi_us: 20_000,
        t2o: fixed(ConnectionType::PointToPoint, 254),
        transport: Transport::CLASS_1_CYCLIC,
        path,
    }
}

/// The robot's points, with its configuration instance or without.
fn robot(config: Option<u32>) -> ConnectionPath<'static> {
    ConnectionPath { config, o2t: Some(150), t2o: Some(100), ..ConnectionPath::default() }
}

fn explicit(length: u16, body: Body<'_>) -> Explicit<'_> {
    Explicit {
        header: header(length, 0x0000_00A5, b"forward!"),
        timeout_s: 0,
        o2t_address: None,
        t2o_address: None,
        body,
    }
}

fn open<'a>(open: ForwardOpen<'a>, path: ConnectionPath<'a>, is_large: bool) -> Body<'a> {
    let mut room = [0; 64];
    let len = path.write(&mut room).unwrap();
    assert_eq!(&room[..len], open.path, "the path is written as it was typed");
    Body::Open { object: MANAGER, is_large, open, path }
}

/// Owner, unicast both ways, with a key that names the robot exactly and a configuration instance.
#[test]
fn owner_with_key_and_configuration() {
    let bytes = [
        0x34, 0x04, 0x1D, 0x06, 0x2B, 0x00, 0xF4, 0x01, 0x0B, 0x03, 0x20, 0x04, 0x24, 0x97, 0x2C,
        0x96, 0x2C, 0x64,
    ];
    let key = ElectronicKey {
        vendor: 1565,
        device_type: 43,
        product_code: 500,
        major: 11,
        minor: 3,
        is_compatible: false,
    };
    let path = ConnectionPath { key: Some(key), ..robot(Some(151)) };
    check::<SendRrData>(
        "6F 00  4C 00  A5 00 00 00  00 00 00 00  66 6F 72 77 61 72 64 21  00 00 00 00
         00 00 00 00        # interface: CIP
         00 00              # timeout
         02 00              # two items
         00 00  00 00       # null address
         B2 00  3C 00       # unconnected data, 60 bytes
         54                 # Forward Open
         02  20 06 24 01    # of the connection manager
         0A 0E              # priority and tick time, ticks
         00 00 00 00        # id O->T, to be chosen by the target
         88 77 66 55        # id T->O
         34 12  39 05  0D F0 FE CA  # triad
         02                 # timeout after 16 intervals
         00~ 00~ 00~        # reserved
         10 27 00 00        # 10 ms O->T
         42 48~10           # point-to-point, scheduled, fixed, 66 bytes
         20 4E 00 00        # 20 ms T->O
         FE 48~10           # point-to-point, scheduled, fixed, 254 bytes
         01                 # class 1, cyclic
         09                 # 9 words of path
         34 04  1D 06  2B 00  F4 01  0B  03  # key, format 4
         20 04  24 97  2C 96  2C 64  # assembly, configuration 151, points 150 and 100",
        &explicit(0x4C, open(owner(&bytes), path, false)),
    );
}

/// Multicast T->O, no configuration instance, and a socket address item: T->O is to go to another port.
#[test]
fn multicast_with_socket_address() {
    let bytes = [0x20, 0x04, 0x2C, 0x96, 0x2C, 0x64];
    let t2o = fixed(ConnectionType::Multicast, 254);
    let body = open(ForwardOpen { t2o, ..owner(&bytes) }, robot(None), false);
    let t2o_address = Some(SocketAddrV4::new(Ipv4Addr::UNSPECIFIED, 2_223));
    check::<SendRrData>(
        "6F 00  54 00  A5 00 00 00  00 00 00 00  66 6F 72 77 61 72 64 21  00 00 00 00
         00 00 00 00  00 00
         03 00              # three items
         00 00  00 00
         B2 00  30 00
         54  02  20 06 24 01
         0A 0E  00 00 00 00  88 77 66 55  34 12  39 05  0D F0 FE CA  02  00~ 00~ 00~
         10 27 00 00  42 48~10
         20 4E 00 00  FE 28~10  # multicast
         01  03
         20 04  2C 96  2C 64
         01! 80!            # socket address T->O
         10 00
         00 02              # big-endian: family 2
         08 AF              # port 2223
         00 00 00 00        # address: where the message comes from
         00~ 00~ 00~ 00~ 00~ 00~ 00~ 00~",
        &Explicit { t2o_address, ..explicit(0x54, body) },
    );
}

/// Numbers above 255 need segments of 16 bits; a wildcard key that takes compatible devices; data for
/// the configuration.
#[test]
fn wide_segments_and_configuration_data() {
    let bytes = [
        0x34, 0x04, 0, 0, 0, 0, 0, 0, 0x80, 0, 0x20, 0x04, 0x25, 0x00, 0x97, 0x01, 0x2D, 0x00,
        0x96, 0x01, 0x2D, 0x00, 0x64, 0x01, 0x80, 0x02, 0x0A, 0x0B, 0x0C, 0x0D,
    ];
    let path = ConnectionPath {
        key: Some(ElectronicKey { is_compatible: true, ..ElectronicKey::default() }),
        config: Some(0x197),
        o2t: Some(0x196),
        t2o: Some(0x164),
        data: &[0x0A, 0x0B, 0x0C, 0x0D],
    };
    check::<SendRrData>(
        "6F 00  58 00  A5 00 00 00  00 00 00 00  66 6F 72 77 61 72 64 21  00 00 00 00
         00 00 00 00  00 00  02 00  00 00  00 00  B2 00  48 00
         54  02  20 06 24 01
         0A 0E  00 00 00 00  88 77 66 55  34 12  39 05  0D F0 FE CA  02  00~ 00~ 00~
         10 27 00 00  42 48~10  20 4E 00 00  FE 48~10  01
         0F                 # 15 words of path
         34 04  00 00  00 00  00 00  80  00  # wildcard key, compatible
         20 04
         25 00 97 01        # instance 0x197: a padding byte, then 16 bits
         2D 00 96 01        # point 0x196
         2D 00 64 01        # point 0x164
         80 02  0A 0B 0C 0D # data segment of two words",
        &explicit(0x58, open(owner(&bytes), path, false)),
    );
}

/// The path of the connection manager itself may be written with 16-bit segments.
#[test]
fn wide_request_path() {
    let object = [0x21, 0x00, 0x06, 0x00, 0x25, 0x00, 0x01, 0x00];
    let bytes = [0x20, 0x04, 0x2C, 0x96, 0x2C, 0x64];
    let body =
        Body::Open { object: &object, is_large: false, open: owner(&bytes), path: robot(None) };
    check::<SendRrData>(
        "6F 00  44 00  A5 00 00 00  00 00 00 00  66 6F 72 77 61 72 64 21  00 00 00 00
         00 00 00 00  00 00  02 00  00 00  00 00  B2 00  34 00
         54  04  21 00 06 00 25 00 01 00
         0A 0E  00 00 00 00  88 77 66 55  34 12  39 05  0D F0 FE CA  02  00~ 00~ 00~
         10 27 00 00  42 48~10  20 4E 00 00  FE 48~10  01  03
         20 04  2C 96  2C 64",
        &explicit(0x44, body),
    );
}

/// A Large Forward Open has 32 bits of parameters a direction: what was in the upper 7 bits of the word is
/// in the upper 7 bits of the double word, and the size has the lower half.
#[test]
fn large() {
    let bytes = [0x20, 0x04, 0x24, 0x97, 0x2C, 0x96, 0x2C, 0x64];
    let o2t = NetworkParameters {
        is_redundant_owner: true,
        priority: Priority::Urgent,
        is_variable: true,
        ..fixed(ConnectionType::PointToPoint, 1_450)
    };
    let t2o =
        NetworkParameters { priority: Priority::High, ..fixed(ConnectionType::Multicast, 4_002) };
    let multiplier = TimeoutMultiplier::from_factor(512).unwrap();
    let large = ForwardOpen { multiplier, o2t, t2o, ..owner(&bytes) };
    check::<SendRrData>(
        "6F 00  46 00  A5 00 00 00  00 00 00 00  66 6F 72 77 61 72 64 21  00 00 00 00
         00 00 00 00  00 00  02 00  00 00  00 00  B2 00  36 00
         5B                 # Large Forward Open
         02  20 06 24 01
         0A 0E  00 00 00 00  88 77 66 55  34 12  39 05  0D F0 FE CA
         07  00~ 00~ 00~    # timeout after 512 intervals
         10 27 00 00
         AA 05 00~ CE~11    # 1450 bytes; redundant owner, point-to-point, urgent, variable
         20 4E 00 00
         A2 0F 00~ 24~11    # 4002 bytes; multicast, high, fixed
         01  04
         20 04  24 97  2C 96  2C 64",
        &explicit(0x46, open(large, robot(Some(151)), true)),
    );
}

/// Null connections open nothing; a listen-only heartbeat has the sequence count for its only data.
#[test]
fn heartbeat() {
    let bytes = [0x20, 0x04, 0x2C, 0xED, 0x2C, 0x64];
    let beat = ForwardOpen { o2t: fixed(ConnectionType::PointToPoint, 2), ..owner(&bytes) };
    check::<SendRrData>(
        "6F 00  40 00  A5 00 00 00  00 00 00 00  66 6F 72 77 61 72 64 21  00 00 00 00
         00 00 00 00  00 00  02 00  00 00  00 00  B2 00  30 00
         54  02  20 06 24 01
         0A 0E  00 00 00 00  88 77 66 55  34 12  39 05  0D F0 FE CA  02  00~ 00~ 00~
         10 27 00 00  02 48~10  # 2 bytes: the sequence count
         20 4E 00 00  FE 48~10  01  03
         20 04  2C ED  2C 64",
        &explicit(0x40, open(beat, ConnectionPath { o2t: Some(237), ..robot(None) }, false)),
    );
}

fn opened(application: &[u8]) -> ForwardOpenReply<'_> {
    ForwardOpenReply {
        o2t_id: 0x1122_0001,
        t2o_id: 0x5566_7788,
        triad: TRIAD,
        o2t_api_us: 10_000,
        t2o_api_us: 20_000,
        application,
    }
}

#[test]
fn opened_unicast() {
    let body = Body::Opened { is_large: false, reply: opened(&[]) };
    check::<SendRrData>(
        "6F 00  2E 00  A5 00 00 00  00 00 00 00  66 6F 72 77 61 72 64 21  00 00 00 00
         00 00 00 00  00 00  02 00  00 00  00 00  B2 00  1E 00
         D4 00~             # answer to a Forward Open, reserved
         00 00              # success, no additional status
         01 00 22 11        # id O->T, chosen by the target
         88 77 66 55        # id T->O
         34 12  39 05  0D F0 FE CA
         10 27 00 00  20 4E 00 00  # 10 ms and 20 ms hold
         00 00~             # no words of the application, reserved",
        &explicit(0x2E, body),
    );
}

/// Multicast: the group stands in the socket address T->O; O->T goes to the address of the target.
#[test]
fn opened_multicast() {
    let body = Body::Opened { is_large: true, reply: opened(&[0xBE, 0xEF]) };
    let expected = Explicit {
        o2t_address: Some(SocketAddrV4::new(Ipv4Addr::UNSPECIFIED, 2_222)),
        t2o_address: Some(SocketAddrV4::new(Ipv4Addr::new(239, 192, 1, 32), 2_222)),
        ..explicit(0x58, body)
    };
    check::<SendRrData>(
        "6F 00  58 00  A5 00 00 00  00 00 00 00  66 6F 72 77 61 72 64 21  00 00 00 00
         00 00 00 00  00 00
         04 00              # four items
         00 00  00 00
         B2 00  20 00
         DB 00~  00 00      # answer to a Large Forward Open
         01 00 22 11  88 77 66 55  34 12  39 05  0D F0 FE CA
         10 27 00 00  20 4E 00 00
         01 00~  BE EF      # one word of the application
         00! 80!  10 00
         00 02  08 AE  00 00 00 00  00~ 00~ 00~ 00~ 00~ 00~ 00~ 00~
         01! 80!  10 00
         00 02  08 AE  EF C0 01 20  00~ 00~ 00~ 00~ 00~ 00~ 00~ 00~",
        &expected,
    );
}

fn refused(words: &[u8], remaining_path_words: u8) -> Body<'_> {
    Body::Refused {
        service: Service::FORWARD_OPEN,
        status: GeneralStatus::CONNECTION_FAILURE,
        words,
        refusal: ConnectionRefusal { triad: TRIAD, remaining_path_words },
    }
}

#[test]
fn refused_for_ownership() {
    check::<SendRrData>(
        "6F 00  20 00  A5 00 00 00  00 00 00 00  66 6F 72 77 61 72 64 21  00 00 00 00
         00 00 00 00  00 00  02 00  00 00  00 00  B2 00  10 00
         D4 00~
         01                 # connection failure
         01  06 01          # one word: ownership conflict
         34 12  39 05  0D F0 FE CA
         00  00~            # nothing left of the path, reserved",
        &explicit(0x20, refused(&[0x06, 0x01], 0)),
    );
}

/// A size that does not fit: the second word has the one that does.
#[test]
fn refused_for_size() {
    let text = "6F 00  22 00  A5 00 00 00  00 00 00 00  66 6F 72 77 61 72 64 21  00 00 00 00
         00 00 00 00  00 00  02 00  00 00  00 00  B2 00  12 00
         D4 00~  01
         02! 27 01  42 00   # two words: size O->T, 66 bytes fit
         34 12  39 05  0D F0 FE CA  03  00~";
    check::<SendRrData>(text, &explicit(0x22, refused(&[0x27, 0x01, 0x42, 0x00], 3)));
    let bytes = vector(text).bytes;
    let message = &bytes[40..];
    let response = fieldarm::wire::enip::message::Response::read(message).unwrap();
    assert_eq!(response.extended(), Some(ExtendedStatus::O2T_SIZE));
    assert_eq!(response.additional_word(1), Some(66));
    assert_eq!(response.additional_word(2), None);
}

/// Bytes of the words that the facts give for the robot's two sizes.
#[test]
fn parameter_words() {
    for (word, connection_type, size) in [
        (0x4842, ConnectionType::PointToPoint, 66),
        (0x48FE, ConnectionType::PointToPoint, 254),
        (0x28FE, ConnectionType::Multicast, 254),
        (0x0800, ConnectionType::Null, 0),
        (0x69FF, ConnectionType::Reserved, 511),
    ] {
        let expected = fixed(connection_type, size);
        assert_eq!(NetworkParameters::from_word(word), expected);
        assert_eq!(expected.to_word(), word);
    }
    assert_eq!(
        NetworkParameters::from_double_word(0x4800_FFFF),
        fixed(ConnectionType::PointToPoint, 65_535)
    );
    assert_eq!(fixed(ConnectionType::Multicast, 65_535).to_double_word(), 0x2800_FFFF);
}

/// The factors 256 and 512 do not fit a byte, and a timeout of the longest interval does not fit 32 bits.
#[test]
fn multipliers() {
    for (wire, factor) in [4, 8, 16, 32, 64, 128, 256, 512].into_iter().enumerate() {
        let multiplier = TimeoutMultiplier::from_wire(wire as u8).unwrap();
        assert_eq!(multiplier.factor(), factor);
        assert_eq!(TimeoutMultiplier::from_factor(factor), Some(multiplier));
    }
    assert!((8..=255).all(|wire| TimeoutMultiplier::from_wire(wire).is_none()));
    assert!([0, 1, 2, 3, 5, 1024].iter().all(|&f| TimeoutMultiplier::from_factor(f).is_none()));
}

/// Class 1, cyclic: 0x01; class 3 of explicit messages, the target being the server: 0xA3.
#[test]
fn transports() {
    let transport = Transport::CLASS_1_CYCLIC;
    assert_eq!((transport.class(), transport.trigger(), transport.is_server()), (1, 0, false));
    let explicit = Transport(0xA3);
    assert_eq!((explicit.class(), explicit.trigger(), explicit.is_server()), (3, 2, true));
}

#[test]
fn a_large_size_does_not_fit_a_small_open() {
    let path = [0x20, 0x04, 0x2C, 0x96, 0x2C, 0x64];
    let mut open = owner(&path);
    open.t2o.size = 512;
    assert!(open.write(&mut [0; 64], false).is_err());
    assert_eq!(open.write(&mut [0; 64], true), Ok(46));
    open.t2o.size = 511;
    assert_eq!(open.write(&mut [0; 64], false), Ok(42));
}
