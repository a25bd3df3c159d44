//! SDO transfers, the subdevice's end.
//!
//! ```text
//!            upload of more than fits          last segment
//!  Idle ──────────────────────────▶ Upload ───────────────────▶ Idle
//!  Idle ──────────────────────────▶ Download ─────────────────▶ Idle
//!            download, data follow             last segment, written
//! ```
//!
//! Any abort, from either end, leads to Idle. An initiate request ends the transfer before it.

use super::dictionary::{Dictionary, check_download, download, entry_len, upload};
use crate::wire::ethercat::al::AlState;
use crate::wire::ethercat::coe::sdo::{self, SDO_LEN, SdoAddress, SdoRequest};
use crate::wire::ethercat::coe::{AbortCode, CoeService};

/// Most that one transfer can carry, in bytes.
pub const MAX_TRANSFER: usize = 512;

/// An answer that waits for room.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SdoReply {
    DownloadDone(SdoAddress),
    DownloadSegmentDone(bool),
    UploadStart(SdoAddress),
    UploadSegment(bool),
    Abort(SdoAddress, AbortCode),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Transfer {
    Idle,
    /// The buffer holds `len` bytes, `sent` of them are gone.
    Upload {
        address: SdoAddress,
        len: usize,
        sent: usize,
        toggle: bool,
    },
    /// The buffer holds the first `received` of `size` bytes.
    Download {
        address: SdoAddress,
        size: usize,
        received: usize,
        toggle: bool,
    },
}

#[derive(Debug)]
pub(super) struct SdoServer {
    buffer: [u8; MAX_TRANSFER],
    transfer: Transfer,
}

impl SdoServer {
    pub(super) const fn new() -> Self {
        Self { buffer: [0; MAX_TRANSFER], transfer: Transfer::Idle }
    }

    pub(super) fn reset(&mut self) {
        self.transfer = Transfer::Idle;
    }

    /// Carries out `request`; nobody answers an abort.
    pub(super) fn request(
        &mut self,
        dictionary: &mut impl Dictionary,
        state: AlState,
        request: SdoRequest<'_>,
    ) -> Option<SdoReply> {
        let before = core::mem::replace(&mut self.transfer, Transfer::Idle);
        let (address, outcome) = match request {
            SdoRequest::Abort { .. } => return None,
            SdoRequest::Unknown { address } => (address, Err(AbortCode::COMMAND)),
            SdoRequest::Upload { address } => {
                (address, self.start_upload(dictionary, state, address))
            }
            SdoRequest::DownloadExpedited { address, data } => {
                let mut bytes = data.bytes();
                if let (false, Some(len)) = (data.sized, entry_len(dictionary, address)) {
                    bytes = bytes.get(..len).unwrap_or(bytes);
                }
                let done = download(dictionary, state, address, bytes);
                (address, done.map(|()| SdoReply::DownloadDone(address)))
            }
            SdoRequest::DownloadNormal { address, size, data } => {
                (address, self.start_download(dictionary, state, address, size, data))
            }
            SdoRequest::UploadSegment { toggle } => match before {
                Transfer::Upload { address, toggle: expected, .. } => {
                    self.transfer = before;
                    let right = toggle == expected;
                    let reply = SdoReply::UploadSegment(toggle);
                    (address, right.then_some(reply).ok_or(AbortCode::TOGGLE))
                }
                Transfer::Download { address, .. } => (address, Err(AbortCode::COMMAND)),
                Transfer::Idle => (SdoAddress::default(), Err(AbortCode::COMMAND)),
            },
            SdoRequest::DownloadSegment { toggle, last, data } => match before {
                Transfer::Download { address, toggle: expected, .. } if toggle != expected => {
                    (address, Err(AbortCode::TOGGLE))
                }
                Transfer::Download { address, size, received, .. } => {
                    let place = Place { address, size, received };
                    (address, self.take_segment(dictionary, state, place, toggle, last, data))
                }
                Transfer::Upload { address, .. } => (address, Err(AbortCode::COMMAND)),
                Transfer::Idle => (SdoAddress::default(), Err(AbortCode::COMMAND)),
            },
        };
        Some(outcome.unwrap_or_else(|code| {
            self.transfer = Transfer::Idle;
            SdoReply::Abort(SdoAddress { complete: false, ..address }, code)
        }))
    }

    fn start_upload(
        &mut self,
        dictionary: &impl Dictionary,
        state: AlState,
        address: SdoAddress,
    ) -> Result<SdoReply, AbortCode> {
        let len = upload(dictionary, state, address, &mut self.buffer)?;
        self.transfer = Transfer::Upload { address, len, sent: 0, toggle: false };
        Ok(SdoReply::UploadStart(address))
    }

    fn start_download(
        &mut self,
        dictionary: &mut impl Dictionary,
        state: AlState,
        address: SdoAddress,
        size: u32,
        data: &[u8],
    ) -> Result<SdoReply, AbortCode> {
        check_download(dictionary, state, address)?;
        let size = usize::try_from(size).unwrap_or(usize::MAX);
        if size > self.buffer.len() {
            return Err(AbortCode::OUT_OF_MEMORY);
        }
        if data.len() > size {
            return Err(AbortCode::TOO_LONG);
        }
        if data.len() == size {
            download(dictionary, state, address, data)?;
        } else {
            self.store(0, data);
            self.transfer =
                Transfer::Download { address, size, received: data.len(), toggle: false };
        }
        Ok(SdoReply::DownloadDone(address))
    }

    fn take_segment(
        &mut self,
        dictionary: &mut impl Dictionary,
        state: AlState,
        place: Place,
        toggle: bool,
        last: bool,
        data: &[u8],
    ) -> Result<SdoReply, AbortCode> {
        let Place { address, size, received } = place;
        let now = received + data.len();
        if now > size {
            return Err(AbortCode::TOO_LONG);
        }
        self.store(received, data);
        if !last {
            let toggle = !toggle;
            self.transfer = Transfer::Download { address, size, received: now, toggle };
        } else if now < size {
            return Err(AbortCode::LENGTH_MISMATCH);
        } else {
            let value = self.buffer.get(..size).unwrap_or(&[]);
            download(dictionary, state, address, value)?;
        }
        Ok(SdoReply::DownloadSegmentDone(toggle))
    }

    /// Puts `data` at `at`; what would not fit was refused before.
    fn store(&mut self, at: usize, data: &[u8]) {
        for (to, from) in self.buffer.iter_mut().skip(at).zip(data) {
            *to = *from;
        }
    }

    /// Writes `reply` behind the CoE header; returns the service and the length. `room` is at
    /// least [`SDO_LEN`] long.
    pub(super) fn write(&mut self, reply: SdoReply, room: &mut [u8]) -> (CoeService, usize) {
        let response = CoeService::SDO_RESPONSE;
        match reply {
            SdoReply::DownloadDone(address) => (response, put(room, &sdo::download_done(address))),
            SdoReply::DownloadSegmentDone(toggle) => {
                (response, put(room, &sdo::download_segment_done(toggle)))
            }
            SdoReply::UploadStart(address) => (response, self.write_upload_start(address, room)),
            SdoReply::UploadSegment(toggle) => (response, self.write_upload_segment(toggle, room)),
            SdoReply::Abort(address, code) => {
                (CoeService::SDO_REQUEST, put(room, &sdo::abort(address, code)))
            }
        }
    }

    fn write_upload_start(&mut self, address: SdoAddress, room: &mut [u8]) -> usize {
        let Transfer::Upload { len, .. } = self.transfer else { return 0 };
        let value = self.buffer.get(..len).unwrap_or(&[]);
        if let Some(answer) = sdo::upload_expedited(address, value) {
            self.transfer = Transfer::Idle;
            return put(room, &answer);
        }
        let size = u32::try_from(len).unwrap_or(u32::MAX);
        let head = put(room, &sdo::upload_normal(address, size));
        let sent = room.get_mut(head..).map_or(0, |room| put(room, value));
        self.transfer = if sent == len {
            Transfer::Idle
        } else {
            Transfer::Upload { address, len, sent, toggle: false }
        };
        head + sent
    }

    fn write_upload_segment(&mut self, toggle: bool, room: &mut [u8]) -> usize {
        let Transfer::Upload { address, len, sent, .. } = self.transfer else { return 0 };
        let left = self.buffer.get(sent..len).unwrap_or(&[]);
        let Some((command, room)) = room.split_first_mut() else { return 0 };
        let now = put(room, left);
        let last = sent + now == len;
        let (first_byte, padding) = sdo::upload_segment(toggle, last, now);
        *command = first_byte;
        room.iter_mut().skip(now).take(padding).for_each(|byte| *byte = 0);
        self.transfer = if last {
            Transfer::Idle
        } else {
            Transfer::Upload { address, len, sent: sent + now, toggle: !toggle }
        };
        (1 + now + padding).max(SDO_LEN)
    }
}

/// Where a download stands.
struct Place {
    address: SdoAddress,
    size: usize,
    received: usize,
}

/// Copies as much of `bytes` as fits; returns how much that was.
pub(super) fn put(room: &mut [u8], bytes: &[u8]) -> usize {
    for (to, from) in room.iter_mut().zip(bytes) {
        *to = *from;
    }
    room.len().min(bytes.len())
}
