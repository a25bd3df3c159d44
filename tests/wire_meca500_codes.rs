//! Codes of the robot, row by row against the table typed from the manual.

use fieldarm::wire::meca500::code::{Code, CodeKind, Resettable};
use std::collections::{BTreeMap, BTreeSet, HashMap};

type Row = HashMap<String, String>;

fn rows() -> Vec<Row> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/spec/meca500_error_codes.csv");
    csv::Reader::from_path(path).unwrap().deserialize().map(Result::unwrap).collect()
}

/// The manual's Greek letters in the plain letters of the crate.
fn plain(text: &str) -> String {
    [
        ("α", "alpha"),
        ("β", "beta"),
        ("γ", "gamma"),
        ("θ", "theta"),
        ("ω", "omega"),
        ("τ", "tau"),
        ("ẋ", "x_dot"),
        ("ẏ", "y_dot"),
        ("ż", "z_dot"),
    ]
    .iter()
    .fold(text.to_owned(), |text, (greek, letters)| text.replace(greek, letters))
}

/// Codes whose values Table 2 misprints; the crate follows the command's own chapter.
const VALUES_BY_CHAPTER: [(u16, &str); 3] =
    [(2113, "n, q_{n,min}, q_{n,max}"), (2156, "p"), (2192, "m, c_x, c_y, c_z")];

#[test]
fn every_code_of_the_table_is_described_and_no_other() {
    let rows = rows();
    assert_eq!(rows.len(), 275);
    let table: BTreeSet<u16> = rows.iter().map(|row| row["code"].parse().unwrap()).collect();
    let described: BTreeSet<u16> =
        (0..=u16::MAX).filter(|c| Code(*c).describe().is_some()).collect();
    assert_eq!(described, table);
    let listed: Vec<u16> = Code::all().map(|info| info.code.0).collect();
    assert_eq!(listed.len(), table.len(), "no code stands in two tables");
}

#[test]
fn kinds_are_those_of_the_table() {
    let mut kinds: BTreeMap<u16, BTreeSet<String>> = BTreeMap::new();
    for row in rows() {
        kinds.entry(row["code"].parse().unwrap()).or_default().insert(row["kind"].clone());
    }
    for (code, expected) in kinds {
        let info = Code(code).describe().unwrap();
        let mut found = BTreeSet::from([match info.kind {
            CodeKind::Error => "error",
            CodeKind::Response => "response",
            CodeKind::Monitoring => "monitoring",
            CodeKind::Safety => "safety",
        }
        .to_owned()]);
        if info.monitored {
            found.insert("monitoring".to_owned());
        }
        assert_eq!(found, expected, "{code}");
    }
}

#[test]
fn the_robots_message_is_one_of_the_table() {
    for info in Code::all() {
        let code = info.code.0;
        let messages: Vec<String> = rows()
            .iter()
            .filter(|row| row["code"] == code.to_string())
            .map(|row| plain(&row["text_template"]))
            .collect();
        match VALUES_BY_CHAPTER.iter().find(|(misprinted, _)| *misprinted == code) {
            Some((_, message)) => assert_eq!(info.message, *message),
            None => assert!(messages.iter().any(|m| m == info.message), "{code}: {messages:?}"),
        }
    }
}

#[test]
fn what_can_be_reset_is_as_the_table_says() {
    for row in rows().iter().filter(|row| !row["resettable"].is_empty()) {
        let cell = row["resettable"].as_str();
        let expected = match cell {
            _ if cell.starts_with("yes") => Resettable::Yes,
            _ if cell.starts_with("not stated") => Resettable::NotStated,
            _ if cell.starts_with("no") => Resettable::No,
            other => panic!("{other}"),
        };
        let code = Code(row["code"].parse().unwrap());
        assert_eq!(code.describe().unwrap().resettable, expected, "{code}");
    }
}

#[test]
fn every_error_says_what_it_means_and_what_to_do_in_our_own_words() {
    for row in rows() {
        let info = Code(row["code"].parse().unwrap()).describe().unwrap();
        assert!(info.text.ends_with('.') && info.text.len() > 4, "{}", info.code);
        assert_ne!(info.text, row["explanation"], "{}", info.code);
        if info.kind == CodeKind::Error {
            assert!(info.remedy.ends_with('.') && info.remedy.len() > 10, "{}", info.code);
        }
    }
}

#[test]
fn an_unknown_code_prints_its_number() {
    assert_eq!(Code(4711).to_string(), "4711");
    assert_eq!(Code::NONE.describe(), None);
    assert!(!Code::NONE.is_set() && Code(4711).is_set());
    assert_eq!(Code::NOT_HOMED.to_string(), "1006: The command needs a homed robot.");
    assert_eq!(Code::E_STOP.describe().unwrap().kind, CodeKind::Safety);
}
