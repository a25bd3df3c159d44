//! One dynamic-data slot as it arrives.

use super::id::DynamicType;
use super::tool::Eoat;
use super::view::DynamicView;

/// A slot's type and its six values, unread.
///
/// The values are kept twice: as Reals, and as the 32 bits of each, because the second value of
/// type 3 is an integer. Which byte order that integer follows is unknown; the image reads it as it
/// reads its Reals. `Unverified:`. Source: PM Tables 22 to 25.
#[derive(Clone, Copy, Debug)]
pub struct DynamicValue {
    ty: DynamicType,
    values: [f32; 6],
    raw_bits: [u32; 6],
}

impl DynamicValue {
    /// A slot from its type, its six values as Reals, and the bits of the six as integers.
    #[must_use]
    pub const fn new(ty: DynamicType, values: [f32; 6], raw_bits: [u32; 6]) -> Self {
        Self { ty, values, raw_bits }
    }

    /// A slot whose bits are those of the Reals.
    #[must_use]
    pub fn from_values(ty: DynamicType, values: [f32; 6]) -> Self {
        Self::new(ty, values, values.map(f32::to_bits))
    }

    /// The type the robot says it reports.
    #[must_use]
    pub const fn dynamic_type(&self) -> DynamicType {
        self.ty
    }

    /// The six values as Reals; those a type does not use are 0.
    #[must_use]
    pub const fn values(&self) -> [f32; 6] {
        self.values
    }

    /// The bits of the six values.
    #[must_use]
    pub const fn raw_bits(&self) -> [u32; 6] {
        self.raw_bits
    }

    /// The values with their meaning. `eoat` decides how type 53 is read.
    #[must_use]
    pub fn view(&self, eoat: Eoat) -> DynamicView {
        DynamicView::decode(self, eoat)
    }
}

/// Equal when type and bits are: a NaN equals itself here.
impl PartialEq for DynamicValue {
    fn eq(&self, other: &Self) -> bool {
        self.ty == other.ty && self.raw_bits == other.raw_bits
    }
}

impl Eq for DynamicValue {}
