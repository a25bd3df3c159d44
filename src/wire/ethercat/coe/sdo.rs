//! SDO transfers: the requests of a main device, and the heads of a subdevice's answers.
//!
//! A transfer begins with an initiate request that names index and sub-index. Up to four bytes
//! travel in it (expedited); more travel behind an 8-byte head that tells the whole size (normal);
//! what does not fit into the mailbox follows in segments whose toggle bit alternates from 0.
//!
//! Invariant: no request is shorter than 8 bytes behind the CoE header; segments of fewer than 7
//! bytes are padded and say how many bytes do not count.

use super::AbortCode;

/// Length of an initiate request or answer behind the CoE header, without data, in bytes. Also the
/// length of the shortest segment.
pub const SDO_LEN: usize = 8;
/// First byte of an abort, from either side.
pub const COMMAND_ABORT: u8 = 0x80;

/// Shortest segment data in bytes: what is less is padded.
const SHORTEST_SEGMENT: usize = 7;

const TOGGLE: u8 = 0x10;
const COMPLETE: u8 = 0x10;

/// Which entry of the dictionary a transfer is about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct SdoAddress {
    /// Index of the object.
    pub index: u16,
    /// Sub-index; the first of all when `complete`.
    pub sub_index: u8,
    /// Complete access: the entries from `sub_index` on at once.
    pub complete: bool,
}

impl SdoAddress {
    /// One entry.
    #[must_use]
    pub const fn entry(index: u16, sub_index: u8) -> Self {
        Self { index, sub_index, complete: false }
    }

    /// All entries from `sub_index` on, 0 or 1.
    #[must_use]
    pub const fn complete(index: u16, sub_index: u8) -> Self {
        Self { index, sub_index, complete: true }
    }

    const fn bit(&self) -> u8 {
        if self.complete { COMPLETE } else { 0 }
    }

    /// Eight bytes: `command` with the bit of complete access, the address, `tail`.
    const fn head(&self, command: u8, tail: [u8; 4]) -> [u8; SDO_LEN] {
        let [low, high] = self.index.to_le_bytes();
        let [a, b, c, d] = tail;
        [command, low, high, self.sub_index, a, b, c, d]
    }
}

/// Up to four bytes of an expedited transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Expedited {
    bytes: [u8; 4],
    len: u8,
    /// Whether the sender said how many of them count.
    pub sized: bool,
}

impl Expedited {
    /// The bytes that count; all four if the sender did not say.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.len)).unwrap_or(&self.bytes)
    }
}

/// A request of a main device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SdoRequest<'a> {
    /// Write up to four bytes.
    DownloadExpedited {
        /// Where to.
        address: SdoAddress,
        /// What.
        data: Expedited,
    },
    /// Write `size` bytes; what is not in `data` follows in segments.
    DownloadNormal {
        /// Where to.
        address: SdoAddress,
        /// Length of the whole in bytes.
        size: u32,
        /// The first bytes.
        data: &'a [u8],
    },
    /// The next bytes of a normal download.
    DownloadSegment {
        /// Alternates from segment to segment, first `false`.
        toggle: bool,
        /// Nothing follows.
        last: bool,
        /// The bytes.
        data: &'a [u8],
    },
    /// Read.
    Upload {
        /// What.
        address: SdoAddress,
    },
    /// Read on.
    UploadSegment {
        /// Alternates from segment to segment, first `false`.
        toggle: bool,
    },
    /// Give up the transfer.
    Abort {
        /// The transfer's entry.
        address: SdoAddress,
        /// Why.
        code: AbortCode,
    },
    /// A command that does not exist.
    Unknown {
        /// What stands where the address would be.
        address: SdoAddress,
    },
}

impl<'a> SdoRequest<'a> {
    /// Reads what stands behind the CoE header; `None` if it is shorter than [`SDO_LEN`].
    #[must_use]
    pub fn read(data: &'a [u8]) -> Option<Self> {
        let (&[command, low, high, sub_index, a, b, c, d], rest) = data.split_first_chunk()?;
        let complete = command & COMPLETE != 0;
        let address = SdoAddress { index: u16::from_le_bytes([low, high]), sub_index, complete };
        let tail = [a, b, c, d];
        let toggle = command & TOGGLE != 0;
        Some(match command >> 5 {
            0 => Self::DownloadSegment {
                toggle,
                last: command & 1 != 0,
                data: segment_data(command, data)?,
            },
            1 if command & 2 != 0 => {
                let sized = command & 1 != 0;
                let len = if sized { 4 - (command >> 2 & 3) } else { 4 };
                Self::DownloadExpedited { address, data: Expedited { bytes: tail, len, sized } }
            }
            1 => Self::DownloadNormal { address, size: u32::from_le_bytes(tail), data: rest },
            2 => Self::Upload { address },
            3 => Self::UploadSegment { toggle },
            4 => Self::Abort {
                address: SdoAddress { complete: false, ..address },
                code: AbortCode(u32::from_le_bytes(tail)),
            },
            _ => Self::Unknown { address: SdoAddress { complete: false, ..address } },
        })
    }
}

/// The bytes of a segment that count.
fn segment_data(command: u8, segment: &[u8]) -> Option<&[u8]> {
    let (_, data) = segment.split_first()?;
    if data.len() > SHORTEST_SEGMENT {
        return Some(data);
    }
    data.get(..SHORTEST_SEGMENT - usize::from(command >> 1 & 7))
}

/// The answer to a download, expedited or normal.
#[must_use]
pub const fn download_done(address: SdoAddress) -> [u8; SDO_LEN] {
    address.head(0x60 | address.bit(), [0; 4])
}

/// The answer to a segment of a download.
#[must_use]
pub const fn download_segment_done(toggle: bool) -> [u8; SDO_LEN] {
    [0x20 | if toggle { TOGGLE } else { 0 }, 0, 0, 0, 0, 0, 0, 0]
}

/// The answer to an upload of one to four bytes; `None` for any other length.
#[must_use]
pub fn upload_expedited(address: SdoAddress, data: &[u8]) -> Option<[u8; SDO_LEN]> {
    let unused = u8::try_from(4_usize.checked_sub(data.len())?).ok().filter(|n| *n < 4)?;
    let mut tail = [0; 4];
    for (to, from) in tail.iter_mut().zip(data) {
        *to = *from;
    }
    Some(address.head(0x43 | unused << 2 | address.bit(), tail))
}

/// The head of the answer to an upload of `size` bytes; the first of them follow.
#[must_use]
pub const fn upload_normal(address: SdoAddress, size: u32) -> [u8; SDO_LEN] {
    address.head(0x41 | address.bit(), size.to_le_bytes())
}

/// The first byte of a segment of an upload with `len` bytes, and how many bytes of padding follow
/// them.
#[must_use]
pub fn upload_segment(toggle: bool, last: bool, len: usize) -> (u8, usize) {
    let padding = SHORTEST_SEGMENT.saturating_sub(len);
    let unused = u8::try_from(padding).unwrap_or(0);
    (if toggle { TOGGLE } else { 0 } | unused << 1 | u8::from(last), padding)
}

/// Gives up a transfer; travels as [`SDO_REQUEST`](super::CoeService::SDO_REQUEST), whoever sends it.
#[must_use]
pub const fn abort(address: SdoAddress, code: AbortCode) -> [u8; SDO_LEN] {
    address.head(COMMAND_ABORT, code.0.to_le_bytes())
}
