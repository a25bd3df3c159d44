//! Requests: what was set is read back, in the manual's order.

use crate::desk::{Desk, codes, content, values};

#[test]
fn queued_settings_are_read_back_once_they_are_in_force() {
    let mut desk = Desk::ready();
    for (set, get, wanted) in [
        ("SetAutoConf(0)", "GetAutoConf", "[2028][0]"),
        ("SetConf(1,-1,1)", "GetConf", "[2029][1,-1,1]"),
        ("SetAutoConf(1)", "GetConf", "[2029][*,*,*]"),
        ("SetConfTurn(2)", "GetConfTurn", "[2036][2]"),
        ("SetAutoConfTurn(1)", "GetConfTurn", "[2036][*]"),
        ("SetAutoConfTurn(1)", "GetAutoConfTurn", "[2031][1]"),
        ("SetBlending(30)", "GetBlending", "[2150][30]"),
        ("SetVelTimeout(0.125)", "GetVelTimeout", "[2151][0.125]"),
        ("SetJointVel(33.3)", "GetJointVel", "[2152][33.3]"),
        ("SetJointAcc(44)", "GetJointAcc", "[2153][44]"),
        ("SetCartLinVel(55.5)", "GetCartLinVel", "[2154][55.5]"),
        ("SetCartAngVel(66)", "GetCartAngVel", "[2155][66]"),
        ("SetCartAcc(77)", "GetCartAcc", "[2156][77]"),
        ("SetJointVelLimit(88)", "GetJointVelLimit", "[2169][88]"),
        ("SetMoveMode(1)", "GetMoveMode", "[2189][1]"),
        ("SetMoveDurationCfg(1)", "GetMoveDurationCfg", "[2190][1]"),
        ("SetMoveDuration(0.0000000015)", "GetMoveDuration", "[2191][0.000000002]"),
        ("SetPayload(0.5,1,2,3)", "GetPayload", "[2192][0.5,1,2,3]"),
        ("SetTorqueLimits(10,20,30,40,50,60)", "GetTorqueLimits", "[2161][10,20,30,40,50,60]"),
        ("SetTorqueLimitsCfg(2,1)", "GetTorqueLimitsCfg", "[2160][2,1]"),
        ("SetTrf(1,2,3,4,5,6.5)", "GetTrf", "[2014][1,2,3,4,5,6.5]"),
        ("SetWrf(6,5,4,3,2,1)", "GetWrf", "[2013][6,5,4,3,2,1]"),
    ] {
        assert!(desk.say(set).is_empty(), "{set}");
        desk.until(3012);
        assert_eq!(desk.ask(get), wanted, "{set}");
    }
}

#[test]
fn persistent_settings_are_read_back_and_survive_a_boot() {
    let mut desk = Desk::connected();
    let settings = [
        ("SetJointLimits(2,-30,40)", "[2092][2]", "GetJointLimitsCfg", "[2094][0]"),
        (
            "SetJointLimitsCfg(1)",
            "[2093][User-defined joint limits enabled.]",
            "GetJointLimits(2)",
            "[2090][2,-30,40]",
        ),
        ("SetCalibrationCfg(0)", "[2170][0]", "GetCalibrationCfg", "[2171][0]"),
        (
            "SetCollisionCfg(1)",
            "[2180][Collision configuration set successfully.]",
            "GetCollisionCfg",
            "[2181][1]",
        ),
        (
            "SetToolSphere(1,2,3,4)",
            "[2168][Tool sphere set successfully.]",
            "GetToolSphere",
            "[2167][1,2,3,4]",
        ),
        (
            "SetWorkZoneCfg(0,3)",
            "[2164][Work zone configuration set successfully.]",
            "GetWorkZoneCfg",
            "[2163][0,3]",
        ),
        (
            "SetWorkZoneLimits(1,2,3,4,5,6)",
            "[2166][Workspace limits set successfully.]",
            "GetWorkZoneLimits",
            "[2165][1,2,3,4,5,6]",
        ),
        (
            "SetPStop2Cfg(2)",
            "[2178][PStop2 configuration set successfully]",
            "GetPStop2Cfg",
            "[2179][2]",
        ),
        (
            "SetSimModeCfg(2)",
            "[2188][Simulation mode configuration set successfully.]",
            "GetSimModeCfg",
            "[2187][2]",
        ),
        (
            "SetRobotName(left)",
            "[2085][Command successful: 'SetRobotName(left)'.]",
            "GetRobotName",
            "[2095][left]",
        ),
        (
            "SetNetworkOptions(5)",
            "[2085][Command successful: 'SetNetworkOptions(5)'.]",
            "GetNetworkOptions",
            "[2119][5,0,0,0,0,0]",
        ),
        (
            "EnableEtherNetIp(2)",
            "[2085][Command successful: 'EnableEtherNetIp(2)'.]",
            "GetEthernetIpEnabled",
            "[2073][2]",
        ),
        (
            "EnableProfinet(1)",
            "[2085][Command successful: 'EnableProfinet(1)'.]",
            "GetProfinetEnabled",
            "[2077][1]",
        ),
    ];
    for (set, answer, get, wanted) in settings {
        assert_eq!(desk.ask(set), answer);
        assert_eq!(desk.ask(get), wanted, "{set}");
    }
    desk.say("RebootRobot");
    assert_eq!(codes(&desk.listen_ms(6000)), [3083]);
    for (set, _, get, wanted) in settings.into_iter().filter(|row| row.2 != "GetJointLimitsCfg") {
        assert_eq!(desk.ask(get), wanted, "{set}");
    }
    assert_eq!(desk.ask("GetModelJointLimits(2)").get(..6), Some("[1005]"));
}

#[test]
fn the_robot_says_what_it_is() {
    let mut desk = Desk::ready();
    assert_eq!(desk.ask("GetFwVersion"), "[2081][v11.3.84]");
    assert_eq!(desk.ask("GetFwVersionFull"), "[2082][11.3.84.0-official]");
    assert_eq!(desk.ask("GetRobotSerial"), "[2083][87654321]");
    assert_eq!(desk.ask("GetProductType"), "[2084][Meca500]");
    assert_eq!(desk.ask("GetRobotCalibrated"), "[2122][0]");
    assert_eq!(desk.ask("GetModelJointLimits(3)"), "[2113][3,-135,70]");
    assert_eq!(desk.ask("GetCmdPendingCount"), "[2080][0]");
    assert_eq!(desk.ask("GetExtToolFwVersion"), "[2086][v0.0.0]");
    assert_eq!(desk.ask("-GetProductType()"), "[2084][Meca500]");
}

#[test]
fn the_clock_is_set_and_runs_beside_the_timestamps() {
    let mut desk = Desk::connected();
    let before = values(&desk.ask("GetRtTrf"))[0];
    desk.say("SetRtc(2000000000)");
    desk.wait_ms(2500);
    assert_eq!(desk.ask("GetRtc"), "[2140][2000000002]");
    assert_eq!(values(&desk.ask("GetRtTrf"))[0], before + 2_500_000.0);
}

#[test]
fn real_time_data_begin_with_the_timestamp() {
    let mut desk = Desk::ready();
    desk.say("SetJointVel(10)");
    desk.say("MoveJoints(80,0,0,0,0,0)");
    desk.wait_ms(1500);
    for (line, number, count) in [
        ("GetRtTargetJointPos", 2200, 7),
        ("GetRtTargetCartPos", 2201, 7),
        ("GetRtTargetJointVel", 2202, 7),
        ("GetRtTargetJointTorq", 2203, 7),
        ("GetRtTargetCartVel", 2204, 7),
        ("GetRtTargetConf", 2208, 4),
        ("GetRtTargetConfTurn", 2209, 2),
        ("GetRtJointPos", 2210, 7),
        ("GetRtCartPos", 2211, 7),
        ("GetRtJointVel", 2212, 7),
        ("GetRtJointTorq", 2213, 7),
        ("GetRtCartVel", 2214, 7),
        ("GetRtConf", 2218, 4),
        ("GetRtConfTurn", 2219, 2),
        ("GetRtAccelerometer(5)", 2220, 5),
        ("GetRtWrf", 2228, 7),
        ("GetRtTrf", 2229, 7),
        ("GetRtExtToolStatus", 2300, 6),
        ("GetRtGripperForce", 2321, 2),
        ("GetRtGripperPos", 2322, 2),
    ] {
        let message = desk.ask(line);
        assert_eq!(codes(std::slice::from_ref(&message)), [number]);
        let values = values(&message);
        assert_eq!(values.len(), count, "{message}");
        assert_eq!(values[0], desk.now.as_nanos() as f64 / 1000.0);
    }
    let joints = values(&desk.ask("GetRtTargetJointPos"));
    assert!((joints[1] - desk.robot.target_joints()[0]).abs() < 1e-6);
    let velocity = values(&desk.ask("GetRtTargetJointVel"));
    assert!((velocity[1] - 15.0).abs() < 0.1, "{velocity:?}");
    let cartesian = values(&desk.ask("GetRtTargetCartVel"));
    let speed = cartesian[1].hypot(cartesian[2]);
    assert!((speed - 190.0 * 15f64.to_radians()).abs() < 0.5, "{cartesian:?}");
    let gravity = values(&desk.ask("GetRtAccelerometer(5)"));
    assert!((gravity[2].hypot(gravity[3]).hypot(gravity[4]) - 16_000.0).abs() < 3.0);
}

#[test]
fn sync_cmd_queue_marks_the_answer_behind_it() {
    let mut desk = Desk::connected();
    assert_eq!(desk.ask("SyncCmdQueue(4294967295)"), "[2097][4294967295]");
    assert_eq!(content(&desk.ask("SyncCmdQueue(16777217)")), "16777217");
    assert_eq!(codes(&desk.say("SyncCmdQueue(4294967296)")), [1003]);
}

#[test]
fn a_capture_is_told_to_end() {
    let mut desk = Desk::connected();
    assert_eq!(desk.ask("TcpDump(2)"), "[3035][TCP dump capture started for 2 seconds.]");
    assert!(desk.listen_ms(1999).is_empty());
    assert_eq!(codes(&desk.listen_ms(2)), [3036]);
    desk.say("TcpDump(2)");
    assert_eq!(codes(&desk.say("TcpDumpStop")), [3036]);
    assert!(desk.listen_ms(3000).is_empty());
}

#[test]
fn the_tool_is_emulated_as_asked() {
    let mut desk = Desk::connected();
    assert_eq!(desk.ask("SetExtToolSim(20)"), "[2047][20]");
    desk.bring_up();
    desk.say("SetValveState(0,1)");
    desk.until(3012);
    assert!(desk.ask("GetRtValveState").ends_with(",0,1]"));
    assert!(desk.ask("GetRtExtToolStatus").contains(",20,0,"));
    assert_eq!(codes(&desk.say("SetExtToolSim(11)")), [1042]);
    assert_eq!(desk.ask("GetExtToolSim"), "[2047][20]");
    desk.say("DeactivateRobot");
    desk.until(2004);
    assert_eq!(desk.ask("SetExtToolSim(1)"), "[2047][10]");
    assert_eq!(desk.ask("SetExtToolSim(0)"), "[2047][0]");
}
