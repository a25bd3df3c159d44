//! The main device's link against emulated robots in memory: start, cycle, falls and returns.
#![cfg(feature = "ethercat")]

#[path = "support/ethercat_line.rs"]
mod ethercat_line;

use ethercat_line::{Line, line, robot};
use fieldarm::bus::ethercat::Settings;
use fieldarm::bus::ethercat::meca500::Meca500Settings;
use fieldarm::cycle::{CyclicSegment, InputQuality};
use fieldarm::link::ethercat::memory::MemoryWire;
use fieldarm::link::ethercat::wire::Wire;
use fieldarm::link::ethercat::{
    Assignment, Clocks, EthercatError, EthercatSegment, EventKind, RobotAddress, RobotChoice,
    SegmentSettings,
};
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::ethercat::al::{AlState, AlStatusCode};
use fieldarm::wire::meca500::image::{INPUT_LEN, InputImage, OUTPUT_LEN, OutputImage};
use fieldarm::wire::order::Little;

/// A segment and the time of its caller.
struct Bus {
    segment: EthercatSegment<Line>,
    now: Instant,
}

impl Bus {
    fn start(line: Line, settings: SegmentSettings) -> Self {
        match EthercatSegment::start(line, settings) {
            Ok(segment) => Self { segment, now: Instant::ZERO },
            Err(failure) => panic!("{}", failure.error),
        }
    }

    fn cycle(&mut self) {
        self.now += Duration::from_millis(1);
        self.segment.exchange(self.now).unwrap();
    }

    fn quality(&self, robot: usize) -> InputQuality {
        self.segment.read_inputs(robot, &mut [0; INPUT_LEN])
    }

    fn inputs(&self, robot: usize) -> [u8; INPUT_LEN] {
        let mut inputs = [0; INPUT_LEN];
        self.segment.read_inputs(robot, &mut inputs);
        inputs
    }

    /// Cycles until `robot` has fresh inputs, and says how many cycles that took.
    fn until_fresh(&mut self, robot: usize, limit: u32) -> u32 {
        for cycle in 0..limit {
            self.cycle();
            if self.quality(robot).is_fresh() {
                return cycle;
            }
        }
        let events = std::iter::from_fn(|| self.segment.poll_event()).collect::<Vec<_>>();
        panic!("robot {robot} not fresh after {limit} cycles: {events:?}");
    }

    fn events(&mut self) -> Vec<(usize, EventKind)> {
        std::iter::from_fn(|| self.segment.poll_event()).map(|e| (e.robot, e.kind)).collect()
    }

    fn fifo_space(&self, robot: usize) -> u16 {
        let inputs = self.inputs(robot);
        InputImage::<Little>::from_bytes(&inputs).unwrap().motion_status.fifo_space.get()
    }
}

#[test]
fn one_robot_comes_to_op_with_the_whole_image() {
    let mut bus = Bus::start(line(1), SegmentSettings::default());
    assert_eq!(bus.segment.robots().len(), 1);
    assert!(
        bus.segment.robots()[0].inputs.is_equal() && bus.segment.robots()[0].outputs.is_equal()
    );
    bus.cycle();
    assert_eq!(bus.quality(0), InputQuality::Fresh);
    assert_eq!(bus.fifo_space(0), 13_000);
    assert_eq!(bus.segment.wire().line()[0].state(), AlState::Op);
}

#[test]
fn the_callers_clock_may_be_behind_the_wires_or_ahead() {
    for callers in [Instant::ZERO, Instant::from_millis(3_600_000)] {
        let mut bus = Bus::start(line(1), SegmentSettings::default());
        bus.now = callers;
        let began = bus.segment.wire().now();
        for _ in 0..500 {
            bus.cycle();
            assert_eq!(bus.quality(0), InputQuality::Fresh);
        }
        let passed = bus.segment.wire().now() - began;
        assert_eq!(passed.as_millis(), 499, "one cycle from exchange to exchange");
        assert_eq!(bus.events(), []);
    }
}

#[test]
fn images_of_sixteen_robots_do_not_mix() {
    let mut bus = Bus::start(line(16), SegmentSettings::default());
    for robot in 0..16 {
        let mut image = OutputImage::<Little>::default();
        image.dynamic_data_configuration.dynamic_data_type_id[0].set(20 + robot as u32);
        bus.segment.write_outputs(robot, zerocopy::IntoBytes::as_bytes(&image));
    }
    for _ in 0..3 {
        bus.cycle();
    }
    for robot in 0..16 {
        let inputs = bus.inputs(robot);
        let image = InputImage::<Little>::from_bytes(&inputs).unwrap();
        assert_eq!(image.dynamic_data[0].dynamic_type.get(), 20 + robot as u32);
    }
}

#[test]
fn robots_are_found_by_position_and_alias_and_others_stay_in_pre_op() {
    let settings = SegmentSettings {
        robots: RobotChoice::These(vec![RobotAddress::Alias(4), RobotAddress::Position(1)]),
        ..SegmentSettings::default()
    };
    let mut bus = Bus::start(line(5), settings);
    let positions: Vec<u16> = bus.segment.robots().iter().map(|robot| robot.position).collect();
    assert_eq!(positions, [3, 1]);
    bus.cycle();
    let states: Vec<AlState> = bus.segment.wire().line().iter().map(|d| d.state()).collect();
    use AlState::{Op, PreOp};
    assert_eq!(states, [PreOp, Op, PreOp, Op, PreOp]);
    assert_eq!(bus.segment.subdevices().len(), 5);
    assert_eq!(bus.segment.subdevices()[3].robot, Some(0));
}

fn refusal(line: Line, robots: RobotChoice) -> EthercatError {
    match EthercatSegment::start(line, SegmentSettings { robots, ..SegmentSettings::default() }) {
        Ok(_) => panic!("started"),
        Err(failure) => failure.error,
    }
}

#[test]
fn what_is_not_there_is_named() {
    assert_eq!(refusal(MemoryWire::new(Vec::new()), RobotChoice::All), EthercatError::Silent);
    let too_few = EthercatError::TooFewRobots { wanted: 3, found: 2 };
    assert_eq!(refusal(line(2), RobotChoice::First(3)), too_few);
    let these = RobotChoice::These(vec![RobotAddress::Position(7)]);
    assert_eq!(refusal(line(2), these), EthercatError::NoSuchPosition { position: 7, found: 2 });
    let these = RobotChoice::These(vec![RobotAddress::Alias(99)]);
    assert_eq!(refusal(line(2), these), EthercatError::NoSuchAlias { alias: 99 });
    let these = RobotChoice::These(vec![RobotAddress::Position(1), RobotAddress::Alias(2)]);
    assert_eq!(refusal(line(2), these), EthercatError::Twice { position: 1 });
    assert_eq!(refusal(line(17), RobotChoice::All), EthercatError::TooManyRobots { wanted: 17 });
}

#[test]
fn an_assignment_that_must_be_written_is_written() {
    let bus_settings = Meca500Settings {
        assignment_must_be_written: true,
        unassigned_at_power_up: &[0x1A08],
        ..Meca500Settings::default()
    };
    let robots = || MemoryWire::new(vec![robot(0, bus_settings, Settings::default())]);
    let mut bus = Bus::start(robots(), SegmentSettings::default());
    bus.cycle();
    assert!(bus.segment.robots()[0].inputs.is_equal());

    let keep = SegmentSettings { assignment: Assignment::Keep, ..SegmentSettings::default() };
    let error = EthercatSegment::start(robots(), keep).err().unwrap().error;
    let code = AlStatusCode::INVALID_PROCESS_DATA_MAPPING;
    assert!(
        matches!(error, EthercatError::Refused { code: found, .. } if found == code),
        "{error}"
    );
}

#[test]
fn an_image_without_one_pdo_is_laid_out_by_name() {
    let bus_settings =
        Meca500Settings { unassigned_at_power_up: &[0x1A08], ..Meca500Settings::default() };
    let robots = MemoryWire::new(vec![robot(0, bus_settings, Settings::default())]);
    let keep = SegmentSettings { assignment: Assignment::Keep, ..SegmentSettings::default() };
    let mut bus = Bus::start(robots, keep);
    let found = &bus.segment.robots()[0].inputs;
    assert_eq!((found.is_equal(), found.robot_len()), (false, 248));
    assert_eq!(found.missing(), [0x6046]);
    for _ in 0..3 {
        bus.cycle();
    }
    assert_eq!(bus.fifo_space(0), 13_000);
    let inputs = bus.inputs(0);
    let image = InputImage::<Little>::from_bytes(&inputs).unwrap();
    assert_eq!(image.robot_timestamp.seconds.get(), 0, "behind the gap, at its own place");
    assert!(image.robot_timestamp.microseconds.get() > 0);
}

#[test]
fn a_robot_whose_watchdog_expired_is_brought_back_with_its_cause() {
    let mut bus = Bus::start(line(2), SegmentSettings::default());
    bus.until_fresh(1, 3);
    bus.now += Duration::from_millis(300);
    bus.cycle();
    assert_eq!(bus.quality(0), InputQuality::Lost);
    bus.until_fresh(0, 500);
    bus.until_fresh(1, 500);
    let fell = |robot| {
        let code = AlStatusCode::SYNC_MANAGER_WATCHDOG;
        (robot, EventKind::Fell { state: AlState::SafeOp, code })
    };
    let events = bus.events();
    for robot in 0..2 {
        assert!(events.contains(&fell(robot)), "{events:?}");
        assert!(events.contains(&(robot, EventKind::BackInOp)), "{events:?}");
    }
    assert_eq!(events.len(), 4, "{events:?}");
}

#[test]
fn a_robot_that_restarts_is_brought_up_again_while_the_others_go_on() {
    let mut bus = Bus::start(line(3), SegmentSettings::default());
    bus.until_fresh(2, 3);
    // The last of the line: nobody is behind it.
    let device = bus.segment.wire_mut().line_mut()[2].application_mut().device_mut();
    device.panel().switch_off();
    for _ in 0..50 {
        bus.cycle();
        assert_eq!(bus.quality(0), InputQuality::Fresh);
        assert_eq!(bus.quality(1), InputQuality::Fresh);
        assert_eq!(bus.quality(2), InputQuality::Lost);
    }
    let device = bus.segment.wire_mut().line_mut()[2].application_mut().device_mut();
    device.panel().switch_on();
    let mut cycles = 0;
    while !bus.quality(2).is_fresh() {
        bus.cycle();
        assert_eq!(bus.quality(0), InputQuality::Fresh);
        assert_eq!(bus.quality(1), InputQuality::Fresh);
        cycles += 1;
        assert!(cycles < 60_000, "{:?}", bus.events());
    }
    let kinds: Vec<(usize, EventKind)> = bus.events();
    assert_eq!(kinds, [(2, EventKind::Gone), (2, EventKind::Returned), (2, EventKind::BackInOp)]);
}

#[test]
fn robots_behind_one_that_is_off_come_back_with_it() {
    let mut bus = Bus::start(line(3), SegmentSettings::default());
    bus.until_fresh(2, 3);
    let first = |bus: &mut Bus, is_on: bool| {
        let device = bus.segment.wire_mut().line_mut()[0].application_mut().device_mut();
        if is_on { device.panel().switch_on() } else { device.panel().switch_off() }
    };
    first(&mut bus, false);
    for _ in 0..400 {
        bus.cycle();
    }
    assert!((0..3).all(|robot| bus.quality(robot) == InputQuality::Lost));
    first(&mut bus, true);
    for robot in 0..3 {
        bus.until_fresh(robot, 60_000);
    }
    let events = bus.events();
    for robot in 0..3 {
        assert!(events.contains(&(robot, EventKind::Gone)), "{events:?}");
        assert!(events.contains(&(robot, EventKind::BackInOp)), "{events:?}");
    }
}

#[test]
fn a_cable_that_is_pulled_and_put_back_costs_a_fall_at_most() {
    for away_ms in [1, 5, 50, 150, 1_000] {
        let mut bus = Bus::start(line(1), SegmentSettings::default());
        bus.until_fresh(0, 3);
        bus.segment.wire_mut().unplug();
        for age in 1..=away_ms {
            bus.cycle();
            match bus.quality(0) {
                InputQuality::Stale { age_cycles } => assert_eq!(age_cycles, age),
                quality => assert!(quality == InputQuality::Lost && age >= 20, "{quality:?}"),
            }
        }
        bus.segment.wire_mut().plug();
        bus.until_fresh(0, 1_000);
    }
}

#[test]
fn a_segment_that_somebody_drives_is_left_alone() {
    let bus = Bus::start(line(1), SegmentSettings::default());
    let mut now = bus.now;
    // Another main device keeps the robot in OP: its watchdog is off.
    let settings = SegmentSettings {
        watchdog: Some(Duration::from_millis(6_000)),
        ..SegmentSettings::default()
    };
    let line = bus.segment.close();
    let mut driven = Bus::start(line, settings);
    driven.cycle();
    now += Duration::from_millis(1);
    let _ = now;
    let line = driven.segment.abandon();
    assert_eq!(refusal_on(line), EthercatError::Driven { position: 0 });
}

fn refusal_on(line: Line) -> EthercatError {
    EthercatSegment::start(line, SegmentSettings::default()).err().unwrap().error
}

#[test]
fn a_segment_whose_main_device_died_is_taken_over() {
    let mut bus = Bus::start(line(1), SegmentSettings::default());
    bus.cycle();
    let line = bus.segment.abandon();
    let mut again = Bus::start(line, SegmentSettings::default());
    again.until_fresh(0, 3);
}

#[test]
fn monitoring_only_moves_nothing_and_may_choose_dynamic_data() {
    let settings = SegmentSettings { monitor_only: true, ..SegmentSettings::default() };
    let mut bus = Bus::start(line(1), settings);
    let mut outputs = [0xFF; OUTPUT_LEN];
    outputs[44..].fill(0);
    outputs[44] = 20;
    bus.segment.write_outputs(0, &outputs);
    for _ in 0..2_000 {
        bus.cycle();
    }
    let inputs = bus.inputs(0);
    let image = InputImage::<Little>::from_bytes(&inputs).unwrap();
    assert!(!image.robot_status.values().flags.activated);
    assert_eq!(image.motion_status.move_id.get(), 0);
    assert_eq!(image.dynamic_data[0].dynamic_type.get(), 20);
}

#[test]
fn robots_with_clocks_run_at_sync0_and_frames_are_drawn_to_it() {
    let clock = |n: u16| Settings {
        clock_start_ns: u64::from(n) * 123_456_789,
        clock_drift_ppb: 20_000 - i32::from(n) * 7_000,
        ..Settings::default()
    };
    let line = (0..4).map(|n| robot(n + 1, Meca500Settings::default(), clock(n))).collect();
    let shift = Duration::from_micros(300);
    let settings =
        SegmentSettings { clocks: Clocks::Sync0 { shift }, ..SegmentSettings::default() };
    let mut bus = Bus::start(MemoryWire::new(line), settings);
    for _ in 0..3_000 {
        let nudge = bus.segment.nudge_ns();
        let next = 1_000_000_i64 + nudge;
        bus.now += Duration::from_nanos(next.unsigned_abs());
        bus.segment.exchange(bus.now).unwrap();
    }
    for robot in 0..4 {
        assert_eq!(bus.quality(robot), InputQuality::Fresh);
    }
    let clock = bus.segment.statistics().clock.unwrap();
    assert!(clock.phase_error_ns.abs() < 50_000, "{clock:?}");
    assert!((clock.drift_ppb - 20_000.0).abs() < 1_000.0, "{clock:?}");
    // The clocks of the robots agree now.
    let wire = bus.segment.wire();
    use fieldarm::link::ethercat::wire::Wire;
    let times: Vec<u64> =
        wire.line().iter().map(|device| device.system_time(wire.now()).unwrap()).collect();
    let spread = times.iter().max().unwrap() - times.iter().min().unwrap();
    assert!(spread < 5_000, "{times:?}");
}

#[test]
fn clocks_that_are_not_there_are_named() {
    let esc = Settings { distributed_clock: false, ..Settings::default() };
    let line = MemoryWire::new(vec![robot(0, Meca500Settings::default(), esc)]);
    let clocks = Clocks::Sync0 { shift: Duration::ZERO };
    let settings = SegmentSettings { clocks, ..SegmentSettings::default() };
    let error = EthercatSegment::start(line, settings).err().unwrap().error;
    assert_eq!(error, EthercatError::NoClocks { position: 0 });
}

#[test]
fn a_start_survives_lost_frames() {
    use fieldarm::link::ethercat::faulty_wire::{FaultPlan, FaultyWire, WireEnd, WireFault};
    for seed in 0..8 {
        let plan = FaultPlan {
            chances: vec![
                (WireFault::Drop, 10),
                (WireFault::Truncate, 5),
                (WireFault::Duplicate, 5),
            ],
            seed,
            limit: None,
        };
        let wire = FaultyWire::new(line(2), WireEnd::MainDevice, plan);
        let started = EthercatSegment::start(wire, SegmentSettings::default());
        if let Err(failure) = started {
            panic!("seed {seed}: {}", failure.error);
        }
    }
}

#[test]
fn a_robot_that_moves_up_is_not_taken_for_the_one_that_left() {
    let mut bus = Bus::start(line(2), SegmentSettings::default());
    bus.until_fresh(1, 3);
    // The second robot comes to the first place, as on a junction whose first branch closes.
    bus.segment.wire_mut().line_mut().swap(0, 1);
    let first = bus.segment.wire_mut().line_mut()[1].application_mut().device_mut();
    first.panel().switch_off();
    for _ in 0..3_000 {
        bus.cycle();
        assert_ne!(bus.quality(0), InputQuality::Fresh, "that is the other robot");
    }
    assert_eq!(bus.quality(1), InputQuality::Fresh, "it was left alone");
    assert_eq!(bus.events(), [(0, EventKind::Gone)]);
}

#[test]
fn a_robot_that_fell_need_not_wait_for_one_that_restarts() {
    let mut bus = Bus::start(line(3), SegmentSettings::default());
    bus.until_fresh(2, 3);
    let power = |bus: &mut Bus, is_on: bool| {
        let robot = bus.segment.wire_mut().line_mut()[2].application_mut().device_mut();
        if is_on { robot.panel().switch_on() } else { robot.panel().switch_off() }
    };
    power(&mut bus, false);
    for _ in 0..100 {
        bus.cycle();
    }
    power(&mut bus, true);
    let returned = (0..20_000).any(|_| {
        bus.cycle();
        bus.events().contains(&(2, EventKind::Returned))
    });
    assert!(returned);
    // In the middle of its restart the others fall.
    for _ in 0..200 {
        bus.cycle();
    }
    bus.now += Duration::from_millis(300);
    bus.cycle();
    assert!(bus.until_fresh(0, 300) + bus.until_fresh(1, 300) < 300);
    assert_ne!(bus.quality(2), InputQuality::Fresh, "still on its way");
    bus.until_fresh(2, 20_000);
}

#[test]
fn a_restart_is_finished_at_slow_cycles_too() {
    let settings = SegmentSettings::with_cycle(Duration::from_millis(50));
    let mut bus = Bus::start(line(1), settings);
    let panel = |bus: &mut Bus, is_on: bool| {
        let robot = bus.segment.wire_mut().line_mut()[0].application_mut().device_mut();
        if is_on { robot.panel().switch_on() } else { robot.panel().switch_off() }
    };
    let slow = |bus: &mut Bus| {
        bus.now += Duration::from_millis(50);
        bus.segment.exchange(bus.now).unwrap();
    };
    panel(&mut bus, false);
    (0..50).for_each(|_| slow(&mut bus));
    panel(&mut bus, true);
    let is_back = (0..12_000).any(|_| {
        slow(&mut bus);
        bus.quality(0).is_fresh()
    });
    assert!(is_back, "{:?}", bus.events());
}

#[test]
fn settings_that_contradict_themselves_are_refused() {
    let zero = SegmentSettings { cycle: Duration::ZERO, ..SegmentSettings::default() };
    let impatient = SegmentSettings { reply_limit: Duration::ZERO, ..SegmentSettings::default() };
    let shift = Duration::from_millis(1);
    let late = SegmentSettings { clocks: Clocks::Sync0 { shift }, ..SegmentSettings::default() };
    for settings in [zero, impatient, late] {
        let error = EthercatSegment::start(line(1), settings).err().unwrap().error;
        assert!(matches!(error, EthercatError::Settings(_)), "{error}");
    }
}
