//! The explicit request of the caller, and its answer.

use super::RequestError;
use crate::wire::enip::message::Service;
use crate::wire::enip::path::ObjectPath;

/// Most bytes of data in a request and in an answer.
pub(super) const DATA_LEN: usize = 504;

/// How far the request is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Stage {
    /// None is under way.
    #[default]
    None,
    /// To be sent.
    Queued,
    /// To be answered.
    Sent,
}

/// One request and, later in the same room, the data of its answer.
#[derive(Debug)]
pub(super) struct Explicit {
    pub(super) stage: Stage,
    pub(super) service: Service,
    pub(super) path: ObjectPath,
    data: [u8; DATA_LEN],
    len: usize,
}

impl Explicit {
    pub(super) const fn new() -> Self {
        Self {
            stage: Stage::None,
            service: Service::GET_ATTRIBUTES_ALL,
            path: ObjectPath { class: 1, instance: 1, attribute: None },
            data: [0; DATA_LEN],
            len: 0,
        }
    }

    pub(super) fn queue(
        &mut self,
        service: Service,
        path: ObjectPath,
        data: &[u8],
    ) -> Result<(), RequestError> {
        if self.stage != Stage::None {
            return Err(RequestError::Busy);
        }
        if data.len() > DATA_LEN {
            return Err(RequestError::TooLong { room: DATA_LEN });
        }
        self.keep(data);
        (self.stage, self.service, self.path) = (Stage::Queued, service, path);
        Ok(())
    }

    /// Ends with `data` as the answer, of which no more than fits is kept.
    pub(super) fn finish(&mut self, data: &[u8]) {
        self.stage = Stage::None;
        self.keep(data);
    }

    fn keep(&mut self, data: &[u8]) {
        self.len = data.len().min(DATA_LEN);
        for (place, byte) in self.data.iter_mut().zip(data) {
            *place = *byte;
        }
    }

    /// Data of the request while there is one, then of the answer.
    pub(super) fn data(&self) -> &[u8] {
        self.data.get(..self.len).unwrap_or(&[])
    }

    /// Data of the answer; none while one is waited for.
    pub(super) fn answer(&self) -> &[u8] {
        if self.stage == Stage::None { self.data() } else { &[] }
    }
}
