//! How a sync manager is timed: objects 1C32h (outputs) and 1C33h (inputs).

use super::assignment::Direction;
use crate::wire::ethercat::coe::AbortCode;

/// Shortest cycle of the robot in nanoseconds: 1 ms.
pub(super) const MIN_CYCLE_NS: u32 = 1_000_000;

/// With the outputs' sync manager (1C32h).
const SM_SYNCHRON: u16 = 0x01;
/// The inputs with the outputs' sync manager (1C33h).
const WITH_SM2: u16 = 0x22;
/// With SYNC0 of the distributed clock.
const DC_SYNC0: u16 = 0x02;

/// Bits of "types supported": synchron with the sync manager, and DC with SYNC0.
pub(super) const TYPES_SUPPORTED: u16 = 1 << 1 | 1 << 2;

/// The timing of one sync manager.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct SyncParameters {
    synchron: u16,
    pub(super) sync_type: u16,
    pub(super) cycle_ns: u32,
}

impl SyncParameters {
    pub(super) const fn new(direction: Direction) -> Self {
        let synchron = match direction {
            Direction::Outputs => SM_SYNCHRON,
            Direction::Inputs => WITH_SM2,
        };
        Self { synchron, sync_type: synchron, cycle_ns: MIN_CYCLE_NS }
    }

    pub(super) const fn set_type(&mut self, value: u16) -> Result<(), AbortCode> {
        if value != self.synchron && value != DC_SYNC0 {
            return Err(AbortCode::VALUE_RANGE);
        }
        self.sync_type = value;
        Ok(())
    }

    pub(super) const fn set_cycle_ns(&mut self, value: u32) -> Result<(), AbortCode> {
        if value < MIN_CYCLE_NS {
            return Err(AbortCode::VALUE_TOO_LOW);
        }
        self.cycle_ns = value;
        Ok(())
    }
}
