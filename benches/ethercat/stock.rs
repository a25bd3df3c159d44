//! `ethercrab` as its examples run it: its own task in `smol`'s thread, the cycle in the main one.

use std::time::Instant;

use ethercrab::error::Error;
use ethercrab::std::tx_rx_task;
use ethercrab::{MainDevice, MainDeviceConfig, PduStorage};

use crate::beat::{Beat, Exchanged, Figures};
use crate::stock_line::{StockLine, TIMEOUTS, find};

type Storage = PduStorage<32, { PduStorage::element_size(1400) }>;

static STORAGE: Storage = Storage::new();

/// Brings all robots to OP and cycles.
pub(crate) fn run(interface: &str, robots: usize, beat: Beat) -> Result<Figures, String> {
    let (tx, rx, pdu_loop) = STORAGE.try_split().map_err(|_| "split twice".to_owned())?;
    let main_device = MainDevice::new(pdu_loop, TIMEOUTS, MainDeviceConfig::default());
    let task = tx_rx_task(interface, tx, rx).map_err(|error| error.to_string())?;
    smol::spawn(task).detach();
    let started = smol::block_on(async {
        let found = find(&main_device).await?;
        let is_complete = found.len() == robots;
        let line = StockLine::start(main_device, found, false, beat.period).await?;
        Ok::<_, Error>((line, is_complete))
    });
    let (mut line, is_complete) = started.map_err(|error| error.to_string())?;
    if !is_complete {
        return Err(format!("{} robots answer, not {robots}", line.inputs.len()));
    }
    let expected = u16::try_from(3 * robots).map_err(|error| error.to_string())?;
    Ok(beat.keep(|| {
        let began = Instant::now();
        let exchanged = smol::block_on(line.exchange());
        let took = began.elapsed();
        let is_whole = exchanged.is_ok_and(|exchanged| exchanged == (expected, true));
        Exchanged { took, engine: None, is_whole }
    }))
}
