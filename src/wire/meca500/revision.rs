//! The two hardware revisions of the Meca500, where they differ in a limit.

use core::fmt;

/// Hardware revision of a Meca500. R4 is the faster one; its robots accept larger joint velocity
/// percentages. Source: PM L2619, L2661.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Revision {
    /// Revision 3. The stricter limits, hence the default when nobody said which robot it is.
    #[default]
    R3,
    /// Revision 4.
    R4,
}

impl Revision {
    /// Product type number the robot reports for this revision in dynamic data type 2.
    /// Source: PM Table 12.
    #[must_use]
    pub const fn product_type(self) -> u32 {
        match self {
            Self::R3 => 3,
            Self::R4 => 4,
        }
    }

    /// Revision that belongs to a product type number; `None` for another product.
    #[must_use]
    pub const fn from_product_type(number: u32) -> Option<Self> {
        match number {
            3 => Some(Self::R3),
            4 => Some(Self::R4),
            _ => None,
        }
    }
}

impl fmt::Display for Revision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::R3 => "R3",
            Self::R4 => "R4",
        })
    }
}
