//! Activation, homing, deactivation, reboot, simulation, recovery mode, brakes, time.
#![cfg(feature = "sim")]

mod sim_support;

use fieldarm::cycle::CyclicDevice;
use fieldarm::sim::meca500::readings::{
    ActivationOutsideLimits, ClearedAtPowerUp, HeldTriggeredBits, HomedInRecovery, HostTimeReading,
    PausedAfterActivation, PausedAtPowerUp, PowerAfterReboot, RebootSignal, TimestampAfterBoot,
};
use fieldarm::sim::meca500::{
    CyclicBus, FittedTool, HOMING_TRAVEL_DEG, Lifecycle, RobotEvent, RobotSettings, SimulationType,
};
use fieldarm::wire::meca500::code::Code;
use fieldarm::wire::meca500::image::{
    BrakesControlFlags, MotionControlFlags, MotionStatusFlags, RobotControlFlags, RobotStatusFlags,
    SafetyPower, SafetySignals,
};
use sim_support::{Cell, close};

#[test]
fn a_robot_activates_homes_and_moves() {
    let mut cell = Cell::new(RobotSettings::default());
    cell.cycle();
    assert_eq!(cell.status(), RobotStatusFlags::BRAKES_ENGAGED);
    assert_eq!(cell.fifo_space(), 13_000);
    cell.activate();
    cell.home();
    let target = [10.0, -20.0, 30.0, -40.0, 50.0, -60.0];
    cell.sent(1, &target);
    cell.sent(17, &[7.0]);
    assert!(!cell.has(MotionStatusFlags::EOM));
    cell.until("the checkpoint", |cell| cell.reached() == 7);
    assert!(cell.is_at(target));
    cell.cycle();
    assert!(cell.has(MotionStatusFlags::EOB | MotionStatusFlags::EOM));
    assert_eq!(cell.fifo_space(), 13_000);
}

#[test]
fn busy_is_set_only_while_activating_homing_and_deactivating() {
    let mut cell = Cell::new(RobotSettings::default());
    cell.cycle();
    assert!(!cell.is(RobotStatusFlags::BUSY));
    cell.control(RobotControlFlags::ACTIVATE_ROBOT, true);
    cell.cycle();
    assert!(cell.is(RobotStatusFlags::BUSY) && !cell.is(RobotStatusFlags::ACTIVATED));
    cell.until("activated", |cell| cell.is(RobotStatusFlags::ACTIVATED));
    assert!(!cell.is(RobotStatusFlags::BUSY));
    cell.control(RobotControlFlags::ACTIVATE_ROBOT, false);
    cell.control(RobotControlFlags::HOME, true);
    cell.cycle();
    assert!(cell.is(RobotStatusFlags::BUSY) && !cell.is(RobotStatusFlags::HOMED));
    cell.until("homed", |cell| cell.is(RobotStatusFlags::HOMED));
    assert!(!cell.is(RobotStatusFlags::BUSY));
    cell.control(RobotControlFlags::HOME, false);
    cell.sent(1, &[5.0]);
    assert!(!cell.is(RobotStatusFlags::BUSY), "moving is not busy");
    cell.control(RobotControlFlags::DEACTIVATE_ROBOT, true);
    cell.cycle();
    assert!(cell.is(RobotStatusFlags::BUSY) && cell.is(RobotStatusFlags::ACTIVATED));
    cell.until("deactivated", |cell| !cell.is(RobotStatusFlags::ACTIVATED));
    assert!(!cell.is(RobotStatusFlags::BUSY));
}

#[test]
fn homing_lasts_three_seconds_and_turns_every_joint_out_and_back() {
    let near_limit = [0.0, 89.0, 0.0, 0.0, 0.0, 0.0];
    let settings = RobotSettings { joints: near_limit, ..RobotSettings::default() };
    let mut cell = Cell::new(settings);
    cell.cycle();
    cell.activate();
    let start = cell.joints();
    cell.control(RobotControlFlags::HOME, true);
    cell.cycle();
    let mut furthest = [0.0_f32; 6];
    let cycles = cell.until("homed", |cell| {
        for (furthest, (now, start)) in furthest.iter_mut().zip(cell.joints().iter().zip(start)) {
            if (now - start).abs() > furthest.abs() {
                *furthest = now - start;
            }
        }
        cell.is(RobotStatusFlags::HOMED)
    });
    assert_eq!(cycles, 3000);
    let mut expected = HOMING_TRAVEL_DEG.map(|travel| travel as f32);
    expected[1] = -expected[1];
    assert!(close(furthest, expected, 0.02), "{furthest:?}");
    assert!(close(cell.joints(), start, 1e-5));
}

#[test]
fn homing_survives_deactivation_but_not_command_1002() {
    let mut cell = Cell::ready();
    cell.deactivate();
    assert!(cell.is(RobotStatusFlags::HOMED));
    cell.activate();
    assert!(cell.is(RobotStatusFlags::HOMED));
    cell.sent(1, &[5.0]);
    cell.finish(1);
    cell.deactivate();
    cell.sent(1002, &[]);
    assert!(!cell.is(RobotStatusFlags::HOMED));
    cell.activate();
    cell.sent(1, &[0.0]);
    cell.cycles(10);
    assert!(cell.is_at([5.0, 0.0, 0.0, 0.0, 0.0, 0.0]), "not homed: refused");
    assert!(cell.events().contains(&RobotEvent::Refused(Code::NOT_HOMED)));
    cell.home();
}

#[test]
fn home_is_ignored_when_not_needed_but_answered() {
    let mut cell = Cell::ready();
    cell.events();
    assert_eq!(cell.robot.home(), Ok(()));
    assert_eq!(cell.robot.lifecycle(), Lifecycle::Activated);
    assert_eq!(cell.events(), [RobotEvent::Homed]);
    cell.control(RobotControlFlags::HOME, true);
    cell.cycles(5);
    assert!(!cell.is(RobotStatusFlags::BUSY));
}

#[test]
fn homing_fails_outside_user_limits_outside_the_work_zone_and_when_blocked() {
    for (reading_code, prepare) in [
        (
            1032,
            (|cell: &mut Cell| {
                let persistent = cell.robot.persistent_mut();
                persistent.joint_limits_enabled = true;
                persistent.user_joint_limits.min[0] = 10.0;
            }) as fn(&mut Cell),
        ),
        (1014, |cell| cell.robot.persistent_mut().work_zone_max = [10.0, 100.0, 100.0]),
        (1014, |cell| cell.robot.panel().block_joint(3, true)),
    ] {
        let mut settings = RobotSettings::default();
        settings.readings.activation_outside_limits = ActivationOutsideLimits::HomingFails;
        let mut cell = Cell::new(settings);
        cell.cycle();
        prepare(&mut cell);
        cell.activate();
        cell.control(RobotControlFlags::HOME, true);
        cell.cycles(2);
        assert_eq!(cell.error(), reading_code);
        assert!(!cell.is(RobotStatusFlags::HOMED));
    }
}

#[test]
fn activation_fails_with_a_stop_with_joints_outside_and_with_an_old_tool() {
    for (code, spoil, mend) in [
        (
            1013,
            (|cell: &mut Cell| cell.robot.panel().press_p_stop2()) as fn(&mut Cell),
            (|cell: &mut Cell| {
                cell.robot.panel().release_p_stop2();
                cell.robot.panel().switch_off();
                cell.robot.panel().switch_on();
            }) as fn(&mut Cell),
        ),
        (
            1013,
            |cell| {
                cell.robot.persistent_mut().joint_limits_enabled = true;
                cell.robot.persistent_mut().user_joint_limits.min[0] = 10.0;
            },
            |cell| cell.control(RobotControlFlags::ENABLE_RECOVERY_MODE, true),
        ),
        (
            3039,
            |cell| cell.robot.panel().set_tool_firmware_outdated(true),
            |cell| cell.robot.panel().set_tool_firmware_outdated(false),
        ),
    ] {
        let mut settings = RobotSettings { tool: FittedTool::Megp25E, ..RobotSettings::default() };
        settings.readings.power_after_reboot = PowerAfterReboot::On;
        let mut cell = Cell::new(settings);
        cell.cycle();
        spoil(&mut cell);
        cell.control(RobotControlFlags::ACTIVATE_ROBOT, true);
        cell.cycles(1000);
        assert!(!cell.is(RobotStatusFlags::ACTIVATED));
        assert_eq!(cell.error(), code);
        let refusals = cell.events();
        assert_eq!(refusals, [RobotEvent::Refused(Code(code))], "said once, not in every cycle");
        mend(&mut cell);
        cell.until("activated", |cell| cell.is(RobotStatusFlags::ACTIVATED));
        assert_eq!(cell.error(), 0);
    }
}

#[test]
fn deactivation_sets_motion_settings_back_and_discards_checkpoints() {
    let mut cell = Cell::ready();
    cell.sent(13, &[1.0, 2.0, 3.0]);
    cell.sent(14, &[0.0, 0.0, 50.0]);
    cell.sent(7, &[30.0]);
    cell.sent(25, &[2.0]);
    cell.finish(1);
    assert_eq!(cell.inputs.target_trf.values().z, 3.0);
    assert_eq!(cell.inputs.target_wrf.values().z, 50.0);
    assert_eq!(cell.read(21)[0], 30.0);
    cell.sent(1, &[90.0]);
    cell.sent(17, &[44.0]);
    cell.deactivate();
    assert_eq!(cell.discarded(), 44);
    assert!(cell.has(MotionStatusFlags::CLEARED | MotionStatusFlags::PAUSED));
    assert_eq!(cell.inputs.target_trf.values().z, 0.0);
    assert_eq!(cell.inputs.target_wrf.values().z, 0.0);
    assert_eq!(cell.read(21)[0], 100.0);
    assert!(cell.read(20)[3].is_nan(), "the desired turn is lost");
    cell.activate();
    assert!(
        !cell.motion_status().intersects(MotionStatusFlags::CLEARED | MotionStatusFlags::PAUSED)
    );
    let joints = cell.joints();
    cell.cycles(500);
    assert_eq!(cell.joints(), joints, "the old motion is not taken up");
}

#[test]
fn deactivate_wins_over_activate() {
    let mut cell = Cell::new(RobotSettings::default());
    let both = RobotControlFlags::ACTIVATE_ROBOT | RobotControlFlags::DEACTIVATE_ROBOT;
    cell.control(both, true);
    cell.cycles(1000);
    assert!(!cell.status().intersects(RobotStatusFlags::ACTIVATED | RobotStatusFlags::BUSY));
}

#[test]
fn a_held_activate_bit_acts_again_as_a_level_and_not_as_an_edge() {
    for (reading, activates) in [(HeldTriggeredBits::Level, true), (HeldTriggeredBits::Edge, false)]
    {
        let mut cell = Cell::ready_with(|settings| settings.readings.held_triggered_bits = reading);
        cell.control(RobotControlFlags::ACTIVATE_ROBOT, true);
        cell.cycles(2);
        cell.trigger(RobotControlFlags::DEACTIVATE_ROBOT, |cell| {
            !cell.is(RobotStatusFlags::ACTIVATED)
        });
        cell.cycles(1000);
        assert_eq!(cell.is(RobotStatusFlags::ACTIVATED), activates);
    }
}

#[test]
fn paused_and_cleared_at_power_up_and_after_activation_follow_the_readings() {
    let mut cell = Cell::new(RobotSettings::default());
    cell.cycle();
    assert!(
        !cell.motion_status().intersects(MotionStatusFlags::PAUSED | MotionStatusFlags::CLEARED)
    );
    let mut settings = RobotSettings { homed: true, ..RobotSettings::default() };
    settings.readings.paused_at_power_up = PausedAtPowerUp::Set;
    settings.readings.cleared_at_power_up = ClearedAtPowerUp::Set;
    settings.readings.paused_after_activation = PausedAfterActivation::Set;
    let mut cell = Cell::new(settings);
    cell.cycle();
    assert!(cell.has(MotionStatusFlags::PAUSED | MotionStatusFlags::CLEARED));
    cell.activate();
    assert!(cell.has(MotionStatusFlags::PAUSED) && !cell.has(MotionStatusFlags::CLEARED));
    cell.sent(1, &[5.0]);
    cell.cycles(100);
    assert!(cell.is_at([0.0; 6]));
    cell.resume();
    cell.finish(1);
    assert!(cell.is_at([5.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
}

#[test]
fn reboot_needs_a_deactivated_robot_and_forgets_all_but_persistent_settings() {
    let mut cell = Cell::ready_with(|settings| {
        settings.readings.reboot_signal = RebootSignal::Reported;
    });
    cell.sent(200, &[]);
    cell.cycles(10);
    assert!(cell.is(RobotStatusFlags::ACTIVATED), "refused while activated");
    cell.deactivate();
    cell.sent(155, &[1.0, 2.0, 3.0, 4.0]);
    cell.sent(48, &[50.0]);
    cell.outputs.host_time.host_time.set(2_000_000_000);
    cell.cycle();
    cell.outputs.host_time.host_time.set(0);
    cell.write(200, &[]);
    cell.cycle();
    assert!(!cell.robot.is_online());
    let frozen = cell.inputs;
    cell.motion(fieldarm::wire::meca500::image::MotionControlFlags::SET_POINT, false);
    cell.cycles(100);
    assert_eq!(frozen.as_bytes(), cell.inputs.as_bytes(), "no inputs while booting");
    cell.until("booted", |cell| cell.robot.is_online());
    cell.cycle();
    assert_eq!(cell.echo(), 0);
    assert!(!cell.is(RobotStatusFlags::HOMED));
    assert_eq!(cell.read(19), [1.0, 2.0, 3.0, 4.0, 0.0, 0.0]);
    assert_eq!(cell.read(54)[0], 100.0);
    assert!(cell.robot.rtc_s() < 1_900_000_000, "the clock went back to the image's date");
    assert!(cell.signals().contains(SafetySignals::REBOOT));
    assert!(!cell.power().contains(SafetyPower::V_MOTOR_ON));
    cell.control(RobotControlFlags::ACTIVATE_ROBOT, true);
    cell.cycles(1000);
    assert!(!cell.is(RobotStatusFlags::ACTIVATED), "motors have no power");
    cell.robot.panel().press_reset();
    cell.until("activated", |cell| cell.is(RobotStatusFlags::ACTIVATED));
    assert!(cell.power().contains(SafetyPower::V_MOTOR_ON));
    assert!(!cell.signals().contains(SafetySignals::REBOOT));
}

#[test]
fn host_time_sets_the_clock_and_not_the_timestamp() {
    for reading in [HostTimeReading::EachCycle, HostTimeReading::OnChange] {
        let mut cell = Cell::new(RobotSettings::default());
        let mut settings = RobotSettings::default();
        settings.readings.host_time = reading;
        cell.robot = fieldarm::sim::meca500::VirtualRobot::new(settings);
        cell.cycle();
        let before = cell.robot.rtc_s();
        cell.outputs.host_time.host_time.set(1_000);
        cell.cycles(3000);
        assert_ne!(cell.robot.rtc_s(), before);
        let expected = if reading == HostTimeReading::EachCycle { 1_000 } else { 1_002 };
        assert_eq!(cell.robot.rtc_s(), expected);
        let timestamp = cell.inputs.robot_timestamp.values();
        assert_eq!((timestamp.seconds, timestamp.microseconds), (3, 1_000));
    }
}

#[test]
fn simulation_changes_only_while_deactivated_and_without_a_stop() {
    let mut cell = Cell::new(RobotSettings::default());
    cell.cycle();
    cell.robot.panel().press_p_stop2();
    cell.control(RobotControlFlags::ACTIVATE_SIM, true);
    cell.cycle();
    assert!(!cell.is(RobotStatusFlags::SIM_ACTIVATED));
    assert_eq!(cell.robot.set_simulation(true), Err(Code::COMMAND_FAILED));
    let mut cell = Cell::ready();
    cell.control(RobotControlFlags::ACTIVATE_SIM, true);
    cell.cycles(5);
    assert!(!cell.is(RobotStatusFlags::SIM_ACTIVATED));
    assert_eq!(cell.robot.set_simulation(true), Err(Code::SIM_NEEDS_DEACTIVATION));
    cell.deactivate();
    assert!(cell.is(RobotStatusFlags::SIM_ACTIVATED), "the level acts when it can");
    assert_eq!(cell.read(52)[0], 10.0, "an MEGP 25E is emulated where there is no tool");
    cell.control(RobotControlFlags::ACTIVATE_SIM, false);
    cell.cycle();
    assert!(!cell.is(RobotStatusFlags::SIM_ACTIVATED));
    assert_eq!(cell.read(52)[0], 0.0);
}

#[test]
fn fast_simulation_executes_as_quickly_as_possible() {
    let mut cell = Cell::new(RobotSettings::default());
    cell.robot.persistent_mut().simulation = SimulationType::Fast;
    cell.control(RobotControlFlags::ACTIVATE_SIM, true);
    cell.cycles(2);
    cell.bring_up();
    for target in [90.0, -90.0, 45.0] {
        cell.sent(1, &[target]);
    }
    cell.sent(6, &[5.0]);
    let cycles = cell.finish(9);
    assert!(cycles < 10, "{cycles}");
    assert!(cell.is_at([45.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
}

#[test]
fn recovery_mode_moves_an_unhomed_robot_slowly() {
    for (reading, shows_homed) in [(HomedInRecovery::Clear, false), (HomedInRecovery::Set, true)] {
        let mut settings = RobotSettings::default();
        settings.readings.homed_in_recovery = reading;
        let mut cell = Cell::new(settings);
        cell.control(RobotControlFlags::ENABLE_RECOVERY_MODE, true);
        cell.cycle();
        assert!(cell.is(RobotStatusFlags::RECOVERY_MODE));
        cell.activate();
        assert_eq!(cell.is(RobotStatusFlags::HOMED), shows_homed);
        cell.sent(8, &[100.0]);
        cell.sent(1, &[15.0]);
        let cycles = cell.finish(1);
        // 15 deg at a tenth of 150 deg/s: a second and the ramps.
        assert!((1000..1200).contains(&cycles), "{cycles}");
        assert!(cell.events().contains(&RobotEvent::RecoveryCap));
        cell.control(RobotControlFlags::ENABLE_RECOVERY_MODE, false);
        cell.cycle();
        assert!(!cell.is(RobotStatusFlags::RECOVERY_MODE));
        assert!(!cell.is(RobotStatusFlags::HOMED));
    }
}

#[test]
fn recovery_mode_ignores_user_limits_and_the_work_zone() {
    let mut cell = Cell::ready();
    cell.deactivate();
    cell.sent(150, &[1.0, -30.0, 30.0]);
    cell.sent(151, &[1.0]);
    cell.sent(153, &[-500.0, -10.0, -500.0, 500.0, 10.0, 500.0]);
    cell.control(RobotControlFlags::ENABLE_RECOVERY_MODE, true);
    cell.activate();
    cell.sent(1, &[40.0]);
    cell.finish(1);
    assert_eq!(cell.error(), 0);
    assert!(cell.is_at([40.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
    cell.control(RobotControlFlags::ENABLE_RECOVERY_MODE, false);
    cell.sent(1, &[0.0]);
    cell.until("refused: the start is outside", |cell| cell.error() == 1007);
}

#[test]
fn brakes_follow_activation_and_obey_only_when_allowed_and_deactivated() {
    let engaged = RobotStatusFlags::BRAKES_ENGAGED;
    let allowed = BrakesControlFlags::BRAKES_CONTROL_ALLOWED;
    let mut cell = Cell::new(RobotSettings::default());
    cell.cycle();
    assert!(cell.is(engaged), "zeros never release the brakes");
    cell.brakes(allowed);
    cell.cycle();
    assert!(!cell.is(engaged));
    cell.brakes(allowed | BrakesControlFlags::BRAKES_ENGAGED);
    cell.cycle();
    assert!(cell.is(engaged));
    cell.activate();
    assert!(!cell.is(engaged), "BrakesEngaged is ignored while activated");
    cell.brakes(BrakesControlFlags::empty());
    cell.deactivate();
    assert!(cell.is(engaged));
}

#[test]
fn disable_ethercat_leaves_the_bus_and_only_on_ethercat() {
    for (bus, leaves) in [(CyclicBus::EtherCat, true), (CyclicBus::EtherNetIp, false)] {
        let mut cell = Cell::new(RobotSettings { bus, ..RobotSettings::default() });
        cell.cycle();
        cell.control(RobotControlFlags::DISABLE_ETHERCAT, true);
        cell.cycle();
        assert_eq!(cell.robot.is_on_bus(), !leaves);
    }
}

#[test]
fn timestamps_are_monotonic_over_a_reboot_but_for_its_reference() {
    for reading in [TimestampAfterBoot::Restarts, TimestampAfterBoot::Continues] {
        let mut settings = RobotSettings::default();
        settings.readings.timestamp_after_boot = reading;
        let mut cell = Cell::new(settings);
        let stamp = |cell: &Cell| {
            let timestamp = cell.inputs.robot_timestamp.values();
            assert!(timestamp.microseconds < 1_000_000);
            u64::from(timestamp.seconds) * 1_000_000 + u64::from(timestamp.microseconds)
        };
        let mut last = 0;
        let mut run = |cell: &mut Cell, cycles: u32| {
            for _ in 0..cycles {
                cell.cycle();
                assert!(stamp(cell) >= last, "{reading:?}");
                last = stamp(cell);
            }
            core::mem::take(&mut last)
        };
        let before = run(&mut cell, 8_000);
        assert_eq!(before, 8_000_000);
        cell.write(200, &[]);
        cell.cycle();
        assert_eq!(cell.robot.lifecycle(), Lifecycle::Booting);
        cell.motion(MotionControlFlags::SET_POINT, false);
        let mut boot = 0;
        while !cell.robot.is_online() {
            cell.cycle();
            boot += 1;
        }
        assert!(boot >= 4_999, "{boot}");
        let begins = stamp(&cell);
        assert_eq!(begins < before, reading == TimestampAfterBoot::Restarts, "{begins}");
        assert!(reading == TimestampAfterBoot::Restarts || begins >= 13_000_000, "{begins}");
        let after = run(&mut cell, 10_000);
        assert_eq!(after, begins + 10_000_000);
    }
}

#[test]
fn recovery_mode_allows_motion_in_self_collision() {
    let into_base = [0.0, -20.0, 70.0, 0.0, 100.0, 0.0];
    let mut cell = Cell::ready();
    cell.control(RobotControlFlags::ENABLE_RECOVERY_MODE, true);
    cell.cycle();
    cell.sent(1, &into_base);
    cell.until("there or refused", |cell| cell.is_at(into_base) || cell.error() != 0);
    assert_eq!(cell.error(), 0);
    cell.sent(1, &[0.0; 6]);
    cell.finish(1);
    assert!(cell.is_at([0.0; 6]) && cell.error() == 0, "and out of it again");
    cell.control(RobotControlFlags::ENABLE_RECOVERY_MODE, false);
    cell.sent(1, &into_base);
    cell.until("the collision", |cell| cell.error() == 3041);
}

#[test]
fn recovery_mode_allows_motion_with_a_torque_overload() {
    for recovers in [true, false] {
        // More torque than the limits of SetTorqueLimits allow.
        let mut cell = Cell::ready();
        cell.sent(27, &[90.0, 90.0, 90.0, 30.0, 90.0, 90.0]);
        cell.sent(28, &[4.0, 2.0]);
        cell.finish(1);
        cell.control(RobotControlFlags::ENABLE_RECOVERY_MODE, recovers);
        cell.cycle();
        cell.robot.panel().push_joint(4, 60.0);
        cell.cycles(10);
        assert_eq!(cell.error(), if recovers { 0 } else { 3029 });
        if recovers {
            assert!(cell.has(MotionStatusFlags::EXCESSIVE_TORQUE));
            cell.sent(1, &[5.0]);
            cell.finish(2);
            assert!(cell.is_at([5.0, 0.0, 0.0, 0.0, 0.0, 0.0]) && cell.error() == 0);
        }
        // More than the motor has: the others move on beside the joint that is held.
        let mut cell = Cell::ready();
        cell.control(RobotControlFlags::ENABLE_RECOVERY_MODE, recovers);
        cell.cycle();
        cell.robot.panel().block_joint(1, true);
        cell.sent(1, &[10.0, 10.0]);
        cell.cycles(3_000);
        assert_eq!(cell.error(), if recovers { 0 } else { 3005 });
        assert_eq!(cell.is_at([10.0, 10.0, 0.0, 0.0, 0.0, 0.0]), recovers);
        assert!((cell.read(40)[0]).abs() < 1e-3, "the held joint stays");
    }
}

#[test]
fn recovery_mode_may_be_set_in_any_state() {
    for (state, mut cell) in sim_support::cells_in_many_states() {
        for on in [true, false] {
            cell.control(RobotControlFlags::ENABLE_RECOVERY_MODE, on);
            cell.cycle();
            assert_eq!(cell.is(RobotStatusFlags::RECOVERY_MODE), on, "{state}");
        }
    }
}

#[test]
fn an_error_while_deactivated_is_reported_and_needs_no_reset() {
    let mut cell = Cell::new(RobotSettings::default());
    cell.cycle();
    cell.events();
    cell.robot.panel().break_drives();
    assert_eq!(cell.events(), [RobotEvent::Error(Code::DRIVE_COMMUNICATION)]);
    cell.cycle();
    assert_eq!(cell.error(), 0, "no error mode");
    assert!(!cell.has(MotionStatusFlags::PAUSED));
    cell.bring_up();
    cell.sent(1, &[5.0]);
    cell.finish(1);
    assert!(cell.is_at([5.0, 0.0, 0.0, 0.0, 0.0, 0.0]), "without ResetError");
}

#[test]
fn activating_an_activated_robot_changes_nothing() {
    let mut cell = Cell::ready();
    cell.sent(7, &[30.0]);
    cell.sent(1, &[60.0]);
    cell.cycles(200);
    cell.events();
    let queued = cell.fifo_space();
    assert_eq!(cell.robot.activate(), Ok(()));
    cell.control(RobotControlFlags::ACTIVATE_ROBOT, true);
    let before = cell.joints()[0];
    for _ in 0..10 {
        cell.cycle();
        assert!(cell.is(RobotStatusFlags::ACTIVATED) && !cell.is(RobotStatusFlags::BUSY));
    }
    assert!(cell.joints()[0] > before && cell.fifo_space() == queued, "it moves on");
    assert_eq!(cell.events(), []);
    assert_eq!(cell.read(21)[0], 30.0, "its settings stay");
    cell.finish(1);
    assert!(cell.is_at([60.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
}

#[test]
fn only_an_activated_robot_is_deactivated() {
    let mut cell = Cell::new(RobotSettings::default());
    cell.cycle();
    cell.events();
    assert_eq!(cell.robot.deactivate(), Err(Code::NOT_ACTIVATED));
    cell.control(RobotControlFlags::DEACTIVATE_ROBOT, true);
    cell.cycles(5);
    assert!(!cell.is(RobotStatusFlags::BUSY), "nothing happens");
    assert!(!cell.events().contains(&RobotEvent::Deactivated));
    cell.control(RobotControlFlags::DEACTIVATE_ROBOT, false);
    cell.activate();
    cell.events();
    assert_eq!(cell.robot.deactivate(), Ok(()));
    cell.until("deactivated", |cell| cell.is(RobotStatusFlags::BRAKES_ENGAGED));
    assert!(cell.events().contains(&RobotEvent::Deactivated));
    assert_eq!(cell.robot.deactivate(), Err(Code::NOT_ACTIVATED));
}

#[test]
fn monitoring_only_shows_and_does_not_obey() {
    let mut cell = Cell::new(RobotSettings { monitoring_only: true, ..RobotSettings::default() });
    cell.control(RobotControlFlags::ACTIVATE_ROBOT, true);
    cell.write(48, &[50.0]);
    cell.cycles(1000);
    assert!(cell.is(RobotStatusFlags::MONITORING_MODE));
    assert!(!cell.is(RobotStatusFlags::ACTIVATED));
    assert_eq!(cell.echo(), 0);
    assert_eq!(cell.read(54)[0], 100.0);
}
