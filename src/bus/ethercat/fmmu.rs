//! FMMUs: what a logical address means in the memory of this ESC.
//!
//! An FMMU maps a run of bits of the logical address space to a run of bits of the physical one.
//! Everything is counted in bits here; where all ends lie on bytes, the caller copies bytes.
//!
//! Source: ETG.1000 part 4.

/// One FMMU, decoded from its 16 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Fmmu {
    /// First logical bit.
    logical: u64,
    /// First physical bit.
    physical: u32,
    /// Number of bits; 0 while it is off.
    bits: u64,
    /// Reads are mapped.
    pub(super) read: bool,
    /// Writes are mapped.
    pub(super) write: bool,
}

/// Where a logical access and an FMMU meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Overlap {
    /// First bit of the datagram's data.
    pub(super) data_bit: usize,
    /// First bit of the physical memory.
    pub(super) physical_bit: usize,
    /// Number of bits.
    pub(super) bits: usize,
}

impl Overlap {
    /// The same in bytes, if all ends lie on bytes: data offset, address, length.
    pub(super) const fn in_bytes(self) -> Option<(usize, u16, usize)> {
        if (self.data_bit | self.physical_bit | self.bits).is_multiple_of(8) {
            Some((self.data_bit / 8, self.first_address(), self.bits / 8))
        } else {
            None
        }
    }

    /// Address of the byte that holds the first physical bit.
    pub(super) const fn first_address(self) -> u16 {
        // The physical start is 16 bits, and no access is longer than 2,047 bytes; beyond the end
        // there is no memory and the access fails there.
        let address = self.physical_bit / 8;
        if address > 0xFFFF { 0xFFFF } else { address as u16 }
    }

    /// Number of bytes that hold the physical bits.
    pub(super) const fn physical_len(self) -> usize {
        (self.physical_bit % 8 + self.bits).div_ceil(8)
    }
}

impl Fmmu {
    /// Decodes the 16 bytes of an FMMU's registers.
    pub(super) fn from_wire(bytes: [u8; 16]) -> Self {
        let [l0, l1, l2, l3, n0, n1, start, end, p0, p1, bit, kind, active, ..] = bytes;
        let length = u64::from(u16::from_le_bytes([n0, n1]));
        let (start, end) = (u64::from(start & 7), u64::from(end & 7));
        let on = active & 1 != 0 && length > 0;
        // The length counts bytes touched: the first from its start bit, the last to its end bit.
        let bits = if on { ((length - 1) * 8 + end + 1).saturating_sub(start) } else { 0 };
        Self {
            logical: u64::from(u32::from_le_bytes([l0, l1, l2, l3])) * 8 + start,
            physical: u32::from(u16::from_le_bytes([p0, p1])) * 8 + u32::from(bit & 7),
            bits,
            read: kind & 1 != 0,
            write: kind & 2 != 0,
        }
    }

    /// Where an access of `length` bytes from logical `address` on meets this FMMU.
    pub(super) fn overlap(&self, address: u32, length: usize) -> Option<Overlap> {
        let first = u64::from(address) * 8;
        let start = first.max(self.logical);
        let end = (first + length as u64 * 8).min(self.logical + self.bits);
        let bits = end.checked_sub(start).filter(|bits| *bits > 0)?;
        Some(Overlap {
            data_bit: usize::try_from(start - first).ok()?,
            physical_bit: usize::try_from(u64::from(self.physical) + start - self.logical).ok()?,
            bits: usize::try_from(bits).ok()?,
        })
    }
}

/// Copies `bits` bits from bit `from` of `source` to bit `to` of `target`; its other bits stay.
pub(super) fn copy_bits(target: &mut [u8], to: usize, source: &[u8], from: usize, bits: usize) {
    for bit in 0..bits {
        let (at, into) = (from + bit, to + bit);
        let (Some(byte), Some(place)) = (source.get(at / 8), target.get_mut(into / 8)) else {
            return;
        };
        let mask = 1 << (into % 8);
        if byte >> (at % 8) & 1 != 0 {
            *place |= mask;
        } else {
            *place &= !mask;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fmmu(length: u8, start: u8, end: u8, physical_bit: u8) -> Fmmu {
        Fmmu::from_wire([
            0x10,
            0,
            0,
            0,
            length,
            0,
            start,
            end,
            0x00,
            0x11,
            physical_bit,
            3,
            1,
            0,
            0,
            0,
        ])
    }

    #[test]
    fn a_run_inside_one_byte() {
        let overlap = fmmu(1, 2, 4, 6).overlap(0x10, 1).unwrap();
        assert_eq!(overlap, Overlap { data_bit: 2, physical_bit: 0x1100 * 8 + 6, bits: 3 });
        assert_eq!(overlap.in_bytes(), None);
        assert_eq!((overlap.first_address(), overlap.physical_len()), (0x1100, 2));
    }

    #[test]
    fn whole_bytes_are_seen_as_such() {
        let overlap = fmmu(4, 0, 7, 0).overlap(0x0E, 4).unwrap();
        assert_eq!(overlap.in_bytes(), Some((2, 0x1100, 2)));
        let overlap = fmmu(4, 0, 7, 0).overlap(0x11, 9).unwrap();
        assert_eq!(overlap.in_bytes(), Some((0, 0x1101, 3)));
    }

    #[test]
    fn no_touch_no_overlap() {
        assert_eq!(fmmu(4, 0, 7, 0).overlap(0x14, 4), None);
        assert_eq!(fmmu(4, 0, 7, 0).overlap(0x0C, 4), None);
        assert_eq!(fmmu(0, 0, 7, 0).overlap(0x10, 4), None);
        assert_eq!(fmmu(1, 5, 3, 0).overlap(0x10, 4), None);
        assert_eq!(Fmmu::default().overlap(0, 100), None);
    }

    #[test]
    fn bits_move_and_neighbours_stay() {
        let mut target = [0xFF, 0x00];
        copy_bits(&mut target, 6, &[0b0001_0100], 2, 3);
        assert_eq!(target, [0b0111_1111, 0b0000_0001]);
    }
}
