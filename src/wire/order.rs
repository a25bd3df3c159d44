//! Byte order of an image: a type parameter for the codec, a plain value for settings.
//!
//! Integers and Reals have an order each. The manual says that 16- and 32-bit integers are
//! big-endian on every bus and says nothing of Reals, while a captured EtherCAT frame of a real
//! robot is little-endian for both; hence four combinations, of which [`Big`] is the default.

use core::fmt;
use core::marker::PhantomData;
use core::str::FromStr;

use zerocopy::byteorder::{BigEndian, ByteOrder as Endianness, LittleEndian};

/// The byte order of an image as a type: one order for 16- and 32-bit integers, one for Reals.
///
/// Bit fields and 8-bit values read the same in every order: bit 0 is the least significant bit
/// of the lowest byte. Implemented by [`Big`], [`Little`], [`BigIntLittleReal`] and
/// [`LittleIntBigReal`]; sealed.
pub trait ImageOrder: sealed::Sealed + Copy + fmt::Debug + 'static {
    /// Order of 16- and 32-bit integers.
    type Int: Endianness + Copy + fmt::Debug + 'static;
    /// Order of 32-bit Reals (IEEE-754 single).
    type Real: Endianness + Copy + fmt::Debug + 'static;
    /// The same choice as a value.
    const VALUE: ByteOrder;
}

/// A pair of orders; use the names [`Big`], [`Little`], [`BigIntLittleReal`] and
/// [`LittleIntBigReal`].
#[derive(Clone, Copy, Debug)]
pub struct Order<I, R>(PhantomData<(I, R)>);

/// Integers and Reals big-endian: the manual's reading and this crate's default.
pub type Big = Order<BigEndian, BigEndian>;
/// Integers and Reals little-endian: as captured from a real robot on EtherCAT.
pub type Little = Order<LittleEndian, LittleEndian>;
/// Integers big-endian as the manual says, Reals little-endian. Unverified: never seen on a wire.
pub type BigIntLittleReal = Order<BigEndian, LittleEndian>;
/// Integers little-endian, Reals big-endian. Unverified: never seen on a wire.
pub type LittleIntBigReal = Order<LittleEndian, BigEndian>;

macro_rules! image_orders {
    ($($order:ty: $integers:ident, $reals:ident;)*) => {$(
        impl sealed::Sealed for $order {}

        impl ImageOrder for $order {
            type Int = $integers;
            type Real = $reals;
            const VALUE: ByteOrder =
                ByteOrder { integers: Endian::$integers, reals: Endian::$reals };
        }
    )*};
}

image_orders! {
    Big: BigEndian, BigEndian;
    Little: LittleEndian, LittleEndian;
    BigIntLittleReal: BigEndian, LittleEndian;
    LittleIntBigReal: LittleEndian, BigEndian;
}

mod sealed {
    pub trait Sealed {}
}

/// Which byte of a multi-byte value comes first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Endian {
    /// Most significant byte first.
    #[default]
    BigEndian,
    /// Least significant byte first.
    LittleEndian,
}

impl Endian {
    /// The 16-bit integer that `bytes` stand for.
    #[must_use]
    pub const fn u16(self, bytes: [u8; 2]) -> u16 {
        match self {
            Self::BigEndian => u16::from_be_bytes(bytes),
            Self::LittleEndian => u16::from_le_bytes(bytes),
        }
    }

    /// The 32-bit integer that `bytes` stand for.
    #[must_use]
    pub const fn u32(self, bytes: [u8; 4]) -> u32 {
        match self {
            Self::BigEndian => u32::from_be_bytes(bytes),
            Self::LittleEndian => u32::from_le_bytes(bytes),
        }
    }
}

impl fmt::Display for Endian {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::BigEndian => "big",
            Self::LittleEndian => "little",
        })
    }
}

/// The byte order of an image as a value: what a setting holds and what detection finds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct ByteOrder {
    /// Order of 16- and 32-bit integers.
    pub integers: Endian,
    /// Order of 32-bit Reals.
    pub reals: Endian,
}

impl ByteOrder {
    /// Integers and Reals big-endian ([`Big`]).
    pub const BIG: Self = Big::VALUE;
    /// Integers and Reals little-endian ([`Little`]).
    pub const LITTLE: Self = Little::VALUE;
    /// Every combination, the likely ones first.
    pub const ALL: [Self; 4] =
        [Big::VALUE, Little::VALUE, BigIntLittleReal::VALUE, LittleIntBigReal::VALUE];
}

impl fmt::Display for ByteOrder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.integers == self.reals {
            self.integers.fmt(f)
        } else {
            write!(f, "{}-int-{}-real", self.integers, self.reals)
        }
    }
}

/// A byte order that is none of `big`, `little`, `big-int-little-real`, `little-int-big-real`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("byte order must be big, little, big-int-little-real or little-int-big-real")]
pub struct ParseByteOrderError;

impl FromStr for ByteOrder {
    type Err = ParseByteOrderError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "big" => Ok(Big::VALUE),
            "little" => Ok(Little::VALUE),
            "big-int-little-real" => Ok(BigIntLittleReal::VALUE),
            "little-int-big-real" => Ok(LittleIntBigReal::VALUE),
            _ => Err(ParseByteOrderError),
        }
    }
}
