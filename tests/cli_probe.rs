//! `fieldarm probe ethercat-sim`: what it finds on an emulated line, as text and as JSON.
#![cfg(all(target_os = "linux", feature = "cli"))]

mod cli_support;

use cli_support::{Ended, run};
use serde_json::Value;

fn probe(more: &[&str]) -> Ended {
    run(&[&["probe", "ethercat-sim", "--cycles", "300"], more].concat())
}

fn json(more: &[&str]) -> (Option<i32>, Value) {
    let ended = probe(&[&["--json"], more].concat());
    assert_eq!(ended.stderr, "");
    (ended.code, serde_json::from_str(&ended.stdout).expect("JSON"))
}

#[test]
fn a_robot_as_the_manual_has_it_is_usable_and_equal() {
    let ended = probe(&[]);
    assert_eq!(ended.code, Some(0), "{ended:?}");
    for line in [
        "ethercat-sim: 1 subdevice, 1 of them Meca500\n",
        "robot 1 at position 0: usable\n",
        "  outputs          60 bytes, equal to our table, firmware 11.3\n",
        "  inputs           252 bytes, equal to our table, firmware 11.3\n",
        "  byte order       little\n",
        "  FifoSpace C8 32 reads 13000 little-endian, 51250 big-endian: little\n",
        "  target pose x 00 00 3E 43 reads 190.0 little-endian, 2.234e-41 big-endian: little\n",
        "  dynamic type 1 (Firmware version), asked for in little-endian: reported with a value\n",
        "  firmware         11.3.84 build 0\n",
        "  serial number    87654321\n",
        "  product          Meca500 R3\n",
        "  tool             MEGP 25E\n",
        "  state            not activated, not homed, brakes engaged\n",
        "  error            none\n",
        "  safety           no signals; motors powered\n",
        "  control          this connection may control it\n",
        "300 exchanges of 1 robot at 1.000 ms\n",
        "  working counter  3 found, 3 expected (3 a robot)\n",
        "  frames           0 exchanges not back in time (limit 5000 us), 0 stray; 0 exchanges began late\n",
    ] {
        assert!(ended.stdout.contains(line), "{line}{}", ended.stdout);
    }
    assert!(!ended.stdout.contains("drift"), "no clocks were used: {}", ended.stdout);
}

#[test]
fn each_order_is_found_with_evidence_that_speaks_for_it() {
    let orders = ["big", "little", "big-int-little-real", "little-int-big-real"];
    let (code, report) = json(&["--robots", "4", "--sim-byte-order", &orders.join(",")]);
    assert_eq!(code, Some(0));
    for (robot, order) in report["robots"].as_array().expect("robots").iter().zip(orders) {
        let found = &robot["byte_order"];
        assert_eq!(found["verdict"], order);
        assert_eq!(found["echo"]["answered"], true);
        assert_eq!(found["echo"]["integers"], found["integers"]);
        let pieces = found["evidence"].as_array().expect("evidence");
        assert_eq!(pieces.len(), 5);
        let (integers, reals) = pieces.split_at(3);
        for (pieces, part) in [(integers, "integers"), (reals, "reals")] {
            for piece in pieces {
                // A small number of microseconds or a slot of type 0 can make sense in both.
                let speaks_for = &piece["speaks_for"];
                assert!(*speaks_for == found[part] || speaks_for.is_null(), "{piece}");
            }
        }
        let fifo_space = &pieces[0];
        assert_eq!(fifo_space["speaks_for"], found["integers"]);
        let is_little = found["integers"] == "little";
        assert_eq!(fifo_space["bytes"], if is_little { "C8 32" } else { "32 C8" });
        assert_eq!(fifo_space[if is_little { "little" } else { "big" }], 13_000);
        assert_eq!(robot["identity"]["firmware"], "11.3.84 build 0");
    }
    assert_eq!(report["exchange"]["working_counter_expected"], 12);
    assert_eq!(report["exchange"]["working_counter_found"], 12);
}

#[test]
fn a_refused_robot_keeps_no_other_from_being_looked_at() {
    let layouts = "11.3,9.3,10.2,11.3-printed";
    let (code, report) = json(&["--robots", "4", "--sim-layout", layouts]);
    assert_eq!(code, Some(4), "one cannot be driven");
    assert_eq!(report["exit_code"], 4);
    let robots = report["robots"].as_array().expect("robots");
    let verdict = |robot: &Value| {
        let part = |image: &str| robot[image]["verdict"].as_str().expect("a verdict").to_string();
        (robot["usable"].as_bool().expect("a verdict"), part("outputs"), part("inputs"))
    };
    let equal = (true, "equal".to_string(), "equal".to_string());
    assert_eq!(verdict(&robots[0]), equal);
    assert_eq!(verdict(&robots[1]), (false, "refused".into(), "refused".into()));
    assert_eq!(verdict(&robots[2]), equal);
    assert_eq!(verdict(&robots[3]), equal);
    assert_eq!(robots[2]["outputs"]["firmware"], "10.2");
    assert_eq!(robots[2]["identity"]["firmware"], "10.2.0 build 0");
    let refused = &robots[1];
    let difference = refused["inputs"]["difference"].as_str().expect("a difference");
    assert!(difference.contains("the inputs lack 6065h:01 (EStop): assign PDO 1A11h in 1C13h"));
    assert!(refused["byte_order"].is_null() && refused["state"].is_null());
    assert_eq!(refused["fresh_inputs"], 0);
    assert_eq!(report["exchange"]["robots"], 3);
    assert_eq!(report["exchange"]["working_counter_found"], 9);

    let text = probe(&["--robots", "2", "--sim-layout", "9.3,11.3"]);
    assert_eq!(text.code, Some(4));
    let (refused, usable) = text.stdout.split_once("robot 2 at position 1: usable").expect("both");
    assert!(refused.contains("robot 1 at position 0: not usable"), "{refused}");
    assert!(refused.contains("  inputs           252 bytes, refused\n"), "{refused}");
    assert!(!refused.contains("trouble"), "it stands with the layout: {refused}");
    assert!(usable.contains("  firmware         11.3.84 build 0\n"), "{usable}");
}

#[test]
fn an_image_that_lacks_an_object_is_laid_out_by_name() {
    let ended = probe(&["--sim-unassigned", "1A08,1A09"]);
    assert_eq!(ended.code, Some(0), "{ended:?}");
    let expected =
        "  inputs           224 bytes (252 in our table), laid out by name, firmware 11.3\n";
    assert!(ended.stdout.contains(expected), "{}", ended.stdout);
    let missing = "not mapped, reads as 0: 6046h TargetConfiguration, 6050h TargetWrf\n";
    assert!(ended.stdout.contains(missing), "{}", ended.stdout);
    let (code, report) = json(&["--sim-unassigned", "1A08", "--write-assignment"]);
    assert_eq!(code, Some(0));
    assert_eq!(report["robots"][0]["inputs"]["verdict"], "equal", "it was assigned");
}

#[test]
fn an_assignment_that_is_wanted_is_written_only_when_told() {
    let ended = probe(&["--robots", "2", "--sim-demand-assignment"]);
    assert_eq!(ended.code, Some(4), "{ended:?}");
    for part in ["refused SAFE-OP", "0x0025", "probe with --write-assignment"] {
        assert_eq!(ended.stdout.matches(part).count(), 2, "{part}: {}", ended.stdout);
    }
    assert!(!ended.stdout.contains("exchanges of"), "{}", ended.stdout);
    assert_eq!(probe(&["--sim-demand-assignment", "--write-assignment"]).code, Some(0));
}

#[test]
fn clocks_are_used_where_all_robots_have_them() {
    let (code, report) = json(&["--robots", "2", "--clocks"]);
    assert_eq!(code, Some(0));
    let clock = &report["exchange"]["clock"];
    assert!(clock["drift_ppm"].as_f64().expect("a drift").abs() < 1.0, "{clock}");
    let phase_ns = clock["phase_error_ns"].as_i64().expect("a phase");
    assert!(phase_ns.abs() < 50_000, "{clock}");
    let ended = probe(&["--clocks", "--sim-no-dc"]);
    assert_eq!(ended.code, Some(0), "{ended:?}");
    let note = "note: cycled without clocks: none is offered at position 0\n";
    assert!(ended.stdout.contains(note), "{}", ended.stdout);
}

#[test]
fn how_long_an_exchange_waits_can_be_set() {
    let ended = probe(&["--reply-limit-us", "300"]);
    assert_eq!(ended.code, Some(0), "{ended:?}");
    assert!(ended.stdout.contains("0 exchanges not back in time (limit 300 us), 0 stray"));
    let (code, report) = json(&["--reply-limit-us", "50"]);
    assert_eq!((code, &report["exchange"]["reply_limit_us"]), (Some(0), &50.into()));
    let refused = probe(&["--reply-limit-us", "49"]);
    assert_eq!(refused.code, Some(2), "{refused:?}");
}

#[test]
fn mistakes_are_told_with_their_remedy() {
    let ended = probe(&["--robots", "2", "--sim-layout", "9.3,10.2", "--sim-unassigned", "1A77"]);
    assert_eq!(ended.code, Some(2));
    assert!(ended.stderr.contains("--sim-unassigned: no PDO 1A77"), "{}", ended.stderr);
    let ended = run(&["probe", "sim"]);
    assert_eq!(ended.code, Some(2));
    assert!(ended.stderr.contains("sim has no bus to look at"), "{}", ended.stderr);
    let ended = run(&["probe", "ethercat:none0", "--robots", "2"]);
    assert_eq!(ended.code, Some(2));
    assert!(ended.stderr.contains("is found out"), "{}", ended.stderr);
    let ended = run(&["probe", "ethercat:none0"]);
    assert_eq!(ended.code, Some(2));
    let expected = "there is no network interface `none0`; there are: ";
    assert!(ended.stderr.contains(expected), "{}", ended.stderr);
    let ended = probe(&["--clocks", "--cycle-us", "250"]);
    assert_eq!(ended.code, Some(2));
    assert!(ended.stderr.contains("every 1000 us or less often"), "{}", ended.stderr);
    assert_eq!(ended.stdout, "");
}
