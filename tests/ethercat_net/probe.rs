//! `fieldarm probe` at the main device's end of a cable.

use serde_json::Value;

use crate::namespaces::{Cable, End, INTERFACE, Running};
use crate::served::{LONG, Robots, end, serve};

fn probe(cable: &Cable, target: &str, more: &[&str]) -> (Option<i32>, String) {
    let arguments = [&["probe", target, "--cycles", "500"], more].concat();
    let (status, said) = Running::start(&mut cable.fieldarm(End::Main, &arguments)).end(LONG);
    (status.code(), said)
}

fn on_interface() -> String {
    format!("ethercat:{INTERFACE}")
}

#[test]
fn robots_are_seen_and_left_in_init() {
    let Some(cable) = Cable::plug() else { return };
    let serving = serve(&cable, Robots::FOUR, &["--alias", "0,0,77"]);
    let (code, said) = probe(&cable, &on_interface(), &["--json", "--clocks"]);
    assert_eq!(code, Some(0), "{said}");
    let report: Value = serde_json::from_str(&said).expect("JSON and nothing else");
    let subdevices = report["subdevices"].as_array().expect("subdevices");
    assert_eq!(subdevices.len(), 4);
    assert_eq!(subdevices[2]["alias"], 77);
    for (number, (found, robot)) in
        subdevices.iter().zip(report["robots"].as_array().expect("robots")).enumerate()
    {
        assert_eq!(found["found_in"], "INIT");
        assert_eq!(robot["identity"]["serial"], 87_654_321 + number);
        assert_eq!(robot["byte_order"]["verdict"], "little");
        assert_eq!(robot["outputs"]["verdict"], "equal");
        assert_eq!(robot["state"]["activated"], false);
        assert_eq!(robot["state"]["move_id"], 0);
    }
    let exchange = &report["exchange"];
    assert_eq!(exchange["count"], 500);
    assert_eq!(exchange["working_counter_expected"], 12);
    assert!(exchange["latency_us"]["p50"].as_f64().expect("a latency") > 0.0);
    assert!(exchange["clock"]["drift_ppm"].is_f64());

    // A second look finds what the first one left.
    let (code, said) = probe(&cable, &format!("{}:2", on_interface()), &[]);
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("robot 1 at position 2: usable"), "{said}");
    assert!(said.contains("note: not looked at: the Meca500 at position 0, 1, 3"), "{said}");
    assert_eq!(said.matches("  INIT  ").count(), 4, "{said}");
    let said = end(serving);
    for robot in 1..=4 {
        let last = said.lines().rfind(|line| line.starts_with(&format!("robot {robot}: ")));
        assert!(last.is_some_and(|line| line.ends_with("-> INIT")), "{said}");
    }
}

#[test]
fn the_other_order_and_a_shorter_image_are_seen() {
    let Some(cable) = Cable::plug() else { return };
    let serving = serve(&cable, Robots::ONE_WITHOUT_CLOCK, &["--unassigned", "1A08"]);
    let (code, said) = probe(&cable, &on_interface(), &[]);
    assert_eq!(code, Some(0), "{said}");
    for line in [
        "FifoSpace 32 C8 reads 51250 little-endian, 13000 big-endian: big",
        "inputs           248 bytes (252 in our table), laid out by name",
        "working counter  3 found, 3 expected",
    ] {
        assert!(said.contains(line), "{line}: {said}");
    }
    end(serving);
}

#[test]
fn an_empty_cable_a_wrong_position_and_a_missing_capability_are_told() {
    let Some(cable) = Cable::plug() else { return };
    let (code, said) = probe(&cable, &on_interface(), &[]);
    assert_eq!(code, Some(4), "{said}");
    assert!(said.contains("no EtherCAT subdevice answers: check the cable"), "{said}");
    let serving = serve(&cable, Robots::ONE, &[]);
    let (code, said) = probe(&cable, &format!("{}:3", on_interface()), &[]);
    assert_eq!(code, Some(4), "{said}");
    assert!(said.contains("no subdevice at position 3: there are 1"), "{said}");
    end(serving);
    let mut command = cable.command(End::Main, "setpriv");
    command.args(["--bounding-set=-net_raw", "--inh-caps=-net_raw"]);
    command.args([env!("CARGO_BIN_EXE_fieldarm"), "probe", &on_interface()]);
    let (status, said) = Running::start(&mut command).end(LONG);
    assert_eq!(status.code(), Some(4), "{said}");
    assert!(said.contains("sudo setcap cap_net_raw+ep"), "{said}");
}
