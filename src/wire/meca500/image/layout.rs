//! How the images of older firmware differ from those of 11.3.

use super::MotionStatus;
use crate::wire::order::ImageOrder;
use zerocopy::byteorder::U32;
use zerocopy::{FromBytes, IntoBytes};

/// Which firmware laid out the images; the lengths are the same in all.
///
/// On EtherCAT the identity cannot tell: the revision stayed 1 while the layout changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum FirmwareLayout {
    /// Firmware 11.3, the programming manual.
    #[default]
    V11_3,
    /// Firmware 10.2: one 32-bit checkpoint instead of reached and discarded, no UseVariables, no
    /// MonitoringMode (those bits stay 0).
    V10_2,
}

/// The checkpoints an input image reports, whatever its layout.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Checkpoints {
    /// Last checkpoint reached; 0 until there is one.
    pub reached: u32,
    /// Last checkpoint discarded; 0 until there is one. Firmware 10.2 does not report it.
    pub discarded: u32,
}

impl<O: ImageOrder> MotionStatus<O> {
    /// The checkpoints under `layout`.
    #[inline]
    #[must_use]
    pub fn checkpoints(&self, layout: FirmwareLayout) -> Checkpoints {
        match layout {
            FirmwareLayout::V11_3 => Checkpoints {
                reached: self.checkpoint_reached.get().into(),
                discarded: self.checkpoint_discarded.get().into(),
            },
            FirmwareLayout::V10_2 => {
                let reached = U32::<O::Int>::read_from_prefix(self.as_bytes())
                    .map_or(0, |(checkpoint, _)| checkpoint.get());
                Checkpoints { reached, discarded: 0 }
            }
        }
    }
}
