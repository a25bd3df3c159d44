//! Units of command arguments and of reported values, as the manual uses them.

use core::fmt;

/// Unit of a number on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Unit {
    /// A plain number: a count, a code, a flag.
    None,
    /// Degrees.
    Degree,
    /// Degrees per second.
    DegreePerSecond,
    /// Millimetres.
    Millimetre,
    /// Millimetres per second.
    MillimetrePerSecond,
    /// Percent of the quantity named with the value.
    Percent,
    /// Seconds.
    Second,
    /// Kilograms.
    Kilogram,
    /// Kilopascals.
    Kilopascal,
    /// Sixteen-thousandths of the standard gravity, the accelerometer's own step.
    GravityPer16000,
}

impl Unit {
    /// The symbol people write, empty for a plain number.
    #[must_use]
    pub const fn symbol(self) -> &'static str {
        match self {
            Self::None => "",
            Self::Degree => "deg",
            Self::DegreePerSecond => "deg/s",
            Self::Millimetre => "mm",
            Self::MillimetrePerSecond => "mm/s",
            Self::Percent => "%",
            Self::Second => "s",
            Self::Kilogram => "kg",
            Self::Kilopascal => "kPa",
            Self::GravityPer16000 => "1/16000 g",
        }
    }

    /// The symbol with a space before it, to stand after a number.
    #[must_use]
    pub const fn suffix(self) -> &'static str {
        match self {
            Self::None => "",
            Self::Degree => " deg",
            Self::DegreePerSecond => " deg/s",
            Self::Millimetre => " mm",
            Self::MillimetrePerSecond => " mm/s",
            Self::Percent => " %",
            Self::Second => " s",
            Self::Kilogram => " kg",
            Self::Kilopascal => " kPa",
            Self::GravityPer16000 => " 1/16000 g",
        }
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.symbol())
    }
}
