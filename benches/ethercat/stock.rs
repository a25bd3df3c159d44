//! `ethercrab` as its examples run it: its own task in `smol`'s thread, the cycle in the main one.

use std::time::{Duration, Instant};

use ethercrab::error::Error;
use ethercrab::std::{ethercat_now, tx_rx_task};
use ethercrab::subdevice_group::{NoDc, Op};
use ethercrab::{DefaultLock, MainDevice, MainDeviceConfig, PduStorage, SubDeviceGroup, Timeouts};

use crate::beat::{Beat, Exchanged, Figures};

const MOST_ROBOTS: usize = 8;
const OUTPUT_LEN: usize = 60;
const INPUT_LEN: usize = 252;
const PROCESS_DATA: usize = 4 * (OUTPUT_LEN + INPUT_LEN);
/// Cycles until all are in OP: far more than it takes.
const PATIENCE: u32 = 20_000;
/// In steps of 100 us: 1 s, because a busy machine may not run us for a while.
const WATCHDOG: u16 = 10_000;

type Storage = PduStorage<32, { PduStorage::element_size(1400) }>;
type Group = SubDeviceGroup<MOST_ROBOTS, PROCESS_DATA, DefaultLock, Op, NoDc>;

static STORAGE: Storage = Storage::new();

/// Brings all robots to OP and cycles.
pub(crate) fn run(interface: &str, robots: usize, beat: Beat) -> Result<Figures, String> {
    let (tx, rx, pdu_loop) = STORAGE.try_split().map_err(|_| "split twice".to_owned())?;
    // The examples' own limits are too tight for a busy machine; none of them matters in the cycle.
    let timeouts = Timeouts {
        state_transition: Duration::from_secs(20),
        pdu: Duration::from_secs(2),
        eeprom: Duration::from_secs(2),
        wait_loop_delay: Duration::from_millis(1),
        mailbox_echo: Duration::from_secs(2),
        mailbox_response: Duration::from_secs(5),
    };
    let main_device = MainDevice::new(pdu_loop, timeouts, MainDeviceConfig::default());
    let task = tx_rx_task(interface, tx, rx).map_err(|error| error.to_string())?;
    smol::spawn(task).detach();
    let started = smol::block_on(start(&main_device, robots, beat.period));
    let mut cell = started.map_err(|error| error.to_string())?;
    Ok(beat.keep(|| {
        let began = Instant::now();
        let exchanged = smol::block_on(cell.exchange());
        let took = began.elapsed();
        Exchanged { took, engine: None, is_whole: exchanged.unwrap_or(false) }
    }))
}

async fn start<'a>(
    main_device: &'a MainDevice<'static>,
    robots: usize,
    period: Duration,
) -> Result<Cell<'a>, Error> {
    let group = main_device.init_single_group::<MOST_ROBOTS, PROCESS_DATA>(ethercat_now).await?;
    for robot in group.iter(main_device) {
        robot.register_write(0x0420_u16, WATCHDOG).await?;
    }
    let group = group.into_safe_op(main_device).await?;
    let group = group.request_into_op(main_device).await?;
    let mut cell = Cell { main_device, group, robots, inputs: vec![[0; INPUT_LEN]; robots] };
    for _ in 0..PATIENCE {
        if cell.exchange().await? {
            return Ok(cell);
        }
        smol::Timer::after(period).await;
    }
    Err(Error::Internal)
}

struct Cell<'a> {
    main_device: &'a MainDevice<'static>,
    group: Group,
    robots: usize,
    inputs: Vec<[u8; INPUT_LEN]>,
}

impl Cell<'_> {
    /// One cycle; whether all robots are in OP and took part.
    async fn exchange(&mut self) -> Result<bool, Error> {
        for robot in 0..self.robots {
            let robot = self.group.subdevice(self.main_device, robot)?;
            robot.outputs_raw_mut().copy_from_slice(&[0; OUTPUT_LEN]);
        }
        let response = self.group.tx_rx(self.main_device).await?;
        for (robot, inputs) in self.inputs.iter_mut().enumerate() {
            let robot = self.group.subdevice(self.main_device, robot)?;
            inputs.copy_from_slice(&robot.inputs_raw());
        }
        let counted = usize::from(response.working_counter) == 3 * self.robots;
        Ok(counted && response.all_op())
    }
}
