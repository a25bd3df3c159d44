//! The two macros behind the images: a block is declared once, and from that declaration come its
//! struct, its plain values, its `Debug`, its layout assertions and its rows of [`Field`].
//!
//! [`Field`]: super::Field

use core::fmt;

use zerocopy::byteorder::{ByteOrder, F32, LittleEndian, U16, U32};
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout, Unaligned};

/// A field of an image that can be read as a plain value and written from one.
pub(super) trait Wire {
    /// The plain value: an integer, a float, a struct of bools, an array of these.
    type Value: Copy;

    /// Reads the value.
    fn load(&self) -> Self::Value;

    /// Writes the value; reserved bits stay as they are.
    fn store(&mut self, value: &Self::Value);

    /// Prints the field for `Debug`.
    fn show(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result;
}

/// Prints a field as its plain value.
pub(super) struct Shown<'a, T>(pub(super) &'a T);

impl<T: Wire> fmt::Debug for Shown<'_, T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.show(f)
    }
}

macro_rules! wire_numbers {
    ($($ty:ty => $value:ty $(, $order:ident)?;)*) => {$(
        impl$(<$order: ByteOrder>)? Wire for $ty {
            type Value = $value;

            #[inline]
            fn load(&self) -> $value {
                self.get()
            }

            #[inline]
            fn store(&mut self, value: &$value) {
                self.set(*value);
            }

            fn show(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                fmt::Debug::fmt(&self.load(), f)
            }
        }
    )*};
}

wire_numbers! {
    U16<O> => u16, O;
    U32<O> => u32, O;
    F32<O> => f32, O;
}

macro_rules! wire_bytes {
    ($($ty:ty),*) => {$(
        impl Wire for $ty {
            type Value = $ty;

            #[inline]
            fn load(&self) -> $ty {
                *self
            }

            #[inline]
            fn store(&mut self, value: &$ty) {
                *self = *value;
            }

            fn show(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                fmt::Debug::fmt(&self.load(), f)
            }
        }
    )*};
}

wire_bytes!(u8, i8);

impl<T: Wire, const N: usize> Wire for [T; N] {
    type Value = [T::Value; N];

    #[inline]
    fn load(&self) -> Self::Value {
        self.each_ref().map(T::load)
    }

    #[inline]
    fn store(&mut self, value: &Self::Value) {
        for (field, value) in self.iter_mut().zip(value) {
            field.store(value);
        }
    }

    fn show(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.iter().map(Shown)).finish()
    }
}

/// Flags that live in a field of bits; the flag types of this module implement it.
pub trait FlagSet: bitflags::Flags<Bits: Into<u32>> + Copy + fmt::Debug {
    /// The bytes in the image. Bit fields are bytes, lowest first, in every byte order.
    type Store: StoredBits<Bits = Self::Bits>
        + FromBytes
        + IntoBytes
        + KnownLayout
        + Immutable
        + Unaligned
        + Copy;
    /// The named bits as a struct of bools.
    type Bools: Copy;

    /// The named bits, one bool each.
    fn bools(self) -> Self::Bools;

    /// The flags that `bools` name.
    fn from_bools(bools: &Self::Bools) -> Self;
}

/// Storage of a field of bits: one, two or four bytes.
pub trait StoredBits {
    /// The integer that holds the bits.
    type Bits;

    /// All bits, bit 0 first.
    fn load_bits(&self) -> Self::Bits;

    /// Replaces all bits.
    fn store_bits(&mut self, bits: Self::Bits);
}

macro_rules! stored_bits {
    ($($ty:ty => $bits:ty;)*) => {$(
        impl StoredBits for $ty {
            type Bits = $bits;

            #[inline]
            fn load_bits(&self) -> $bits {
                (*self).into()
            }

            #[inline]
            fn store_bits(&mut self, bits: $bits) {
                *self = bits.into();
            }
        }
    )*};
}

stored_bits! {
    u8 => u8;
    U16<LittleEndian> => u16;
    U32<LittleEndian> => u32;
}

/// A field of bits in an image.
///
/// Reading keeps unknown bits. Writing named bits leaves reserved ones as they are, except for
/// [`set_raw`](Self::set_raw).
#[derive(Clone, Copy, FromBytes, IntoBytes, KnownLayout, Immutable, Unaligned)]
#[repr(transparent)]
pub struct BitField<F: FlagSet> {
    store: F::Store,
}

impl<F: FlagSet> BitField<F> {
    /// All bits, unknown ones included.
    #[inline]
    #[must_use]
    pub fn get(&self) -> F {
        F::from_bits_retain(self.store.load_bits())
    }

    /// Whether all bits of `flags` are set.
    #[inline]
    #[must_use]
    pub fn contains(&self, flags: F) -> bool {
        self.get().contains(flags)
    }

    /// Replaces the named bits; reserved bits stay as they are.
    #[inline]
    pub fn set(&mut self, flags: F) {
        let reserved = self.get().difference(F::all());
        self.set_raw(reserved.union(flags.intersection(F::all())));
    }

    /// Sets (`on`) or clears the bits of `flags`; all others stay as they are.
    #[inline]
    pub fn assign(&mut self, flags: F, on: bool) {
        let bits = self.get();
        self.set_raw(if on { bits.union(flags) } else { bits.difference(flags) });
    }

    /// Replaces all bits, reserved ones included.
    #[inline]
    pub fn set_raw(&mut self, flags: F) {
        self.store.store_bits(flags.bits());
    }
}

impl<F: FlagSet> fmt::Debug for BitField<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.get().fmt(f)
    }
}

impl<F: FlagSet> Wire for BitField<F> {
    type Value = F::Bools;

    #[inline]
    fn load(&self) -> F::Bools {
        self.get().bools()
    }

    #[inline]
    fn store(&mut self, bools: &F::Bools) {
        self.set(F::from_bools(bools));
    }

    fn show(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.get().fmt(f)
    }
}

/// Declares a field of bits: its flags, its struct of bools, and its rows.
///
/// Bits are listed from bit 0 upwards without a gap; `_: n` is a run of `n` reserved bits.
macro_rules! flags {
    (
        $(#[$doc:meta])*
        $flags:ident: $bits:ty as $store:ty, bools $bools:ident {
            $(
                $(#[doc = $bit_doc:literal])+
                $flag:ident $bool:ident = $bit:literal $name:literal sub $sub:literal
                $(support $support:ident)?;
            )*
        }
        reserved { $($reserved_after:literal + $reserved:literal),* $(,)? }
    ) => {
        bitflags::bitflags! {
            $(#[$doc])*
            #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
            pub struct $flags: $bits {
                $(
                    $(#[doc = $bit_doc])+
                    const $flag = 1 << $bit;
                )*
            }
        }

        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub struct $bools {
            $(
                $(#[doc = $bit_doc])+
                pub $bool: bool,
            )*
        }

        impl $flags {
            pub(super) const ROWS: &[Row] = &{
                const NAMED: &[(u8, Row)] = &[$(($bit, {
                    Row::value($name, FieldType::Bool, $sub, "", concat!($($bit_doc),+).trim_ascii())
                        $(.support(Support::$support))?
                })),*];
                const RESERVED: &[(u8, u16)] = &[$(($reserved_after, $reserved)),*];
                super::block::merge::<{ NAMED.len() + RESERVED.len() }>(NAMED, RESERVED)
            };
        }

        const _: () = assert!(
            super::block::width($flags::ROWS) == <$bits>::BITS as u16,
            concat!(stringify!($flags), " does not cover its bytes")
        );

        impl super::block::FlagSet for $flags {
            type Store = $store;
            type Bools = $bools;

            #[inline]
            fn bools(self) -> $bools {
                let bits = u32::from(self.bits());
                $bools { $($bool: super::block::bit(bits, $bit)),* }
            }

            #[inline]
            fn from_bools(bools: &$bools) -> Self {
                Self::from_bits_retain(0 $(| <$bits>::from(bools.$bool) << $bit)*)
            }
        }
    };
}

/// Bit `bit` of `bits`.
///
/// Looked up instead of shifted and masked: neighbouring bools of a struct then become one copy of
/// up to four bytes, which halves the instructions of a full decode.
#[inline]
pub(super) fn bit(bits: u32, bit: u8) -> bool {
    let nibble = bits >> (bit & !3) & 0xF;
    let [first, second, third, fourth] = BITS_OF_NIBBLE.get(nibble as usize).unwrap_or(&[false; 4]);
    match bit & 3 {
        0 => *first,
        1 => *second,
        2 => *third,
        _ => *fourth,
    }
}

/// The bits of each number below 16, the least significant first.
static BITS_OF_NIBBLE: [[bool; 4]; 16] = {
    const NO: bool = false;
    const YES: bool = true;
    [
        [NO, NO, NO, NO],
        [YES, NO, NO, NO],
        [NO, YES, NO, NO],
        [YES, YES, NO, NO],
        [NO, NO, YES, NO],
        [YES, NO, YES, NO],
        [NO, YES, YES, NO],
        [YES, YES, YES, NO],
        [NO, NO, NO, YES],
        [YES, NO, NO, YES],
        [NO, YES, NO, YES],
        [YES, YES, NO, YES],
        [NO, NO, YES, YES],
        [YES, NO, YES, YES],
        [NO, YES, YES, YES],
        [YES, YES, YES, YES],
    ]
};

/// Named bits and runs of reserved bits in the order of their bit numbers. A bit number that does
/// not follow from the rows before it is a build error.
pub(super) const fn merge<const N: usize>(
    mut named: &[(u8, super::field::Row)],
    mut reserved: &[(u8, u16)],
) -> [super::field::Row; N] {
    let mut rows = [super::field::Row::reserved(0); N];
    let mut room: &mut [super::field::Row] = &mut rows;
    let mut next_bit = 0;
    while let Some((slot, more_room)) = room.split_first_mut() {
        match (named.split_first(), reserved.split_first()) {
            (Some(((bit, row), more)), _) if *bit as u16 == next_bit => {
                *slot = *row;
                named = more;
            }
            (_, Some(((bit, size), more))) if *bit as u16 == next_bit => {
                *slot = super::field::Row::reserved(*size);
                reserved = more;
            }
            _ => return [super::field::Row::reserved(0); N],
        }
        next_bit += slot.size_bits;
        room = more_room;
    }
    rows
}

/// Bits that `rows` cover together.
pub(super) const fn width(mut rows: &[super::field::Row]) -> u16 {
    let mut bits = 0;
    while let Some((row, more)) = rows.split_first() {
        bits += row.size_bits;
        rows = more;
    }
    bits
}

/// Declares a block: the struct in the image, its plain values, and its rows.
macro_rules! block {
    (
        $(#[$doc:meta])*
        $block:ident $(<$order:ident>)?: $size:literal bytes, values $values:ident, parts $parts:ident {
            $(
                $(#[$field_doc:meta])*
                $field:ident: $ty:ty => $value:ty, at $at:literal, rows $rows:expr;
            )*
        }
    ) => {
        $(#[$doc])*
        #[derive(
            Clone, Copy, zerocopy::FromBytes, zerocopy::IntoBytes, zerocopy::KnownLayout,
            zerocopy::Immutable, zerocopy::Unaligned,
        )]
        #[repr(C)]
        pub struct $block $(<$order: ImageOrder>)? {
            $(
                $(#[$field_doc])*
                pub $field: $ty,
            )*
        }

        $(#[$doc])*
        ///
        /// These are the plain values, every bit a `bool`.
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct $values {
            $(
                $(#[$field_doc])*
                pub $field: $value,
            )*
        }

        impl $(<$order: ImageOrder>)? $block $(<$order>)? {
            /// Every field as a plain value.
            #[inline]
            #[must_use]
            pub fn values(&self) -> $values {
                $values { $($field: super::block::Wire::load(&self.$field)),* }
            }

            /// Writes every field; reserved bits stay as they are.
            #[inline]
            pub fn set_values(&mut self, values: &$values) {
                $(super::block::Wire::store(&mut self.$field, &values.$field);)*
            }
        }

        impl $(<$order: ImageOrder>)? super::block::Wire for $block $(<$order>)? {
            type Value = $values;

            #[inline]
            fn load(&self) -> $values {
                self.values()
            }

            #[inline]
            fn store(&mut self, values: &$values) {
                self.set_values(values);
            }

            fn show(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                core::fmt::Debug::fmt(self, f)
            }
        }

        impl $(<$order: ImageOrder>)? core::fmt::Debug for $block $(<$order>)? {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                f.debug_struct(stringify!($block))
                    $(.field(stringify!($field), &super::block::Shown(&self.$field)))*
                    .finish()
            }
        }

        pub(super) const $parts: &[Part] = &[$(Part { at: $at, rows: $rows }),*];

        // The layout does not depend on the order: any order serves to check it.
        const _: () = {
            $(type $order = crate::wire::order::Big;)?
            type Block = $block $(<$order>)?;
            $(
                assert!(
                    core::mem::offset_of!(Block, $field) == $at,
                    concat!(stringify!($block), ".", stringify!($field), " is misplaced")
                );
                assert!(
                    super::block::width($rows) as usize == 8 * size_of::<$ty>(),
                    concat!(stringify!($block), ".", stringify!($field), ": rows and type differ")
                );
            )*
            assert!(size_of::<Block>() == $size);
        };
    };
}

/// Declares an image: its blocks at their places, its plain values, and its rows.
macro_rules! image {
    (
        $(#[$doc:meta])*
        $image:ident<$order:ident>: $size:literal bytes as $len:ident, values $values:ident, fields $fields:ident {
            $(
                $(#[$block_doc:meta])*
                $block:ident: $ty:ty => $block_values:ty, at $at:literal $parts:ident {
                    $($section:literal at $section_at:literal, object $object:literal, pdo $pdo:literal, table $table:literal;)+
                }
            )*
        }
    ) => {
        $(#[$doc])*
        #[derive(
            Clone, Copy, zerocopy::FromBytes, zerocopy::IntoBytes, zerocopy::KnownLayout,
            zerocopy::Immutable, zerocopy::Unaligned,
        )]
        #[repr(C)]
        pub struct $image<$order: ImageOrder = crate::wire::order::Big> {
            $(
                $(#[$block_doc])*
                pub $block: $ty,
            )*
        }

        $(#[$doc])*
        ///
        /// These are the plain values, every bit a `bool`.
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct $values {
            $(
                $(#[$block_doc])*
                pub $block: $block_values,
            )*
        }

        #[doc = concat!("Length of the image in bytes: ", stringify!($size), ".")]
        pub const $len: usize = $size;

        impl<$order: ImageOrder> $image<$order> {
            /// An image of zeros, the same in every order.
            #[must_use]
            pub fn zeroed() -> Self {
                zerocopy::FromZeros::new_zeroed()
            }

            /// The image that lies in `bytes`; nothing is copied.
            ///
            /// # Errors
            ///
            /// [`WireError::Length`] unless `bytes` has exactly the length of the image.
            #[inline]
            pub fn from_bytes(bytes: &[u8]) -> Result<&Self, WireError> {
                zerocopy::FromBytes::ref_from_bytes(bytes)
                    .map_err(|_| Self::wrong_length(bytes.len()))
            }

            /// The image that lies in `bytes`, to be written in place.
            ///
            /// # Errors
            ///
            /// [`WireError::Length`] unless `bytes` has exactly the length of the image.
            #[inline]
            pub fn from_bytes_mut(bytes: &mut [u8]) -> Result<&mut Self, WireError> {
                let found = bytes.len();
                zerocopy::FromBytes::mut_from_bytes(bytes).map_err(|_| Self::wrong_length(found))
            }

            /// The bytes as they go over the bus.
            #[inline]
            #[must_use]
            pub fn as_bytes(&self) -> &[u8] {
                zerocopy::IntoBytes::as_bytes(self)
            }

            /// Every field as a plain value, for people and tools; a cyclic program reads the few
            /// fields it needs instead.
            #[inline]
            #[must_use]
            pub fn values(&self) -> $values {
                $values { $($block: super::block::Wire::load(&self.$block)),* }
            }

            /// Writes every field; reserved bits stay as they are.
            #[inline]
            pub fn set_values(&mut self, values: &$values) {
                $(super::block::Wire::store(&mut self.$block, &values.$block);)*
            }

            const fn wrong_length(found: usize) -> WireError {
                WireError::Length { image: stringify!($image), expected: $len, found }
            }
        }

        impl<$order: ImageOrder> Default for $image<$order> {
            fn default() -> Self {
                Self::zeroed()
            }
        }

        impl<$order: ImageOrder> core::fmt::Debug for $image<$order> {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                f.debug_struct(stringify!($image))
                    $(.field(stringify!($block), &self.$block))*
                    .finish()
            }
        }

        #[doc = concat!("Every field of [`", stringify!($image), "`] in the order of the image.")]
        pub const $fields: &[Field] = {
            const PLACED: &[Placed] = &[$($(Placed {
                section: $section,
                at: $section_at,
                object: $object,
                pdo: $pdo,
                table: $table,
                parts: $parts,
            }),+),*];
            &super::field::place::<{ super::field::count(PLACED) }>(PLACED)
        };

        const _: () = {
            type $order = crate::wire::order::Big;
            $(assert!(
                core::mem::offset_of!($image<$order>, $block) == $at,
                concat!(stringify!($image), ".", stringify!($block), " is misplaced")
            );)*
            assert!(size_of::<$image<$order>>() == $size);
        };
    };
}

pub(super) use {block, flags, image};
