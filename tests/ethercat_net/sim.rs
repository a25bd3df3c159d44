//! `fieldarm sim` as a person uses it: what it says, and how it ends.

use std::time::Duration;

use fieldarm::link::ethercat::raw_socket::RawSocket;
use fieldarm::link::ethercat::wire::{MAX_FRAME, Wire};

use crate::namespaces::{Cable, End, INTERFACE, Running};
use crate::served::{LONG, Robots, end, serve};

fn run(cable: &Cable, arguments: &[&str]) -> (Option<i32>, String) {
    let (status, said) = Running::start(&mut cable.fieldarm(End::Robots, arguments)).end(LONG);
    (status.code(), said)
}

/// BRD of one byte at 0000h: every robot that answers counts one.
fn count_robots(socket: &mut RawSocket) -> Option<u8> {
    let mut frame = [0; 60];
    frame[..6].fill(0xFF);
    frame[6..12].fill(0x10);
    frame[12..27].copy_from_slice(&[0x88, 0xA4, 13, 0x10, 7, 0x55, 0, 0, 0, 0, 1, 0, 0, 0, 0]);
    socket.send(&frame).ok()?;
    let mut buffer = [0; MAX_FRAME];
    let deadline = socket.now() + Duration::from_millis(200);
    while let Some(length) = socket.receive(&mut buffer, deadline).ok()? {
        if length >= 29 && buffer[17] == 0x55 {
            return Some(buffer[27]);
        }
    }
    None
}

/// Asks until `expected` robots answer, or for ten seconds.
fn await_robots(socket: &mut RawSocket, expected: Option<u8>) -> bool {
    (0..200).any(|_| {
        let found = count_robots(socket);
        let deadline = socket.now() + Duration::from_millis(50);
        socket.pause_until(deadline);
        found == expected
    })
}

fn main_device(cable: &Cable) -> RawSocket {
    cable.inside(End::Main, LONG, || RawSocket::open(INTERFACE)).expect("root opens it")
}

#[test]
fn robots_answer_until_ctrl_c_and_frames_are_counted() {
    let Some(cable) = Cable::plug() else { return };
    let serving = serve(&cable, Robots { count: 3, ..Robots::ONE }, &[]);
    let mut socket = main_device(&cable);
    for _ in 0..20 {
        assert_eq!(count_robots(&mut socket), Some(3));
    }
    let said = end(serving);
    assert!(said.contains("serving 3 virtual Meca500 on ecat0: byte order little, with"), "{said}");
    assert!(said.contains("20 frames received, 20 returned, 0 lost in the line"), "{said}");
    assert_eq!(count_robots(&mut socket), None, "nobody is there any more");
}

#[test]
fn quiet_is_quiet() {
    let Some(cable) = Cable::plug() else { return };
    let arguments = ["sim", "--ethercat", INTERFACE, "--quiet"];
    let serving = Running::start(&mut cable.fieldarm(End::Robots, &arguments));
    let mut socket = main_device(&cable);
    assert!(await_robots(&mut socket, Some(1)));
    assert_eq!(end(serving), "");
}

#[test]
fn a_link_that_was_down_is_told_and_served_again() {
    let Some(cable) = Cable::plug() else { return };
    let mut serving = serve(&cable, Robots::ONE, &[]);
    let mut socket = main_device(&cable);
    assert_eq!(count_robots(&mut socket), Some(1));
    cable.set_up(End::Robots, false);
    serving.wait_for("Network is down", LONG);
    cable.set_up(End::Robots, true);
    assert!(await_robots(&mut socket, Some(1)));
    serving.wait_for("ecat0 carries frames again", LONG);
    end(serving);
}

#[test]
fn an_interface_that_is_removed_ends_it_with_the_links_exit_code() {
    let Some(cable) = Cable::plug() else { return };
    let serving = serve(&cable, Robots::ONE, &[]);
    cable.cut();
    let (status, said) = serving.end(LONG);
    assert_eq!(status.code(), Some(4), "{said}");
    assert!(said.contains("No such device"), "{said}");
}

#[test]
fn a_power_cut_takes_the_robots_off_the_bus_until_they_have_booted() {
    let Some(cable) = Cable::plug() else { return };
    let serving = serve(&cable, Robots { count: 2, ..Robots::ONE }, &["--power-cycle-after", "1"]);
    let mut socket = main_device(&cable);
    assert_eq!(count_robots(&mut socket), Some(2));
    assert!(await_robots(&mut socket, None), "no power, no answer");
    assert!(await_robots(&mut socket, Some(2)), "they boot in five seconds");
    let said = end(serving);
    for line in [
        "power cut",
        "position 1: has left the bus",
        "power back",
        "position 1: is back on the bus",
    ] {
        assert!(said.contains(line), "{line}: {said}");
    }
}

#[test]
fn faults_of_the_wire_are_made_and_counted() {
    let Some(cable) = Cable::plug() else { return };
    let faults = ["--fault", "drop:300:7,delay:200"];
    let serving = serve(&cable, Robots::ONE, &faults);
    let mut socket = main_device(&cable);
    let answered = (0..60).filter(|_| count_robots(&mut socket).is_some()).count();
    assert!((5..55).contains(&answered), "{answered} of 60 answered");
    let said = end(serving);
    assert!(!said.contains(" 0 faults made"), "{said}");
}

#[test]
fn mistakes_are_told_with_their_remedy() {
    let Some(cable) = Cable::plug() else { return };
    let (code, said) = run(&cable, &["sim", "--ethercat", "eth7"]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("no network interface `eth7`; there are: ecat0"), "{said}");
    let (code, said) = run(&cable, &["sim", "--ethercat", "lo"]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("`lo` is not Ethernet; there are: ecat0"), "{said}");
    let (code, said) = run(&cable, &["sim", "--ethercat", INTERFACE, "--fault", "melt"]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("no fault `melt`; there are drop, duplicate,"), "{said}");
    let (code, said) = run(&cable, &["sim", "--ethercat", INTERFACE, "--fault", "drop:1001"]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("0 to 1000"), "{said}");
    let (code, said) = run(&cable, &["sim", "--ethercat", INTERFACE, "--alias", "1,2"]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("2 aliases for 1 robot:"), "{said}");
}

#[test]
fn a_missing_capability_is_named_with_the_way_to_grant_it() {
    let Some(cable) = Cable::plug() else { return };
    let mut command = cable.command(End::Robots, "setpriv");
    command.args(["--bounding-set=-net_raw", "--inh-caps=-net_raw"]);
    command.args([env!("CARGO_BIN_EXE_fieldarm"), "sim", "--ethercat", INTERFACE]);
    let (status, said) = Running::start(&mut command).end(LONG);
    assert_eq!(status.code(), Some(4), "{said}");
    assert!(said.contains("the capability CAP_NET_RAW is missing"), "{said}");
    let remedy = format!("sudo setcap cap_net_raw+ep {}", env!("CARGO_BIN_EXE_fieldarm"));
    assert!(said.contains(&remedy), "{said}");
}
