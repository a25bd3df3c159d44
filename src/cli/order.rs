//! Names of byte orders on the command line.

use clap::ValueEnum;

use crate::wire::order::{Big, BigIntLittleReal, ByteOrder, ImageOrder, Little, LittleIntBigReal};

/// A byte order of the images.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum OrderName {
    /// Integers and Reals big-endian, as the manual says.
    Big,
    /// Integers and Reals little-endian, as seen on EtherCAT.
    Little,
    /// Integers big-endian, Reals little-endian.
    BigIntLittleReal,
    /// Integers little-endian, Reals big-endian.
    LittleIntBigReal,
}

impl From<OrderName> for ByteOrder {
    fn from(order: OrderName) -> Self {
        match order {
            OrderName::Big => Big::VALUE,
            OrderName::Little => Little::VALUE,
            OrderName::BigIntLittleReal => BigIntLittleReal::VALUE,
            OrderName::LittleIntBigReal => LittleIntBigReal::VALUE,
        }
    }
}
