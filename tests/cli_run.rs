//! `fieldarm run`: good programs, bad programs, programs the robot refuses.
#![cfg(feature = "cli")]

mod cli_support;

use cli_support::{Ended, Scratch, run, run_with_input};

fn fast(program: &str) -> Ended {
    run(&["run", program, "--fast", "--quiet"])
}

/// The value of a line of the summary.
fn value<'a>(ended: &'a Ended, name: &str) -> &'a str {
    let line = ended.stdout.lines().find(|line| line.trim_start().starts_with(name));
    line.unwrap_or_else(|| panic!("no line `{name}` in {}", ended.stdout))
        .trim_start()
        .strip_prefix(name)
        .expect("just found")
        .trim()
}

#[test]
fn good_programs_run_to_their_last_checkpoint() {
    for (name, commands) in [("square", 15), ("pick_and_place", 21), ("jog", 15), ("postures", 27)]
    {
        let program = format!("programs/{name}.txt");
        let ended = fast(&program);
        assert_eq!(ended.code, Some(0), "{name}: {ended:?}");
        assert!(ended.stdout.starts_with(&format!("{program}: done\n")), "{name}: {ended:?}");
        let expected = format!("{commands} of {commands} done, {commands} accepted");
        assert_eq!(value(&ended, "commands"), expected, "{name}");
        assert_eq!(value(&ended, "acknowledgement"), "min 1   p50 1   p99 1   max 1 cycle");
        assert_eq!(ended.stderr, "", "{name}");
    }
}

#[test]
fn a_square_is_as_long_as_its_sides() {
    // Down and up are lines of sqrt(30^2 + 30^2 + 30^2) mm, the sides 4 x 60 mm; the ways there and
    // back in joint space are longer than the straight line between their ends.
    let lines = 2.0 * 2700_f64.sqrt() + 240.0;
    let distance = fast("programs/square.txt");
    let distance: f64 =
        value(&distance, "distance").trim_end_matches(" mm, homing included").parse().unwrap();
    assert!(distance > lines + 2.0 * 128.0 && distance < lines + 600.0, "{distance}");
}

#[test]
fn every_byte_order_is_found_or_taken_as_told() {
    let scratch = Scratch::new("byte_orders");
    let program = scratch.write("short.txt", "Delay(0.01)\n");
    for order in ["big", "little", "big-int-little-real", "little-int-big-real"] {
        let ended = run(&["run", &program, "--fast", "-q", "--sim-byte-order", order]);
        assert_eq!(ended.code, Some(0), "{order}: {ended:?}");
        assert_eq!(value(&ended, "byte order"), format!("{order} (found)"));
        let told = ["--byte-order", order, "--sim-byte-order", order];
        let ended = run(&[&["run", &program, "--fast", "-q"], &told[..]].concat());
        assert_eq!(value(&ended, "byte order"), format!("{order} (as told)"));
    }
}

#[test]
fn a_wrong_byte_order_is_noticed_before_anything_is_sent() {
    for order in ["little", "big-int-little-real", "little-int-big-real"] {
        let file = "programs/square.txt";
        let ended = run(&["run", file, "--fast", "-q", "--byte-order", order]);
        assert_eq!(ended.code, Some(4), "{order}: {ended:?}");
        assert!(ended.stderr.contains("makes no sense in the byte order"), "{order}: {ended:?}");
        assert!(ended.stderr.contains("use --byte-order auto"), "{order}: {ended:?}");
        let names_the_other = ended.stderr.contains("or --byte-order big.");
        assert_eq!(names_the_other, order == "little", "{order}: {ended:?}");
        assert_eq!(value(&ended, "commands"), "0 of 15 done, 0 accepted", "{order}");
        for nonsense in ["distance", "robot time", "queue space"] {
            assert!(!ended.stdout.contains(nonsense), "{order}: {nonsense}: {}", ended.stdout);
        }
        let talkative = run(&["run", file, "--fast", "--byte-order", order]);
        assert!(!talkative.stderr.contains("queue space"), "{order}: {}", talkative.stderr);
    }
}

#[test]
fn bad_programs_give_all_their_errors_and_move_nothing() {
    let lists: [(&str, &[&str]); 5] = [
        (
            "syntax",
            &[
                "2:1: there is no command `MoveJoint`; did you mean `MoveJoints`?",
                "3:28: `)` is missing at the end of MoveJoints",
                "4:12: `(` is missing after MoveJoints",
                "5:20: a comma is missing before `0`",
                "6:18: an argument is missing here",
                "7:25: MoveJoints takes 6 arguments, not 5",
                "8:12: Delay takes 1 argument, not 2",
                "9:7: Delay: t must be a number, not `half`",
                "10:8: nothing may follow the command, but `now` does",
                "11:5: a command's name is expected here, not `(1,`",
            ],
        ),
        (
            "ranges",
            &[
                "2:12: MoveJoints: theta1 = 200 deg, allowed: -175 to 175 deg",
                "3:27: MoveJoints: theta6 = 40000 deg, allowed: -36000 to 36000 deg",
                "4:13: SetBlending: p = 101 %, allowed: 0 to 100 %",
                "5:13: SetJointVel: p = 150 %, allowed: 0.001 to 100 % on a Meca500 R3",
                "6:7: Delay: t = -1 s, allowed: 0 s or more",
                "7:12: SetConf: c_e = 0, allowed: -1, 1",
                "8:15: SetCheckpoint: n = 0, allowed: an integer from 1 to 8000",
                "9:15: SetCheckpoint: n = 1.5, allowed: an integer from 1 to 8000",
                "10:17: SetGripperForce: p = 4 %, allowed: 5 to 100 %",
                "11:15: SetVelTimeout: t = 2 s, allowed: 0.001 to 1 s",
                "12:24: SetJointLimits: q_max = 10 deg, allowed: 15 deg or more, to leave q_min room",
                "13:22: SetWorkZoneLimits: y_min = 0 mm, allowed: less than y_max, which is -100 mm",
                "14:9: MoveLin: x: 1e99 is too large for a 32-bit Real",
            ],
        ),
        (
            "tcp_only",
            &[
                "2:1: GetJoints is a request for data; read it from the cyclic image: TargetJointSet",
                "3:1: GetRtTargetJointPos is a request for data; read it from the cyclic image: \
                 TargetJointSet",
                "4:1: ConnectionWatchdog exists only on the robot's TCP interface; nothing in the \
                 cyclic image stands for it",
                "5:1: SetExtToolSim exists only on the robot's TCP interface; nothing in the cyclic \
                 image stands for it",
                "6:13: ActivateSim with a kind exists only on the robot's TCP interface; the cyclic \
                 bit starts the kind that SetSimModeCfg chose: write ActivateSim()",
                "7:1: VacuumGrip is not available on the Meca500",
                "8:1: MoveJump is not available on the Meca500",
                "9:14: StartProgram over the cyclic image takes programs named by a number from 1 to \
                 500, not `palletize`",
                "10:1: SetVariable names its variable, and names exist only on the robot's TCP \
                 interface; the cyclic image sets a variable by its cyclic ID",
                "11:12: `vars.a` is a robot variable, which only the robot's TCP interface looks up \
                 by name; write a number",
            ],
        ),
        (
            "endless_pause",
            &["3:1: PauseMotion is never followed by ResumeMotion, so the program could not end"],
        ),
        ("empty", &["1:1: the program has no commands"]),
    ];
    for (name, errors) in lists {
        let file = format!("programs/bad/{name}.txt");
        let ended = run(&["run", &file]);
        let mut expected: String = errors.iter().map(|error| format!("{file}:{error}\n")).collect();
        let count = if errors.len() == 1 { "1 error" } else { &format!("{} errors", errors.len()) };
        expected += &format!("{count} in {file}; nothing was sent to the robot\n");
        assert_eq!(ended.stderr, expected, "{name}");
        assert_eq!(ended.code, Some(2), "{name}");
        assert_eq!(ended.stdout, "", "{name}");
    }
}

#[test]
fn limits_of_this_program_are_told_with_their_place() {
    let scratch = Scratch::new("own_limits");
    let program = scratch.write("eternal.txt", "Delay(86400)\nDelay(1e30)\n");
    let ended = fast(&program);
    assert_eq!(ended.code, Some(2), "{ended:?}");
    assert!(ended.stderr.starts_with(&format!("{program}:2:7: Delay: 1e30 s is more than a day")));

    let all: String = (1..=8_000).map(|n| format!("SetCheckpoint({n})\n")).collect();
    let program = scratch.write("checkpoints.txt", &all);
    let ended = fast(&program);
    assert_eq!(ended.code, Some(2), "{}", ended.stderr);
    assert!(ended.stderr.starts_with(&format!("{program}:7981:1: no 20 checkpoint numbers")));
}

#[test]
fn a_program_may_come_from_standard_input() {
    let ended = run_with_input(&["run", "-", "--fast", "-q"], "Delay(0.01)\n");
    assert_eq!(ended.code, Some(0), "{ended:?}");
    assert!(ended.stdout.starts_with("<stdin>: done\n"), "{ended:?}");
    let ended = run_with_input(&["run", "-", "--fast", "-q"], "Delay(0.01)\nDelay(x)\n");
    assert_eq!(ended.code, Some(2), "{ended:?}");
    assert!(ended.stderr.starts_with("<stdin>:2:7: Delay: t must be a number"), "{ended:?}");
}

#[test]
fn commands_that_may_be_refused_in_silence_are_named() {
    let ended = fast("programs/pick_and_place.txt");
    let told = value(&ended, "unconfirmed");
    assert!(told.starts_with("lines 10, 11, 13, 18, 25: the robot may refuse"), "{told}");
    assert!(!fast("programs/square.txt").stdout.contains("unconfirmed"));
}

#[test]
fn a_revision_decides_its_limits() {
    let scratch = Scratch::new("revisions");
    let program = scratch.write("fast.txt", "SetJointVel(150)\n");
    assert_eq!(run(&["run", &program, "--fast", "-q"]).code, Some(2));
    assert_eq!(run(&["run", &program, "--fast", "-q", "--revision", "R4"]).code, Some(0));
}

#[test]
fn a_robot_error_names_line_code_text_and_remedy() {
    let ended = fast("programs/out_of_reach.txt");
    assert_eq!(ended.code, Some(3), "{ended:?}");
    assert_eq!(
        ended.stderr,
        "programs/out_of_reach.txt:7: MovePose(480, 0, 180, 180, 0, 180)\n  robot error 1016: The \
         pose, or one on the way to it, cannot be reached in the allowed postures.\n  Remedy: Check \
         the pose, the tool and world frames, and the desired posture.\n"
    );
    assert!(ended.stdout.starts_with("programs/out_of_reach.txt: stopped at line 7\n"));
    assert_eq!(value(&ended, "commands"), "3 of 6 done, 6 accepted, 3 aborted");
}

#[test]
fn commands_that_the_robot_cannot_take_are_told_with_the_way_out() {
    let scratch = Scratch::new("held_back");
    let program = scratch.write("unhomed.txt", "ActivateRobot()\nMoveJoints(0,0,0,0,0,0)\n");
    let ended = fast(&program);
    assert_eq!(ended.code, Some(3), "{ended:?}");
    let expected = format!(
        "{program}:2: MoveJoints(0,0,0,0,0,0)\n  the command cannot be sent: the robot is not \
         homed\n  Remedy: put Home() before this line.\n"
    );
    assert!(ended.stderr.starts_with(&expected), "{}", ended.stderr);
}

#[test]
fn a_program_may_do_everything_itself() {
    let scratch = Scratch::new("by_itself");
    let program = scratch.write(
        "all.txt",
        "ActivateSim()\nActivateRobot(1)\nHome()\nMoveJoints(10,0,0,0,0,0)\nPauseMotion()\n\
         ResumeMotion()\nMoveJoints(0,0,0,0,0,0)\nDelay(5)\nClearMotion()\nResumeMotion()\n\
         SetTimeScaling(50)\nDeactivateRobot()\nSetJointLimitsCfg(1)\nDeactivateSim()\n",
    );
    let ended = fast(&program);
    assert_eq!(ended.code, Some(0), "{ended:?}");
    let counts = value(&ended, "commands");
    assert!(counts.starts_with("11 of 14 done") || counts.starts_with("12 of 14 done"), "{counts}");
    assert!(counts.ends_with(" aborted"), "ClearMotion drops what is queued: {counts}");
}

#[test]
fn bad_usage_says_what_would_be_right() {
    let cases: [(&[&str], &str); 13] = [
        (&["--link", "ethercat"], "ethercat needs the name of a network interface"),
        (&["--link", "ethercat:eth0:one"], "`one` is no position on the segment"),
        (
            &["--link", "profinet"],
            "profinet is coming in a later version; for now there are sim, ethercat-sim, \
             ethercat:IFACE[:POSITION], enip-sim, enip:ADDR, tcp-sim and tcp:ADDR",
        ),
        (
            &["--link", "usb"],
            "for now there are sim, ethercat-sim, ethercat:IFACE[:POSITION], enip-sim, enip:ADDR, \
             tcp-sim and tcp:ADDR; profinet is coming",
        ),
        (
            &["--link", "ethercat:eth0", "--fast"],
            "--fast needs simulated time, and the robots of --link ethercat:eth0 live in real time",
        ),
        (
            &["--link", "ethercat:eth0", "--sim-byte-order", "big"],
            "--sim-byte-order builds virtual robots in this process, and --link ethercat:eth0 has none",
        ),
        (
            &["--link", "ethercat:eth0:1", "--robots", "2"],
            "--link ethercat:eth0:1 is one robot, --robots 2 wants more: --link ethercat:eth0 takes \
             the first 2 of the segment",
        ),
        (&["--robots", "0"], "0 is not in 1..=64"),
        (&["--robots", "17"], "--robots 17: --link sim drives 16 at most"),
        (&["--robots", "65"], "65 is not in 1..=64"),
        (&["--cycle-us", "0"], "0 is not in 100..=100000"),
        (&["--byte-order", "middle"], "possible values: auto, big, little"),
        (&["--revision", "R5"], "possible values: R3, R4"),
    ];
    for (flags, message) in cases {
        let ended = run(&[&["run", "programs/square.txt"], flags].concat());
        assert_eq!(ended.code, Some(2), "{ended:?}");
        assert!(ended.stderr.contains(message), "{flags:?}: {}", ended.stderr);
    }
}

#[test]
fn files_that_cannot_be_read_or_written_are_named() {
    let ended = run(&["run", "programs/nowhere.txt"]);
    assert_eq!(ended.code, Some(1));
    assert!(ended.stderr.starts_with("fieldarm: cannot read programs/nowhere.txt: "), "{ended:?}");

    let scratch = Scratch::new("unreadable");
    let occupied = scratch.write("occupied", "a file, no directory");
    let ended = run(&["run", "programs/square.txt", "--fast", "--report", &occupied]);
    assert_eq!(ended.code, Some(1));
    let expected = format!("fieldarm: cannot write a report into {occupied}: ");
    assert!(ended.stderr.starts_with(&expected), "{ended:?}");
    assert_eq!(ended.stdout, "", "nothing ran");

    let binary = scratch.path("binary");
    std::fs::write(&binary, [0xFF, 0xFE, 0x00]).unwrap();
    let ended = run(&["run", &binary]);
    assert_eq!(ended.code, Some(2));
    assert!(ended.stderr.contains("is not a text"), "{ended:?}");
}

#[test]
fn help_lists_the_exit_codes() {
    for arguments in [&["--help"][..], &["run", "--help"], &["run", "-h"]] {
        let ended = run(arguments);
        assert_eq!(ended.code, Some(0));
        for code in ["0  done", "1  ", "2  ", "3  ", "4  ", "130  interrupted"] {
            assert!(ended.stdout.contains(code), "{arguments:?}: {code}");
        }
    }
}

#[test]
fn progress_off_a_terminal_is_plain_lines() {
    let ended = run(&["run", "programs/square.txt", "--fast"]);
    assert_eq!(ended.code, Some(0));
    let lines: Vec<&str> = ended.stderr.lines().collect();
    for line in ["byte order found: big", "connected", "robot is activated, homed and ready"] {
        assert!(lines.contains(&line), "{line}: {lines:?}");
    }
    let checkpoints: Vec<&&str> = lines.iter().filter(|line| line.contains("checkpoint")).collect();
    assert_eq!(
        checkpoints,
        [&"checkpoint 1 reached", &"checkpoint 2 reached", &"checkpoint 3 reached"]
    );
    assert!(!ended.stderr.contains('\u{1b}'), "no escape sequences: {:?}", ended.stderr);
}
