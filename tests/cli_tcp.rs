//! `fieldarm sim --tcp` as a person uses it: the two ports, alone and with EtherNet/IP on the same robot.
//!
//! Every test serves at a loopback address of its own, so that all can run at once, and nothing needs root.
#![cfg(all(target_os = "linux", feature = "cli"))]

mod cli_support;
#[path = "support/loopback.rs"]
mod loopback;
#[path = "support/namespaces.rs"]
mod namespaces;
#[path = "support/serving.rs"]
mod serving;
#[path = "support/text_line.rs"]
mod text_line;

use std::net::TcpListener;

use cli_support::{Scratch, fieldarm};
use loopback::address;
use namespaces::Running;
use serving::{LONG, end, ended, serve};
use text_line::Line;

const OWNERSHIP_CONFLICT: &str = "0x0106";

#[test]
fn one_robot_at_its_two_ports() {
    let address = address().to_string();
    let mut serving = serve(&["--tcp", &address, "--revision", "r4"]);
    let whereabouts =
        format!("TCP at {address}:10000 for control and {address}:10001 for monitoring");
    assert!(serving.said().contains(&whereabouts), "{}", serving.said());
    let mut control = Line::open(&address, 10_000);
    control.expect("[3000][Connected to Meca500 R4 v11.3.84]");
    let mut monitor = Line::open(&address, 10_001);
    monitor.expect("[2007][0,0,0,0,0,1,1]");
    control.ask("ActivateRobot", "[2000]");
    monitor.expect("[2007][1,0,0,");
    let mut second = Line::open(&address, 10_000);
    second.expect("[3001]");
    second.expect_end();
    drop(control);
    serving.wait_for(" closed\n", LONG);
    drop(Line::controlling(&address));
    let said = end(serving);
    for words in [
        "monitoring connection of 127.0.0.1",
        "refused the control connection",
        "TCP: 4 connections",
    ] {
        assert!(said.contains(words), "{words}: {said}");
    }
}

#[test]
fn ports_can_be_chosen() {
    let [first, second] = [address(), address()].map(|address| address.to_string());
    let (tcp, monitor) = (format!("{first}:12000"), format!("{second}:12001"));
    let serving = serve(&["--tcp", &tcp, "--monitor", &monitor]);
    Line::open(&first, 12_000).expect("[3000]");
    Line::open(&second, 12_001).expect("[2007]");
    end(serving);
}

#[test]
fn a_power_cycle_closes_the_ports_for_a_while() {
    let address = address().to_string();
    let mut serving = serve(&["--tcp", &address, "--power-cycle-after", "1"]);
    let mut control = Line::controlling(&address);
    control.expect_end();
    serving.wait_for("opens its TCP ports", LONG);
    drop(Line::controlling(&address));
    let said = end(serving);
    assert!(said.contains("closed: the robot closed its ports"), "{said}");
    assert!(said.contains("closes its TCP ports\n"), "{said}");
}

#[test]
fn one_controller_at_a_time_over_both_protocols() {
    let address = address().to_string();
    let mut serving = serve(&["--tcp", &address, "--enip", &address]);
    let scratch = Scratch::new("tcp_both");
    let program = scratch.write("short.txt", "ActivateSim()\nDeactivateSim()\n");
    let long = scratch.write("long.txt", "SetJointVel(1)\nMoveJoints(60, 0, 0, 0, 0, 0)\n");
    let link = format!("enip:{address}?multiplier=64");
    // Who controls it over TCP keeps owners away, and no monitors.
    let control = Line::controlling(&address);
    let (code, said) = ended(&["run", &program, "--link", &link]);
    assert_eq!(code, Some(4), "{said}");
    assert!(said.contains(OWNERSHIP_CONFLICT), "{said}");
    let (code, said) = ended(&["probe", &format!("enip:{address}")]);
    assert_eq!(code, Some(0), "{said}");
    drop(control);
    let (code, said) = ended(&["run", &program, "--link", &link]);
    assert_eq!(code, Some(0), "{said}");
    // An owner keeps control connections away, and no monitoring ones.
    let running = Running::start(&mut fieldarm(&["run", &long, "--link", &link]));
    serving.wait_for("its owner runs", LONG);
    let mut monitor = Line::open(&address, 10_001);
    monitor.expect("[2007][1,1,");
    let mut refused = Line::open(&address, 10_000);
    refused.expect("[3001]");
    refused.expect_end();
    let (status, said) = running.interrupt(LONG);
    assert_ne!(status.code(), Some(0), "interrupted: {said}");
    // Its connection is closed, so the robot is free.
    let mut control = Line::controlling(&address);
    control.ask("GetStatusRobot", "[2007]");
    end(serving);
}

#[test]
fn enable_ethernet_ip_acts() {
    let address = address().to_string();
    let mut serving = serve(&["--tcp", &address, "--enip", &address]);
    let probe = format!("enip:{address}");
    let mut control = Line::controlling(&address);
    control.ask("EnableEtherNetIp(0)", "[");
    serving.wait_for("EtherNet/IP: nobody is answered from now on", LONG);
    let (code, said) = ended(&["probe", &probe]);
    assert_eq!(code, Some(4), "{said}");
    control.ask("EnableEtherNetIp(2)", "[");
    serving.wait_for("EtherNet/IP: for monitoring only from now on", LONG);
    let (code, said) = ended(&["probe", &probe]);
    assert_eq!(code, Some(0), "{said}");
    control.ask("EnableEtherNetIp(1)", "[");
    serving.wait_for("EtherNet/IP: owners and monitors are let in from now on", LONG);
    control.ask("SwitchToEtherCat", "[2085]");
    control.expect_end();
    serving.wait_for("it is in EtherCAT mode now", LONG);
    let (code, said) = ended(&["probe", &probe]);
    assert_eq!(code, Some(4), "{said}");
    end(serving);
}

#[test]
fn what_cannot_be_served_names_the_place_and_the_remedy() {
    let address = address().to_string();
    let taken = TcpListener::bind(format!("{address}:10001")).expect("nobody else is here");
    for (arguments, code, words) in [
        (vec!["--tcp", "203.0.113.7"], 2, "control port cannot be opened at 203.0.113.7:10000"),
        (vec!["--tcp", &address], 4, "and the port free?"),
        (vec!["--tcp", "robot"], 2, "127.0.0.1:10000"),
        (vec!["--monitor", "127.0.0.1"], 2, "--tcp"),
        (vec!["--tcp", "127.0.0.1:7", "--monitor", "127.0.0.1:7"], 2, "give --monitor another one"),
        (vec!["--tcp", "255.255.255.255", "--robots", "2"], 2, "begin at a lower one"),
        (vec!["--tcp", &address, "--ethercat", "lo"], 2, "`lo` is not Ethernet"),
        (vec!["--tcp", &address, "--alias", "1"], 2, "--ethercat"),
        (vec!["--tcp", &address, "--monitoring-only"], 2, "--enip"),
        (vec![], 2, "--tcp"),
    ] {
        let (found, said) = ended(&[&["sim"], &arguments[..]].concat());
        assert_eq!(found, Some(code), "{arguments:?}: {said}");
        assert!(said.contains(words), "{arguments:?}: {said}");
    }
    drop(taken);
}
