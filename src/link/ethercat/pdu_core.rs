//! The parts of `ethercrab` that a segment needs for its whole life, kept for the next one.
//!
//! `ethercrab` hands out frames that borrow their storage, and a link that owned both would borrow
//! from itself. So the storage lives as long as the process (13 kB each, and a frame for each group),
//! and a pool keeps what a dropped segment gave back: as many exist as segments were ever open at once.

use std::prelude::v1::*;
use std::sync::{Arc, Mutex, PoisonError};

use core::time::Duration;
use ethercrab::{
    MainDevice, MainDeviceConfig, PduRx, PduStorage, PduTx, ReceiveAction, RetryBehaviour,
    SendableFrame, Timeouts,
};

use super::wire::MAX_FRAME;

/// Frames that can be under way at once outside the cycle: one at a time, and those of tasks that were
/// given up. A power of two, as `ethercrab` asks.
pub(super) const FRAMES: usize = 8;
/// Longest frame of the cycle of a single robot, with room to spare: `ethercrab` clears the whole place
/// each time.
const SHORT_FRAME: usize = 384;

/// Rounds in which the clocks are drawn together before the start, when clocks are used.
const STATIC_SYNC_ROUNDS: u32 = 1_000;

/// Limits of the waits inside `ethercrab`, in real time. Generous: a busy machine may not run us for
/// a while. The driver has limits of its own, in the time of the wire. A PDU never times out there:
/// its timer would allocate in each cycle.
const TIMEOUTS: Timeouts = Timeouts {
    state_transition: Duration::from_secs(10),
    pdu: Duration::MAX,
    eeprom: Duration::from_millis(500),
    wait_loop_delay: Duration::ZERO,
    mailbox_echo: Duration::from_secs(2),
    mailbox_response: Duration::from_secs(3),
};

/// A main device and both ends of its frame storage.
struct Parts {
    tx: PduTx<'static>,
    rx: PduRx<'static>,
    main_device: Arc<MainDevice<'static>>,
    has_clocks: bool,
}

static POOL: Mutex<Vec<Parts>> = Mutex::new(Vec::new());

/// A main device for nothing but the cycle of one group, and both ends of its storage of one frame.
struct CycleParts {
    tx: PduTx<'static>,
    rx: PduRx<'static>,
    main_device: &'static MainDevice<'static>,
    room: usize,
}

static CYCLE_POOL: Mutex<Vec<CycleParts>> = Mutex::new(Vec::new());

/// Parts on loan from the pool. They go back when this is dropped, unless somebody still holds their
/// main device; then they are lost.
pub(super) struct PduCore {
    pub(super) main_device: Arc<MainDevice<'static>>,
    parts: Option<Parts>,
}

impl PduCore {
    /// A core that nobody uses, with or without distributed clocks.
    pub(super) fn take(has_clocks: bool) -> Self {
        let parts = pooled(has_clocks).unwrap_or_else(|| new_parts(has_clocks));
        Self { main_device: Arc::clone(&parts.main_device), parts: Some(parts) }
    }

    /// The next frame that waits to be sent.
    pub(super) fn next_sendable_frame(&mut self) -> Option<SendableFrame<'static>> {
        self.parts.as_mut()?.tx.next_sendable_frame()
    }

    /// Hands a frame that came back to whoever waits for it; whether somebody took it.
    pub(super) fn receive_frame(&mut self, frame: &[u8]) -> bool {
        self.parts.as_mut().is_some_and(|parts| {
            matches!(parts.rx.receive_frame(frame), Ok(ReceiveAction::Processed))
        })
    }
}

impl Drop for PduCore {
    fn drop(&mut self) {
        let Some(parts) = self.parts.take() else { return };
        // One of these and one of the parts.
        if Arc::strong_count(&self.main_device) == 2 {
            POOL.lock().unwrap_or_else(PoisonError::into_inner).push(parts);
        }
    }
}

/// Parts for the cycle of one group, on loan from the pool. They go back when this is dropped; until
/// then nobody else has them, and the futures of a cycle do not outlive the exchange.
pub(super) struct CycleCore {
    main_device: &'static MainDevice<'static>,
    parts: Option<CycleParts>,
}

impl CycleCore {
    /// A core that nobody uses, for frames of up to `frame_len` bytes.
    pub(super) fn take(frame_len: usize) -> Self {
        let room = if frame_len <= SHORT_FRAME { SHORT_FRAME } else { MAX_FRAME };
        let mut pool = CYCLE_POOL.lock().unwrap_or_else(PoisonError::into_inner);
        let pooled = pool.iter().position(|parts| parts.room == room);
        let parts = match pooled.map(|index| pool.swap_remove(index)) {
            Some(parts) => parts,
            None if room == SHORT_FRAME => new_cycle_parts::<SHORT_FRAME>(),
            None => new_cycle_parts::<MAX_FRAME>(),
        };
        Self { main_device: parts.main_device, parts: Some(parts) }
    }

    /// The main device of the group's cycle.
    pub(super) const fn main_device(&self) -> &'static MainDevice<'static> {
        self.main_device
    }

    /// The frame that waits to be sent.
    pub(super) fn next_sendable_frame(&mut self) -> Option<SendableFrame<'static>> {
        self.parts.as_mut()?.tx.next_sendable_frame()
    }

    /// Hands a frame that came back to whoever waits for it.
    pub(super) fn receive_frame(&mut self, frame: &[u8]) {
        if let Some(parts) = &mut self.parts {
            let _ = parts.rx.receive_frame(frame);
        }
    }
}

impl Drop for CycleCore {
    fn drop(&mut self) {
        CYCLE_POOL.lock().unwrap_or_else(PoisonError::into_inner).extend(self.parts.take());
    }
}

fn new_cycle_parts<const ROOM: usize>() -> CycleParts {
    let config =
        MainDeviceConfig { dc_static_sync_iterations: 0, retry_behaviour: RetryBehaviour::None };
    loop {
        let storage: &'static PduStorage<1, ROOM> = Box::leak(Box::new(PduStorage::new()));
        // A storage splits once, and this one is new.
        if let Ok((tx, rx, pdu_loop)) = storage.try_split() {
            let main_device = Box::leak(Box::new(MainDevice::new(pdu_loop, TIMEOUTS, config)));
            return CycleParts { tx, rx, main_device, room: ROOM };
        }
    }
}

fn pooled(has_clocks: bool) -> Option<Parts> {
    let mut pool = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    let index = pool.iter().position(|parts| parts.has_clocks == has_clocks)?;
    Some(pool.swap_remove(index))
}

fn new_parts(has_clocks: bool) -> Parts {
    let config = MainDeviceConfig {
        dc_static_sync_iterations: if has_clocks { STATIC_SYNC_ROUNDS } else { 0 },
        retry_behaviour: RetryBehaviour::None,
    };
    loop {
        let storage: &'static PduStorage<FRAMES, MAX_FRAME> =
            Box::leak(Box::new(PduStorage::new()));
        // A storage splits once, and this one is new.
        if let Ok((tx, rx, pdu_loop)) = storage.try_split() {
            let main_device = Arc::new(MainDevice::new(pdu_loop, TIMEOUTS, config));
            return Parts { tx, rx, main_device, has_clocks };
        }
    }
}
