//! Runs of bits from one buffer to another.

/// Copies `count` bits; bit 0 of a byte is its least significant. `None` if either buffer is too
/// short; what was copied until then stays.
pub(crate) fn copy_bits(
    from: &[u8],
    from_bit: usize,
    to: &mut [u8],
    to_bit: usize,
    count: usize,
) -> Option<()> {
    for step in 0..count {
        let (source, target) = (from_bit + step, to_bit + step);
        let bit = from.get(source / 8)? >> (source % 8) & 1;
        let byte = to.get_mut(target / 8)?;
        *byte = *byte & !(1 << (target % 8)) | bit << (target % 8);
    }
    Some(())
}
