//! What the names of links over IP have in common: hosts, and options behind `?`.

use std::prelude::v1::*;

/// Most robots that a name lists; segments take more, a screen does not.
pub(super) const MOST_ROBOTS: usize = 64;
/// Longest name of a host, in bytes.
const LONGEST_HOST: usize = 253;

/// The part before `?` and the part behind it, if there is one.
pub(super) fn split_query(text: &str) -> (&str, Option<&str>) {
    match text.split_once('?') {
        Some((head, query)) => (head, Some(query)),
        None => (text, None),
    }
}

/// Hands each `KEY=VALUE` of a query to `set`; `keys` names those that there are, for a person.
pub(super) fn read_options(
    query: Option<&str>,
    keys: &str,
    mut set: impl FnMut(&str, &str) -> Result<(), String>,
) -> Result<(), String> {
    let Some(query) = query else { return Ok(()) };
    let mut seen: Vec<String> = Vec::new();
    for (key, value) in form_urlencoded::parse(query.as_bytes()) {
        if seen.iter().any(|earlier| *earlier == key) {
            return Err(format!("`{key}` is given twice"));
        }
        set(&key, &value)?;
        seen.push(key.into_owned());
    }
    if seen.is_empty() {
        return Err(format!("nothing stands behind `?`; there are {keys}"));
    }
    Ok(())
}

/// What is said of a key that is none of `keys`.
pub(super) fn no_option(key: &str, keys: &str) -> String {
    format!("`{key}` is no option of this link; there are {keys}")
}

/// What is said of more than [`MOST_ROBOTS`] addresses.
pub(super) fn check_count(addresses: usize) -> Result<(), String> {
    if addresses > MOST_ROBOTS {
        return Err(format!("{addresses} addresses; one link drives {MOST_ROBOTS} at most"));
    }
    Ok(())
}

/// What is said of a port that is none.
pub(super) fn no_port(port: &str, usual: u16) -> String {
    format!("`{port}` is no port of TCP: 1 to 65535, usually {usual}")
}

/// Letters, digits, hyphens and dots, and not all numbers: those would be a mistyped address.
pub(super) fn is_host_name(name: &str) -> bool {
    let is_label = |label: &str| {
        let is_inside = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'-' || byte == b'_';
        !label.is_empty()
            && label.bytes().all(is_inside)
            && !label.starts_with('-')
            && !label.ends_with('-')
    };
    let last = name.rsplit('.').next().unwrap_or_default();
    name.len() <= LONGEST_HOST
        && name.split('.').all(is_label)
        && last.bytes().any(|byte| !byte.is_ascii_digit())
}
