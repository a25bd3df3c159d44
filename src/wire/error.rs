//! What is wrong with bytes that cannot be read.

/// Bytes that do not form an image. Small and `Copy`; says which image and what was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WireError {
    /// The slice has not the length of the image.
    #[error("{image} is {expected} bytes long, found {found}")]
    Length {
        /// Name of the image.
        image: &'static str,
        /// Length it must have, in bytes.
        expected: usize,
        /// Length of the slice, in bytes.
        found: usize,
    },
}
