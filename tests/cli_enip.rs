//! `fieldarm` on EtherNet/IP as a person uses it: `sim --enip` in one process, `run` and `probe` in others.
//!
//! Every test serves at loopback addresses of its own, so that all can run at once, and nothing needs root.
#![cfg(all(target_os = "linux", feature = "cli"))]

mod cli_support;
#[path = "support/namespaces.rs"]
mod namespaces;
#[path = "support/serving.rs"]
mod serving;

use std::io::Write as _;
use std::net::TcpListener;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use cli_support::{Ended, Scratch, fieldarm, run};
use namespaces::Running;
use serde_json::Value;
use serving::{LONG, end, ended};

/// A program that needs neither activation nor homing, so it ends soon.
const SHORT: &str = "ActivateSim()\nDeactivateSim()\n";

/// Tests that keep to real time, or a core busy, take turns: cores are few.
static TURN: Mutex<()> = Mutex::new(());

fn turn() -> MutexGuard<'static, ()> {
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The beginning of four addresses that no other test has, at this moment or in this process.
fn address() -> String {
    static ADDRESSES: AtomicU32 = AtomicU32::new(0);
    let process = std::process::id();
    let last = 4 * ADDRESSES.fetch_add(1, Ordering::Relaxed) + 1;
    assert!(last < 250, "more tests than addresses");
    format!("127.{}.{}.{last}", 64 + process / 256 % 128, process % 256)
}

/// The address `more` behind `first`.
fn behind(first: &str, more: u8) -> String {
    let (network, last) = first.rsplit_once('.').expect("an address");
    format!("{network}.{}", last.parse::<u8>().expect("a number") + more)
}

fn serve(address: &str, more: &[&str]) -> Running {
    serving::serve(&[&["--enip", address], more].concat())
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

fn report(directory: &str) -> Value {
    let path = format!("{directory}/report.json");
    json(&std::fs::read_to_string(path).expect("a report was written"))
}

#[test]
fn a_program_runs_through_sockets_to_its_end() {
    let _turn = turn();
    let address = address();
    let serving = serve(&address, &[]);
    let scratch = Scratch::new("enip_square");
    let directory = scratch.path("report");
    let link = format!("enip:{address}?multiplier=64");
    let (code, said) =
        ended(&["run", "programs/square.txt", "--link", &link, "--report", &directory]);
    assert_eq!(code, Some(0), "{said}");
    for line in [
        "opening 1 connection\n",
        "byte order found: little\n",
        "  commands         15 of 15 done, 15 accepted\n",
        "  connection       frames every 10 ms; configuration assembly 151, inputs to us alone\n",
    ] {
        assert!(said.contains(line), "{line}{said}");
    }
    let report = report(&directory);
    assert_eq!(report["settings"]["link"], link);
    assert_eq!(report["settings"]["cycle_us"], 10_000, "what the robot granted");
    assert!(report["bus"].is_null(), "that is EtherCAT's");
    let enip = &report["enip"];
    assert_eq!(enip["address"], format!("{address}:44818"));
    assert_eq!((&enip["product"], &enip["revision"]), (&"Meca500".into(), &"11.3".into()));
    assert_eq!(enip["serial"], 87_654_321);
    assert_eq!((&enip["o2t_api_us"], &enip["t2o_api_us"]), (&1e4.into(), &1e4.into()));
    assert_eq!(enip["config_assembly"], 151);
    assert!(enip["multicast"].is_null());
    let counters = &enip["counters"];
    assert_eq!((&counters["opened"], &counters["timed_out"]), (&1.into(), &0.into()));
    let cycles = report["cycles"]["count"].as_u64().expect("a count");
    // A connection that opens and closes lives a little longer than the cycles; late cycles leave some out.
    let produced = counters["produced"].as_u64().expect("a count");
    assert!(produced > cycles / 2 && produced < cycles * 2 + 100, "{produced} in {cycles} cycles");
    assert!(counters["consumed"].as_u64() > Some(cycles / 2), "{counters}");
    assert!(enip["t2o_gap_us"]["count"].as_u64() > Some(cycles / 2), "{enip}");
    assert_eq!(report["final_outputs"], "00".repeat(60));

    let said = end(serving);
    for line in [
        format!(
            "serving 1 virtual Meca500 on EtherNet/IP at {address} (TCP and UDP 44818, UDP 2222)"
        ),
        "owner connection of 127.0.0.1 opened, frames every 10 ms\n".into(),
        "its owner runs\n".into(),
        "its owner idles".into(),
        "owner connection of 127.0.0.1 closed\n".into(),
        "datagrams received".into(),
    ] {
        assert!(said.contains(&line), "{line}{said}");
    }
    assert!(!said.contains("timed out") && !said.contains("refused"), "{said}");
}

#[test]
fn robots_at_addresses_in_a_row_share_one_run() {
    let _turn = turn();
    let first = address();
    let serving = serve(&first, &["--robots", "2", "--byte-order", "big"]);
    let scratch = Scratch::new("enip_two");
    let program = scratch.write("short.txt", SHORT);
    let directory = scratch.path("report");
    let second = behind(&first, 1);
    let last = second.rsplit('.').next().expect("a number");
    let links = [
        format!("enip:{first},{second}"),
        format!("enip:{first}-{last}?t2o=multicast&config=none&multiplier=64"),
    ];
    for link in &links {
        let (code, said) = ended(&["run", &program, "--link", link, "--report", &directory]);
        assert_eq!(code, Some(0), "{link}: {said}");
        assert!(said.contains(&format!("2 robots over {link}\n")), "{said}");
        assert!(said.contains("robot 2: byte order found: big\n"), "{said}");
    }
    for (robot, address) in [(1, &first), (2, &second)] {
        let report = report(&format!("{directory}/robot-{robot}"));
        let enip = &report["enip"];
        assert_eq!(enip["address"], format!("{address}:44818"));
        assert_eq!(enip["serial"], 87_654_320 + robot);
        assert!(enip["config_assembly"].is_null());
        let group = enip["multicast"].as_str().expect("a group");
        assert!(group.starts_with("239.192."), "{group}");
    }
    let said = end(serving);
    assert!(said.contains(&format!("at {first} to {second} (")), "{said}");
    assert!(said.contains("robot 2: owner connection of 127.0.0.1 opened"), "{said}");
    assert!(said.contains("inputs to a group\n"), "{said}");
}

#[test]
fn what_the_robot_grants_is_the_period_and_is_told() {
    let _turn = turn();
    let address = address();
    let _serving = serve(&address, &[]);
    let scratch = Scratch::new("enip_granted");
    let program = scratch.write("short.txt", SHORT);
    let directory = scratch.path("report");
    let link = format!("enip:{address}?rpi_ms=20.4&multiplier=32");
    let (code, said) = ended(&["run", &program, "--link", &link, "--report", &directory]);
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("asked for frames every 20.4 ms, granted every 21 ms\n"), "{said}");
    let report = report(&directory);
    assert_eq!(report["settings"]["cycle_us"], 21_000);
    assert_eq!(report["enip"]["rpi_us"], 20_400.0);
    assert_eq!(report["enip"]["t2o_api_us"], 21_000.0);
}

#[test]
fn a_second_owner_is_refused_with_the_remedy_while_others_may_watch() {
    let _turn = turn();
    let address = address();
    let serving = serve(&address, &[]);
    let scratch = Scratch::new("enip_second");
    let long = scratch.write("long.txt", "SetCheckpoint(1)\nDelay(3600)\n");
    let link = format!("enip:{address}?multiplier=128");
    let mut first = Running::start(&mut fieldarm(&["run", &long, "--link", &link]));
    first.wait_for("checkpoint 1 reached", LONG);

    let (code, said) = ended(&["run", "programs/square.txt", "--link", &link]);
    assert_eq!(code, Some(4), "{said}");
    assert!(
        said.contains("0x0106: somebody else controls the robot; close the connection"),
        "{said}"
    );

    let name = format!("enip:{address}?multiplier=128");
    let watched = run(&["probe", &name, "--cycles", "100", "--json"]);
    assert_eq!(watched.code, Some(0), "{watched:?}");
    let watched = json(&watched.stdout);
    assert_eq!(watched["devices"][0]["owned"], true);
    assert_eq!(watched["robot"]["owned"], true);
    assert_eq!(watched["robot"]["state"]["monitoring_mode"], true, "it only watches");
    assert_eq!(watched["robot"]["state"]["activated"], true, "it sees what the owner does");

    let (status, said) = first.interrupt(LONG);
    assert_eq!(status.code(), Some(130), "the owner was not disturbed: {said}");
    assert!(said.contains("Motion was paused and cleared, both confirmed by the robot"), "{said}");
    let said = end(serving);
    assert!(
        said.contains("refused a connection of 127.0.0.1: 0x01: connection failure, 0x0106"),
        "{said}"
    );
    assert_eq!(said.matches("owner connection of 127.0.0.1 opened").count(), 1, "{said}");
    assert!(said.contains("input-only connection of 127.0.0.1 opened"), "{said}");
}

#[test]
fn a_robot_that_goes_away_ends_the_run() {
    let _turn = turn();
    let address = address();
    let serving = serve(&address, &[]);
    let scratch = Scratch::new("enip_gone");
    let long = scratch.write("long.txt", "SetCheckpoint(1)\nDelay(3600)\n");
    let link = format!("enip:{address}");
    let mut running = Running::start(&mut fieldarm(&["run", &long, "--link", &link]));
    running.wait_for("checkpoint 1 reached", LONG);
    end(serving);
    let (status, said) = running.end(LONG);
    assert_eq!(status.code(), Some(4), "{said}");
    assert!(said.contains("connection lost after"), "{said}");
}

#[test]
fn silence_that_the_watchdog_allows_does_not_end_the_run() {
    let _turn = turn();
    let address = address();
    let serving = serve(&address, &[]);
    let scratch = Scratch::new("enip_silent");
    let program = scratch.write("pause.txt", "SetCheckpoint(1)\nDelay(3)\nSetCheckpoint(2)\n");
    // A watchdog of five seconds.
    let link = format!("enip:{address}?multiplier=512");
    let mut running = Running::start(&mut fieldarm(&["run", &program, "--link", &link]));
    running.wait_for("checkpoint 1 reached", LONG);
    thread::sleep(Duration::from_millis(300));
    serving.signal("-STOP");
    thread::sleep(Duration::from_millis(800));
    serving.signal("-CONT");
    let (status, said) = running.end(LONG);
    assert_eq!(status.code(), Some(0), "{said}");
    assert!(!end(serving).contains("timed out"), "{said}");
}

#[test]
fn a_probe_tells_what_a_robot_accepts_and_sends() {
    let _turn = turn();
    let address = address();
    let serving = serve(&address, &["--layout", "10.2"]);
    let name = format!("enip:{address}?multiplier=64");
    let ended = run(&["probe", &name, "--cycles", "100"]);
    assert_eq!(ended.code, Some(0), "{ended:?}");
    let device = format!("{address}:44818  Meca500    1565    43      500  10.2      87654321");
    for line in [
        &format!("{name}: 1 device, 1 of them Meca500\n"),
        &*device,
        "robot: usable\n",
        "  connections      input-only, configuration assembly 151, unicast: accepted, frames every 10 ms\n",
        "  input-only, no configuration assembly, unicast: accepted, frames every 10 ms\n",
        "  input-only, configuration assembly 151, multicast: accepted, frames every 10 ms, to the group 239.192.",
        "  listen-only, configuration assembly 151, multicast: the target refuses the connection: 0x0119",
        "  owner            nobody controls it over EtherNet/IP\n",
        "  byte order       little\n",
        "  FifoSpace C8 32 reads 13000 little-endian, 51250 big-endian: little\n",
        "  state            not activated, not homed, brakes engaged\n",
        "  control          not tried: this connection only watches\n",
        "  queue            FifoSpace 13000, MoveID 0\n",
        " missed, ",
        " ms, granted 10 ms\n",
    ] {
        assert!(ended.stdout.contains(line), "{line}\n{}", ended.stdout);
    }
    let said = end(serving);
    assert!(!said.contains("owner connection of"), "nobody controlled it: {said}");
}

#[test]
fn each_byte_order_is_found_with_its_evidence() {
    let _turn = turn();
    for order in ["big", "little-int-big-real"] {
        let address = address();
        let _serving = serve(&address, &["--byte-order", order]);
        let name = format!("enip:{address}?config=none&multiplier=64");
        let ended = run(&["probe", &name, "--cycles", "100", "--json"]);
        assert_eq!(ended.code, Some(0), "{ended:?}");
        assert_eq!(ended.stderr, "");
        let report = json(&ended.stdout);
        assert_eq!(report["schema"], "fieldarm.probe.enip");
        assert_eq!(report["exit_code"], 0);
        let robot = &report["robot"];
        assert_eq!(robot["byte_order"]["verdict"], order);
        let pieces = robot["byte_order"]["evidence"].as_array().expect("evidence");
        assert_eq!(pieces[0]["speaks_for"], robot["byte_order"]["integers"]);
        assert!(robot["byte_order"]["echo"].is_null(), "nothing was asked: that takes outputs");
        let connections = robot["connections"].as_array().expect("connections");
        assert_eq!(connections.len(), 3, "with one path only: {connections:?}");
        assert!(connections.iter().all(|tried| tried["config_assembly"].is_null()));
        let accepted: Vec<_> = connections.iter().map(|tried| &tried["accepted"]).collect();
        assert_eq!(accepted, [true, true, false]);
        assert_eq!(robot["frames"]["connection"], 1);
        assert_eq!(robot["frames"]["api_us"], 10_000.0);
        assert!(robot["frames"]["counters"]["consumed"].as_u64() > Some(50), "{}", robot["frames"]);
    }
}

#[test]
fn a_broadcast_finds_everybody() {
    let _turn = turn();
    let first = address();
    let _serving = serve(&first, &["--robots", "2"]);
    let ended = run(&["probe", "enip:broadcast?bind=127.0.0.1", "--json"]);
    assert_eq!(ended.code, Some(0), "{ended:?}");
    let report = json(&ended.stdout);
    assert!(report["robot"].is_null(), "nobody is looked at more closely");
    for (address, serial) in [(first.clone(), 87_654_321), (behind(&first, 1), 87_654_322)] {
        let devices = report["devices"].as_array().expect("devices");
        let address = format!("{address}:44818");
        let device = devices.iter().find(|device| device["address"] == address);
        let device = device.unwrap_or_else(|| panic!("no {address}: {report}"));
        assert_eq!(device["serial"], serial);
        assert_eq!(device["told_address"], address);
        assert_eq!((&device["name"], &device["is_meca500"]), (&"Meca500".into(), &true.into()));
    }
}

#[test]
fn robots_that_may_only_be_watched_are_not_controlled() {
    let _turn = turn();
    let address = address();
    let _serving = serve(&address, &["--monitoring-only"]);
    let name = format!("enip:{address}?multiplier=64");
    let (code, said) = ended(&["run", "programs/square.txt", "--link", &name]);
    assert_eq!(code, Some(4), "{said}");
    assert!(said.contains("0x0106"), "{said}");
    let ended = run(&["probe", &name, "--cycles", "100"]);
    assert_eq!(ended.code, Some(0), "{ended:?}");
}

#[test]
fn refusals_name_their_reason_and_end_in_time() {
    let _turn = turn();
    let address = address();
    let _serving = serve(&address, &[]);
    let cases = [
        ("rpi_ms=2", "0x0111: the target does not support this interval; ask for a longer one"),
        ("config=77", "0x0129: the path names a configuration assembly that is not there"),
    ];
    for (options, reason) in cases {
        let link = format!("enip:{address}?{options}");
        let (code, said) = ended(&["run", "programs/square.txt", "--link", &link]);
        assert_eq!(code, Some(4), "{said}");
        assert!(said.contains(&format!("--link {link}: ")) && said.contains(reason), "{said}");
    }
    // Nobody listens at the next address.
    let link = format!("enip:{}", behind(&address, 1));
    let (code, said) = ended(&["run", "programs/square.txt", "--link", &link]);
    assert_eq!(code, Some(4), "{said}");
    assert!(said.contains("no TCP connection to the target: check its address"), "{said}");
    let (code, said) = ended(&["probe", &link]);
    assert_eq!(code, Some(4), "{said}");
    assert!(said.contains("check that the device is switched on"), "{said}");
}

/// What listens at the port of EtherNet/IP and is none: it answers each connection with `answer`, then says
/// nothing more.
fn impostor(address: &str, answer: &'static [u8]) {
    let listener = TcpListener::bind((address, 44818)).expect("an address of this test");
    thread::spawn(move || {
        let mut streams = Vec::new();
        for stream in listener.incoming() {
            let mut stream = stream.expect("a connection");
            // Who hung up does not want it.
            let _ = stream.write_all(answer);
            streams.push(stream);
        }
    });
}

#[test]
fn what_is_no_ethernet_ip_device_is_told_apart_from_a_robot() {
    let _turn = turn();
    let address = address();
    impostor(&address, b"");
    let babbler = behind(&address, 1);
    impostor(&babbler, b"HTTP/1.1 400 Bad Request\r\nContent-Length: 0\r\n\r\n");
    let remedy = "check that what listens there is an EtherNet/IP device";
    for (address, reason) in
        [(&address, "does not answer RegisterSession"), (&babbler, "cannot be read")]
    {
        let link = format!("enip:{address}");
        let (code, said) = ended(&["run", "programs/square.txt", "--link", &link]);
        assert_eq!(code, Some(4), "{said}");
        assert!(said.contains(reason) && said.contains(remedy), "{said}");
    }
    // Whoever does not want to wait for a silent device need not, and is not told that the link failed.
    let link = format!("enip:{address}");
    for arguments in [&["probe", &*link][..], &["run", "programs/square.txt", "--link", &link]] {
        let waiting = Running::start(&mut fieldarm(arguments));
        thread::sleep(Duration::from_secs(1));
        let (status, said) = waiting.interrupt(LONG);
        assert_eq!(status.code(), Some(130), "{arguments:?}: {said}");
    }
}

#[test]
fn addresses_that_cannot_be_served_are_told_with_the_reason() {
    let address = address();
    let serving = serve(&address, &[]);
    let (code, said) = ended(&["sim", "--enip", &address]);
    assert_eq!(code, Some(4), "{said}");
    let expected = format!("--enip: cannot listen at {address}:44818 (TCP, for sessions)");
    assert!(said.contains(&expected) && said.contains("holds the port"), "{said}");
    end(serving);
    // An address for documentation: no machine has it.
    let (code, said) = ended(&["sim", "--enip", "192.0.2.1"]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("the address is not of this machine"), "{said}");
    let (code, said) = ended(&["sim", "--enip", "255.255.255.250", "--robots", "9"]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("behind it there are no 9 addresses"), "{said}");
}

#[test]
fn who_asks_sim_to_stop_is_answered_with_0_and_the_figures() {
    let address = address();
    for signal in ["-INT", "-TERM", "-HUP"] {
        let serving = serve(&address, &[]);
        serving.signal(signal);
        let (status, said) = serving.end(LONG);
        assert_eq!(status.code(), Some(0), "{signal}: {said}");
        assert!(said.contains("0 datagrams received, 0 sent, 0 not sent\n"), "{signal}: {said}");
    }
}

#[test]
fn power_that_is_cut_takes_a_robot_off_the_network_until_it_has_booted() {
    let address = address();
    let mut serving = serve(&address, &["--power-cycle-after", "1"]);
    serving.wait_for("has left the bus; its connections are gone", LONG);
    serving.wait_for("is back on the bus", LONG);
    let listed = run(&["probe", "enip:broadcast?bind=127.0.0.1"]);
    assert!(listed.stdout.contains(&format!("{address}:44818")), "{listed:?}");
    end(serving);
}

#[test]
fn the_whole_stack_runs_in_memory_in_simulated_time() {
    let _turn = turn();
    let scratch = Scratch::new("enip_sim");
    let directory = scratch.path("report");
    let link = "enip-sim?rpi_ms=2&t2o=multicast";
    let arguments = ["run", "programs/square.txt", "--link", link, "--fast", "--robots", "3"];
    let ended = run(&[&arguments[..], &["--report", &directory]].concat());
    assert_eq!(ended.code, Some(0), "{ended:?}");
    for robot in 1..=3 {
        let report = report(&format!("{directory}/robot-{robot}"));
        assert_eq!(report["settings"]["cycle_us"], 2_000);
        assert_eq!(report["settings"]["pace"], "simulated");
        assert_eq!(report["settings"]["byte_order_used"], "little");
        assert_eq!(report["commands"]["done"], 15);
        let enip = &report["enip"];
        assert_eq!(enip["address"], format!("192.168.0.{}:44818", 100 + robot));
        assert_eq!((&enip["o2t_api_us"], &enip["t2o_api_us"]), (&2e3.into(), &2e3.into()));
        let counters = &enip["counters"];
        assert_eq!((&counters["missed"], &counters["out_of_order"]), (&0.into(), &0.into()));
        let cycles = report["cycles"]["count"].as_u64().expect("a count");
        let produced = counters["produced"].as_u64().expect("a count");
        assert!((cycles..cycles + 50).contains(&produced), "one a cycle: {produced} in {cycles}");
    }
}

#[test]
fn more_robots_than_fit_on_an_ethercat_segment_share_one_run() {
    let _turn = turn();
    let scratch = Scratch::new("enip_many");
    let program = scratch.write("short.txt", SHORT);
    let ended = run(&["run", &program, "--link", "enip-sim", "--fast", "--robots", "17"]);
    assert_eq!(ended.code, Some(0), "{ended:?}");
    assert!(ended.stdout.contains("17 robots over enip-sim"), "{ended:?}");
}

/// What is said to arguments that are refused before anything is opened.
fn mistake(arguments: &[&str]) -> String {
    let Ended { code, stdout, stderr } = run(arguments);
    assert_eq!((code, &*stdout), (Some(2), ""), "{arguments:?}: {stderr}");
    stderr
}

#[test]
fn mistakes_are_told_with_their_remedy() {
    let run = |more: &[&str]| mistake(&[&["run", "programs/square.txt", "--link"], more].concat());
    let cases: [(&[&str], &str); 11] = [
        (
            &["enip:127.0.0.1?rpi=10"],
            "`rpi` is no option of this link; there are rpi_ms, multiplier",
        ),
        (&["enip:127.0.0.1?multiplier=5"], "multiplier=`5`: 4, 8, 16, 32, 64, 128, 256 or 512"),
        (&["enip:127.0.0.300"], "is neither an IPv4 address nor the name of a host"),
        (&["enip:127.0.0.1?bind=192.0.2.1"], "bind to an address that this machine has"),
        (&["enip:127.0.0.1-3", "--robots", "2"], "names 3 robots, --robots 2 wants another number"),
        (&["enip:127.0.0.1", "--cycle-us", "1000"], "the robot decides the period of the run"),
        (&["enip-sim", "--cycle-us", "1000"], "ask for one with ?rpi_ms= behind --link"),
        (&["enip:127.0.0.1", "--fast"], "leave --fast away, or use --link enip-sim"),
        (&["enip:127.0.0.1", "--clocks"], "--clocks is about EtherCAT"),
        (
            &["enip:127.0.0.1-2?bind=192.0.2.1", "--robots", "2"],
            "cannot open a UDP port at 192.0.2.1",
        ),
        (&["enip-sim", "--robots", "65"], "65 is not in 1..=64"),
    ];
    for (arguments, message) in cases {
        let said = run(arguments);
        assert!(said.contains(message), "{arguments:?}: {said}");
    }
    let cases: [(&[&str], &str); 9] = [
        (&["sim"], "<--ethercat <IFACE>|--enip <ADDR>|--tcp <ADDR>>"),
        (&["sim", "--enip", "127.0.0.1", "--ethercat", "lo"], "`lo` is not Ethernet"),
        (&["sim", "--enip", "eth0"], "an IPv4 address of this machine"),
        (&["sim", "--enip", "127.0.0.1", "--alias", "1"], "--ethercat <IFACE>"),
        (&["sim", "--ethercat", "eth0", "--monitoring-only"], "--enip <ADDR>"),
        (&["sim", "--enip", "127.0.0.1", "--min-rpi-ms", "0"], "an interval in ms, 0.1 to 1000"),
        (
            &["probe", "enip-sim"],
            "start `fieldarm sim --enip 127.0.0.1`, then probe enip:127.0.0.1",
        ),
        (&["probe", "enip:127.0.0.1", "--clocks"], "--clocks is about EtherCAT"),
        (&["probe", "enip:127.0.0.1,127.0.0.2"], "probe looks at one robot at a time"),
    ];
    for (arguments, message) in cases {
        let said = mistake(arguments);
        assert!(said.contains(message), "{arguments:?}: {said}");
    }
}
