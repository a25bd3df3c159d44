//! Peers that mean no good, or do not know better. The controlling connection keeps working.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration as Wait;

use crate::served::{Line, Served};
use crate::text_support::ScriptedDevice;
use fieldarm::bus::text::server::{CloseReason, Peer};
use fieldarm::link::text::ServerEvent;
use fieldarm::time::Duration;
use socket2::{Domain, SockRef, Socket, Type};

fn still_works(line: &mut Line) {
    line.send(b"Say(still here)\0");
    assert_eq!(line.next(), "[2000][still here]");
}

#[test]
fn a_megabyte_without_an_end_is_one_error() {
    let served = Served::start(ScriptedDevice::default());
    let mut line = served.control();
    let megabyte = vec![b'x'; 1 << 20];
    line.send(&megabyte);
    assert!(line.next().starts_with("[3003]"));
    line.send(&megabyte);
    line.send(b"\0");
    still_works(&mut line);
    line.send(&vec![0xff; 1 << 20]);
    line.send(b"\n");
    assert!(line.next().starts_with("[3003]"));
    still_works(&mut line);
    assert_eq!(served.counts().session.rejected, 2);
}

#[test]
fn binary_lines_are_each_one_error() {
    let served = Served::start(ScriptedDevice::default());
    let mut line = served.control();
    let mut random = fastrand::Rng::with_seed(7);
    for _ in 0..50 {
        let mut bytes: Vec<u8> = (0..200).map(|_| random.u8(128..)).collect();
        bytes.push(0);
        line.send(&bytes);
        assert!(line.next().starts_with("[1001]"));
    }
    // With ends of line inside: as many answers as lines, and nothing is out of step after it.
    let bytes: Vec<u8> = (0..4_000).map(|_| random.u8(..)).collect();
    line.send(&bytes);
    line.send(b"\0Say(end)\0");
    let answered = (0..10_000).any(|_| line.next() == "[2000][end]");
    assert!(answered);
    still_works(&mut line);
}

#[test]
fn thousands_of_connections_change_nothing() {
    let served = Served::start(ScriptedDevice::default());
    let mut line = served.control();
    for round in 0..2_000_u32 {
        let port =
            if round % 2 == 0 { served.endpoints.control } else { served.endpoints.monitoring };
        let stream = TcpStream::connect(port).unwrap();
        match round % 3 {
            0 => drop(stream),
            // Reset instead of an orderly end.
            1 => SockRef::from(&stream).set_linger(Some(Wait::ZERO)).unwrap(),
            _ => drop((&stream).write(b"Say(x)\0")),
        }
        if round % 200 == 0 {
            still_works(&mut line);
        }
    }
    still_works(&mut line);
    assert_eq!(served.commands().len(), 11);
    // Everybody who left is forgotten: a place is free again.
    let mut monitor = served.monitor();
    assert!((0..200).any(|_| {
        let is_in = monitor.try_next().is_some_and(|first| first.starts_with("[2007]"));
        if !is_in {
            std::thread::sleep(Wait::from_millis(5));
            monitor = served.monitor();
        }
        is_in
    }));
}

#[test]
fn connections_that_say_nothing_hold_nobody_up() {
    let served = Served::start(ScriptedDevice::default());
    let mut line = served.control();
    let idle: Vec<TcpStream> =
        (0..100).map(|_| TcpStream::connect(served.endpoints.monitoring).unwrap()).collect();
    still_works(&mut line);
    assert!(served.with(|server| server.counts().accepted) <= 101);
    drop(idle);
    still_works(&mut line);
}

/// A connection whose system keeps as little for it as it can.
fn narrow(address: SocketAddr) -> TcpStream {
    let socket = Socket::new(Domain::IPV4, Type::STREAM, None).unwrap();
    socket.set_recv_buffer_size(4_096).unwrap();
    socket.connect(&address.into()).unwrap();
    socket.into()
}

#[test]
fn a_monitor_that_does_not_read_is_closed_and_the_others_hear_everything() {
    let served = Served::start(ScriptedDevice::default());
    let _slow = narrow(served.endpoints.monitoring);
    served.wait_for_event(|event| matches!(event, ServerEvent::Connected { .. }));
    let mut quick = served.monitor();
    quick.next();
    quick.next();
    let mut control = served.control();
    let wide = "x".repeat(2_000);
    let mut is_closed = false;
    for round in 0..20_000 {
        control.send(format!("Shout({round}{wide})\0").as_bytes());
        assert!(quick.next().starts_with(&format!("[2095][{round}x")));
        is_closed = round % 50 == 0 && served.counts().session.overfull == 1;
        if is_closed {
            break;
        }
    }
    assert!(is_closed);
    served.wait_for_event(|event| {
        let reason = Some(CloseReason::Overfull);
        *event == ServerEvent::Disconnected { peer: Peer::Monitor(0), reason }
    });
    still_works(&mut control);
}

#[test]
fn a_controller_that_does_not_read_is_closed_and_another_may_come() {
    let served = Served::start(ScriptedDevice::default());
    let mut deaf = narrow(served.endpoints.control);
    deaf.set_write_timeout(Some(Wait::from_secs(20))).unwrap();
    let wide = format!("Wide({})\0", 4_000).repeat(20);
    for _ in 0..100 {
        // It is read to the end even when it was closed for this.
        deaf.write_all(wide.as_bytes()).unwrap();
    }
    served.wait_for_event(|event| {
        let reason = Some(CloseReason::Overfull);
        *event == ServerEvent::Disconnected { peer: Peer::Control, reason }
    });
    still_works(&mut served.control());
    assert_eq!(served.counts().session.overfull, 1);
}

#[test]
fn many_commands_with_three_busy_monitors_lose_nothing() {
    const COMMANDS: usize = 5_000;
    let interval = Some(Duration::from_millis(2));
    let served = Served::start(ScriptedDevice { interval, ..ScriptedDevice::default() });
    let monitors: Vec<Line> = (0..3).map(|_| served.monitor()).collect();
    let mut control = served.control();
    let mut writer = control.stream.try_clone().unwrap();
    let sender = std::thread::spawn(move || {
        for number in 0..COMMANDS {
            writer.write_all(format!("-Say({number})\0Shout({number})\0").as_bytes()).unwrap();
        }
    });
    let listeners: Vec<_> = monitors
        .into_iter()
        .map(|mut monitor| {
            std::thread::spawn(move || {
                let mut next = 0;
                let mut last_time = 0_u64;
                while next < COMMANDS {
                    let message = monitor.next();
                    if let Some(time) = message.strip_prefix("[2230][") {
                        let time = time.trim_end_matches(']').parse().unwrap();
                        assert!(time >= last_time);
                        last_time = time;
                    } else if message != "[2095][m500]" && !message.starts_with("[2007]") {
                        assert_eq!(message, format!("[2095][{next}]"));
                        next += 1;
                    }
                }
            })
        })
        .collect();
    for number in 0..COMMANDS {
        assert_eq!(control.next(), format!("[2000][{number}]"));
    }
    sender.join().unwrap();
    for listener in listeners {
        listener.join().unwrap();
    }
    assert_eq!(served.counts().session.overfull, 0);
}

#[test]
fn answers_that_fill_the_outbox_many_times_over_are_all_sent_to_who_reads() {
    const REQUESTS: usize = 200;
    let served = Served::start(ScriptedDevice::default());
    let mut line = served.control();
    // All at once, so that the server reads them in few pieces; each answer fills half an outbox.
    let requests = "Wide(30000)\0".repeat(REQUESTS) + "Say(last)\0";
    let mut writer = line.stream.try_clone().unwrap();
    let sender = std::thread::spawn(move || writer.write_all(requests.as_bytes()).unwrap());
    for _ in 0..REQUESTS {
        assert_eq!(line.next().len(), 30_008);
    }
    assert_eq!(line.next(), "[2000][last]");
    sender.join().unwrap();
    assert_eq!(served.counts().session.overfull, 0);
}

#[test]
fn a_server_that_was_stopped_for_a_while_catches_up() {
    let interval = Some(Duration::from_millis(2));
    let served = Served::start(ScriptedDevice { interval, ..ScriptedDevice::default() });
    let mut monitor = served.monitor();
    monitor.next();
    monitor.next();
    // What a robot has to say after it was not served for long: more than an outbox holds, at once.
    served.with(|server| {
        let news = |number| format!("[2095][{number}{}]", "x".repeat(400));
        server.device_mut().monitoring.extend((0..2_000).map(news));
    });
    let mut next = 0;
    while next < 2_000 {
        let message = monitor.next();
        if message.starts_with("[2095]") {
            assert!(message.starts_with(&format!("[2095][{next}x")), "{message}");
            next += 1;
        }
    }
    assert_eq!(served.counts().session.overfull, 0);
}

#[test]
fn nothing_but_terminators_is_nothing() {
    let served = Served::start(ScriptedDevice::default());
    let mut line = served.control();
    for terminator in [b"\0".as_slice(), b"\n", b"\r\n"] {
        line.send(&terminator.repeat(1 << 20));
        still_works(&mut line);
    }
    assert_eq!(served.counts().session.rejected, 0);
    assert_eq!(served.commands().len(), 3);
}

#[test]
fn one_byte_at_a_time_is_a_command_in_the_end() {
    let served = Served::start(ScriptedDevice::default());
    let mut line = served.control();
    // On the monitoring port nobody listens to what is said, however slowly.
    let mut others: Vec<Line> = (0..4).map(|_| served.monitor()).collect();
    for byte in b"Say(slowly)\n" {
        line.send(&[*byte]);
        others.iter_mut().for_each(|other| other.send(&[*byte]));
        // Whoever knocks meanwhile is told, and is not kept waiting.
        let mut knocking = Line::connect(served.endpoints.control);
        assert!(knocking.next().starts_with("[3001]"));
    }
    assert_eq!(line.next(), "[2000][slowly]");
    assert_eq!(served.commands(), ["Say(slowly)"]);
}

#[test]
fn a_half_closed_connection_is_closed() {
    let served = Served::start(ScriptedDevice::default());
    let mut line = served.control();
    line.send(b"Say(bye)\0");
    assert_eq!(line.next(), "[2000][bye]");
    line.stream.shutdown(std::net::Shutdown::Write).unwrap();
    let mut rest = Vec::new();
    line.stream.read_to_end(&mut rest).unwrap();
    assert!(rest.is_empty());
    still_works(&mut served.control());
}
