//! The crate `ethercrab` as its own examples use it, with its own transmit and receive task, against
//! the virtual robots. Offsets are typed from the manual's tables, not taken from the codec.

use std::thread;
use std::time::{Duration, Instant};

use ethercrab::error::Error;
use ethercrab::std::tx_rx_task;
use ethercrab::{MainDevice, MainDeviceConfig, PduStorage};
use futures_lite::future;

use crate::capture::Capture;
use crate::namespaces::{Cable, End, INTERFACE};
use crate::served::{Robots, end, serve};
use crate::stock_line::{StockLine, TIMEOUTS, find};

const CYCLE: Duration = Duration::from_millis(2);
/// Cycles after which something should have happened: far more than it takes.
const PATIENCE: usize = 20_000;
/// Far longer than a run takes.
const LONG: Duration = Duration::from_secs(120);
/// Cycles for the figures.
const MEASURED: usize = 1_000;

/// A frame for the process data of four robots, and one that they do not fit into.
const WIDE: usize = PduStorage::element_size(1_400);
const NARROW: usize = PduStorage::element_size(1_100);

/// Robots in OP, and the order their images have.
struct Cell {
    robots: Robots,
    /// Sum of the working counters of a cycle's frames.
    counter: u16,
    line: StockLine,
}

impl Cell {
    fn is_little(&self) -> bool {
        self.robots.order == "little"
    }

    fn bytes<const N: usize>(&self, big_endian: [u8; N]) -> [u8; N] {
        let mut bytes = big_endian;
        if self.is_little() {
            bytes.reverse();
        }
        bytes
    }

    fn write<const N: usize>(&mut self, robot: usize, offset: usize, big_endian: [u8; N]) {
        let bytes = self.bytes(big_endian);
        self.line.outputs[robot][offset..offset + N].copy_from_slice(&bytes);
    }

    fn read<const N: usize>(&self, robot: usize, offset: usize) -> [u8; N] {
        self.bytes(self.line.inputs[robot][offset..offset + N].try_into().expect("N bytes"))
    }

    fn u16(&self, robot: usize, offset: usize) -> u16 {
        u16::from_be_bytes(self.read(robot, offset))
    }

    fn u32(&self, robot: usize, offset: usize) -> u32 {
        u32::from_be_bytes(self.read(robot, offset))
    }

    fn reals<const N: usize>(&self, robot: usize, offset: usize) -> [f32; N] {
        core::array::from_fn(|at| f32::from_be_bytes(self.read(robot, offset + 4 * at)))
    }

    /// Cycles until `is_there` for every robot.
    async fn until(&mut self, what: &str, is_there: impl Fn(&Self, usize) -> bool) {
        for _ in 0..PATIENCE {
            let (counter, _) = self.line.exchange().await.expect(what);
            assert_eq!(counter, self.counter, "working counter: {what}");
            if (0..self.robots.count).all(|robot| is_there(self, robot)) {
                return;
            }
            thread::sleep(CYCLE);
        }
        panic!("{what}: not after {PATIENCE} cycles; {:02X?}", self.line.inputs);
    }

    fn command(&mut self, robot: usize, move_id: u16, command: u32, arguments: [f32; 6]) {
        self.write(robot, 4, move_id.to_be_bytes());
        self.line.outputs[robot][6] = 1;
        self.write(robot, 8, command.to_be_bytes());
        for (at, argument) in arguments.into_iter().enumerate() {
            self.write(robot, 12 + 4 * at, argument.to_be_bytes());
        }
    }
}

/// From nothing to OP, as the examples do it.
async fn start(
    main_device: MainDevice<'static>,
    robots: Robots,
    counter: u16,
) -> Result<Cell, Error> {
    let group = find(&main_device).await?;
    assert_eq!(group.len(), robots.count);
    for robot in group.iter(&main_device) {
        let identity = robot.identity();
        let found = (identity.vendor_id, identity.product_id, identity.revision);
        assert_eq!(found, (0x00EC_ADE1, 0x0004_D500, 1));
        assert_eq!(robot.sdo_read::<u32>(0x1018, 1).await?, 0x00EC_ADE1);
        assert_eq!(robot.sdo_read::<u32>(0x1018, 2).await?, 0x0004_D500);
        assert_eq!(robot.dc_support().any(), robots.has_clock);
    }
    let line = StockLine::start(main_device, group, robots.has_clock, CYCLE).await?;
    Ok(Cell { robots, counter, line })
}

/// Outputs that differ from robot to robot, and what each makes of its own.
async fn exchange_by_value(cell: &mut Cell) {
    let robots = 0..cell.robots.count;
    cell.until("FifoSpace 13000", |cell, robot| cell.u16(robot, 10) == 13_000).await;
    for robot in robots.clone() {
        assert_eq!(cell.line.inputs[robot][0] & 0x06, 0, "neither activated nor homed");
        assert_eq!(cell.u16(robot, 8), 0, "no MoveID");
        cell.write(robot, 36, (1_800_000_000 + robot as u32).to_be_bytes());
        cell.write(robot, 44 + 4 * robot, 1_u32.to_be_bytes());
    }
    let is_typed = |cell: &Cell, robot: usize| cell.u32(robot, 140 + 28 * robot) == 1;
    cell.until("the firmware version's type", is_typed).await;
    for robot in robots.clone() {
        assert_eq!(cell.reals(robot, 144 + 28 * robot), [11.0, 3.0, 84.0]);
        cell.line.outputs[robot][0] = 1 << 1;
    }
    cell.until("Activated", |cell, robot| cell.line.inputs[robot][0] & 1 << 1 != 0).await;
    cell.line.outputs.iter_mut().for_each(|outputs| outputs[0] = 1 << 2);
    cell.until("Homed", |cell, robot| cell.line.inputs[robot][0] & 1 << 2 != 0).await;
    for outputs in &mut cell.line.outputs {
        outputs[0] = 0;
        outputs[6] = 1 << 3;
    }
    cell.until("not paused", |cell, robot| cell.line.inputs[robot][12] & 1 == 0).await;
    let target = |robot: usize| [10.0 + robot as f32, -5.0, 5.5, 0.25, 20.0, -7.0];
    for robot in robots.clone() {
        cell.command(robot, 1_000 + robot as u16, 1, target(robot));
    }
    cell.until("MoveID", |cell, robot| cell.u16(robot, 8) == 1_000 + robot as u16).await;
    for robot in robots.clone() {
        let checkpoint = [100.0 + robot as f32, 0.0, 0.0, 0.0, 0.0, 0.0];
        cell.command(robot, 2_000 + robot as u16, 17, checkpoint);
    }
    cell.until("MoveID", |cell, robot| cell.u16(robot, 8) == 2_000 + robot as u16).await;
    cell.until("checkpoint", |cell, robot| cell.u16(robot, 4) == 100 + robot as u16).await;
    cell.until("end of motion", |cell, robot| cell.line.inputs[robot][12] & 1 << 2 != 0).await;
    for robot in robots {
        for (found, expected) in cell.reals::<6>(robot, 16).into_iter().zip(target(robot)) {
            assert!(
                (found - expected).abs() < 0.01,
                "robot {robot}: {:?}",
                cell.reals::<6>(robot, 16)
            );
        }
        assert_eq!(cell.u16(robot, 2), 0, "ErrorCode");
    }
}

/// The whole conversation; runs where the main device is.
fn converse<const FRAME: usize>(robots: Robots, counter: u16) -> String {
    // As long as the process: the task below keeps it after the conversation.
    let storage: &'static PduStorage<32, FRAME> = Box::leak(Box::new(PduStorage::new()));
    let (tx, rx, pdu_loop) = storage.try_split().expect("split once");
    let settings =
        MainDeviceConfig { dc_static_sync_iterations: 500, ..MainDeviceConfig::default() };
    let main_device = MainDevice::new(pdu_loop, TIMEOUTS, settings);
    let task = tx_rx_task(INTERFACE, tx, rx).expect("root opens the interface");
    // It never ends by itself; the process ends it.
    thread::spawn(move || future::block_on(task).map(drop));
    future::block_on(async {
        let begin = Instant::now();
        let mut cell = start(main_device, robots, counter).await.expect("OP");
        let started = begin.elapsed();
        exchange_by_value(&mut cell).await;
        let mut times = Vec::with_capacity(MEASURED);
        for _ in 0..MEASURED {
            let begin = Instant::now();
            let exchanged = cell.line.exchange().await.expect("a cycle");
            times.push(begin.elapsed().as_micros());
            assert_eq!(exchanged, (counter, true));
        }
        times.sort_unstable();
        let (p50, p99) = (times[MEASURED / 2], times[MEASURED * 99 / 100]);
        format!(
            "{} robots, OP after {:.2} s, exchange p50 {p50} us, p99 {p99} us",
            robots.count,
            started.as_secs_f64()
        )
    })
}

fn bring_to_op<const FRAME: usize>(robots: Robots, counter: u16) {
    let Some(cable) = Cable::plug() else { return };
    let capture = Capture::start(&cable, &format!("ethercrab-{counter}-{}", robots.order));
    let serving = serve(&cable, robots, &[]);
    let figures = cable.inside(End::Main, LONG, move || converse::<FRAME>(robots, counter));
    let served = end(serving);
    println!("ethercrab passed: {figures}");
    for robot in 0..robots.count {
        assert!(served.contains(&format!("position {robot}: SAFE-OP -> OP")), "{served}");
    }
    if let Some(capture) = capture {
        capture.check(2_000);
    }
}

#[test]
fn one_robot_with_distributed_clocks() {
    bring_to_op::<WIDE>(Robots::ONE, 3);
}

#[test]
fn one_robot_without_distributed_clocks() {
    bring_to_op::<WIDE>(Robots::ONE_WITHOUT_CLOCK, 3);
}

#[test]
fn four_robots_with_distributed_clocks() {
    bring_to_op::<WIDE>(Robots::FOUR, 12);
}

#[test]
fn four_robots_without_distributed_clocks() {
    bring_to_op::<WIDE>(Robots::FOUR_WITHOUT_CLOCK, 12);
}

#[test]
fn four_robots_whose_outputs_are_cut_in_two_by_the_end_of_a_frame() {
    // The outputs of one robot come in two frames, and count in both.
    bring_to_op::<NARROW>(Robots::FOUR_WITHOUT_CLOCK, 12 + 2);
}
