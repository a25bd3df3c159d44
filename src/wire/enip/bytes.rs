//! Reading and writing little-endian fields in order.

use super::error::{DecodeError, NoRoom};

/// Takes fields off the front of a message.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reader<'a> {
    message: &'static str,
    bytes: &'a [u8],
}

impl<'a> Reader<'a> {
    /// Reads `bytes` as the message called `message` in errors.
    pub(crate) const fn new(message: &'static str, bytes: &'a [u8]) -> Self {
        Self { message, bytes }
    }

    /// The next `len` bytes.
    pub(crate) fn take(
        &mut self,
        field: &'static str,
        len: usize,
    ) -> Result<&'a [u8], DecodeError> {
        let Some((taken, rest)) = self.bytes.split_at_checked(len) else {
            return Err(DecodeError::Truncated { message: self.message, field });
        };
        self.bytes = rest;
        Ok(taken)
    }

    /// The next `N` bytes.
    pub(crate) fn array<const N: usize>(
        &mut self,
        field: &'static str,
    ) -> Result<[u8; N], DecodeError> {
        let Some((taken, rest)) = self.bytes.split_first_chunk() else {
            return Err(DecodeError::Truncated { message: self.message, field });
        };
        self.bytes = rest;
        Ok(*taken)
    }

    pub(crate) fn u8(&mut self, field: &'static str) -> Result<u8, DecodeError> {
        self.array(field).map(|[byte]| byte)
    }

    pub(crate) fn u16(&mut self, field: &'static str) -> Result<u16, DecodeError> {
        self.array(field).map(u16::from_le_bytes)
    }

    pub(crate) fn u32(&mut self, field: &'static str) -> Result<u32, DecodeError> {
        self.array(field).map(u32::from_le_bytes)
    }

    /// What has not been taken yet.
    pub(crate) const fn rest(&self) -> &'a [u8] {
        self.bytes
    }

    /// That `field`, just read, may not have the value `found`.
    pub(crate) fn wrong(
        &self,
        field: &'static str,
        found: impl Into<u32>,
        allowed: &'static str,
    ) -> DecodeError {
        DecodeError::Value { message: self.message, field, found: found.into(), allowed }
    }

    /// That nothing is left.
    pub(crate) const fn end(&self) -> Result<(), DecodeError> {
        match self.bytes.len() {
            0 => Ok(()),
            count => Err(DecodeError::Trailing { message: self.message, count }),
        }
    }
}

/// Puts fields behind each other into room of the caller; what does not fit is noticed at the end.
#[derive(Debug)]
pub(crate) struct Writer<'a> {
    room: &'a mut [u8],
    len: usize,
    is_overfull: bool,
}

impl<'a> Writer<'a> {
    pub(crate) const fn new(room: &'a mut [u8]) -> Self {
        Self { room, len: 0, is_overfull: false }
    }

    pub(crate) fn put(&mut self, bytes: &[u8]) {
        let end = self.len.saturating_add(bytes.len());
        match self.room.get_mut(self.len..end) {
            Some(room) => {
                room.copy_from_slice(bytes);
                self.len = end;
            }
            None => self.is_overfull = true,
        }
    }

    pub(crate) fn u8(&mut self, value: u8) {
        self.put(&[value]);
    }

    pub(crate) fn u16(&mut self, value: u16) {
        self.put(&value.to_le_bytes());
    }

    pub(crate) fn u32(&mut self, value: u32) {
        self.put(&value.to_le_bytes());
    }

    /// Puts the size of `bytes` in 16-bit words, `between`, and the bytes, an odd one filled up with a zero.
    ///
    /// More than 255 words cannot be said and count as not fitting.
    pub(crate) fn put_words(&mut self, bytes: &[u8], between: &[u8]) {
        match u8::try_from(bytes.len().div_ceil(2)) {
            Ok(words) => self.u8(words),
            Err(_) => self.is_overfull = true,
        }
        self.put(between);
        self.put(bytes);
        if bytes.len() % 2 == 1 {
            self.u8(0);
        }
    }

    /// Notes that a value does not fit its field.
    pub(crate) const fn fail(&mut self) {
        self.is_overfull = true;
    }

    /// Bytes so far.
    pub(crate) const fn len(&self) -> usize {
        self.len
    }

    /// Replaces bytes at `position`, which have been put before.
    pub(crate) fn replace(&mut self, position: usize, bytes: &[u8]) {
        let end = position.saturating_add(bytes.len());
        match self.room.get_mut(position..end).filter(|_| end <= self.len) {
            Some(room) => room.copy_from_slice(bytes),
            None => self.is_overfull = true,
        }
    }

    /// Replaces the 16-bit length at `position` by the number of bytes put since `start`.
    pub(crate) fn replace_len(&mut self, position: usize, start: usize) {
        match u16::try_from(self.len.saturating_sub(start)) {
            Ok(len) => self.replace(position, &len.to_le_bytes()),
            Err(_) => self.is_overfull = true,
        }
    }

    /// Number of bytes put.
    pub(crate) const fn finish(self) -> Result<usize, NoRoom> {
        if self.is_overfull { Err(NoRoom { room: self.room.len() }) } else { Ok(self.len) }
    }
}
