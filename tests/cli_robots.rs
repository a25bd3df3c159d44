//! `fieldarm run --robots`: several robots in one process, on one segment.
#![cfg(feature = "cli")]

mod cli_support;

use cli_support::{Ended, Scratch, run, run_with_input};
use serde_json::Value;

/// Four programs of different lengths; all but the second come to their end.
const FOUR: [&str; 4] = [
    "programs/square.txt",
    "programs/out_of_reach.txt",
    "programs/jog.txt",
    "programs/pick_and_place.txt",
];

fn four(more: &[&str]) -> Ended {
    run(&[&["run", "--robots", "4", "--fast"], &FOUR[..], more].concat())
}

/// The part of the summary that belongs to a robot.
fn block(ended: &Ended, robot: usize) -> &str {
    let head = format!("robot {robot}: ");
    let from = ended.stdout.find(&head).unwrap_or_else(|| panic!("no `{head}`: {}", ended.stdout));
    let block = &ended.stdout[from..];
    let end = block[1..].find("\nrobot ").or_else(|| block[1..].find("\n4 robots"));
    &block[..end.map_or(block.len(), |end| end + 1)]
}

#[test]
fn one_robot_fails_and_the_others_go_on_to_their_ends() {
    let ended = four(&["-q"]);
    assert_eq!(ended.code, Some(3), "{ended:?}");
    let expected = [
        ("done", "15 of 15 done, 15 accepted\n"),
        ("stopped at line 7", "3 of 6 done, 6 accepted, 3 aborted\n"),
        ("done", "15 of 15 done, 15 accepted\n"),
        ("done", "21 of 21 done, 21 accepted\n"),
    ];
    for (robot, (program, (verdict, counts))) in (1..).zip(FOUR.into_iter().zip(expected)) {
        let block = block(&ended, robot);
        assert!(block.starts_with(&format!("robot {robot}: {program}: {verdict}\n")), "{block}");
        assert!(block.contains(&format!("  commands         {counts}")), "{block}");
        assert!(block.contains("  byte order       big (found)\n"), "{block}");
        assert!(!block.contains("cycle time"), "what is shared stands below: {block}");
    }
    let (_, shared) = ended.stdout.split_once("\n4 robots over sim\n").expect("the shared figures");
    for name in ["cycle time", "work per cycle", "cycles", "wall time"] {
        assert!(shared.contains(&format!("  {name} ")), "{name}: {shared}");
    }
    let expected = "robot 2:\nprograms/out_of_reach.txt:7: MovePose(480, 0, 180, 180, 0, 180)\n  \
                    robot error 1016: ";
    assert!(ended.stderr.starts_with(expected), "{}", ended.stderr);
    assert_eq!(
        ended.stderr.matches("robot ").count() - ended.stderr.matches("robot error").count(),
        1
    );
}

#[test]
fn robots_do_not_notice_each_other() {
    let together = four(&["-q"]);
    for (robot, program) in (1..).zip(FOUR) {
        let alone = run(&["run", program, "--fast", "-q"]);
        for name in ["commands", "acknowledgement", "distance"] {
            let line = |text: &str| {
                let line = text.lines().find(|line| line.trim_start().starts_with(name));
                line.unwrap_or_else(|| panic!("no {name} in {text}")).to_string()
            };
            assert_eq!(line(block(&together, robot)), line(&alone.stdout), "robot {robot}");
        }
    }
}

#[test]
fn each_robot_gets_a_report_of_its_own() {
    let scratch = Scratch::new("robots_report");
    let directory = scratch.path("report");
    let ended = four(&["-q", "--report", &directory]);
    assert_eq!(ended.code, Some(3), "{ended:?}");
    let mut cycles = Vec::new();
    for (robot, program) in (1..).zip(FOUR) {
        for file in ["report.json", "joints.svg", "path.svg", "handshake.svg"] {
            let path = format!("{directory}/robot-{robot}/{file}");
            assert!(block(&ended, robot).contains(&path), "the summary names {path}");
            let content = std::fs::read_to_string(&path).expect("written");
            if file == "report.json" {
                let json: Value = serde_json::from_str(&content).expect("JSON");
                assert_eq!(json["robot"], robot);
                assert_eq!(json["program"], program);
                assert_eq!(json["settings"]["robots"], 4);
                let exit_code = if robot == 2 { 3 } else { 0 };
                assert_eq!(json["outcome"]["exit_code"], exit_code, "robot {robot}");
                assert_eq!(json["final_outputs"], "00".repeat(60), "robot {robot}");
                assert!(json["cycles"]["engine_us"]["count"].as_u64() > Some(1_000));
                cycles.push(json["cycles"]["count"].as_u64());
            } else {
                assert!(content.contains(&format!("robot {robot}: {program}")), "{path}");
            }
        }
    }
    assert!(cycles.iter().all(|count| *count == cycles[0]), "one bus cycle for all: {cycles:?}");
    let mut names: Vec<_> = std::fs::read_dir(&directory)
        .expect("a directory")
        .map(|entry| entry.expect("an entry").file_name())
        .collect();
    names.sort();
    assert_eq!(names, ["robot-1", "robot-2", "robot-3", "robot-4"]);
}

#[test]
fn one_program_serves_all_robots() {
    let ended = run(&["run", "programs/square.txt", "--robots", "3", "--fast", "-q"]);
    assert_eq!(ended.code, Some(0), "{ended:?}");
    for robot in 1..=3 {
        let head = format!("robot {robot}: programs/square.txt: done\n");
        assert!(ended.stdout.contains(&head), "{}", ended.stdout);
    }
    assert!(ended.stdout.contains("\n3 robots over sim\n"), "{}", ended.stdout);
    let arguments = ["run", "-", "--robots", "16", "--fast", "-q"];
    let ended = run_with_input(&arguments, "Delay(0.01)\n");
    assert_eq!(ended.code, Some(0), "{ended:?}");
    assert!(ended.stdout.contains("robot 16: <stdin>: done\n"), "{}", ended.stdout);
}

#[test]
fn live_lines_name_their_robot() {
    let ended = four(&[]);
    for robot in 1..=4 {
        for said in ["byte order found: big", "connected", "robot is activated, homed and ready"] {
            let line = format!("robot {robot}: {said}");
            assert!(ended.stderr.lines().any(|found| found == line), "{line}: {}", ended.stderr);
        }
    }
    let unnamed = ended.stderr.lines().find(|line| !line.starts_with("robot "));
    let place = "programs/out_of_reach.txt:7:";
    assert!(unnamed.is_some_and(|line| line.starts_with(place)), "only the end: {unnamed:?}");
    assert!(ended.stderr.contains("robot 1: checkpoint 3 reached\n"), "{}", ended.stderr);
    assert!(!ended.stderr.contains("robot 3: checkpoint"), "jog has none: {}", ended.stderr);
}

#[test]
fn wrong_counts_of_programs_say_what_would_be_right() {
    let square = "programs/square.txt";
    let cases: [(&[&str], &str); 4] = [
        (&[square, square], "2 programs for 1 robot: give one program, which every robot runs"),
        (&[square, square, "--robots", "4"], "2 programs for 4 robots: give one program"),
        (&[square, square, square, "--robots", "2"], "3 programs for 2 robots"),
        (&["-", "-", "--robots", "2"], "standard input (-) can be read only once"),
    ];
    for (arguments, message) in cases {
        let ended = run(&[&["run", "--fast"], arguments].concat());
        assert_eq!(ended.code, Some(2), "{arguments:?}: {ended:?}");
        assert!(ended.stderr.starts_with(&format!("fieldarm: {message}")), "{}", ended.stderr);
        assert_eq!(ended.stdout, "", "nothing ran");
    }
}

#[test]
fn mistakes_in_any_program_are_all_told_and_nothing_runs() {
    let (empty, pause) = ("programs/bad/empty.txt", "programs/bad/endless_pause.txt");
    let programs = ["programs/square.txt", empty, pause, empty];
    let ended = run(&[&["run", "--robots", "4", "--fast"], &programs[..]].concat());
    assert_eq!(ended.code, Some(2), "{ended:?}");
    assert_eq!(ended.stdout, "", "nothing ran");
    for (file, times) in [(empty, 1), (pause, 1), ("programs/square.txt", 0)] {
        let told = ended.stderr.matches(&format!("in {file}; nothing was sent")).count();
        assert_eq!(told, times, "{file}: {}", ended.stderr);
    }
    let ended = run(&["run", "--robots", "2", "--fast", empty, "programs/nowhere.txt"]);
    assert_eq!(ended.code, Some(1), "{ended:?}");
    assert!(ended.stderr.contains(&format!("{empty}:1:1: ")), "{}", ended.stderr);
    assert!(ended.stderr.contains("\nfieldarm: cannot read programs/nowhere.txt"), "{ended:?}");
}

#[test]
fn the_worst_robot_decides_the_exit_code() {
    let scratch = Scratch::new("robots_worst");
    let held_back = scratch.write("unhomed.txt", "ActivateRobot()\nDelay(1)\n");
    let good = scratch.write("good.txt", "Delay(0.01)\n");
    let code = |programs: &[&str], more: &[&str]| {
        run(&[&["run", "--robots", "2", "--fast", "-q"], programs, more].concat()).code
    };
    assert_eq!(code(&[&good, &good], &[]), Some(0));
    assert_eq!(code(&[&held_back, &good], &[]), Some(3));
    assert_eq!(code(&[&good, &held_back], &[]), Some(3));
    // In the wrong byte order no robot can be understood.
    assert_eq!(code(&[&good, &held_back], &["--byte-order", "little"]), Some(4));
    // A report that cannot be written is worse still, and the robots are told all the same.
    let report = scratch.path("report");
    std::fs::create_dir_all(format!("{report}/robot-2/report.json")).expect("writable");
    let flags = ["-q", "--report", &report];
    let ended = run(&[&["run", "--robots", "2", "--fast", &held_back, &good], &flags[..]].concat());
    assert_eq!(ended.code, Some(1), "{ended:?}");
    assert!(ended.stdout.contains(&format!("robot 2: {good}: done\n")), "{}", ended.stdout);
    assert!(ended.stderr.starts_with(&format!("robot 1:\n{held_back}:2: ")), "{}", ended.stderr);
    assert!(ended.stderr.contains("\nfieldarm: cannot write "), "{}", ended.stderr);
    assert!(std::fs::exists(format!("{report}/robot-1/report.json")).expect("readable"));
}
