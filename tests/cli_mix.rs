//! `fieldarm sim` on several interfaces at once: every robot is one robot on all of them.
//!
//! What is about EtherCAT needs root, for network namespaces; a test that cannot run says `skipped:` and why.
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

use std::io::ErrorKind;
use std::net::{Ipv4Addr, TcpStream};
use std::time::Duration;

use cli_support::Scratch;
use fieldarm::cycle::{CyclicLink, InputQuality};
use fieldarm::link::ethercat::raw_socket::RawSocket;
use fieldarm::link::ethercat::{EthercatLink, SegmentSettings};
use fieldarm::wire::meca500::image::{InputImage, OutputImage, RobotControlFlags};
use fieldarm::wire::order::Little;
use loopback::address;
use namespaces::{Cable, End, INTERFACE, Running};
use serving::{LONG, end, ended, ended_by, serve, serve_by};
use text_line::Line;

const PROGRAM: &str = "MoveJoints(0, 0, 0, 0, 0, 0)\nMoveJoints(10, -5, 5, 0, 20, 0)\n";
const HOME: &str = "127.0.0.1";

fn run(program: &str, link: &str) -> (Option<i32>, String) {
    ended(&["run", program, "--link", link])
}

#[test]
fn several_robots_have_all_faces_each_at_an_address_of_its_own() {
    let first = address();
    let [second, third] =
        [1, 2].map(|number| Ipv4Addr::from_bits(first.to_bits() + number).to_string());
    let first = first.to_string();
    let mut serving = serve(&["--tcp", &first, "--enip", &first, "--robots", "3"]);
    let whereabouts = format!(
        "serving 3 virtual Meca500 on EtherNet/IP at {first} to {third} (TCP and UDP 44818, UDP 2222): byte order \
         little, frames every 10 ms or less often; and on TCP at {first}:10000 to {third}:10000 for control and \
         {first}:10001 to {third}:10001 for monitoring; Ctrl-C ends it"
    );
    assert!(serving.said().contains(&whereabouts), "{}", serving.said());
    let scratch = Scratch::new("mix_several");
    let program = scratch.write("short.txt", "ActivateSim()\nDeactivateSim()\n");
    // Each is a robot of its own: who controls one keeps nobody from the others.
    let mut controls = [&first, &second].map(|address| Line::controlling(address));
    controls[1].ask("ActivateRobot", "[2000]");
    controls[0].ask("GetStatusRobot", "[2007][0,");
    let mut monitor = Line::open(&second, 10_001);
    monitor.expect("[2007][1,");
    let link = |address: &str| format!("enip:{address}?multiplier=64");
    let (code, said) = run(&program, &link(&second));
    assert_eq!(code, Some(4), "{said}");
    assert!(said.contains("0x0106"), "{said}");
    let (code, said) = run(&program, &link(&third));
    assert_eq!(code, Some(0), "{said}");
    // What is set on one face counts on the others, and for this robot alone.
    controls[1].ask("EnableEtherNetIp(0)", "[2085]");
    serving.wait_for("robot 2: EtherNet/IP: nobody is answered from now on", LONG);
    let (code, _) = ended(&["probe", &format!("enip:{second}")]);
    assert_eq!(code, Some(4));
    let (code, said) = ended(&["probe", &format!("enip:{first}")]);
    assert_eq!(code, Some(0), "{said}");
    drop(controls);
    serving.wait_for("robot 2: control connection", LONG);
    drop(Line::controlling(&second));
    let said = end(serving);
    assert!(said.contains("robot 1: control connection of 127.0.0.1"), "{said}");
    assert!(said.contains("TCP: 4 connections"), "{said}");
}

#[test]
fn the_mode_needs_a_face_that_is_served_in_it() {
    for (arguments, words) in [
        (&["--ethercat", "no-such-name", "--mode", "tcp"][..], "give --tcp ADDR or --enip ADDR"),
        (&["--tcp", HOME, "--mode", "ethercat"], "--ethercat <IFACE>"),
        (&["--ethercat", "no-such-name", "--tcp", HOME], "no network interface `no-such-name`"),
    ] {
        let (code, said) = ended(&[&["sim"], arguments].concat());
        assert_eq!(code, Some(2), "{said}");
        assert!(said.contains(words), "{words}: {said}");
    }
}

/// Robots on a cable and at the loopback addresses of its robots' end.
struct Plugged {
    cable: Cable,
    serving: Running,
}

impl Plugged {
    fn serve(arguments: &[&str]) -> Option<Self> {
        let cable = Cable::plug()?;
        cable.set_interface_up(End::Robots, "lo", true);
        let arguments = [&["sim", "--ethercat", INTERFACE], arguments].concat();
        let serving = serve_by(&mut cable.fieldarm(End::Robots, &arguments));
        Some(Self { cable, serving })
    }

    fn controlling(&self, address: &'static str) -> Line {
        self.cable.inside(End::Robots, LONG, move || Line::controlling(address))
    }

    /// Whether somebody listens at this port of the robots' end.
    fn is_open(&self, port: u16) -> bool {
        let connected =
            self.cable.inside(End::Robots, LONG, move || TcpStream::connect((HOME, port)));
        match connected {
            Ok(_) => true,
            Err(error) => {
                assert_eq!(error.kind(), ErrorKind::ConnectionRefused);
                false
            }
        }
    }

    fn run(&self, program: &str) -> (Option<i32>, String) {
        let link = format!("ethercat:{INTERFACE}");
        ended_by(&mut self.cable.fieldarm(End::Main, &["run", program, "--link", &link]))
    }

    /// Sets DisableEtherCAT in the outputs of the only robot, until it is gone.
    fn disable_ethercat(&self) {
        self.cable.inside(End::Main, LONG, || {
            let socket = RawSocket::open(INTERFACE).expect("root opens it");
            let clock = socket.clock();
            let cycle = Duration::from_millis(5);
            let settings = SegmentSettings {
                reply_limit: Duration::from_millis(50),
                ..SegmentSettings::with_cycle(cycle)
            };
            let mut link = match EthercatLink::start(socket, settings) {
                Ok(link) => link,
                Err(failure) => panic!("{}", failure.error),
            };
            let mut outputs = OutputImage::<Little>::zeroed();
            outputs.robot_control.flags.assign(RobotControlFlags::DISABLE_ETHERCAT, true);
            let mut inputs = InputImage::<Little>::zeroed().as_bytes().to_vec();
            let is_gone = (0..1_000).any(|_| {
                let at = clock.now() + cycle;
                clock.sleep_until(at);
                let quality = link.exchange(at, outputs.as_bytes(), &mut inputs);
                quality.expect("the interface is there") == InputQuality::Lost
            });
            assert!(is_gone, "it stays on the bus");
        });
    }
}

#[test]
fn a_robot_goes_from_tcp_to_ethercat_and_back() {
    let Some(mut robot) = Plugged::serve(&["--tcp", HOME, "--enip", HOME]) else { return };
    assert!(robot.serving.said().contains("in TCP/IP mode at first"), "{}", robot.serving.said());
    let scratch = Scratch::new("mix_back_and_forth");
    let program = scratch.write("square.txt", PROGRAM);
    let (code, said) = robot.run(&program);
    assert_eq!(code, Some(4), "it is not in the line yet: {said}");
    let mut control = robot.controlling(HOME);
    control.ask("SetMonitoringInterval(0.5)", "[");
    control.ask("ActivateRobot", "[2000]");
    control.ask("Home", "[2002]");
    control.ask("MoveJoints(0, 10, 0, 0, 0, 0)", "[3012]");
    assert!(robot.is_open(44_818));
    control.ask("SwitchToEtherCat", "[2085]");
    control.expect_end();
    for words in [
        "closes its TCP ports: it is in EtherCAT mode now\n",
        "EtherNet/IP: has left the bus; its connections are gone",
        "position 0: is on the bus",
    ] {
        robot.serving.wait_for(words, LONG);
    }
    for port in [10_000, 10_001, 44_818] {
        assert!(!robot.is_open(port), "{port}");
    }
    let (code, said) = robot.run(&program);
    assert_eq!(code, Some(0), "{said}");
    robot.serving.wait_for("position 0: SAFE-OP -> OP", LONG);
    assert!(!robot.is_open(10_000), "a segment that ends leaves the mode as it is");

    robot.disable_ethercat();
    for words in
        ["opens its TCP ports", "EtherNet/IP: is back on the bus", "position 0: has left the bus"]
    {
        robot.serving.wait_for(words, LONG);
    }
    let mut control = robot.controlling(HOME);
    // It is the same robot, where the program over EtherCAT left it.
    control.ask("GetStatusRobot", "[2007][1,1,");
    control.ask("GetJoints", "[2026][10.0000,-5.0000,5.0000,");
    assert!(robot.is_open(44_818));
    end(robot.serving);
}

#[test]
fn robots_may_boot_in_ethercat_mode_with_their_other_ports_closed() {
    let arguments =
        ["--tcp", HOME, "--enip", HOME, "--mode", "ethercat", "--power-cycle-after", "4"];
    let Some(mut robot) = Plugged::serve(&arguments) else { return };
    assert!(!robot.is_open(10_000));
    let scratch = Scratch::new("mix_boots");
    let program = scratch.write("square.txt", "ActivateSim()\nDeactivateSim()\n");
    // The mode is kept over a boot.
    robot.serving.wait_for("position 0: is back on the bus", LONG);
    assert!(!robot.is_open(10_000) && !robot.is_open(44_818));
    let (code, said) = robot.run(&program);
    assert_eq!(code, Some(0), "{said}");
    robot.disable_ethercat();
    robot.serving.wait_for("opens its TCP ports", LONG);
    drop(robot.controlling(HOME));
    end(robot.serving);
}

#[test]
fn a_robot_in_tcp_mode_ends_the_line_for_those_behind_it() {
    let Some(mut robots) = Plugged::serve(&["--tcp", HOME, "--robots", "2"]) else { return };
    let scratch = Scratch::new("mix_two");
    let program = scratch.write("short.txt", "ActivateSim()\nDeactivateSim()\n");
    robots.controlling("127.0.0.2").ask("SwitchToEtherCat", "[2085]");
    robots.serving.wait_for("position 1: is on the bus", LONG);
    let (code, said) = robots.run(&program);
    assert_eq!(code, Some(4), "the first one is before it: {said}");
    assert!(robots.is_open(10_000));
    robots.controlling(HOME).ask("SwitchToEtherCat", "[2085]");
    robots.serving.wait_for("position 0: is on the bus", LONG);
    let link = format!("ethercat:{INTERFACE}");
    let arguments = ["run", &program, "--robots", "2", "--link", &link];
    let (code, said) = ended_by(&mut robots.cable.fieldarm(End::Main, &arguments));
    assert_eq!(code, Some(0), "{said}");
    end(robots.serving);
}
