//! The robot's commands as methods, against the virtual robot: waited for and awaited.

use std::time::Duration;

use crate::robot::Robot;
use crate::served::LONG;
use fieldarm::link::text::{
    Answer, AnswerError, Client, EndReason, NewVariable, Simulation, Variable, VariableValue,
};
use fieldarm::wire::meca500::code::Code;
use fieldarm::wire::meca500::text::value::{
    ConfTurn, FirmwareVersion, Posture, SafetySignal, SafetyState,
};
use futures_lite::future::{block_on, zip};

/// The answer of a command that was sent.
#[track_caller]
fn get<T>(sent: Result<Answer<T>, AnswerError>) -> T {
    sent.unwrap().wait(LONG).unwrap()
}

#[track_caller]
fn refused<T: std::fmt::Debug>(sent: Result<Answer<T>, AnswerError>) -> Code {
    match sent.unwrap().wait(LONG) {
        Err(AnswerError::Refused { code, .. }) => code,
        other => panic!("{other:?}"),
    }
}

fn near(found: [f64; 6], wanted: [f64; 6]) {
    let is_near = found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-3);
    assert!(is_near, "{found:?} is not {wanted:?}");
}

#[test]
fn up_and_down() {
    let robot = Robot::start();
    let client = robot.client();
    assert_eq!(refused(client.home()), Code::NOT_ACTIVATED);
    assert!(get(client.activate_sim(Simulation::RealTime)));
    assert_eq!(get(client.get_status_robot()).simulation, 1);
    get(client.deactivate_sim());
    assert!(get(client.activate_sim(Simulation::Fast)));
    assert!(get(client.activate_sim(Simulation::AsConfigured)));
    get(client.deactivate_sim());
    get(client.activate_robot());
    assert_eq!(refused(client.activate_sim(Simulation::Fast)), Code::SIM_NEEDS_DEACTIVATION);
    assert!(get(client.set_recovery_mode(true)));
    assert!(!get(client.set_recovery_mode(false)));
    get(client.home());
    let status = get(client.get_status_robot());
    assert!(status.is_activated && status.is_homed && !status.is_in_error);
    // Nothing was in error.
    assert!(!get(client.reset_error()));
    get(client.deactivate_robot());
    get(client.activate_robot_afresh());
    assert!(!get(client.get_status_robot()).is_homed);
    get(client.deactivate_robot());
    client.reboot_robot().unwrap();
    let ended = client.wait_until(LONG, |_| false);
    assert_eq!(ended, Err(AnswerError::Ended(EndReason::ByRobot)));
}

#[test]
fn motion_is_held_back_cleared_and_goes_on() {
    let robot = Robot::start();
    let client = robot.ready();
    assert_eq!(get(client.set_time_scaling(50.0)), 50.0);
    assert_eq!(get(client.get_time_scaling()), 50.0);
    assert_eq!(refused(client.set_time_scaling(150.0)), Code::ARGUMENT_ERROR);
    get(client.set_time_scaling(100.0));
    let sent = client.send_all("MoveJoints(60,0,0,0,0,0)\n\nMoveJoints(0,0,0,0,0,0)\n").unwrap();
    assert_eq!(sent.len(), 2);
    get(client.pause_motion());
    assert!(get(client.get_status_robot()).is_paused);
    get(client.resume_motion());
    get(client.clear_motion());
    get(client.resume_motion());
    let error = client.request("MovePose(5000,0,0,0,0,0)", LONG);
    let in_error = client.until_status(|status| status.is_in_error).unwrap().wait(LONG).unwrap();
    assert!(in_error.is_paused, "{error:?}");
    assert!(get(client.reset_error()));
    get(client.resume_motion());
}

#[test]
fn who_the_robot_is() {
    let robot = Robot::start();
    let client = robot.client();
    let version = FirmwareVersion { major: 11, minor: 3, patch: 84 };
    assert_eq!(get(client.get_fw_version()), version);
    assert_eq!(get(client.get_product_type()), "Meca500");
    assert!(get(client.get_robot_serial()).parse::<u32>().is_ok());
    get(client.set_robot_name("cell-4"));
    assert_eq!(get(client.get_robot_name()), "cell-4");
    get(client.set_rtc(1_700_000_000));
    assert!((1_700_000_000..1_700_000_600).contains(&get(client.get_rtc())));
    assert!(matches!(
        client.set_robot_name("a\"b"),
        Err(AnswerError::Argument { argument: "s", .. })
    ));
}

#[test]
fn where_it_is_and_how_it_is_set() {
    let robot = Robot::start();
    let client = robot.ready();
    let there = [10.0, 5.0, -5.0, 0.0, 20.0, 0.0];
    drop(client.send_all("MoveJoints(10,5,-5,0,20,0)\nSetBlending(40)\nSetConf(1,1,1)").unwrap());
    client.until_idle().unwrap().wait(LONG).unwrap();
    let target = get(client.get_rt_target_joint_pos());
    near(target.value, there);
    let real = get(client.get_rt_joint_pos());
    near(real.value, there);
    assert!(real.timestamp_us >= target.timestamp_us);
    near(get(client.get_joints()), there);
    let pose = get(client.get_rt_cart_pos()).value;
    near(get(client.get_rt_target_cart_pos()).value, pose);
    near(get(client.get_pose()), pose);
    near(get(client.get_rt_target_joint_vel()).value, [0.0; 6]);
    near(get(client.get_rt_cart_vel()).value, [0.0; 6]);
    for six in [
        client.get_rt_joint_vel(),
        client.get_rt_joint_torq(),
        client.get_rt_target_joint_torq(),
        client.get_rt_target_cart_vel(),
        client.get_rt_wrf(),
        client.get_rt_trf(),
    ] {
        assert!(get(six).timestamp_us > 0);
    }
    assert_eq!(get(client.get_rt_accelerometer()).value[0], 5.0);
    let posture = Posture { c_s: 1, c_e: 1, c_w: 1 };
    assert_eq!(get(client.get_rt_conf()).value, posture);
    assert_eq!(get(client.get_rt_target_conf()).value, posture);
    assert_eq!(get(client.get_rt_conf_turn()).value, ConfTurn(0));
    assert_eq!(get(client.get_rt_target_conf_turn()).value, ConfTurn(0));
    assert_eq!(get(client.get_conf()), Some(posture));
    assert_eq!(get(client.get_conf_turn()), None);
    assert!(!get(client.get_auto_conf()) && get(client.get_auto_conf_turn()));
    assert_eq!(get(client.get_blending()), 40.0);
    assert_eq!(get(client.get_joint_vel()), 100.0);
    for number in [
        client.get_joint_vel_limit(),
        client.get_joint_acc(),
        client.get_cart_lin_vel(),
        client.get_cart_ang_vel(),
        client.get_cart_acc(),
        client.get_vel_timeout(),
        client.get_move_duration(),
    ] {
        assert!(get(number) > 0.0);
    }
    near(get(client.get_trf()), [0.0; 6]);
    near(get(client.get_wrf()), [0.0; 6]);
    assert_eq!(get(client.get_payload()), [0.0; 4]);
    assert_eq!(get(client.get_move_mode()), 0);
    near(get(client.get_torque_limits()), [100.0; 6]);
    assert_eq!(get(client.get_torque_limits_cfg()).mode, 2);
    assert!(!get(client.get_joint_limits_cfg()));
    let limits = get(client.get_joint_limits(2));
    assert_eq!((limits.joint, limits.min_deg, limits.max_deg), (2, -70.0, 90.0));
    assert_eq!(get(client.get_model_joint_limits(3)).min_deg, -135.0);
    assert_eq!(refused(client.get_joint_limits(7)), Code::ARGUMENT_ERROR);
}

#[test]
fn state_and_stops() {
    let robot = Robot::start();
    let client = robot.ready();
    client.checkpoint(7).unwrap().wait(LONG).unwrap();
    assert_eq!(get(client.get_checkpoint()), 7);
    assert_eq!(get(client.get_checkpoint_discarded()), 0);
    assert_eq!(get(client.get_cmd_pending_count()), 0);
    assert!(!get(client.get_torque_limits_status()));
    assert!(!get(client.get_status_gripper()).is_in_error);
    for signal in [SafetySignal::PStop2, SafetySignal::EStop, SafetySignal::ConnectionDrop] {
        assert_eq!(get(client.get_safety_stop_status(signal)), SafetyState::Clear, "{signal:?}");
    }
}

#[test]
fn what_the_robot_tells_by_itself_can_be_chosen() {
    let robot = Robot::start();
    let client = robot.client();
    let wanted = [Code(2210), Code(2213)];
    assert_eq!(get(client.set_real_time_monitoring(&wanted)), wanted);
    assert_eq!(get(client.get_real_time_monitoring()), wanted);
    assert_eq!(refused(client.set_real_time_monitoring(&[Code(2007)])), Code::ARGUMENT_ERROR);
    assert!(get(client.set_real_time_monitoring(&[])).is_empty());
    let interval = Duration::from_millis(5);
    get(client.set_monitoring_interval(interval));
    assert_eq!(get(client.get_monitoring_interval()), interval);
    assert_eq!(refused(client.set_monitoring_interval(Duration::ZERO)), Code::ARGUMENT_ERROR);
    assert!(get(client.set_eom(true)) && !get(client.set_eom(false)));
    assert!(!get(client.set_eob(false)) && get(client.set_eob(true)));
    get(client.set_ctrl_port_monitoring(true));
    client.wait_until(LONG, |state| state.timestamp_us.is_some()).unwrap();
    get(client.set_ctrl_port_monitoring(false));
}

#[test]
fn variables_live_in_the_robot() {
    let robot = Robot::start();
    let client = robot.client();
    let home = VariableValue::numbers(&[10.0, 0.0, -5.5]);
    let new = NewVariable { cyclic_id: Some(10_001), replaces: false };
    let created = get(client.create_variable("tour.home", &home, new));
    let expected =
        Variable { name: "tour.home".into(), value: home.clone(), cyclic_id: Some(10_001) };
    assert_eq!(created, expected);
    assert_eq!(get(client.get_variable("tour.home")), expected);
    let other = VariableValue::numbers(&[1.0, 2.0, 3.0]);
    assert_eq!(get(client.set_variable("tour.home", &other)).value, other);
    let shorter = VariableValue::numbers(&[1.0]);
    assert_eq!(refused(client.set_variable("tour.home", &shorter)), Code::SET_VARIABLE_FAILED);
    for (name, value) in [
        ("on", VariableValue::Truth(true)),
        ("text", VariableValue::Text("a, \"b\" (c) \\".into())),
        ("small", VariableValue::Number(1e-6)),
    ] {
        get(client.create_variable(name, &value, NewVariable::default()));
        assert_eq!(get(client.get_variable(name)).value, value);
    }
    assert_eq!(get(client.list_variables()).len(), 4);
    get(client.delete_variable("on"));
    assert_eq!(refused(client.get_variable("on")), Code::GET_VARIABLE_FAILED);
    assert_eq!(refused(client.delete_variable("on")), Code::DELETE_VARIABLE_FAILED);
    let nan = VariableValue::Number(f64::NAN);
    assert!(matches!(client.set_variable("small", &nan), Err(AnswerError::Argument { .. })));
    assert!(matches!(client.get_variable("a,b"), Err(AnswerError::Argument { .. })));
}

#[test]
fn programs_are_saved_and_run() {
    let robot = Robot::start();
    let client = robot.ready();
    assert_eq!(refused(client.start_program("12")), Code::NO_OFFLINE_PROGRAM);
    assert_eq!(refused(client.stop_saving()), Code::NOT_SAVING);
    get(client.start_saving(12));
    drop(client.send_all("MoveJoints(3,0,0,0,0,0)\nMoveJoints(6,0,0,0,0,0)").unwrap());
    drop(client.set_offline_program_loop(false).unwrap());
    assert_eq!(get(client.stop_saving()).commands, Some(2));
    drop(client.send_all("MoveJoints(0,0,0,0,0,0)").unwrap());
    get(client.start_program("12"));
    client.until_idle().unwrap().wait(LONG).unwrap();
    near(get(client.get_rt_joint_pos()).value, [6.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert!(matches!(client.start_program("a b"), Err(AnswerError::Argument { .. })));
}

#[test]
fn idle_is_behind_everything_that_was_sent() {
    let robot = Robot::start();
    let client = robot.client();
    let never = client.until_idle().unwrap().wait(LONG);
    assert!(matches!(never, Err(AnswerError::Refused { code: Code::NOT_ACTIVATED, .. })));
    get(client.activate_robot());
    drop(client.home().unwrap());
    assert!(client.until_homed().unwrap().wait(LONG).unwrap().is_homed);
    // At once when it is so already.
    assert!(client.until_homed().unwrap().wait(LONG).unwrap().is_homed);
    drop(
        client
            .send_all("SetJointVel(100)\nMoveJoints(20,0,0,0,0,0)\nMoveJoints(1,0,0,0,0,0)")
            .unwrap(),
    );
    let mut idle = client.until_idle().unwrap();
    assert_eq!(idle.wait(Duration::from_millis(5)), Err(AnswerError::TimedOut));
    let status = idle.wait(LONG).unwrap();
    assert!(status.is_end_of_block && status.is_end_of_motion);
    near(get(client.get_rt_target_joint_pos()).value, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    drop(client.send_all("MoveJoints(40,0,0,0,0,0)").unwrap());
    client.until_end_of_block().unwrap().wait(LONG).unwrap();
    drop(client.send_all("MoveJoints(0,0,0,0,0,0)").unwrap());
    let mut idle = client.until_idle().unwrap();
    get(client.clear_motion());
    assert_eq!(idle.wait(LONG), Err(AnswerError::Discarded));
}

#[test]
fn all_of_it_can_be_awaited() {
    let robot = Robot::start();
    let client = robot.client();
    block_on(async {
        client.activate_robot()?.await?;
        let (home, version) = zip(client.home()?, client.get_fw_version()?).await;
        home?;
        assert_eq!(version?.to_string(), "v11.3.84");
        assert!(client.until_homed()?.await?.is_homed);
        drop(client.send_all("SetJointVel(100)\nMoveJoints(15,0,0,0,0,0)")?);
        assert!(client.until_idle()?.await?.is_end_of_block);
        near(client.get_rt_joint_pos()?.await?.value, [15.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert!(client.until_end_of_block()?.await?.is_end_of_motion);
        let value = VariableValue::Number(4.5);
        client.create_variable("v", &value, NewVariable::default())?.await?;
        assert_eq!(client.get_variable("v")?.await?.value, value);
        assert_eq!(client.list_variables()?.await?, ["v"]);
        let refused = client.delete_variable("w")?.await.unwrap_err();
        assert!(matches!(refused, AnswerError::Refused { code: Code::DELETE_VARIABLE_FAILED, .. }));
        client.deactivate_robot()?.await?;
        let never = client.until_idle()?.await.unwrap_err();
        assert!(matches!(never, AnswerError::Refused { .. }), "{never}");
        Ok::<(), AnswerError>(())
    })
    .unwrap();
}

#[test]
fn the_watchdog_is_kept_and_cancelled() {
    let robot = Robot::start();
    let client = robot.client();
    let too_short = client.keep_connection_watchdog(Duration::from_micros(1)).unwrap_err();
    assert!(too_short.to_string().contains("0.001 to 4294967.294 s"), "{too_short}");
    let messages = client.messages();
    client.keep_connection_watchdog(Duration::from_secs(2)).unwrap();
    let first = messages.wait_next(LONG).unwrap().unwrap();
    assert_eq!(first.to_string(), "[2177][1]");
    get(client.cancel_connection_watchdog());
    assert!(get(client.get_status_robot()).is_end_of_block);
    drop(robot);
    let ended = client.wait_until(LONG, |_| false);
    assert!(matches!(ended, Err(AnswerError::Ended(_))));
    let late = client.keep_connection_watchdog(Duration::from_secs(2));
    assert!(matches!(late, Err(AnswerError::Ended(_))));
}

#[test]
fn a_listener_hears_the_greeting() {
    let robot = Robot::start();
    let options = fieldarm::link::text::ClientOptions::default();
    let (client, messages) = Client::connect_listening(robot.endpoints.control, options).unwrap();
    let greeting = messages.wait_next(LONG).unwrap().unwrap();
    assert_eq!(greeting.code, Code::CONNECTED);
    get(client.get_status_robot());
}
