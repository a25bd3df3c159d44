//! Where quotation marks, brackets and braces begin and end.
//!
//! Both directions share it: arguments of commands and values of messages are parted by commas
//! outside of all three. A double mark opens a text anywhere; a single one only where an argument or
//! an element may begin, so that an apostrophe inside a bare word is a letter. A backslash takes the
//! next mark along. Source: choice; the manual shows double marks only.

/// Follows a text from quotation mark to quotation mark.
#[derive(Debug)]
pub(super) struct Quotes {
    /// Position and kind of the mark that is open.
    open: Option<(usize, u8)>,
    is_escaped: bool,
    /// Whether something may begin here: nothing but blanks since a symbol.
    begins: bool,
}

impl Quotes {
    /// For a text that is itself a list: something may begin at its front.
    pub(super) const fn of_list() -> Self {
        Self { open: None, is_escaped: false, begins: true }
    }

    /// For a whole line, which begins with a name.
    pub(super) const fn of_line() -> Self {
        Self { open: None, is_escaped: false, begins: false }
    }

    /// Whether this byte is a quotation mark or stands between two of them.
    pub(super) fn hold(&mut self, position: usize, byte: u8) -> bool {
        match (self.open, byte) {
            (None, b'"') => self.open = Some((position, byte)),
            (None, b'\'') if self.begins => self.open = Some((position, byte)),
            (None, _) => {
                let is_blank = byte.is_ascii_whitespace();
                self.begins =
                    matches!(byte, b'(' | b',' | b'[' | b'{' | b':') || (is_blank && self.begins);
                return false;
            }
            (Some(_), _) if self.is_escaped => self.is_escaped = false,
            (Some(_), b'\\') => self.is_escaped = true,
            (Some((_, mark)), _) if mark == byte => {
                self.open = None;
                self.begins = false;
            }
            (Some(_), _) => {}
        }
        true
    }

    /// Position of the mark that has no counterpart so far.
    pub(super) fn open_mark(&self) -> Option<usize> {
        self.open.map(|(position, _)| position)
    }
}

/// Position of the first byte of a list that `wanted` accepts outside quotation marks, brackets and
/// braces.
pub(super) fn find_outside(list: &str, wanted: impl Fn(u8) -> bool) -> Option<usize> {
    let mut quotes = Quotes::of_list();
    let mut depth = 0_usize;
    for (position, byte) in list.bytes().enumerate() {
        if quotes.hold(position, byte) {
            continue;
        }
        match byte {
            byte if depth == 0 && wanted(byte) => return Some(position),
            b'[' | b'{' => depth += 1,
            b']' | b'}' => depth = depth.saturating_sub(1),
            _ => {}
        }
    }
    None
}

/// Position of a quotation mark of a list without its counterpart.
pub(super) fn open_quote(list: &str) -> Option<usize> {
    let mut quotes = Quotes::of_list();
    for (position, byte) in list.bytes().enumerate() {
        quotes.hold(position, byte);
    }
    quotes.open_mark()
}

/// The text without its quotation marks, if a pair stands around it.
pub(super) fn unquoted(text: &str) -> &str {
    let without = |mark: char| text.strip_prefix(mark).and_then(|text| text.strip_suffix(mark));
    without('"').or_else(|| without('\'')).unwrap_or(text)
}

/// What stands between the brackets of an array.
pub(super) fn inside_brackets(text: &str) -> Option<&str> {
    text.strip_prefix('[').and_then(|text| text.strip_suffix(']'))
}

/// The pieces of a list between its commas, without surrounding blanks. A list of nothing but blanks
/// has none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Elements<'a> {
    rest: Option<&'a str>,
}

impl<'a> Elements<'a> {
    pub(super) fn of(list: &'a str) -> Self {
        Self { rest: (!list.trim().is_empty()).then_some(list) }
    }
}

impl<'a> Iterator for Elements<'a> {
    type Item = &'a str;

    fn next(&mut self) -> Option<&'a str> {
        let list = self.rest?;
        let end = find_outside(list, |byte| byte == b',').unwrap_or(list.len());
        let (element, after) = list.split_at_checked(end)?;
        self.rest = after.strip_prefix(',');
        Some(element.trim())
    }
}
