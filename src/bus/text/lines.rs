//! A stream of bytes, cut into lines.

/// What the splitter found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Line<'a> {
    /// A line without its terminator: printable ASCII and tabs, at least one.
    Text(&'a str),
    /// A line with a byte that is neither printable ASCII nor a tab.
    NotAscii,
    /// A line that is longer than the splitter holds. Told as soon as that is known; the rest of the
    /// line is passed over.
    TooLong,
}

/// Cuts a stream into lines of at most `N` bytes, which end with NUL, LF or CR LF. Lines without a
/// byte are passed over, so that CR LF and a doubled terminator end one line.
#[derive(Clone, Debug)]
pub struct LineSplitter<const N: usize> {
    line: [u8; N],
    len: usize,
    has_foreign: bool,
    /// Whether a line that is too long has been told and its end has not come.
    is_skipping: bool,
}

impl<const N: usize> Default for LineSplitter<N> {
    fn default() -> Self {
        Self::new()
    }
}

const fn ends(byte: u8) -> bool {
    matches!(byte, 0 | b'\n' | b'\r')
}

const fn is_foreign(byte: u8) -> bool {
    !matches!(byte, b' '..=b'~' | b'\t')
}

impl<const N: usize> LineSplitter<N> {
    /// A splitter at the beginning of a stream.
    #[must_use]
    pub const fn new() -> Self {
        Self { line: [0; N], len: 0, has_foreign: false, is_skipping: false }
    }

    /// Forgets what it holds: a new stream begins.
    pub fn restart(&mut self) {
        self.begin_line();
        self.is_skipping = false;
    }

    fn begin_line(&mut self) {
        self.len = 0;
        self.has_foreign = false;
    }

    /// Takes bytes from the front of `bytes` up to the end of a line, and says what that line is; `None`
    /// when all were taken and no line has ended. To be called until then.
    pub fn next_line<'a>(&'a mut self, bytes: &mut &[u8]) -> Option<Line<'a>> {
        while !bytes.is_empty() {
            let end = bytes.iter().position(|byte| ends(*byte));
            let (piece, rest) = bytes.split_at_checked(end.unwrap_or(bytes.len()))?;
            *bytes = if end.is_some() { rest.get(1..).unwrap_or(&[]) } else { rest };
            if self.is_skipping {
                self.is_skipping = end.is_none();
                continue;
            }
            if self.len == 0 && piece.is_empty() {
                continue;
            }
            if !self.hold(piece) {
                self.begin_line();
                self.is_skipping = end.is_none();
                return Some(Line::TooLong);
            }
            if end.is_some() {
                return Some(self.take_line());
            }
        }
        None
    }

    /// Appends to the line; `false` when it does not fit.
    fn hold(&mut self, piece: &[u8]) -> bool {
        self.has_foreign |= piece.iter().any(|byte| is_foreign(*byte));
        let end = self.len.saturating_add(piece.len());
        let Some(room) = self.line.get_mut(self.len..end) else { return false };
        room.copy_from_slice(piece);
        self.len = end;
        true
    }

    fn take_line(&mut self) -> Line<'_> {
        let has_foreign = self.has_foreign;
        let len = self.len;
        self.begin_line();
        if has_foreign {
            return Line::NotAscii;
        }
        let text = self.line.get(..len).and_then(|line| core::str::from_utf8(line).ok());
        text.map_or(Line::NotAscii, Line::Text)
    }
}
