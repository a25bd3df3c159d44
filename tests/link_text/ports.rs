//! Both ports of a robot.

use std::net::TcpStream;

use crate::served::Served;
use crate::text_support::ScriptedDevice;
use fieldarm::bus::text::server::{CloseReason, Peer};
use fieldarm::link::text::{Endpoints, MONITORS, Port, ServerEvent, TextPorts};
use fieldarm::time::{Duration, Instant};

#[test]
fn commands_are_answered_whatever_ends_them() {
    let served = Served::start(ScriptedDevice::default());
    let mut line = served.control();
    line.send(b"\0");
    line.send(b"Say(1)\0Say(2)\nSay(3)\r\nSa");
    line.send(b"y(4)\0");
    for number in 1..=4 {
        assert_eq!(line.next(), format!("[2000][{number}]"));
    }
    assert_eq!(served.commands(), ["Say(1)", "Say(2)", "Say(3)", "Say(4)"]);
}

#[test]
fn the_second_controller_is_told_and_sent_away() {
    let served = Served::start(ScriptedDevice::default());
    let mut first = served.control();
    for _ in 0..3 {
        let mut second = crate::served::Line::connect(served.endpoints.control);
        // What it says in the meantime does not keep it from hearing why.
        second.send(b"Say(stolen)\0");
        assert!(second.next().starts_with("[3001][Another user"));
        assert_eq!(second.try_next(), None);
    }
    first.send(b"Say(mine)\0");
    assert_eq!(first.next(), "[2000][mine]");
    served
        .wait_for_event(|event| matches!(event, ServerEvent::SentAway { port: Port::Control, .. }));
    assert_eq!(served.counts().session.refused, 3);
    drop(first);
    served.wait_for_event(|event| {
        matches!(event, ServerEvent::Disconnected { peer: Peer::Control, reason: None })
    });
    served.control();
    assert_eq!(served.commands(), ["Say(mine)"]);
}

#[test]
fn who_connects_again_between_two_passes_has_control_again() {
    let any = "127.0.0.1:0".parse().unwrap();
    let mut ports = TextPorts::bind(Endpoints { control: any, monitoring: any }).unwrap();
    let mut device = ScriptedDevice::default();
    let control = ports.endpoints().control;
    let mut connections = Vec::new();
    for pass in 0..10 {
        // The one before leaves and this one knocks while nobody serves.
        connections.clear();
        connections.push(TcpStream::connect(control).unwrap());
        ports.wait(Duration::from_secs(1)).unwrap();
        ports.serve(Instant::from_nanos(pass * 1_000_000), &mut device);
        assert_eq!(ports.peers().collect::<Vec<_>>(), [Peer::Control], "{pass}");
    }
    assert_eq!(ports.counts().session.refused, 0);
}

#[test]
fn monitors_hear_the_state_and_then_everything() {
    let interval = Some(Duration::from_millis(2));
    let served = Served::start(ScriptedDevice { interval, ..ScriptedDevice::default() });
    let mut monitors: Vec<_> = (0..MONITORS).map(|_| served.monitor()).collect();
    for monitor in &mut monitors {
        assert_eq!(monitor.next(), "[2007][0,0,0,0,0,1,1]");
        assert_eq!(monitor.next(), "[2095][m500]");
        assert!(monitor.next().starts_with("[2230]["));
    }
    let mut one_more = served.monitor();
    assert!(one_more.next().starts_with("[3001][Too many monitoring connections"));
    assert_eq!(one_more.try_next(), None);
    let mut control = served.control();
    control.send(b"Shout(news)\0");
    for monitor in &mut monitors {
        let heard = (0..1_000).any(|_| monitor.next() == "[2095][news]");
        assert!(heard);
    }
}

#[test]
fn ports_close_and_open_with_the_robot() {
    let served = Served::start(ScriptedDevice::default());
    let mut control = served.control();
    let mut monitor = served.monitor();
    monitor.next();
    monitor.next();
    served.with(|server| server.device_mut().is_on_text = false);
    assert_eq!(control.try_next(), None);
    assert_eq!(monitor.try_next(), None);
    served.wait_for_event(|event| {
        let reason = Some(CloseReason::PortsClosed);
        *event == ServerEvent::Disconnected { peer: Peer::Control, reason }
    });
    assert!(TcpStream::connect(served.endpoints.control).is_err());
    assert!(TcpStream::connect(served.endpoints.monitoring).is_err());
    served.with(|server| server.device_mut().is_on_text = true);
    let open = (0..10_000).any(|_| {
        std::thread::sleep(std::time::Duration::from_millis(1));
        TcpStream::connect(served.endpoints.monitoring).is_ok()
    });
    assert!(open);
    served.control();
}

#[test]
fn the_robot_may_drop_its_controller() {
    let served = Served::start(ScriptedDevice::default());
    let mut control = served.control();
    control.send(b"Say(last)\0Hang()\0Say(never)\0");
    assert_eq!(control.next(), "[2000][last]");
    assert_eq!(control.try_next(), None);
    served.control();
    assert_eq!(served.commands(), ["Say(last)", "Hang()"]);
}

#[test]
fn a_port_that_is_taken_is_named() {
    let served = Served::start(ScriptedDevice::default());
    let free = "127.0.0.1:0".parse().unwrap();
    let control = served.endpoints.control;
    let error = TextPorts::bind(Endpoints { control, monitoring: free }).unwrap_err();
    assert_eq!((error.port, error.address), (Port::Control, control));
    assert!(
        error.to_string().starts_with(&format!("the control port cannot be opened at {control}"))
    );
    let monitoring = served.endpoints.monitoring;
    let error = TextPorts::bind(Endpoints { control: free, monitoring }).unwrap_err();
    assert_eq!(error.port, Port::Monitoring);
}

/// So many passes, with time between them.
#[cfg(target_os = "linux")]
fn passes(
    count: u64,
    ports: &mut TextPorts,
    device: &mut ScriptedDevice,
    mut done: impl FnMut(&TextPorts, &ScriptedDevice) -> bool,
) -> bool {
    (0..count).any(|_| {
        ports.wait(Duration::from_millis(10)).unwrap();
        let now = device.now + Duration::from_millis(10);
        ports.serve(now, device);
        done(ports, device)
    })
}

#[test]
#[cfg(target_os = "linux")]
fn a_pulled_cable_is_silence_in_both_directions_until_it_is_in_again() {
    use std::io::{ErrorKind, Read, Write};

    let any = "127.0.0.1:0".parse().unwrap();
    let mut ports = TextPorts::bind(Endpoints { control: any, monitoring: any }).unwrap();
    let mut device = ScriptedDevice::default();
    let Endpoints { control, monitoring } = ports.endpoints();
    let mut first = TcpStream::connect(control).unwrap();
    let mut monitor = TcpStream::connect(monitoring).unwrap();
    let both = |ports: &TextPorts, _: &ScriptedDevice| ports.peers().count() == 2;
    assert!(passes(1_000, &mut ports, &mut device, both));
    for stream in [&first, &monitor] {
        stream.set_read_timeout(Some(Duration::from_millis(50))).unwrap();
    }
    // What was said before the cable is pulled.
    let mut room = [0; 512];
    assert!(monitor.read(&mut room).unwrap() > 0);

    ports.set_plugged(false).expect("filters are there");
    first.write_all(b"Say(heard)\0").unwrap();
    device.monitoring.push_back("[2007][told]".into());
    let never = |_: &TextPorts, _: &ScriptedDevice| false;
    assert!(!passes(10, &mut ports, &mut device, never));
    assert!(device.commands().is_empty());
    assert_eq!(monitor.read(&mut room).unwrap_err().kind(), ErrorKind::WouldBlock);
    let brief = Duration::from_millis(200);
    assert_eq!(
        TcpStream::connect_timeout(&control, brief).unwrap_err().kind(),
        ErrorKind::TimedOut
    );
    assert!(both(&ports, &device), "nobody has left");

    ports.set_plugged(true).expect("filters are there");
    let is_heard = |_: &TextPorts, device: &ScriptedDevice| device.commands() == ["Say(heard)"];
    assert!(passes(1_000, &mut ports, &mut device, is_heard));
    let count = monitor.read(&mut room).expect("it was kept");
    assert_eq!(&room[..count], b"[2007][told]\0");
    first.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    let mut heard = String::new();
    while !heard.contains("[2000][heard]") {
        let count = first.read(&mut room).expect("it answers");
        assert!(count > 0, "closed: {heard}");
        heard.push_str(core::str::from_utf8(&room[..count]).unwrap());
    }

    // What is closed meanwhile the peer learns afterwards.
    ports.set_plugged(false).expect("filters are there");
    device.is_on_text = false;
    let nobody = |ports: &TextPorts, _: &ScriptedDevice| ports.peers().count() == 0;
    assert!(passes(1_000, &mut ports, &mut device, nobody));
    assert_eq!(monitor.read(&mut room).unwrap_err().kind(), ErrorKind::WouldBlock);
    ports.set_plugged(true).expect("filters are there");
    monitor.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    assert_eq!(monitor.read(&mut room).unwrap(), 0, "closed");
}

#[test]
#[cfg(target_os = "linux")]
fn a_controller_behind_a_pulled_cable_is_missed_after_some_seconds() {
    let any = "127.0.0.1:0".parse().unwrap();
    let mut ports = TextPorts::bind(Endpoints { control: any, monitoring: any }).unwrap();
    let mut device = ScriptedDevice::default();
    let _peer = TcpStream::connect(ports.endpoints().control).unwrap();
    let is_there = |ports: &TextPorts, _: &ScriptedDevice| ports.peers().count() == 1;
    assert!(passes(1_000, &mut ports, &mut device, is_there));
    ports.set_plugged(false).expect("filters are there");
    let is_gone = |ports: &TextPorts, _: &ScriptedDevice| ports.peers().count() == 0;
    assert!(passes(3_000, &mut ports, &mut device, is_gone), "half open for ever");
    assert_eq!(device.told.last(), Some(&crate::text_support::Told::Closed));
}
