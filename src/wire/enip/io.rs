//! Class 1 frames: what travels over UDP 2222 once a connection is open.
//!
//! Source: CIP volume 2, chapter 2; CIP volume 1, chapter 3.

use super::bytes::{Reader, Writer};
use super::cpf::{self, ItemType, items};
use super::error::{DecodeError, NoRoom};

/// Bytes around the image: items, ids, both sequence numbers; the run/idle header adds four.
pub const OVERHEAD: usize = 20;
/// The bit of the run/idle header that says run.
const RUN: u32 = 1;

/// One frame: 20 bytes and the data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IoFrame<'a> {
    /// Id of the connection in this direction: O->T chosen by the target, T->O by the originator.
    pub connection_id: u32,
    /// Counts every frame of the connection.
    pub sequence: u32,
    /// Counts new data.
    pub data_sequence: u16,
    /// What follows the sequence count: the image, O->T behind its run/idle header.
    pub data: &'a [u8],
}

impl<'a> IoFrame<'a> {
    /// Reads a frame.
    ///
    /// # Errors
    ///
    /// The datagram does not begin with a sequenced address and connected data with a sequence count, or its
    /// items are malformed. Further items are passed over.
    pub fn read(datagram: &'a [u8]) -> Result<Self, DecodeError> {
        const MESSAGE: &str = "class 1 frame";
        let mut items = items(datagram)?;
        let missing = |field| DecodeError::Truncated { message: MESSAGE, field };
        let address = items.next().ok_or(missing("address item"))?;
        let mut reader = Reader::new(MESSAGE, address.data);
        if address.kind != ItemType::SEQUENCED_ADDRESS {
            return Err(reader.wrong(
                "address item type",
                address.kind.0,
                "32770 (sequenced address)",
            ));
        }
        let connection_id = reader.u32("connection id")?;
        let sequence = reader.u32("sequence number")?;
        reader.end()?;
        let data = items.next().ok_or(missing("data item"))?;
        let mut reader = Reader::new(MESSAGE, data.data);
        if data.kind != ItemType::CONNECTED_DATA {
            return Err(reader.wrong("data item type", data.kind.0, "177 (connected data)"));
        }
        let data_sequence = reader.u16("sequence count")?;
        Ok(Self { connection_id, sequence, data_sequence, data: reader.rest() })
    }

    /// Takes the run/idle header off the data: whether it says run, and what follows it.
    ///
    /// # Errors
    ///
    /// The data are shorter than the header.
    pub fn split_run_idle(&self) -> Result<(bool, &'a [u8]), DecodeError> {
        let mut reader = Reader::new("class 1 frame", self.data);
        let header = reader.u32("run/idle header")?;
        Ok((header & RUN != 0, reader.rest()))
    }

    /// Writes the frame into `room` and returns its length; with `run` a run/idle header goes in front of
    /// the data.
    ///
    /// # Errors
    ///
    /// [`NoRoom`] if it does not fit.
    pub fn write(&self, run: Option<bool>, room: &mut [u8]) -> Result<usize, NoRoom> {
        let mut writer = Writer::new(room);
        writer.u16(2);
        let item = cpf::begin_item(&mut writer, ItemType::SEQUENCED_ADDRESS);
        writer.u32(self.connection_id);
        writer.u32(self.sequence);
        cpf::end_item(&mut writer, item);
        let item = cpf::begin_item(&mut writer, ItemType::CONNECTED_DATA);
        writer.u16(self.data_sequence);
        if let Some(run) = run {
            writer.u32(u32::from(run) * RUN);
        }
        writer.put(self.data);
        cpf::end_item(&mut writer, item);
        writer.finish()
    }
}

/// Whether a frame numbered `new` comes after the one numbered `last`, across the wrap.
#[must_use]
pub const fn is_later(new: u32, last: u32) -> bool {
    let ahead = new.wrapping_sub(last);
    ahead != 0 && ahead < 1 << 31
}

/// Whether data numbered `new` come after those numbered `last`, across the wrap.
#[must_use]
pub const fn is_newer(new: u16, last: u16) -> bool {
    let ahead = new.wrapping_sub(last);
    ahead != 0 && ahead < 1 << 15
}
