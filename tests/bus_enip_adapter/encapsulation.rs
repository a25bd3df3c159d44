//! Commands, sessions and streams.

use fieldarm::bus::enip::adapter::{Access, Adapter, AdapterSettings, STREAMS, Transmit};
use fieldarm::time::Instant;

use crate::support::{
    ADDRESS, Robot, hex, ms, open_request, packet, peer, rr_data, shown, unwrapped,
};

/// An answer with `status`, typed: command, length, session, status, context, options, data.
fn answer(command: &str, session: u32, status: &str, data: &str) -> Vec<u8> {
    let data = hex(data);
    let mut bytes = hex(command);
    bytes.extend((data.len() as u16).to_le_bytes());
    bytes.extend(session.to_le_bytes());
    bytes.extend(hex(status));
    bytes.extend(hex("00 00 00 | 01 02 03 04 05 06 07 08 | 00 00 00 00"));
    bytes.extend(data);
    bytes
}

const IDENTITY: &str = "01 00 | 0C 00 29 00 | 01 00 | 00 02 AF 12 C0 A8 00 64 00 00 00 00 00 00 00 00 \
                        | 1D 06 2B 00 F4 01 0B 03 30 00 00 00 00 00 07 4D 65 63 61 35 30 30 | 03";
const SERVICES: &str = "01 00 | 00 01 14 00 | 01 00 20 01 | \
                        43 6F 6D 6D 75 6E 69 63 61 74 69 6F 6E 73 00 00";

#[test]
fn lists_are_answered_over_tcp_and_udp_without_a_session() {
    let rows = [(0x63, "63 00", IDENTITY), (0x04, "04 00", SERVICES), (0x64, "64 00", "00 00")];
    for (number, command, data) in rows {
        let wanted = answer(command, 0, "00", data);
        let mut robot = Robot::new();
        let stream = robot.accept(peer(1));
        assert_eq!(shown(&robot.feed(stream, &packet(number, 0, &[]))), shown(&wanted));
        let with_data = robot.feed(stream, &packet(number, 0, &[0]));
        assert_eq!(shown(&with_data), shown(&answer(command, 0, "65", "")));
        robot.adapter.handle_message_datagram(robot.now, peer(3), &packet(number, 0, &[]));
        robot.flush();
        assert_eq!(robot.messages, [(peer(3), wanted)]);
    }
}

#[test]
fn the_status_word_tells_how_the_connections_are() {
    let mut robot = Robot::new();
    let session = robot.session(peer(1));
    let status = |robot: &mut Robot| {
        let listed = robot.feed(session.stream, &packet(0x63, 0, &[]));
        shown(&listed[56..58])
    };
    assert_eq!(status(&mut robot), "30 00");
    let opened = robot.open(session, &open_request(&[]));
    assert_eq!(status(&mut robot), "71 00");
    robot.output(peer(1), opened.o2t_id, (1, 1), true, 0);
    assert_eq!(status(&mut robot), "61 00");
}

#[test]
fn other_commands_over_udp_are_refused_or_dropped() {
    let mut robot = Robot::new();
    for (number, command) in [(0x65, "65 00"), (0x6F, "6F 00"), (0x70, "70 00"), (0x99, "99 00")] {
        robot.adapter.handle_message_datagram(
            robot.now,
            peer(3),
            &packet(number, 5, &[1, 0, 0, 0]),
        );
        robot.flush();
        let wanted = answer(command, 5, "01", "");
        assert_eq!(robot.messages.pop(), Some((peer(3), wanted)), "{command}");
    }
    let whole = packet(0x63, 0, &[]);
    let mut long = whole.clone();
    long.push(0);
    let mut options = whole.clone();
    options[20] = 1;
    for wrong in
        [&whole[..23], &[], &long[..], &options[..], &packet(0, 0, &[]), &packet(0x66, 0, &[])]
    {
        robot.adapter.handle_message_datagram(robot.now, peer(3), wrong);
        robot.flush();
        assert!(robot.messages.is_empty(), "{}", shown(wrong));
    }
}

#[test]
fn a_session_is_registered_once_and_only_in_version_1() {
    let mut robot = Robot::new();
    let stream = robot.accept(peer(1));
    let mut register = |data: &str| robot.feed(stream, &packet(0x65, 0, &hex(data)));
    assert_eq!(register("02 00 00 00"), answer("65 00", 0, "69", "01 00 00 00"));
    assert_eq!(register("00 00 00 00"), answer("65 00", 0, "69", "01 00 00 00"));
    assert_eq!(register("01 00 01 00"), answer("65 00", 0, "69", "01 00 00 00"));
    assert_eq!(register("01 00 00"), answer("65 00", 0, "65", ""));
    assert_eq!(register("01 00 00 00 00"), answer("65 00", 0, "65", ""));
    let first = register("01 00 00 00");
    let handle = u32::from_le_bytes(first[4..8].try_into().unwrap());
    assert_ne!(handle, 0);
    assert_eq!(first, answer("65 00", handle, "00", "01 00 00 00"));
    assert_eq!(register("01 00 00 00"), answer("65 00", 0, "01", ""));
    let other = robot.session(peer(2));
    assert_ne!(other.handle, handle);
}

#[test]
fn requests_need_the_session_of_their_own_stream() {
    let mut robot = Robot::new();
    let bare = robot.accept(peer(1));
    let request = rr_data(&hex("0E 03 20 01 24 01 30 01"), &[]);
    let refused = |session| answer("6F 00", session, "64", "");
    assert_eq!(robot.feed(bare, &packet(0x6F, 0, &request)), refused(0));
    let (one, two) = (robot.session(peer(2)), robot.session(peer(3)));
    assert_eq!(robot.feed(one.stream, &packet(0x6F, two.handle, &request)), refused(two.handle));
    assert_eq!(robot.feed(one.stream, &packet(0x6F, 0, &request)), refused(0));
    let (reply, _) = unwrapped(&robot.feed(one.stream, &packet(0x6F, one.handle, &request)));
    assert_eq!(reply, hex("8E 00 00 00 1D 06"));
}

#[test]
fn connected_messages_and_unknown_commands_are_not_supported() {
    let mut robot = Robot::new();
    let session = robot.session(peer(1));
    for (number, command) in [(0x70, "70 00"), (0x01, "01 00"), (0xFFFF, "FF FF")] {
        let data = hex("00 00 00 00 00 00 02 00 A1 00 04 00 01 00 00 00 B1 00 02 00 00 00");
        let got = robot.feed(session.stream, &packet(number, session.handle, &data));
        assert_eq!(got, answer(command, session.handle, "01", ""));
    }
}

#[test]
fn unregistering_closes_the_stream_but_not_the_connection() {
    let mut robot = Robot::new();
    let session = robot.session(peer(1));
    robot.open(session, &open_request(&[]));
    assert!(robot.feed(session.stream, &packet(0x66, session.handle ^ 1, &[])).is_empty());
    assert!(robot.closed.is_empty());
    assert!(robot.feed(session.stream, &packet(0x66, session.handle, &[])).is_empty());
    assert_eq!(robot.closed, [session.stream.index()]);
    assert_eq!(robot.adapter.connections().count(), 1);
    assert!(robot.feed(session.stream, &packet(0x63, 0, &[])).is_empty(), "it is gone");
}

#[test]
fn malformed_items_get_status_3() {
    let whole = rr_data(&hex("0E 03 20 01 24 01 30 01"), &[]);
    let mut robot = Robot::new();
    let session = robot.session(peer(1));
    let refused = answer("6F 00", session.handle, "03", "");
    let mut wrong: Vec<Vec<u8>> = (0..whole.len()).map(|len| whole[..len].to_vec()).collect();
    for (at, value) in [(0, 1), (6, 1), (6, 3), (8, 1), (10, 1), (12, 0xB1), (14, 7), (14, 9)] {
        let mut changed = whole.clone();
        changed[at] = value;
        wrong.push(changed);
    }
    wrong.push([&whole[..], &[0]].concat());
    // A socket address that is cut off, and one of another family.
    let message = hex("0E 03 20 01 24 01 30 01");
    wrong.push(rr_data(&message, &[&hex("01 80 08 00 00 02 08 AE 00 00 00 00")]));
    wrong.push(rr_data(
        &message,
        &[&hex("01 80 10 00 00 0A 08 AE 00 00 00 00 00 00 00 00 00 00 00 00")],
    ));
    // No message, and a response.
    wrong.push(rr_data(&[], &[]));
    wrong.push(rr_data(&hex("8E 00 00 00"), &[]));
    for data in wrong {
        let got = robot.feed(session.stream, &packet(0x6F, session.handle, &data));
        assert_eq!(shown(&got), shown(&refused), "{}", shown(&data));
    }
    let got = robot.feed(session.stream, &packet(0x6F, session.handle, &whole));
    assert_eq!(unwrapped(&got).0, hex("8E 00 00 00 1D 06"));
}

#[test]
fn options_and_nops_are_passed_over() {
    let mut robot = Robot::new();
    let stream = robot.accept(peer(1));
    let mut odd = packet(0x65, 0, &hex("01 00 00 00"));
    odd[20] = 1;
    assert!(robot.feed(stream, &odd).is_empty());
    assert!(robot.feed(stream, &packet(0, 0, &[7; 600])).is_empty());
    assert!(robot.feed(stream, &packet(0, 0, &[7; 4_000])).is_empty());
    assert_eq!(robot.feed(stream, &packet(0x64, 0, &[])), answer("64 00", 0, "00", "00 00"));
}

#[test]
fn any_cut_of_the_stream_gives_the_same_answers() {
    let requests = [
        packet(0x63, 0, &[]),
        packet(0, 0, &[1, 2, 3]),
        packet(0x64, 0, &[]),
        packet(0x99, 3, &[0; 601]),
        packet(0x65, 0, &hex("01 00 00 00")),
        packet(0x04, 0, &[]),
    ]
    .concat();
    let fresh = || {
        let mut robot = Robot::new();
        let stream = robot.accept(peer(1));
        (robot, stream)
    };
    let (mut robot, stream) = fresh();
    let whole = robot.feed(stream, &requests);
    assert_eq!(whole.len(), (24 + 47) + 26 + 24 + 28 + 50);
    for size in 1..requests.len() {
        let (mut robot, stream) = fresh();
        let pieces = requests.chunks(size).flat_map(|piece| robot.feed(stream, piece));
        assert_eq!(pieces.collect::<Vec<_>>(), whole, "pieces of {size}");
    }
}

#[test]
fn a_packet_that_is_too_long_is_refused_and_passed_over() {
    for len in [601, 1_000, 65_535] {
        let mut robot = Robot::new();
        let session = robot.session(peer(1));
        // Its bytes look like requests themselves.
        let inner: Vec<u8> = packet(0x63, 0, &[]).into_iter().cycle().take(len).collect();
        let got = robot.feed(session.stream, &packet(0x6F, session.handle, &inner));
        assert_eq!(got, answer("6F 00", session.handle, "65", ""));
        let after = robot.feed(session.stream, &packet(0x64, 0, &[]));
        assert_eq!(after, answer("64 00", 0, "00", "00 00"));
    }
}

#[test]
fn a_silent_stream_is_closed_so_that_dead_peers_lock_nobody_out() {
    let mut robot = Robot::new();
    let all: Vec<_> = (0..STREAMS).map(|_| robot.accept(peer(1))).collect();
    assert_eq!(robot.adapter.handle_accepted(robot.now, peer(2)), None);
    robot.advance(ms(119_000));
    // Half a packet is no message; a NOP is one.
    assert!(robot.feed(all[0], &packet(0x63, 0, &[])[..10]).is_empty());
    assert!(robot.feed(all[5], &packet(0x00, 0, &[])).is_empty());
    robot.advance(ms(999));
    assert!(robot.closed.is_empty());
    robot.advance(ms(1));
    robot.closed.sort_unstable();
    assert_eq!(robot.closed, [0, 1, 2, 3, 4, 6, 7]);
    assert_eq!(robot.accept(peer(2)).index(), 0);
    robot.closed.clear();
    robot.advance(ms(118_999));
    assert!(robot.closed.is_empty());
    robot.advance(ms(1));
    assert_eq!(robot.closed, [5]);
}

#[test]
fn silence_is_noticed_by_whatever_is_called_next() {
    let mut robot = Robot::new();
    for _ in 0..STREAMS {
        robot.accept(peer(1));
    }
    robot.now += ms(120_000);
    // The places are free once the streams are closed.
    assert_eq!(robot.adapter.handle_accepted(robot.now, peer(2)), None);
    robot.flush();
    assert_eq!(robot.closed.len(), STREAMS);
    robot.accept(peer(2));
}

#[test]
fn a_stream_may_be_silent_while_the_connection_opened_over_it_lives() {
    let mut robot = Robot::new();
    let (owner, other) = (robot.session(peer(1)), robot.session(peer(2)));
    let opened = robot.open(owner, &open_request(&[]));
    for count in 1..=1_500_u16 {
        robot.output(peer(1), opened.o2t_id, (count.into(), count), true, 1);
        robot.advance(ms(100));
    }
    assert_eq!(robot.closed, [other.stream.index()]);
    // Its silence counts from the end of the connection: 60 ms from now.
    robot.closed.clear();
    robot.advance(ms(120_059));
    assert!(robot.closed.is_empty());
    robot.advance(ms(1));
    assert_eq!(robot.closed, [owner.stream.index()]);
}

#[test]
fn silence_is_a_setting() {
    let never = AdapterSettings { inactivity: ms(0), ..AdapterSettings::meca500() };
    let mut robot = Robot::with(never);
    let session = robot.session(peer(1));
    assert_eq!(robot.adapter.poll_timeout(), None);
    robot.advance(ms(86_400_000));
    robot.adapter.handle_timeout(robot.now);
    robot.flush();
    assert!(robot.closed.is_empty());
    assert_eq!(robot.cip(session, &hex("0E 03 20 F5 24 01 30 0D")), hex("8E 00 00 00 00 00"));
}

#[test]
fn too_many_streams_are_turned_away() {
    let mut robot = Robot::new();
    let all: Vec<_> = (0..STREAMS).map(|_| robot.accept(peer(1))).collect();
    assert_eq!(all.iter().map(|id| id.index()).collect::<Vec<_>>(), [0, 1, 2, 3, 4, 5, 6, 7]);
    assert_eq!(robot.adapter.handle_accepted(robot.now, peer(2)), None);
    robot.adapter.handle_stream_closed(robot.now, all[3]);
    let again = robot.accept(peer(2));
    assert_eq!(again.index(), 3);
    // It is a new one: no session, no half a packet.
    assert_eq!(robot.feed(again, &packet(0x6F, 0, &[])), answer("6F 00", 0, "64", ""));
}

#[test]
fn half_a_packet_does_not_reach_the_next_stream() {
    let mut robot = Robot::new();
    let first = robot.accept(peer(1));
    assert!(robot.feed(first, &packet(0x63, 0, &[])[..10]).is_empty());
    robot.adapter.handle_stream_closed(robot.now, first);
    let second = robot.accept(peer(1));
    assert_eq!(second, first);
    assert_eq!(robot.feed(second, &packet(0x64, 0, &[])), answer("64 00", 0, "00", "00 00"));
}

#[test]
fn who_does_not_read_is_told_and_then_cut_off() {
    let mut adapter = Adapter::new(AdapterSettings::meca500(), ADDRESS, 1);
    let now = Instant::ZERO;
    let stream = adapter.handle_accepted(now, peer(1)).unwrap();
    for _ in 0..1_000 {
        adapter.handle_stream(now, stream, &packet(0x63, 0, &[]));
    }
    let mut sent = Vec::new();
    let mut room = [0; 100];
    let mut is_closed = false;
    for _ in 0..1_000 {
        match adapter.poll_transmit(now, &mut room) {
            Some(Transmit::Stream { len, .. }) => sent.extend_from_slice(&room[..len]),
            Some(Transmit::CloseStream { .. }) => is_closed = true,
            Some(other) => panic!("{other:?}"),
            None => break,
        }
    }
    assert!(is_closed);
    // Whole answers, then refusals for lack of memory, each whole too.
    let (mut answered, mut refused) = (0, 0);
    let mut rest = &sent[..];
    while !rest.is_empty() {
        let len = 24 + usize::from(u16::from_le_bytes([rest[2], rest[3]]));
        match rest[8] {
            0 => answered += 1,
            2 => refused += 1,
            other => panic!("status {other}"),
        }
        rest = &rest[len..];
    }
    assert!(answered > 10 && refused > 10, "{answered} answered, {refused} refused");
}

#[test]
fn nobody_is_answered_while_disabled() {
    let mut robot = Robot::new();
    let session = robot.session(peer(1));
    robot.open(session, &open_request(&[]));
    robot.frames.clear();
    robot.adapter.set_access(robot.now, Access::Disabled);
    assert_eq!(robot.adapter.connections().count(), 0);
    assert!(robot.feed(session.stream, &packet(0x63, 0, &[])).is_empty());
    assert_eq!(robot.closed, [session.stream.index()]);
    robot.adapter.handle_message_datagram(robot.now, peer(1), &packet(0x63, 0, &[]));
    robot.advance(ms(1_000));
    robot.flush();
    assert_eq!((robot.messages.len(), robot.frames.len()), (0, 0));
    assert_eq!(robot.adapter.handle_accepted(robot.now, peer(1)), None);
    robot.adapter.set_access(robot.now, Access::Full);
    let session = robot.session(peer(1));
    robot.open(session, &open_request(&[]));
}
