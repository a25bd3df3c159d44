//! Messages in the order in which the manual prints them.

use fieldarm::sim::meca500::readings::{
    CommandsWhileBusy, ConnectionDropCode, EndOfMovementAfterPause, TextInErrorMode,
};
use fieldarm::sim::meca500::{PStop2Mode, Readings};
use fieldarm::text_device::{LineProblem, TextDevice};

use crate::desk::{Desk, code, codes};

#[test]
fn the_greeting_comes_first_and_names_the_robot() {
    let mut desk = Desk::connected_with(|_| {});
    assert_eq!(desk.heard(), ["[3000][Connected to Meca500 R4 v11.3.84]"]);
}

#[test]
fn activation_and_homing_are_answered_when_they_are_done() {
    let mut desk = Desk::connected();
    assert!(desk.say("ActivateRobot").is_empty());
    assert_eq!(codes(&desk.until(2000)), [2000]);
    assert_eq!(desk.ask("ActivateRobot()"), "[2000][Motors activated.]");
    assert!(desk.say("Home").is_empty());
    assert_eq!(codes(&desk.until(2002)), [2002]);
    assert_eq!(desk.ask("Home"), "[2002][Homing done.]");
    assert_eq!(desk.ask("GetStatusRobot"), "[2007][1,1,0,0,0,1,1]");
    assert!(desk.listen_ms(50).is_empty());
    let statuses = desk.monitored(2007);
    let wanted = ["[2007][1,0,0,0,0,1,1]", "[2007][1,0,0,0,0,0,0]", "[2007][1,1,0,0,0,1,1]"];
    assert_eq!(statuses, wanted);
}

#[test]
fn commands_sent_at_once_wait_for_activation_and_homing() {
    let mut desk = Desk::connected();
    for line in
        ["ActivateRobot", "Home", "MoveJoints(5,0,0,0,0,0)", "SetCheckpoint(1)", "GetBlending"]
    {
        assert!(desk.say(line).is_empty(), "{line}");
    }
    // What any state allows does not wait.
    assert_eq!(codes(&desk.say("GetStatusRobot")), [2007]);
    assert_eq!(codes(&desk.say("PauseMotion")), [1005]);
    assert_eq!(codes(&desk.until(3030)), [2000, 2002, 2150, 3030]);
    desk.say("DeactivateRobot");
    assert!(desk.say("SetJointLimitsCfg(1)").is_empty());
    assert_eq!(codes(&desk.until(2093)).last(), Some(&2093));
    // An E-Stop ends the waiting too.
    let mut desk = Desk::connected();
    desk.say("ActivateRobot");
    desk.say("Home");
    desk.robot.panel().press_e_stop();
    assert_eq!(codes(&desk.listen_ms(10)), [3070, 1013, 1005]);
}

#[test]
fn commands_sent_at_once_are_refused_under_the_other_reading() {
    let mut desk = Desk::connected_with(|settings| {
        settings.readings.commands_while_busy = CommandsWhileBusy::Judged;
    });
    desk.heard();
    desk.say("ActivateRobot");
    assert_eq!(codes(&desk.say("Home")), [1005]);
    assert_eq!(codes(&desk.say("MoveJoints(5,0,0,0,0,0)")), [1005]);
}

#[test]
fn an_activation_that_an_e_stop_ends_is_told_as_failed() {
    let mut desk = Desk::connected();
    desk.say("ActivateRobot");
    desk.wait_ms(20);
    desk.robot.panel().press_e_stop();
    assert_eq!(codes(&desk.listen_ms(300)), [3070, 1013]);
    assert_eq!(codes(&desk.say("ActivateRobot")), [1013]);
    desk.robot.panel().release_e_stop();
    desk.robot.panel().press_reset();
    assert_eq!(desk.listen_ms(2), ["[3070][0]"]);
    desk.say("ActivateRobot");
    desk.until(2000);
}

#[test]
fn activate_robot_1_forgets_the_homing() {
    let mut desk = Desk::ready();
    desk.say("DeactivateRobot");
    assert_eq!(codes(&desk.until(2004)), [2004]);
    desk.say("ActivateRobot");
    desk.until(2000);
    assert!(desk.ask("GetStatusRobot").starts_with("[2007][1,1,"));
    desk.say("DeactivateRobot");
    desk.until(2004);
    desk.say("ActivateRobot(1)");
    desk.until(2000);
    assert!(desk.ask("GetStatusRobot").starts_with("[2007][1,0,"));
    assert_eq!(codes(&desk.say("MoveJoints(1,1,1,1,1,1)")), [1006]);
}

#[test]
fn end_of_block_and_end_of_movement_come_in_their_places() {
    let mut desk = Desk::ready();
    assert_eq!(codes(&desk.say("SetEom(1)")), [2052]);
    // The manual's own example: EOM when the robot stops, EOB when the delay has elapsed. Between
    // the two moves it does not stand for a millisecond.
    for line in [
        "MoveJoints(10,0,0,0,0,0)",
        "SetTrf(0,0,10,0,0,0)",
        "MovePose(190,20,298,0,90,0)",
        "Delay(0.5)",
    ] {
        assert!(desk.say(line).is_empty(), "{line}");
    }
    let mut heard = desk.until(3004);
    heard.extend(desk.listen_ms(450));
    assert_eq!(codes(&heard), [3004]);
    assert_eq!(codes(&desk.until(3012)), [3012]);
    assert_eq!(codes(&desk.say("SetEom(0)")), [2053]);
    assert_eq!(codes(&desk.say("SetEob(0)")), [2055]);
    desk.say("MoveJoints(0,0,0,0,0,0)");
    heard = desk.listen_ms(5000);
    assert!(heard.is_empty(), "{heard:?}");
}

#[test]
fn checkpoints_are_reached_or_discarded_on_both_ports() {
    let mut desk = Desk::ready();
    for line in ["MoveJoints(5,0,0,0,0,0)", "SetCheckpoint(7)", "SetCheckpoint(8191)", "Delay(1)"] {
        desk.say(line);
    }
    assert_eq!(codes(&desk.say("SetCheckpoint(8192)")), [1003]);
    desk.say("SetCheckpoint(9)");
    let heard = desk.until(3030);
    assert_eq!(heard, ["[3030][7]"]);
    assert_eq!(desk.until(3030), ["[3030][8191]"]);
    assert_eq!(desk.ask("GetCheckpoint"), "[2157][8191]");
    assert_eq!(codes(&desk.say("ClearMotion")), [3040, 2044, 3012]);
    assert_eq!(desk.ask("GetCheckpointDiscarded"), "[2149][9]");
    assert_eq!(desk.monitored(3030).len(), 2);
}

#[test]
fn pausing_a_moving_robot_tells_its_stop() {
    for (reading, enabled, wanted) in [
        (EndOfMovementAfterPause::Always, false, vec![2042, 3004]),
        (EndOfMovementAfterPause::WhenEnabled, false, vec![2042]),
        (EndOfMovementAfterPause::WhenEnabled, true, vec![2042, 3004]),
        (EndOfMovementAfterPause::Always, true, vec![2042, 3004]),
    ] {
        let mut desk = Desk::ready_with(|settings| {
            settings.readings.end_of_movement_after_pause = reading;
        });
        desk.say(if enabled { "SetEom(1)" } else { "SetEom(0)" });
        desk.say("MoveJoints(60,0,0,0,0,0)");
        desk.wait_ms(300);
        desk.monitored.clear();
        let mut heard = desk.say("PauseMotion");
        heard.extend(desk.listen_ms(500));
        assert_eq!(codes(&heard), wanted, "{reading:?} {enabled}");
        // A pause of an arm at rest tells no stop.
        assert_eq!(codes(&desk.say("PauseMotion")), [2042]);
        assert!(desk.listen_ms(100).is_empty());
        assert_eq!(desk.monitored(2007).last().unwrap(), "[2007][1,1,0,0,1,0,1]");
        assert_eq!(codes(&desk.say("ResumeMotion")), [2043]);
        // Resumed before it stood: there is no stop to tell.
        desk.wait_ms(300);
        desk.say("PauseMotion");
        desk.wait_ms(3);
        desk.say("ResumeMotion");
        let heard = desk.until(3012);
        assert_eq!(codes(&heard).contains(&3004), enabled);
    }
}

#[test]
fn clearing_ends_with_a_status_of_a_paused_robot_with_nothing_to_do() {
    let mut desk = Desk::ready();
    desk.say("MoveJoints(60,0,0,0,0,0)");
    desk.wait_ms(300);
    desk.monitored.clear();
    assert_eq!(codes(&desk.say("ClearMotion")), [2044]);
    assert_eq!(codes(&desk.until(3012)), [3012]);
    assert_eq!(desk.monitored.iter().filter(|message| code(message) == 2044).count(), 1);
    assert_eq!(desk.monitored(2007).last().unwrap(), "[2007][1,1,0,0,1,1,1]");
    assert_eq!(codes(&desk.say("ResumeMotion")), [2043]);
}

#[test]
fn an_error_is_told_once_and_reset() {
    let mut desk = Desk::ready();
    desk.monitored.clear();
    desk.say("SetCheckpoint(3)");
    assert_eq!(codes(&desk.listen_ms(2)), [3030, 3012]);
    assert!(desk.say("MoveJoints(0,0,71,0,0,0)").is_empty());
    desk.say("SetCheckpoint(4)");
    let heard = desk.listen_ms(5);
    assert_eq!(codes(&heard), [1007, 3040, 3012], "{heard:?}");
    assert_eq!(desk.monitored(2007).last().unwrap(), "[2007][1,1,0,1,1,1,1]");
    assert_eq!(codes(&desk.say("MoveJoints(0,0,0,0,0,0)")), [1011]);
    // A checkpoint that cannot enter the queue is discarded there and then.
    assert_eq!(desk.say("SetCheckpoint(8005)")[1..], ["[3040][8005]"]);
    assert_eq!(desk.ask("GetCheckpointDiscarded"), "[2149][8005]");
    assert_eq!(codes(&desk.say("ResumeMotion")), [1011]);
    assert_eq!(codes(&desk.say("GetBlending")), [2150]);
    assert_eq!(desk.ask("ResetError"), "[2005][The error was reset.]");
    assert_eq!(desk.ask("ResetError"), "[2006][There was no error to reset.]");
    desk.say("MoveJoints(1,0,0,0,0,0)");
    assert!(desk.listen_ms(1000).is_empty());
    assert_eq!(codes(&desk.say("ResumeMotion")), [2043]);
    desk.until(3012);
}

#[test]
fn requests_in_error_mode_follow_the_reading() {
    let mut desk = Desk::ready_with(|settings| {
        settings.readings.text_in_error_mode = TextInErrorMode::Refused;
    });
    desk.say("MoveJoints(0,0,71,0,0,0)");
    assert_eq!(codes(&desk.listen_ms(2)), [1007, 3012]);
    for line in ["GetBlending", "SetEob(1)", "GetRtJointPos", "ListVariables"] {
        assert_eq!(codes(&desk.say(line)), [1011], "{line}");
    }
    assert!(desk.ask("GetStatusRobot").starts_with("[2007][1,1,0,1,1,"));
    assert_eq!(codes(&desk.say("SyncCmdQueue(4294967295)")), [2097]);
    desk.say("ResetError");
    assert_eq!(codes(&desk.say("GetBlending")), [2150]);
}

#[test]
fn p_stop_2_is_told_as_the_manual_prints_it() {
    for (mode, clears) in [(3, true), (2, false)] {
        let mut desk = Desk::connected();
        assert_eq!(codes(&desk.say(&format!("SetPStop2Cfg({mode})"))), [2178]);
        let kept = desk.robot.settings().persistent.p_stop2;
        assert_eq!(kept, if clears { PStop2Mode::Clear } else { PStop2Mode::Pause });
        desk.bring_up();
        desk.say("MoveJoints(60,0,0,0,0,0)");
        desk.say("SetCheckpoint(5)");
        desk.wait_ms(300);
        desk.heard();
        desk.robot.panel().press_p_stop2();
        let heard = desk.listen_ms(1000);
        let wanted: &[u16] = if clears { &[3032, 3040, 2044, 3012] } else { &[3032] };
        assert_eq!(codes(&heard), wanted);
        assert_eq!(heard[0], "[3032][1]");
        let heard = desk.say("MoveJoints(50,0,0,0,0,0)");
        if clears {
            assert_eq!(heard, ["[3032][1]"]);
        } else {
            assert!(heard.is_empty(), "{heard:?}");
        }
        assert_eq!(desk.ask("GetSafetyStopStatus(3032)"), "[3032][1]");
        desk.robot.panel().release_p_stop2();
        assert_eq!(desk.listen_ms(5), ["[3032][2]"]);
        let heard = desk.say("ResumeMotion");
        assert_eq!(heard, ["[2043][Motion resumed.]", "[3032][0]"]);
        if !clears {
            assert_eq!(codes(&desk.until(3012)), [3030, 3012]);
        }
    }
}

#[test]
fn an_e_stop_clears_deactivates_and_waits_for_reset() {
    let mut desk = Desk::ready();
    desk.say("MoveJoints(60,0,0,0,0,0)");
    desk.say("SetCheckpoint(5)");
    desk.wait_ms(300);
    desk.heard();
    desk.monitored.clear();
    desk.robot.panel().press_e_stop();
    assert_eq!(codes(&desk.listen_ms(2000)), [3070, 3040, 2044, 2004]);
    assert_eq!(desk.monitored(2007).last().unwrap(), "[2007][0,1,0,0,1,1,1]");
    desk.robot.panel().release_e_stop();
    assert_eq!(desk.listen_ms(5), ["[3070][2]"]);
    desk.robot.panel().press_reset();
    assert_eq!(desk.listen_ms(5), ["[3070][0]"]);
}

#[test]
fn a_redundancy_fault_is_told() {
    let mut desk = Desk::ready();
    desk.robot.panel().set_safety_mismatch(true);
    let heard = desk.listen_ms(1200);
    assert_eq!(codes(&heard), [3084, 2044, 2004]);
}

#[test]
fn a_connection_that_drops_while_moving_stops_the_robot() {
    for (reading, number) in
        [(ConnectionDropCode::Tables, 3086), (ConnectionDropCode::Section4, 3081)]
    {
        let mut desk =
            Desk::ready_with(|settings| settings.readings.connection_drop_code = reading);
        desk.say("MoveJoints(60,0,0,0,0,0)");
        desk.wait_ms(300);
        desk.monitored.clear();
        desk.robot.close_control(desk.now);
        desk.wait_ms(500);
        assert_eq!(desk.monitored(number), [format!("[{number}][1]")]);
        let joints = desk.robot.target_joints();
        assert!(joints[0] < 59.0 && !desk.robot.panel().fit_tool(Default::default()));
        assert!(desk.robot.open_control(desk.now));
        assert_eq!(codes(&desk.heard()), [3000, number]);
        let heard = desk.say("ResumeMotion");
        assert_eq!(heard, ["[2043][Motion resumed.]".to_owned(), format!("[{number}][0]")]);
        desk.until(3012);
        // At rest a connection may go without a word.
        desk.monitored.clear();
        desk.robot.close_control(desk.now);
        desk.wait_ms(10);
        assert!(desk.monitored(number).is_empty());
    }
}

#[test]
fn the_connection_watchdog_ends_the_connection() {
    let mut desk = Desk::ready();
    assert_eq!(desk.ask("ConnectionWatchdog(0.1)"), "[2177][1]");
    desk.wait_ms(90);
    assert!(desk.say("ConnectionWatchdog(0.1)").is_empty());
    desk.wait_ms(90);
    assert!(!desk.robot.drops_control());
    assert_eq!(desk.ask("ConnectionWatchdog(0)"), "[2177][0]");
    desk.wait_ms(500);
    assert!(!desk.robot.drops_control());
    desk.say("ConnectionWatchdog(0.1)");
    let heard = desk.listen_ms(101);
    assert!(desk.robot.drops_control());
    assert_eq!(heard, ["[3086][1]"]);
    desk.robot.close_control(desk.now);
    assert!(!desk.robot.drops_control());
    assert!(desk.robot.open_control(desk.now));
    assert_eq!(codes(&desk.heard()), [3000, 3086]);
    assert_eq!(codes(&desk.say("ResumeMotion")), [2043, 3086]);
}

#[test]
fn a_reboot_is_told_to_who_connects_afterwards() {
    let mut desk = Desk::connected();
    desk.say("SetNetworkOptions(9)");
    assert_eq!(desk.ask("GetNetworkOptions"), "[2119][9,0,0,0,0,0]");
    assert_eq!(desk.robot.protocol_settings().keep_alive_packets, 3);
    desk.say("SetEom(1)");
    desk.say("RebootRobot");
    assert!(!desk.robot.is_on_text());
    desk.robot.close_control(desk.now);
    assert!(!desk.robot.open_control(desk.now));
    desk.wait_ms(6000);
    assert!(desk.robot.is_on_text());
    assert_eq!(desk.robot.protocol_settings().keep_alive_packets, 9);
    assert_eq!(desk.robot.keep_alive_packets(), 9);
    assert!(desk.robot.open_control(desk.now));
    assert_eq!(codes(&desk.heard()), [3000, 3083]);
    assert_eq!(codes(&desk.say("ActivateRobot")), [1013]);
    desk.robot.panel().press_reset();
    assert_eq!(desk.listen_ms(2), ["[3083][0]"]);
    desk.bring_up();
}

#[test]
fn lines_that_a_server_refuses_are_answered() {
    let mut desk = Desk::connected();
    for (problem, wanted) in
        [(LineProblem::TooLong, 3003), (LineProblem::NotAscii, 1001), (LineProblem::Empty, 1001)]
    {
        desk.robot.reject(desk.now, problem);
        assert_eq!(codes(&desk.heard()), [wanted]);
    }
}

#[test]
fn simulation_is_told_and_fast_simulation_takes_no_time() {
    let mut desk = Desk::connected();
    assert_eq!(codes(&desk.say("ActivateSim(2)")), [2045]);
    desk.bring_up();
    assert_eq!(desk.ask("GetStatusRobot"), "[2007][1,1,2,0,0,1,1]");
    for line in ["MoveJoints(60,0,0,0,0,0)", "SetCheckpoint(1)", "Delay(100)", "SetCheckpoint(2)"] {
        desk.say(line);
    }
    let heard = desk.listen_ms(20);
    assert_eq!(codes(&heard), [3030, 3030, 3012]);
    assert_eq!(codes(&desk.say("DeactivateSim")), [1027]);
    desk.say("DeactivateRobot");
    desk.until(2004);
    assert_eq!(codes(&desk.say("DeactivateSim")), [2046]);
    assert_eq!(codes(&desk.say("SetSimModeCfg(2)")), [2188]);
    assert_eq!(desk.ask("GetSimModeCfg"), "[2187][2]");
    desk.say("ActivateSim");
    assert!(desk.ask("GetStatusRobot").starts_with("[2007][0,0,2,"));
}

#[test]
fn recovery_mode_lets_an_unhomed_robot_move_slowly() {
    let mut desk = Desk::connected();
    assert_eq!(desk.ask("SetRecoveryMode(1)"), "[2049][Recovery mode enabled]");
    desk.say("ActivateRobot");
    desk.until(2000);
    desk.say("MoveJoints(1,0,0,0,0,0)");
    assert_eq!(codes(&desk.until(3012)), [2051, 3012]);
    assert_eq!(desk.monitored(2049).len(), 1);
}

#[test]
fn every_reading_leaves_a_robot_that_answers() {
    for variation in Readings::variations() {
        let mut desk = Desk::connected_with(|settings| settings.readings = variation.readings);
        desk.heard();
        desk.bring_up();
        desk.say("ResumeMotion");
        desk.say("MoveJoints(10,0,0,0,0,0)");
        desk.say("SetCheckpoint(1)");
        desk.until(3030);
        desk.say("PauseMotion");
        desk.say("ClearMotion");
        desk.say("ResumeMotion");
        desk.wait_ms(50);
        desk.heard();
        for line in ["GetWrf", "GetPStop2Cfg", "GetExtToolFwVersion", "GetExtToolSim", "GetRtc"] {
            let heard = desk.say(line);
            assert!(heard.len() == 1 && code(&heard[0]) >= 2000, "{}: {heard:?}", variation.switch);
        }
    }
}
