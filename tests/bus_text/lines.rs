//! Cutting a stream into lines.

use fieldarm::bus::text::{Line, LineSplitter, Outbox};
use proptest::prelude::*;
use std::fmt::Write;

#[derive(Clone, Debug, PartialEq, Eq)]
enum Cut {
    Text(String),
    NotAscii,
    TooLong,
}

/// All lines of a stream that comes in pieces.
fn cut<const N: usize>(pieces: &[&[u8]]) -> Vec<Cut> {
    let mut splitter = LineSplitter::<N>::new();
    let mut lines = Vec::new();
    for piece in pieces {
        let mut bytes = *piece;
        while let Some(line) = splitter.next_line(&mut bytes) {
            lines.push(match line {
                Line::Text(text) => Cut::Text(text.to_owned()),
                Line::NotAscii => Cut::NotAscii,
                Line::TooLong => Cut::TooLong,
            });
        }
        assert!(bytes.is_empty());
    }
    lines
}

fn text(line: &str) -> Cut {
    Cut::Text(line.to_owned())
}

#[test]
fn every_terminator_ends_a_line_and_empty_lines_are_none() {
    assert_eq!(
        cut::<16>(&[b"\0a\0b\nc\r\nd\0\0\n\n\re\r\0 \0"]),
        [text("a"), text("b"), text("c"), text("d"), text("e"), text(" ")]
    );
    assert_eq!(cut::<16>(&[b"Ho", b"me", b"", b"\r", b"\nx"]), [text("Home")]);
}

#[test]
fn a_line_may_be_as_long_as_the_splitter_and_no_longer() {
    assert_eq!(cut::<4>(&[b"abcd\0abcde\0abc\0"]), [text("abcd"), Cut::TooLong, text("abc")]);
    assert_eq!(cut::<4>(&[b"abc", b"de"]), [Cut::TooLong]);
    // Told once however much follows, binary or not, and the next line is read again.
    assert_eq!(
        cut::<4>(&[b"abcde", b"fghijk", &[0x80; 100], b"x\0ok\0"]),
        [Cut::TooLong, text("ok")]
    );
}

#[test]
fn foreign_bytes_make_the_line_no_text() {
    assert_eq!(
        cut::<16>(&["Größe\0ok\0a\x07b\0tab\tbed\0\x7f\0".as_bytes()]),
        [Cut::NotAscii, text("ok"), Cut::NotAscii, text("tab\tbed"), Cut::NotAscii]
    );
}

proptest! {
    #[test]
    fn the_cuts_of_the_network_do_not_matter(
        bytes in prop::collection::vec(prop::sample::select(b"ab \0\n\r\x80".to_vec()), 0..200),
        size in 1_usize..20,
    ) {
        let whole = cut::<5>(&[&bytes]);
        let pieces: Vec<&[u8]> = bytes.chunks(size).collect();
        let mut pieced = cut::<5>(&pieces);
        // A line without an end that is too long is told when it is known.
        prop_assert_eq!(&whole, &pieced);
        pieced.retain(|line| *line == Cut::TooLong);
        let long = bytes.split(|b| matches!(b, 0 | 10 | 13)).filter(|line| line.len() > 5).count();
        prop_assert_eq!(pieced.len(), long);
    }

    #[test]
    fn an_outbox_hands_out_whole_messages_in_order(
        steps in prop::collection::vec((0_usize..30, 0_usize..60), 1..200),
    ) {
        let mut outbox = Outbox::<64>::new();
        let (mut put, mut got) = (Vec::new(), Vec::new());
        for (step, (len, sent)) in steps.into_iter().enumerate() {
            let letter = char::from(b'a' + (step % 26) as u8);
            let before = outbox.waiting().len();
            for _ in 0..len {
                let _ = outbox.write_char(letter);
            }
            let message = letter.to_string().repeat(len);
            let needs = if len == 0 { 0 } else { len + 1 };
            match outbox.finish() {
                Ok(()) => {
                    prop_assert!(before + needs <= 64);
                    put.extend_from_slice(message.as_bytes());
                    put.extend((len > 0).then_some(0));
                }
                Err(_) => {
                    prop_assert!(before + needs > 64, "{before} {needs}");
                    prop_assert_eq!(outbox.waiting().len(), before);
                }
            }
            let sent = sent.min(outbox.waiting().len());
            got.extend_from_slice(&outbox.waiting()[..sent]);
            outbox.sent(sent);
        }
        got.extend_from_slice(outbox.waiting());
        prop_assert_eq!(put, got);
    }
}
