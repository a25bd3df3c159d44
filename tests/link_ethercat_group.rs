//! A PLC with a main device of its own: robots in a group that it brings up and cycles itself.
#![cfg(feature = "ethercat")]

#[path = "support/ethercat_line.rs"]
mod ethercat_line;

use std::future::Future;
use std::pin::pin;
use std::task::{Context, Poll, Waker};

use ethercat_line::{Line, line, robot};
use ethercrab::subdevice_group::Op;
use ethercrab::{
    DefaultLock, MainDevice, MainDeviceConfig, PduRx, PduStorage, PduTx, SubDeviceGroup, Timeouts,
};
use fieldarm::bus::ethercat::Settings;
use fieldarm::bus::ethercat::meca500::Meca500Settings;
use fieldarm::cycle::InputQuality;
use fieldarm::engine::meca500::{Action, Config, Engine, Event};
use fieldarm::link::ethercat::layout::{Direction, LayoutMismatch};
use fieldarm::link::ethercat::memory::MemoryWire;
use fieldarm::link::ethercat::wire::Wire;
use fieldarm::link::ethercat::{EthercatError, GroupRobot};
use fieldarm::time::Duration;
use fieldarm::wire::meca500::command::MotionCommand;

type Group = SubDeviceGroup<4, 1_248, DefaultLock, Op>;

/// The PLC's own loop: a main device of `ethercrab`, its frames, and the line.
struct Plc {
    main_device: MainDevice<'static>,
    network: Network,
}

struct Network {
    tx: PduTx<'static>,
    rx: PduRx<'static>,
    line: Line,
}

impl Network {
    fn run<F: Future>(&mut self, future: F) -> F::Output {
        let mut future = pin!(future);
        let mut context = Context::from_waker(Waker::noop());
        let mut buffer = [0; 1_514];
        for _ in 0..1_000_000 {
            if let Poll::Ready(output) = future.as_mut().poll(&mut context) {
                return output;
            }
            while let Some(frame) = self.tx.next_sendable_frame() {
                let sent = frame.send_blocking(|bytes| {
                    self.line.send(bytes).unwrap();
                    Ok(bytes.len())
                });
                sent.unwrap();
            }
            let deadline = self.line.now() + Duration::from_millis(1);
            if let Some(len) = self.line.receive(&mut buffer, deadline).unwrap() {
                self.rx.receive_frame(&buffer[..len]).unwrap();
            }
        }
        panic!("not done after a million polls");
    }
}

impl Plc {
    fn new(line: Line) -> Self {
        let storage: &'static PduStorage<16, 1_514> = Box::leak(Box::new(PduStorage::new()));
        let (tx, rx, pdu_loop) = storage.try_split().unwrap();
        let timeouts = Timeouts {
            state_transition: std::time::Duration::MAX,
            pdu: std::time::Duration::MAX,
            eeprom: std::time::Duration::MAX,
            wait_loop_delay: std::time::Duration::ZERO,
            mailbox_echo: std::time::Duration::MAX,
            mailbox_response: std::time::Duration::MAX,
        };
        let config =
            MainDeviceConfig { dc_static_sync_iterations: 0, ..MainDeviceConfig::default() };
        let main_device = MainDevice::new(pdu_loop, timeouts, config);
        Self { main_device, network: Network { tx, rx, line } }
    }

    /// Everything to OP, as the documentation of `ethercrab` has it.
    fn bring_up(&mut self) -> Group {
        let Self { main_device, network } = self;
        let group = network.run(main_device.init_single_group::<4, 1_248>(|| 0)).unwrap();
        let group = network.run(group.into_safe_op(main_device)).unwrap();
        let group = network.run(group.request_into_op(main_device)).unwrap();
        for _ in 0..100 {
            if network.run(group.tx_rx(main_device)).unwrap().all_op() {
                return group;
            }
        }
        panic!("not in OP after 100 cycles");
    }
}

#[test]
fn robots_in_a_foreign_group_run_their_commands() {
    let mut plc = Plc::new(line(2));
    let group = plc.bring_up();
    let Plc { main_device, network } = &mut plc;
    let mut robots = [0, 1].map(|index| GroupRobot::new(&group, main_device, index).unwrap());
    let mut engines = [0, 1].map(|_| Engine::<8>::new(Config::default()));
    let mut images = [([0; 60], [0; 252], InputQuality::Lost); 2];
    let mut done = [false; 2];
    for _ in 0..60_000 {
        let now = network.line.now() + Duration::from_micros(970);
        network.line.advance_to(now);
        for ((robot, engine), (outputs, inputs, quality)) in
            robots.iter().zip(&mut engines).zip(&mut images)
        {
            engine.cycle_bytes(now, *quality, inputs, outputs).unwrap();
            robot.write(&group, main_device, outputs);
        }
        let response = network.run(group.tx_rx(main_device)).unwrap();
        for (robot, (_, inputs, quality)) in robots.iter_mut().zip(&mut images) {
            *quality = robot.read(&group, main_device, Some(&response), 6, inputs);
        }
        for ((number, engine), done) in (1_u8..).zip(&mut engines).zip(&mut done) {
            while let Some(event) = engine.poll_event() {
                match event {
                    Event::Connected { .. } => engine.bring_up().unwrap(),
                    Event::ActionDone(Action::BringUp) => {
                        let joint = 10.0 * f32::from(number);
                        let target = [joint, 0.0, 0.0, 0.0, 0.0, 0.0];
                        engine.submit(MotionCommand::MoveJoints(target)).unwrap();
                    }
                    Event::Done { .. } => *done = true,
                    _ => {}
                }
            }
        }
        if done == [true; 2] {
            let first_joint =
                |inputs: &[u8; 252]| f32::from_le_bytes(inputs[16..20].try_into().unwrap());
            assert!((first_joint(&images[0].1) - 10.0).abs() < 0.01);
            assert!((first_joint(&images[1].1) - 20.0).abs() < 0.01);
            return;
        }
    }
    panic!("{done:?} after 60,000 cycles");
}

#[test]
fn what_came_back_is_judged() {
    let mut plc = Plc::new(line(1));
    let group = plc.bring_up();
    let Plc { main_device, network } = &mut plc;
    let mut robot = GroupRobot::new(&group, main_device, 0).unwrap();
    let mut inputs = [0; 252];
    let response = network.run(group.tx_rx(main_device)).unwrap();
    let mut read = |response, counter, inputs: &mut [u8]| {
        robot.read(&group, main_device, response, counter, inputs)
    };
    assert_eq!(read(None, 3, &mut inputs), InputQuality::Lost, "nothing was ever fresh");
    assert_eq!(inputs, [0; 252]);
    assert_eq!(read(Some(&response), 3, &mut inputs), InputQuality::Fresh);
    assert_ne!(inputs, [0; 252]);
    let stale = |age_cycles| InputQuality::Stale { age_cycles };
    assert_eq!(read(Some(&response), 6, &mut inputs), stale(1), "the counter does not add up");
    assert_eq!(read(None, 3, &mut inputs), stale(2));
    assert_eq!(read(Some(&response), 3, &mut inputs), InputQuality::Fresh);
    assert_eq!(read(Some(&response), 3, &mut [0; 10]), InputQuality::Lost, "no room");
}

#[test]
fn a_group_without_our_image_is_refused() {
    let settings =
        Meca500Settings { unassigned_at_power_up: &[0x1A08], ..Meca500Settings::default() };
    let mut plc = Plc::new(MemoryWire::new(vec![robot(0, settings, Settings::default())]));
    let group = plc.bring_up();
    let error = GroupRobot::new(&group, &plc.main_device, 0).unwrap_err();
    let mismatch =
        LayoutMismatch::ProcessData { direction: Direction::Inputs, mapped: 252, found: 248 };
    assert_eq!(error, EthercatError::Layout { position: 0, mismatch });
    let error = GroupRobot::new(&group, &plc.main_device, 3).unwrap_err();
    assert_eq!(error, EthercatError::NoSuchPosition { position: 3, found: 1 });
}
