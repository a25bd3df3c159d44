//! SDO information, the subdevice's end: an answer is built as a whole and sent in fragments.

use super::dictionary::{Dictionary, real_entry};
use super::sdo_server::put;
use crate::wire::ethercat::coe::AbortCode;
use crate::wire::ethercat::coe::info::{INFO_HEADER_LEN, InfoHeader, InfoOpCode, ObjectList};

/// Longest answer in bytes.
const MAX_ANSWER: usize = 512;

/// What an entry description always tells: access rights, category and mappability share one word.
const TOLD_OF_ENTRIES: u8 = 0x07;

#[derive(Debug)]
pub(super) struct InfoServer {
    op_code: InfoOpCode,
    answer: [u8; MAX_ANSWER],
    len: usize,
    sent: usize,
}

/// A request that is shorter than its operation needs.
pub(super) struct TooShort;

impl InfoServer {
    pub(super) const fn new() -> Self {
        Self { op_code: InfoOpCode::ERROR, answer: [0; MAX_ANSWER], len: 0, sent: 0 }
    }

    /// Builds the answer to a request, `data` being what follows its header.
    pub(super) fn request(
        &mut self,
        dictionary: &impl Dictionary,
        header: InfoHeader,
        data: &[u8],
    ) -> Result<(), TooShort> {
        (self.len, self.sent) = (0, 0);
        let built = match (header.op_code, data) {
            (InfoOpCode::LIST_REQUEST, [low, high, ..]) => {
                self.op_code = InfoOpCode::LIST_RESPONSE;
                self.list(dictionary, u16::from_le_bytes([*low, *high]))
            }
            (InfoOpCode::OBJECT_REQUEST, [low, high, ..]) => {
                self.op_code = InfoOpCode::OBJECT_RESPONSE;
                self.object(dictionary, u16::from_le_bytes([*low, *high]))
            }
            (InfoOpCode::ENTRY_REQUEST, [low, high, sub_index, wanted, ..]) => {
                self.op_code = InfoOpCode::ENTRY_RESPONSE;
                let index = u16::from_le_bytes([*low, *high]);
                self.entry(dictionary, index, *sub_index, *wanted)
            }
            (
                InfoOpCode::LIST_REQUEST | InfoOpCode::OBJECT_REQUEST | InfoOpCode::ENTRY_REQUEST,
                _,
            ) => return Err(TooShort),
            _ => Err(AbortCode::COMMAND),
        };
        if let Err(code) = built {
            self.op_code = InfoOpCode::ERROR;
            self.len = 0;
            // Four bytes always fit.
            let _ = self.append(&code.0.to_le_bytes());
        }
        Ok(())
    }

    fn append(&mut self, bytes: &[u8]) -> Result<(), AbortCode> {
        let room = self.answer.get_mut(self.len..).unwrap_or_default();
        if bytes.len() > room.len() {
            return Err(AbortCode::OUT_OF_MEMORY);
        }
        self.len += put(room, bytes);
        Ok(())
    }

    fn list(&mut self, dictionary: &impl Dictionary, number: u16) -> Result<(), AbortCode> {
        let list = ObjectList::from_wire(number).ok_or(AbortCode::UNSUPPORTED_ACCESS)?;
        self.append(&number.to_le_bytes())?;
        if list == ObjectList::Lengths {
            for list in ObjectList::LISTS {
                let count = members(dictionary, list).count();
                self.append(&u16::try_from(count).unwrap_or(u16::MAX).to_le_bytes())?;
            }
            return Ok(());
        }
        for index in members(dictionary, list) {
            self.append(&index.to_le_bytes())?;
        }
        Ok(())
    }

    fn object(&mut self, dictionary: &impl Dictionary, index: u16) -> Result<(), AbortCode> {
        let object = dictionary.object(index).ok_or(AbortCode::NO_OBJECT)?;
        self.append(&index.to_le_bytes())?;
        self.append(&object.data_type.0.to_le_bytes())?;
        self.append(&[object.max_sub_index, object.code.to_wire()])?;
        self.append(object.name.as_bytes())
    }

    fn entry(
        &mut self,
        dictionary: &impl Dictionary,
        index: u16,
        sub_index: u8,
        wanted: u8,
    ) -> Result<(), AbortCode> {
        dictionary.object(index).ok_or(AbortCode::NO_OBJECT)?;
        let entry = real_entry(dictionary, index, sub_index)?;
        self.append(&index.to_le_bytes())?;
        self.append(&[sub_index, wanted & TOLD_OF_ENTRIES])?;
        self.append(&entry.data_type.0.to_le_bytes())?;
        self.append(&entry.bits.to_le_bytes())?;
        self.append(&entry.access.bits().to_le_bytes())?;
        self.append(entry.name.as_bytes())
    }

    /// Writes the next fragment behind the CoE header; returns its length and whether it was the
    /// last. `room` has space for the header and two bytes at least.
    pub(super) fn write(&mut self, room: &mut [u8]) -> (usize, bool) {
        // No fragment ends inside an index.
        let most = (room.len().saturating_sub(INFO_HEADER_LEN) & !1).max(2);
        let left = self.answer.get(self.sent..self.len).unwrap_or(&[]);
        let (now, later) = left.split_at_checked(most).unwrap_or((left, &[]));
        let header = InfoHeader {
            op_code: self.op_code,
            incomplete: !later.is_empty(),
            fragments_left: u16::try_from(later.len().div_ceil(most)).unwrap_or(u16::MAX),
        };
        let (head, body) = room.split_at_mut_checked(INFO_HEADER_LEN).unwrap_or_default();
        let len = put(head, &header.to_bytes()) + put(body, now);
        let last = later.is_empty();
        self.sent += now.len();
        (len, last)
    }
}

/// The indices of the objects in `list`, ascending.
fn members(dictionary: &impl Dictionary, list: ObjectList) -> impl Iterator<Item = u16> {
    let all = core::iter::successors(dictionary.next_index(None), |index| {
        dictionary.next_index(Some(*index))
    });
    all.filter(move |index| {
        let Some(object) = dictionary.object(*index) else { return false };
        list.needs().is_empty()
            || (0..=object.max_sub_index)
                .filter_map(|sub_index| dictionary.entry(*index, sub_index))
                .any(|entry| entry.access.intersects(list.needs()))
    })
}
