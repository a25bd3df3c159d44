//! What a device must tell about its objects, and how they are read and written as a whole.

use super::bits::copy_bits;
use crate::wire::ethercat::al::AlState;
use crate::wire::ethercat::coe::AbortCode;
use crate::wire::ethercat::coe::info::{DataType, ObjectAccess, ObjectCode};
use crate::wire::ethercat::coe::sdo::SdoAddress;

/// An object of the dictionary.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Object {
    /// Variable, array or record.
    pub code: ObjectCode,
    /// Type of the object: of a variable and of an array's entries; of a record, the record's.
    pub data_type: DataType,
    /// Highest sub-index the object can have; 0 for a variable.
    pub max_sub_index: u8,
    /// Name for people.
    pub name: &'static str,
}

/// An entry of an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Its type.
    pub data_type: DataType,
    /// Its length in bits.
    pub bits: u16,
    /// What may be done with it, and when.
    pub access: ObjectAccess,
    /// Name for people.
    pub name: &'static str,
}

impl Entry {
    /// Bits without a meaning: they take room in complete access, and are no entry otherwise.
    #[must_use]
    pub const fn padding(bits: u16) -> Self {
        Self { data_type: DataType::NONE, bits, access: ObjectAccess::empty(), name: "" }
    }

    /// Whether this is only room.
    #[must_use]
    pub const fn is_padding(&self) -> bool {
        self.access.is_empty()
    }

    /// Its length in bytes when it travels alone.
    #[must_use]
    pub const fn byte_len(&self) -> usize {
        self.bits.div_ceil(8) as usize
    }
}

/// The objects of a device.
pub trait Dictionary {
    /// The lowest index above `after`; without it, the lowest of all.
    fn next_index(&self, after: Option<u16>) -> Option<u16>;

    /// The object at `index`.
    fn object(&self, index: u16) -> Option<Object>;

    /// The entry at `sub_index`; [padding](Entry::padding) for a number left out whose bits take
    /// room in complete access.
    fn entry(&self, index: u16, sub_index: u8) -> Option<Entry>;

    /// Writes the value of an entry that may be read, and returns its length in bytes.
    ///
    /// # Errors
    ///
    /// Why it cannot be read after all; [`AbortCode::OUT_OF_MEMORY`] if `value` is too short.
    fn read(&self, index: u16, sub_index: u8, value: &mut [u8]) -> Result<usize, AbortCode>;

    /// Takes the value of an entry that may be written, as long as the entry.
    ///
    /// # Errors
    ///
    /// Why it is refused; nothing has changed.
    fn write(&mut self, index: u16, sub_index: u8, value: &[u8]) -> Result<(), AbortCode>;

    /// Takes the values of all entries from `first` (0 or 1) on. Sub-index 0 comes with a byte of
    /// padding behind it.
    ///
    /// # Errors
    ///
    /// Why they are refused; nothing has changed. An object that is not written as a whole answers
    /// [`AbortCode::UNSUPPORTED_ACCESS`].
    fn write_complete(&mut self, index: u16, first: u8, values: &[u8]) -> Result<(), AbortCode> {
        let _ = (index, first, values);
        Err(AbortCode::UNSUPPORTED_ACCESS)
    }
}

/// Reads what `address` names into `value` and returns the length in bytes.
pub(super) fn upload(
    dictionary: &impl Dictionary,
    state: AlState,
    address: SdoAddress,
    value: &mut [u8],
) -> Result<usize, AbortCode> {
    let object = dictionary.object(address.index).ok_or(AbortCode::NO_OBJECT)?;
    if address.complete {
        return upload_complete(dictionary, state, address, object, value);
    }
    readable_entry(dictionary, state, address.index, address.sub_index)?;
    dictionary.read(address.index, address.sub_index, value)
}

/// All entries from sub-index 0 or 1 up to what sub-index 0 says, packed: sub-index 0 takes 16
/// bits, entries of 16 bits or more begin on a multiple of 16, the rest follow bit by bit.
fn upload_complete(
    dictionary: &impl Dictionary,
    state: AlState,
    address: SdoAddress,
    object: Object,
    value: &mut [u8],
) -> Result<usize, AbortCode> {
    if object.code == ObjectCode::Variable || address.sub_index > 1 {
        return Err(AbortCode::UNSUPPORTED_ACCESS);
    }
    let mut highest = [0];
    readable_entry(dictionary, state, address.index, 0)?;
    dictionary.read(address.index, 0, &mut highest)?;
    let mut bit = 0;
    if address.sub_index == 0 {
        value.iter_mut().take(2).zip([highest, [0]].as_flattened()).for_each(|(to, from)| {
            *to = *from;
        });
        bit = 16;
    }
    for sub_index in 1..=u8::from_le_bytes(highest) {
        let Some(entry) = dictionary.entry(address.index, sub_index) else { continue };
        let bits = usize::from(entry.bits);
        if bits >= 16 {
            bit = usize::next_multiple_of(bit, 16);
        }
        let mut single = [0; 8];
        if !entry.is_padding() {
            readable_entry(dictionary, state, address.index, sub_index)?;
            dictionary.read(address.index, sub_index, &mut single)?;
        }
        copy_bits(&single, 0, value, bit, bits).ok_or(AbortCode::OUT_OF_MEMORY)?;
        bit += bits;
    }
    let len = bit.div_ceil(8);
    let used_bits = bit;
    copy_bits(&[0], 0, value, used_bits, len * 8 - used_bits).ok_or(AbortCode::OUT_OF_MEMORY)?;
    Ok(len)
}

/// Whether what `address` names may be written now, before any data have come.
pub(super) fn check_download(
    dictionary: &impl Dictionary,
    state: AlState,
    address: SdoAddress,
) -> Result<(), AbortCode> {
    let object = dictionary.object(address.index).ok_or(AbortCode::NO_OBJECT)?;
    if !address.complete {
        return writable_entry(dictionary, state, address.index, address.sub_index).map(drop);
    }
    if object.code == ObjectCode::Variable || address.sub_index > 1 {
        return Err(AbortCode::UNSUPPORTED_ACCESS);
    }
    writable_entry(dictionary, state, address.index, 1).map(drop)
}

/// Writes `value` to what `address` names.
pub(super) fn download(
    dictionary: &mut impl Dictionary,
    state: AlState,
    address: SdoAddress,
    value: &[u8],
) -> Result<(), AbortCode> {
    check_download(dictionary, state, address)?;
    if address.complete {
        return dictionary.write_complete(address.index, address.sub_index, value);
    }
    let entry = writable_entry(dictionary, state, address.index, address.sub_index)?;
    match value.len().cmp(&entry.byte_len()) {
        core::cmp::Ordering::Greater => Err(AbortCode::TOO_LONG),
        core::cmp::Ordering::Less => Err(AbortCode::TOO_SHORT),
        core::cmp::Ordering::Equal => dictionary.write(address.index, address.sub_index, value),
    }
}

/// Length in bytes of the entry at `address`; `None` if there is none or all are meant.
pub(super) fn entry_len(dictionary: &impl Dictionary, address: SdoAddress) -> Option<usize> {
    let entry = dictionary.entry(address.index, address.sub_index)?;
    (!address.complete).then(|| entry.byte_len())
}

/// The entry, if it is one.
pub(super) fn real_entry(
    dictionary: &impl Dictionary,
    index: u16,
    sub_index: u8,
) -> Result<Entry, AbortCode> {
    dictionary
        .entry(index, sub_index)
        .filter(|entry| !entry.is_padding())
        .ok_or(AbortCode::NO_SUB_INDEX)
}

fn readable_entry(
    dictionary: &impl Dictionary,
    state: AlState,
    index: u16,
    sub_index: u8,
) -> Result<(), AbortCode> {
    let entry = real_entry(dictionary, index, sub_index)?;
    let (read, _) = rights_in(state);
    if !entry.access.intersects(ObjectAccess::READ) {
        Err(AbortCode::WRITE_ONLY)
    } else if !entry.access.intersects(read) {
        Err(AbortCode::NOT_IN_THIS_STATE)
    } else {
        Ok(())
    }
}

fn writable_entry(
    dictionary: &impl Dictionary,
    state: AlState,
    index: u16,
    sub_index: u8,
) -> Result<Entry, AbortCode> {
    let entry = real_entry(dictionary, index, sub_index)?;
    let (_, write) = rights_in(state);
    if entry.access.intersects(write) {
        Ok(entry)
    } else if entry.access.intersects(ObjectAccess::WRITE) {
        Err(AbortCode::NOT_IN_THIS_STATE)
    } else if entry.access.intersects(ObjectAccess::RX_PDO) {
        Err(AbortCode::MAPPED_OUTPUT)
    } else {
        Err(AbortCode::READ_ONLY)
    }
}

/// The rights to read and to write that count in `state`.
const fn rights_in(state: AlState) -> (ObjectAccess, ObjectAccess) {
    match state {
        AlState::PreOp => (ObjectAccess::READ_PRE_OP, ObjectAccess::WRITE_PRE_OP),
        AlState::SafeOp => (ObjectAccess::READ_SAFE_OP, ObjectAccess::WRITE_SAFE_OP),
        AlState::Op => (ObjectAccess::READ_OP, ObjectAccess::WRITE_OP),
        AlState::Init | AlState::Bootstrap => (ObjectAccess::empty(), ObjectAccess::empty()),
    }
}
