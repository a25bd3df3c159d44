//! Decisions taken from a string of bytes: what a fuzzer or a seed makes, a driver obeys.

/// Bytes not yet used up.
pub(crate) struct Choices<'a> {
    bytes: &'a [u8],
}

impl<'a> Choices<'a> {
    pub(crate) const fn new(bytes: &'a [u8]) -> Self {
        Self { bytes }
    }

    /// The next byte; `None` when all are used up.
    pub(crate) fn next(&mut self) -> Option<u8> {
        let (first, rest) = self.bytes.split_first()?;
        self.bytes = rest;
        Some(*first)
    }

    /// A byte, 0 behind the end.
    pub(crate) fn byte(&mut self) -> u8 {
        self.next().unwrap_or(0)
    }

    pub(crate) fn word(&mut self) -> u16 {
        u16::from_le_bytes([self.byte(), self.byte()])
    }

    pub(crate) fn double_word(&mut self) -> u32 {
        u32::from(self.word()) | u32::from(self.word()) << 16
    }

    /// A number below `count`, which is not 0.
    pub(crate) fn below(&mut self, count: usize) -> usize {
        usize::from(if count > 256 { self.word() } else { self.byte().into() }) % count
    }

    /// True once in `count` times.
    pub(crate) fn one_in(&mut self, count: usize) -> bool {
        self.below(count) == count - 1
    }

    pub(crate) fn pick<T: Copy>(&mut self, among: &[T]) -> T {
        among[self.below(among.len())]
    }

    /// Up to `most` bytes as they come.
    pub(crate) fn some(&mut self, most: usize) -> &'a [u8] {
        let len = self.below(most + 1).min(self.bytes.len());
        let (taken, rest) = self.bytes.split_at(len);
        self.bytes = rest;
        taken
    }
}

/// Spoils a message a little: bits, bytes, ends, pieces. Often repairs the length of the header, so that what
/// is wrong is found further inside.
pub(crate) fn spoil(message: &mut Vec<u8>, choices: &mut Choices<'_>) {
    for _ in 0..=choices.below(3) {
        if message.is_empty() {
            return;
        }
        let at = choices.below(message.len());
        match choices.below(7) {
            0 => message[at] ^= 1 << choices.below(8),
            1 => message[at] = choices.byte(),
            2 => message[at] = choices.pick(&[0, 1, 0x7F, 0x80, 0xFF]),
            3 => message.truncate(at),
            4 => message.insert(at, choices.byte()),
            5 => drop(message.remove(at)),
            _ => message.extend_from_within(at..),
        }
    }
    if choices.below(2) == 0 && message.len() >= 24 {
        let [low, high] = u16::try_from(message.len() - 24).unwrap_or(u16::MAX).to_le_bytes();
        (message[2], message[3]) = (low, high);
    }
}
