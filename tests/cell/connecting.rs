//! The first cycles: byte order, monitoring connections, MoveID at its wrap, dynamic slots.

use fieldarm::engine::meca500::{ConnectionPhase, Event, RequestError};
use fieldarm::sim::meca500::{Readings, RobotSettings};
use fieldarm::wire::meca500::dynamic::DynamicType;
use fieldarm::wire::order::ByteOrder;

use crate::checkers::End;
use crate::harness::{Cell, Setup};
use crate::quick_robot::quick_robot;
use crate::streaming::numbered;

#[test]
fn the_byte_order_is_found_in_every_order_and_nothing_is_sent_before() {
    for byte_order in ByteOrder::ALL {
        for homed in [false, true] {
            let joints = [12.0, -3.0, 4.0, 30.0, -60.0, 500.0];
            let robot = RobotSettings { byte_order, homed, joints, ..quick_robot() };
            let mut cell = Cell::new(Setup { robot, ..Setup::default() });
            while cell.engine.byte_order().is_none() {
                cell.step();
                assert!(cell.cycles < 2_000, "{byte_order} not found\n{cell:#?}");
                let settled = cell.engine.byte_order().is_some();
                assert!(settled || cell.outputs == [0; 60], "nothing but zeros until then");
            }
            assert_eq!(cell.engine.byte_order(), Some(byte_order));
        }
    }
}

#[test]
fn a_robot_at_zero_joints_is_read_in_every_order() {
    for byte_order in ByteOrder::ALL {
        let robot = RobotSettings { byte_order, ..quick_robot() };
        let mut cell = Cell::new(Setup { robot, ..Setup::default() });
        cell.until("the byte order", 2_000, |cell| cell.engine.byte_order().is_some());
        assert_eq!(cell.engine.byte_order(), Some(byte_order));
    }
}

#[test]
fn a_monitoring_connection_is_watched_and_never_touched() {
    let robot = RobotSettings { monitoring_only: true, ..quick_robot() };
    let mut cell = Cell::new(Setup { robot, ..Setup::default() });
    cell.until("the verdict", 2_000, |cell| {
        cell.saw(|event| matches!(event, Event::MonitoringOnly))
    });
    assert_eq!(cell.engine.status().phase, ConnectionPhase::Monitoring);
    assert!(matches!(cell.engine.bring_up(), Err(RequestError::MonitoringOnly)));
    assert!(cell.submit(numbered(0)).is_err());
    for _ in 0..100 {
        cell.step();
        assert_eq!(cell.outputs, [0; 60]);
    }
}

#[test]
fn move_id_wraps_past_zero() {
    let mut setup = Setup::default();
    setup.config.first_move_id = Some(65_530);
    let mut cell = Cell::running(setup);
    let tickets: Vec<_> = (0..30).map(|number| cell.submit(numbered(number)).unwrap()).collect();
    cell.finish(1_000);
    assert!(tickets.iter().all(|ticket| cell.state(*ticket).end == Some(End::Done)));
    cell.judge_acceptance();
}

#[test]
fn six_subscriptions_share_four_slots_under_every_reading() {
    const TYPES: [DynamicType; 6] = [
        DynamicType::FIRMWARE_VERSION,
        DynamicType::SERIAL_NUMBER,
        DynamicType::ACTUAL_JOINT_POSITION,
        DynamicType::TIME_SCALING,
        DynamicType::PAYLOAD,
        DynamicType::MOTION_QUEUE_PARAMETERS,
    ];
    for variation in Readings::variations() {
        let robot = RobotSettings { readings: variation.readings, ..quick_robot() };
        let serial = robot.serial_number;
        let mut cell = Cell::running(Setup { robot, ..Setup::default() });
        for ty in TYPES {
            cell.engine.subscribe(ty).unwrap();
        }
        cell.until("all six readings", 1_000, |cell| {
            TYPES.iter().all(|ty| cell.engine.dynamic(*ty).is_some())
        });
        cell.steps(200);
        for ty in TYPES {
            let reading = cell.engine.dynamic(ty).unwrap();
            assert_eq!(reading.value.dynamic_type(), ty);
            assert!(reading.age.as_millis() < 100, "{ty:?} is {:?} old", reading.age);
        }
        let reading = cell.engine.dynamic(DynamicType::SERIAL_NUMBER).unwrap();
        assert_eq!(reading.value.raw_bits()[1], serial, "{variation:?}");
    }
}
