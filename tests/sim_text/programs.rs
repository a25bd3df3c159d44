//! Offline programs: saving, what is refused meanwhile, starting.

use crate::desk::{Desk, codes};

fn save(desk: &mut Desk, number: u16, lines: &[&str]) -> Vec<String> {
    assert_eq!(codes(&desk.say(&format!("StartSaving({number})"))), [2060]);
    for line in lines {
        assert!(desk.say(line).is_empty(), "{line}");
    }
    desk.say("StopSaving")
}

#[test]
fn a_deactivated_robot_saves_and_does_not_execute() {
    let mut desk = Desk::connected();
    let heard = save(&mut desk, 7, &["MoveJoints(5,0,0,0,0,0)", "SetCheckpoint(3)", "Delay(0.2)"]);
    assert_eq!(
        heard,
        ["[2061][3 commands saved.]", "[2065][Offline program looping is disabled.]"]
    );
    desk.bring_up();
    assert_eq!(desk.robot.target_joints(), [0.0; 6]);
    assert_eq!(desk.ask("StartProgram(7)"), "[2063][Offline program 7 started.]");
    assert_eq!(codes(&desk.until(3012)), [3030, 3013, 3012]);
    assert!((desk.robot.target_joints()[0] - 5.0).abs() < 1e-9);
    assert_eq!(codes(&desk.say("StartProgram(8)")), [3017]);
    assert_eq!(codes(&desk.say("StartProgram(main)")), [3017]);
    assert_eq!(codes(&desk.say("StartProgram(a b)")), [1003]);
}

#[test]
fn a_ready_robot_executes_what_it_saves() {
    let mut desk = Desk::ready();
    save(&mut desk, 2, &["MoveJoints(5,0,0,0,0,0)", "SetCheckpoint(8100)"]);
    let heard = desk.until(3030);
    assert_eq!(heard.last().unwrap(), "[3030][8100]");
    assert!((desk.robot.target_joints()[0] - 5.0).abs() < 1e-9);
    assert_eq!(
        desk.robot.programs(),
        [(2, vec!["MoveJoints(5,0,0,0,0,0)".to_owned(), "SetCheckpoint(8100)".to_owned(),])]
    );
}

#[test]
fn requests_are_answered_and_changes_of_state_abort() {
    let mut desk = Desk::connected();
    desk.say("StartSaving(3)");
    assert_eq!(codes(&desk.say("StartSaving(4)")), [1030]);
    assert_eq!(codes(&desk.say("GetStatusRobot")), [2007]);
    assert_eq!(codes(&desk.say("SetWorkZoneCfg(1,1)")), [1023]);
    assert_eq!(codes(&desk.say("Nonsense")), [1001]);
    assert_eq!(codes(&desk.say("Delay(-1)")), [1003]);
    assert_eq!(codes(&desk.say("SetEom(1)")), [1031]);
    assert_eq!(codes(&desk.say("StopSaving")), [1022]);
    assert!(desk.robot.programs().is_empty());
    // What aborts is not executed.
    desk.say("StartSaving(3)");
    assert_eq!(codes(&desk.say("ActivateRobot")), [1031]);
    assert!(desk.listen_ms(1000).is_empty());
    // Neither is anything kept when the connection goes.
    desk.say("StartSaving(3)");
    desk.say("Delay(1)");
    fieldarm::text_device::TextDevice::close_control(&mut desk.robot, desk.now);
    assert!(fieldarm::text_device::TextDevice::open_control(&mut desk.robot, desk.now));
    desk.heard();
    assert_eq!(codes(&desk.say("StopSaving")), [1022]);
}

#[test]
fn program_1_may_loop_from_the_button() {
    let mut desk = Desk::connected();
    desk.say("StartSaving(1)");
    assert!(desk.say("SetOfflineProgramLoop(1)").is_empty());
    desk.say("SetCheckpoint(1)");
    desk.say("Delay(0.1)");
    assert_eq!(codes(&desk.say("StopSaving")), [2061, 2064]);
    assert_eq!(codes(&desk.say("SetOfflineProgramLoop(0)")), [1022]);
    desk.bring_up();
    desk.robot.panel().press_start().unwrap();
    let heard = desk.listen_ms(550);
    let reached = codes(&heard).iter().filter(|code| **code == 3030).count();
    assert!((5..=6).contains(&reached), "{heard:?}");
    desk.say("ClearMotion");
    desk.say("ResumeMotion");
    desk.heard();
    desk.say("StartProgram(1)");
    assert_eq!(codes(&desk.until(3012)), [3030, 3013, 3012]);
}

#[test]
fn a_program_is_full_at_13000_commands() {
    let mut desk = Desk::connected();
    desk.say("StartSaving(5)");
    for _ in 0..13_000 {
        assert!(desk.say("Delay(0.001)").is_empty());
    }
    assert_eq!(codes(&desk.say("Delay(0.001)")), [1029]);
    assert_eq!(codes(&desk.say("StopSaving")), [1022]);
    assert_eq!(desk.robot.programs()[0].1.len(), 13_000);
}

#[test]
fn a_program_takes_the_values_its_variables_have_when_it_starts() {
    let mut desk = Desk::connected();
    desk.say("CreateVariable(cell.place,[1,2,3,4,5,6],10000)");
    desk.say("CreateVariable(cell.turn,11)");
    save(
        &mut desk,
        4,
        &[
            "MoveJoints(*vars.cell.place)",
            "SetVariable(cell.place,[9,9,9,9,9,9])",
            "MoveJointsRel(vars.cell.turn,0,0,0,0,0)",
        ],
    );
    let stored = desk.robot.programs();
    let mut desk = Desk::connected();
    desk.say("CreateVariable(cell.place,[1,2,3,4,5,6],10000)");
    desk.say("CreateVariable(cell.turn,11)");
    desk.say("SetVariable(cell.turn,20)");
    for (number, lines) in stored {
        desk.robot.restore_program(number, lines).unwrap();
    }
    desk.bring_up();
    desk.say("StartProgram(4)");
    desk.until(3012);
    let joints = desk.robot.target_joints();
    assert!((joints[0] - 21.0).abs() < 1e-6 && (joints[5] - 6.0).abs() < 1e-6, "{joints:?}");
    assert_eq!(desk.robot.variable(10_000), Some(&[9.0; 6][..]));
    desk.say("DeleteVariable(cell.turn)");
    let heard = desk.ask("StartProgram(4)");
    assert_eq!(heard, "[3020][Offline program 4 is invalid]");
}

#[test]
fn a_program_cannot_set_a_variable_without_a_cyclic_id() {
    let mut desk = Desk::connected();
    desk.say("CreateVariable(text,\"x\")");
    desk.say("StartSaving(4)");
    assert_eq!(codes(&desk.say("SetVariable(text,\"y\")")), [1023]);
    assert_eq!(codes(&desk.say("StopSaving")), [2061, 2065]);
}
