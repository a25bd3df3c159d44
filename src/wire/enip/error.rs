//! What is wrong with bytes that cannot be read, and with room that does not suffice.

/// Bytes that do not form the message they should. Names the message and the field.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    /// The bytes end too early.
    #[error("{message} is cut off in its {field}")]
    Truncated {
        /// Which message.
        message: &'static str,
        /// The first field that is not whole.
        field: &'static str,
    },
    /// A field has a value that it cannot have.
    #[error("{message}: {field} is {found}, but must be {allowed}")]
    Value {
        /// Which message.
        message: &'static str,
        /// Which field.
        field: &'static str,
        /// Its value.
        found: u32,
        /// What it may be, in words.
        allowed: &'static str,
    },
    /// More bytes follow than belong to the message.
    #[error("{message} is followed by {count} bytes that do not belong to it")]
    Trailing {
        /// Which message.
        message: &'static str,
        /// Bytes too many.
        count: usize,
    },
}

/// The room given for a message is too small for it, or a part is longer than the length in front of it
/// can say (255 words of a path, 65535 bytes of an item, 511 bytes of a connection's size).
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a message does not fit into {room} bytes, or a part of it not into its length field")]
pub struct NoRoom {
    /// Bytes there were.
    pub room: usize,
}
