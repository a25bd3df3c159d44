//! Bytes from hex text, as people paste it.

use std::prelude::v1::*;

/// Where and why a text is not bytes in hex.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum HexError {
    #[error("line {line}, column {column}: `{found}` is not a hex digit")]
    NotHex { line: usize, column: usize, found: char },
    #[error(
        "line {line}, column {column}: odd number of hex digits, `{found}` has no partner; a byte \
         has two digits"
    )]
    Odd { line: usize, column: usize, found: char },
}

/// The bytes that `text` spells.
///
/// Digits come in pairs, in either case. Between groups there may be blanks, commas, colons, dashes
/// and line ends; a group may begin with `0x`; `#` begins a comment up to the end of the line.
pub(super) fn parse(text: &str) -> Result<Vec<u8>, HexError> {
    let mut bytes = Vec::new();
    for (line, content) in (1..).zip(text.lines()) {
        let content = content.split('#').next().unwrap_or_default();
        let is_gap = |c: char| c.is_whitespace() || matches!(c, ',' | ':' | '-' | ';');
        let mut column = 1;
        for group in content.split_inclusive(is_gap) {
            let digits = group.trim_end_matches(is_gap);
            parse_group(digits, line, column, &mut bytes)?;
            column += group.chars().count();
        }
    }
    Ok(bytes)
}

fn parse_group(
    group: &str,
    line: usize,
    column: usize,
    bytes: &mut Vec<u8>,
) -> Result<(), HexError> {
    let (digits, column) = match group.strip_prefix("0x").or_else(|| group.strip_prefix("0X")) {
        Some(digits) => (digits, column + 2),
        None => (group, column),
    };
    let mut open: Option<(u8, usize, char)> = None;
    for (column, found) in (column..).zip(digits.chars()) {
        let digit = found.to_digit(16).and_then(|digit| u8::try_from(digit).ok());
        let digit = digit.ok_or(HexError::NotHex { line, column, found })?;
        open = match open {
            None => Some((digit, column, found)),
            Some((high, ..)) => {
                bytes.push(high << 4 | digit);
                None
            }
        };
    }
    match open {
        None => Ok(()),
        Some((_, column, found)) => Err(HexError::Odd { line, column, found }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_usual_ways_to_write_bytes() {
        for text in
            ["16 00 32c8", "160032C8", "0x16,0x00,0x32,0xC8", "16:00:32:c8\n", "1600\n# x\n32 c8"]
        {
            assert_eq!(parse(text), Ok(vec![0x16, 0, 0x32, 0xC8]), "{text:?}");
        }
        assert_eq!(parse(""), Ok(vec![]));
    }

    #[test]
    fn errors_say_where() {
        let error = parse("16 00\n32 cg").unwrap_err();
        assert_eq!(error, HexError::NotHex { line: 2, column: 5, found: 'g' });
        let error = parse("16 00 3").unwrap_err();
        assert_eq!(
            error.to_string(),
            "line 1, column 7: odd number of hex digits, `3` has no partner; a byte has two digits"
        );
    }
}
