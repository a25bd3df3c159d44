//! Requests and responses of the message router.
//!
//! Source: CIP volume 1, chapter 2.

use super::bytes::{Reader, Writer};
use super::error::{DecodeError, NoRoom};
use super::status::{ExtendedStatus, GeneralStatus};

/// Set in the service of a response.
const RESPONSE: u8 = 0x80;

/// What is asked of an object: 0x00 to 0x7F; bit 7 tells a response from a request and stands apart from it.
///
/// Source: CIP volume 1, appendix A for the common services, chapter 3 for those of the connection manager.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Service(pub u8);

impl Service {
    /// All attributes at once.
    pub const GET_ATTRIBUTES_ALL: Self = Self(0x01);
    /// Some attributes.
    pub const GET_ATTRIBUTE_LIST: Self = Self(0x03);
    /// Starts the device again.
    pub const RESET: Self = Self(0x05);
    /// One attribute.
    pub const GET_ATTRIBUTE_SINGLE: Self = Self(0x0E);
    /// Changes one attribute.
    pub const SET_ATTRIBUTE_SINGLE: Self = Self(0x10);
    /// Closes a connection (connection manager).
    pub const FORWARD_CLOSE: Self = Self(0x4E);
    /// A message to be routed on (connection manager).
    pub const UNCONNECTED_SEND: Self = Self(0x52);
    /// Opens a connection (connection manager).
    pub const FORWARD_OPEN: Self = Self(0x54);
    /// Opens a connection whose sizes need 16 bits (connection manager).
    pub const LARGE_FORWARD_OPEN: Self = Self(0x5B);
}

/// A request: service, path, data, at least 2 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Request<'a> {
    /// What is asked.
    pub service: Service,
    /// Of which object, as an encoded path: see [`super::path`].
    pub path: &'a [u8],
    /// With which data.
    pub data: &'a [u8],
}

impl<'a> Request<'a> {
    /// Reads a request.
    ///
    /// # Errors
    ///
    /// It is cut off in its path, or a response.
    pub fn read(message: &'a [u8]) -> Result<Self, DecodeError> {
        let mut reader = Reader::new("CIP request", message);
        let service = reader.u8("service")?;
        if service & RESPONSE != 0 {
            return Err(reader.wrong("service", service, "below 0x80 in a request"));
        }
        let words = reader.u8("path size")?;
        let path = reader.take("path", 2 * usize::from(words))?;
        Ok(Self { service: Service(service), path, data: reader.rest() })
    }

    /// Writes the request into `room` and returns its length. A path of an odd number of bytes, which no
    /// encoded path has, is filled up with a zero.
    ///
    /// # Errors
    ///
    /// [`NoRoom`] if it does not fit, or if the path is longer than 255 words.
    pub fn write(&self, room: &mut [u8]) -> Result<usize, NoRoom> {
        let mut writer = Writer::new(room);
        writer.u8(self.service.0 & !RESPONSE);
        writer.put_words(self.path, &[]);
        writer.put(self.data);
        writer.finish()
    }
}

/// A response: at least 4 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Response<'a> {
    /// The service that was asked.
    pub service: Service,
    /// What came of it.
    pub status: GeneralStatus,
    /// Words of additional status, little-endian; 255 at most, usually none or one.
    pub additional: &'a [u8],
    /// With which data.
    pub data: &'a [u8],
}

impl<'a> Response<'a> {
    /// A success with `data`.
    #[must_use]
    pub const fn success(service: Service, data: &'a [u8]) -> Self {
        Self { service, status: GeneralStatus::SUCCESS, additional: &[], data }
    }

    /// A refusal without additional status.
    #[must_use]
    pub const fn refusal(service: Service, status: GeneralStatus) -> Self {
        Self { service, status, additional: &[], data: &[] }
    }

    /// Reads a response.
    ///
    /// # Errors
    ///
    /// It is cut off, or a request.
    pub fn read(message: &'a [u8]) -> Result<Self, DecodeError> {
        let mut reader = Reader::new("CIP response", message);
        let service = reader.u8("service")?;
        if service & RESPONSE == 0 {
            return Err(reader.wrong("service", service, "0x80 or above in a response"));
        }
        reader.u8("reserved byte")?;
        let status = GeneralStatus(reader.u8("general status")?);
        let words = reader.u8("size of additional status")?;
        let additional = reader.take("additional status", 2 * usize::from(words))?;
        Ok(Self { service: Service(service & !RESPONSE), status, additional, data: reader.rest() })
    }

    /// Writes the response into `room` and returns its length. Of an odd number of additional bytes the
    /// last is left out.
    ///
    /// # Errors
    ///
    /// [`NoRoom`] if it does not fit.
    pub fn write(&self, room: &mut [u8]) -> Result<usize, NoRoom> {
        let room_len = room.len();
        let mut writer = Writer::new(room);
        let words =
            u8::try_from(self.additional.len() / 2).map_err(|_| NoRoom { room: room_len })?;
        writer.u8(self.service.0 | RESPONSE);
        writer.u8(0);
        writer.u8(self.status.0);
        writer.u8(words);
        writer.put(self.additional.get(..2 * usize::from(words)).unwrap_or(&[]));
        writer.put(self.data);
        writer.finish()
    }

    /// The first word of additional status.
    #[must_use]
    pub fn extended(&self) -> Option<ExtendedStatus> {
        self.additional_word(0).map(ExtendedStatus)
    }

    /// A word of additional status, counted from 0.
    #[must_use]
    pub fn additional_word(&self, index: usize) -> Option<u16> {
        let bytes = self.additional.get(2 * index..)?.first_chunk()?;
        Some(u16::from_le_bytes(*bytes))
    }
}
