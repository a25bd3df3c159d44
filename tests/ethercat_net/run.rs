//! `fieldarm run` against `fieldarm sim` over a cable: what the README promises, as a person types it.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use crate::capture::Capture;
use crate::namespaces::{Cable, End, INTERFACE, Running};
use crate::served::{LONG, Robots, can_go_first, end, serve};

/// A program that takes about a second once the robot is homed.
const PROGRAM: &str =
    "MoveJoints(10, -5, 5, 0, 20, 0)\nSetCheckpoint(7)\nMoveJoints(0, 0, 0, 0, 0, 0)\n";
/// A program that would take long.
const LONG_PROGRAM: &str = "MoveJoints(10, 0, 0, 0, 0, 0)\nDelay(60)\n";

/// A file with a program, for this process and this test.
fn program(name: &str, text: &str) -> PathBuf {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR"))
        .join(format!("{name}-{}.txt", std::process::id()));
    fs::write(&path, text).unwrap();
    path
}

/// `fieldarm run` at the main device's end, before others where that may be.
fn run(cable: &Cable, program: &PathBuf, arguments: &[&str]) -> Running {
    let mut command = if can_go_first() {
        let mut command = cable.command(End::Main, "chrt");
        command.args(["--fifo", "1", env!("CARGO_BIN_EXE_fieldarm")]);
        command
    } else {
        cable.command(End::Main, env!("CARGO_BIN_EXE_fieldarm"))
    };
    command.arg("run").arg(program).args(arguments);
    Running::start(&mut command)
}

fn link() -> String {
    format!("ethercat:{INTERFACE}")
}

/// Runs to its end; the exit code and all that was said.
fn ended(running: Running) -> (Option<i32>, String) {
    let (status, said) = running.end(2 * LONG);
    (status.code(), said)
}

/// The program on every robot of a segment, with distributed clocks where the robots have them.
fn runs_on_all(robots: Robots) {
    let Some(cable) = Cable::plug() else { return };
    let capture = Capture::start(&cable, &format!("run-{}-{}", robots.count, robots.order));
    let serving = serve(&cable, robots, &[]);
    let program = program(&format!("all-{}-{}", robots.count, robots.order), PROGRAM);
    let (link, count) = (link(), robots.count.to_string());
    let mut arguments = vec!["--link", &link, "--robots", &count];
    if robots.has_clock {
        arguments.push("--clocks");
    }
    let (code, said) = ended(run(&cable, &program, &arguments));
    assert_eq!(code, Some(0), "{said}");
    for robot in 1..=robots.count {
        let who = if robots.count == 1 { String::new() } else { format!("robot {robot}: ") };
        for line in [format!("byte order found: {}", robots.order), "checkpoint 7 reached".into()] {
            assert!(said.contains(&format!("{who}{line}")), "{who}{line}: {said}");
        }
    }
    assert_eq!(said.contains("clock            drift"), robots.has_clock, "{said}");
    let served = end(serving);
    for position in 0..robots.count {
        for change in ["SAFE-OP -> OP", "OP -> INIT"] {
            let line = format!("position {position}: {change}");
            assert!(served.contains(&line), "{line}: {served}");
        }
    }
    if let Some(capture) = capture {
        capture.check(2_000);
    }
}

#[test]
fn a_program_runs_on_one_robot_with_distributed_clocks() {
    runs_on_all(Robots::ONE);
}

#[test]
fn a_program_runs_on_one_robot_without_distributed_clocks() {
    runs_on_all(Robots::ONE_WITHOUT_CLOCK);
}

#[test]
fn a_program_runs_on_four_robots_with_distributed_clocks() {
    runs_on_all(Robots::FOUR);
}

#[test]
fn a_program_runs_on_four_robots_without_distributed_clocks() {
    runs_on_all(Robots::FOUR_WITHOUT_CLOCK);
}

#[test]
fn the_robot_at_a_position_moves_and_the_others_stay_in_pre_op() {
    let Some(cable) = Cable::plug() else { return };
    let serving = serve(&cable, Robots { count: 3, ..Robots::ONE }, &[]);
    let program = program("position", PROGRAM);
    let (code, said) = ended(run(&cable, &program, &["--link", &format!("{}:1", link())]));
    assert_eq!(code, Some(0), "{said}");
    let served = end(serving);
    assert!(served.contains("position 1: SAFE-OP -> OP"), "{served}");
    for position in [0, 2] {
        assert!(!served.contains(&format!("position {position}: PRE-OP -> SAFE-OP")), "{served}");
    }
}

#[test]
fn a_robot_that_demands_its_assignment_gets_it() {
    let Some(cable) = Cable::plug() else { return };
    let more = ["--demand-assignment", "--unassigned", "1A08"];
    let serving = serve(&cable, Robots::ONE, &more);
    let program = program("assignment", PROGRAM);
    let (code, said) = ended(run(&cable, &program, &["--link", &link(), "--keep-assignment"]));
    assert_eq!(code, Some(4), "{said}");
    assert!(said.contains("0x0025"), "{said}");
    let (code, said) = ended(run(&cable, &program, &["--link", &link()]));
    assert_eq!(code, Some(0), "{said}");
    end(serving);
}

#[test]
fn lost_and_doubled_frames_cost_time_only() {
    let Some(cable) = Cable::plug() else { return };
    let faults = ["--fault", "drop:10:3,duplicate:10,truncate:5"];
    let serving = serve(&cable, Robots::ONE, &faults);
    let program = program("faults", PROGRAM);
    let (code, said) = ended(run(&cable, &program, &["--link", &link()]));
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("checkpoint 7 reached"), "{said}");
    assert!(!said.contains(" 0 exchanges not back"), "there were faults to survive: {said}");
    end(serving);
}

#[test]
fn a_power_cut_ends_the_program_and_the_next_run_finds_the_robot_again() {
    let Some(cable) = Cable::plug() else { return };
    let serving = serve(&cable, Robots::ONE, &["--power-cycle-after", "4"]);
    let program = program("power", LONG_PROGRAM);
    let (code, said) = ended(run(&cable, &program, &["--link", &link()]));
    assert_eq!(code, Some(4), "{said}");
    assert!(said.contains("does not answer any more"), "{said}");
    assert!(said.contains("connection lost"), "{said}");
    let again = self::program("power-again", PROGRAM);
    // It boots for five seconds; until then nobody answers, which says so.
    let found = (0..20).find_map(|_| {
        let (code, said) = ended(run(&cable, &again, &["--link", &link()]));
        match code {
            Some(4) => {
                assert!(said.contains("no EtherCAT subdevice answers"), "{said}");
                None
            }
            code => Some((code, said)),
        }
    });
    let (code, said) = found.expect("the robot came back");
    assert_eq!(code, Some(0), "{said}");
    end(serving);
}

#[test]
fn ctrl_c_stops_the_robot_and_leaves_the_bus() {
    let Some(cable) = Cable::plug() else { return };
    let serving = serve(&cable, Robots::ONE, &[]);
    let program = program("interrupt", LONG_PROGRAM);
    let mut running = run(&cable, &program, &["--link", &link()]);
    running.wait_for("activated, homed", LONG);
    let (status, said) = running.interrupt(LONG);
    assert_eq!(status.code(), Some(130), "{said}");
    let served = end(serving);
    assert!(served.contains("position 0: OP -> INIT"), "{served}");
}

#[test]
fn a_segment_that_another_run_drives_is_refused() {
    let Some(cable) = Cable::plug() else { return };
    let serving = serve(&cable, Robots::ONE, &[]);
    let program = program("driven", LONG_PROGRAM);
    let mut first = run(&cable, &program, &["--link", &link()]);
    first.wait_for("activated, homed", LONG);
    let (code, said) = ended(run(&cable, &program, &["--link", &link()]));
    assert_eq!(code, Some(4), "{said}");
    assert!(said.contains("another main device drives this segment"), "{said}");
    // The other one did not notice.
    let (status, said) = first.interrupt(LONG);
    assert_eq!(status.code(), Some(130), "{said}");
    end(serving);
}

#[test]
fn what_cannot_be_opened_is_told_with_the_remedy() {
    let Some(cable) = Cable::plug() else { return };
    let program = program("refused", PROGRAM);
    let (code, said) = ended(run(&cable, &program, &["--link", "ethercat:nowhere"]));
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("there is no network interface `nowhere`; there are: ecat0"), "{said}");

    let (code, said) = ended(run(&cable, &program, &["--link", &link()]));
    assert_eq!(code, Some(4), "nobody is at the other end: {said}");
    assert!(said.contains("no EtherCAT subdevice answers: check the cable"), "{said}");

    let mut command: Command = cable.command(End::Main, "setpriv");
    command.args(["--bounding-set=-net_raw", "--inh-caps=-net_raw"]);
    command.args([env!("CARGO_BIN_EXE_fieldarm"), "run"]).arg(&program);
    let (code, said) = ended(Running::start(command.args(["--link", &link()])));
    assert_eq!(code, Some(4), "{said}");
    assert!(said.contains("CAP_NET_RAW") && said.contains("setcap"), "{said}");
}
