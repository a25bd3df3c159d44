//! The crate `ethercrab` as its own examples use it: a whole segment in one group, brought to OP and
//! cycled with its own transmit and receive task, which whoever uses this starts in its own thread.

#![allow(dead_code, reason = "each binary uses a part of it")]

use std::thread;
use std::time::Duration;

use ethercrab::error::{Error, TimeoutError};
use ethercrab::std::ethercat_now;
use ethercrab::subdevice_group::{DcConfiguration, HasDc, NoDc, Op, PreOp};
use ethercrab::{DcSync, DefaultLock, MainDevice, SubDeviceGroup, Timeouts};

/// Bytes of outputs of a robot.
pub(crate) const OUTPUT_LEN: usize = 60;
/// Bytes of inputs of a robot.
pub(crate) const INPUT_LEN: usize = 252;
const MOST_ROBOTS: usize = 8;
/// Of four robots.
const PROCESS_DATA: usize = 4 * (OUTPUT_LEN + INPUT_LEN);
/// Cycles until all are in OP: far more than it takes.
const PATIENCE: usize = 20_000;
/// Steps of 100 us, so 1 s rather than 100 ms: a busy machine may not run us for a while.
const WATCHDOG: u16 = 10_000;

type Group<State, Clock = NoDc> =
    SubDeviceGroup<MOST_ROBOTS, PROCESS_DATA, DefaultLock, State, Clock>;
/// Everybody on the segment, in PRE-OP.
pub(crate) type Found = Group<PreOp>;

/// With or without the clock's part in each cycle.
enum InOp {
    Plain(Group<Op>),
    Clocked(Group<Op, HasDc>),
}

/// Robots in OP.
pub(crate) struct StockLine {
    main_device: MainDevice<'static>,
    group: InOp,
    /// What each robot gets in the next exchange.
    pub(crate) outputs: Vec<[u8; OUTPUT_LEN]>,
    /// What each robot gave in the last one.
    pub(crate) inputs: Vec<[u8; INPUT_LEN]>,
}

/// The examples' own limits are too tight for a busy machine; none of them matters in the cycle.
pub(crate) const TIMEOUTS: Timeouts = Timeouts {
    state_transition: Duration::from_secs(20),
    pdu: Duration::from_secs(2),
    eeprom: Duration::from_secs(2),
    wait_loop_delay: Duration::from_millis(1),
    mailbox_echo: Duration::from_secs(2),
    mailbox_response: Duration::from_secs(5),
};

/// Resets whoever is there and brings all to PRE-OP, with a watchdog that suits a busy machine.
pub(crate) async fn find(main_device: &MainDevice<'static>) -> Result<Found, Error> {
    let group = main_device.init_single_group::<MOST_ROBOTS, PROCESS_DATA>(ethercat_now).await?;
    for robot in group.iter(main_device) {
        robot.register_write(0x0420_u16, WATCHDOG).await?;
    }
    Ok(group)
}

impl StockLine {
    /// From PRE-OP to OP, with outputs of zero every `cycle`.
    pub(crate) async fn start(
        main_device: MainDevice<'static>,
        mut group: Found,
        has_clock: bool,
        cycle: Duration,
    ) -> Result<Self, Error> {
        let robots = group.len();
        let group = if has_clock {
            for mut robot in group.iter_mut(&main_device) {
                robot.set_dc_sync(DcSync::Sync0);
            }
            let group = group.into_pre_op_pdi(&main_device).await?;
            for _ in 0..100 {
                group.tx_rx_sync_system_time(&main_device).await?;
            }
            let configuration = DcConfiguration {
                start_delay: Duration::from_millis(100),
                sync0_period: Duration::from_millis(10),
                sync0_shift: Duration::from_millis(5),
            };
            let group = group.configure_dc_sync(&main_device, configuration).await?;
            let group = group.into_safe_op(&main_device).await?;
            InOp::Clocked(group.request_into_op(&main_device).await?)
        } else {
            let group = group.into_safe_op(&main_device).await?;
            InOp::Plain(group.request_into_op(&main_device).await?)
        };
        let (outputs, inputs) = (vec![[0; OUTPUT_LEN]; robots], vec![[0; INPUT_LEN]; robots]);
        let mut line = Self { main_device, group, outputs, inputs };
        for _ in 0..PATIENCE {
            if line.exchange().await?.1 {
                return Ok(line);
            }
            thread::sleep(cycle);
        }
        Err(Error::Timeout(TimeoutError::StateTransition))
    }

    /// One cycle; the working counter, and whether all are in OP.
    pub(crate) async fn exchange(&mut self) -> Result<(u16, bool), Error> {
        let main_device = &self.main_device;
        macro_rules! exchange {
            ($group:expr, $tx_rx:ident) => {{
                for (robot, outputs) in self.outputs.iter().enumerate() {
                    let robot = $group.subdevice(main_device, robot)?;
                    robot.outputs_raw_mut().copy_from_slice(outputs);
                }
                let response = $group.$tx_rx(main_device).await?;
                for (robot, inputs) in self.inputs.iter_mut().enumerate() {
                    inputs.copy_from_slice(&$group.subdevice(main_device, robot)?.inputs_raw());
                }
                (response.working_counter, response.all_op())
            }};
        }
        Ok(match &self.group {
            InOp::Plain(group) => exchange!(group, tx_rx),
            InOp::Clocked(group) => exchange!(group, tx_rx_dc),
        })
    }
}
