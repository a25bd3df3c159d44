//! The shape of the house, enforced: who may import whom, what the lower floors must not contain,
//! how long a file may be, which sources exist. `ARCHITECTURE.md` explains why.

use std::fs;
use std::path::{Path, PathBuf};

/// What each floor may import from this crate. `link` and `run` may name only the parts listed.
const FLOORS: &[(&str, &[&str])] = &[
    ("time", &[]),
    ("cycle", &["time"]),
    ("text_device", &["time"]),
    ("wire", &["wire"]),
    ("bus", &["bus", "wire", "time", "cycle", "text_device"]),
    ("sim", &["sim", "wire", "time", "cycle", "text_device"]),
    ("engine", &["engine", "wire", "time", "cycle"]),
    ("link", &["link", "bus", "wire", "time", "cycle", "text_device"]),
    ("run", &["run", "engine", "cycle", "time", "wire", "link::clock"]),
    (
        "cli",
        &["cli", "run", "link", "sim", "engine", "bus", "cycle", "text_device", "wire", "time"],
    ),
];

/// Floors whose code must not be able to panic by writing it down.
const PANIC_FREE: &[&str] = &["wire", "engine", "bus", "time", "cycle", "text_device"];

const MAX_LINES: usize = 800;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Every file below `folder` with one of `extensions`.
fn files(folder: &str, extensions: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![root().join(folder)];
    while let Some(path) = open.pop() {
        if path.is_dir() {
            open.extend(fs::read_dir(&path).unwrap().map(|entry| entry.unwrap().path()));
        } else if path.extension().is_some_and(|e| extensions.iter().any(|want| e == *want)) {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// The floor of a file of `src`: its first folder, or its own name.
fn floor_of(path: &Path) -> String {
    let relative = path.strip_prefix(root().join("src")).unwrap();
    let first = relative.iter().next().unwrap().to_str().unwrap();
    first.trim_end_matches(".rs").to_owned()
}

/// `path` as a reader of a failure wants it.
fn shown(path: &Path) -> String {
    path.strip_prefix(root()).unwrap().display().to_string()
}

/// The code of a file without comments and without what is compiled for tests only: everything
/// from the first `#[cfg(test)]` on, which stands at the end of a file here.
fn code_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines()
        .enumerate()
        .take_while(|(_, line)| line.trim() != "#[cfg(test)]")
        .map(|(index, line)| (index + 1, line.split("//").next().unwrap_or("")))
}

/// Paths of this crate that `text` uses, with their lines: what follows `crate::`, one path for
/// each name in a braced list directly behind it.
fn crate_paths(text: &str) -> Vec<(usize, String)> {
    let mut paths = Vec::new();
    for (number, line) in code_lines(text) {
        for (start, _) in line.match_indices("crate::") {
            if line[..start].ends_with('$') {
                continue;
            }
            let rest = &line[start + "crate::".len()..];
            let names = match rest.strip_prefix('{') {
                Some(list) => list.split('}').next().unwrap_or(list).split(',').collect(),
                None => vec![rest],
            };
            for name in names.into_iter().map(str::trim) {
                let end = name
                    .find(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':'))
                    .unwrap_or(name.len());
                paths.push((number, name[..end].to_owned()));
            }
        }
    }
    paths
}

/// How many modules stand between the code of a file and the root of the crate.
fn module_depth(path: &Path) -> usize {
    let relative = path.strip_prefix(root().join("src")).unwrap();
    relative.iter().count() - usize::from(path.ends_with("mod.rs"))
}

#[test]
fn no_path_climbs_out_of_its_floor() {
    let mut problems = Vec::new();
    for path in files("src", &["rs"]) {
        for (line, code) in code_lines(&fs::read_to_string(&path).unwrap()) {
            if code.contains(&"super::".repeat(module_depth(&path))) {
                problems.push(format!("{}:{line}: name the crate path instead", shown(&path)));
            }
        }
    }
    report(problems);
}

fn allowed(path: &str, list: &[&str]) -> bool {
    list.iter().any(|entry| {
        path == *entry || path.strip_prefix(entry).is_some_and(|rest| rest.starts_with("::"))
    })
}

fn report(problems: Vec<String>) {
    assert!(problems.is_empty(), "\n{}\n", problems.join("\n"));
}

#[test]
fn each_floor_uses_only_the_floors_below_it() {
    let mut problems = Vec::new();
    let mut checked = 0;
    for path in files("src", &["rs"]) {
        let floor = floor_of(&path);
        let Some((_, list)) = FLOORS.iter().find(|(name, _)| *name == floor) else {
            if !["lib", "bin"].contains(&floor.as_str()) {
                problems.push(format!("{}: no floor named `{floor}`", shown(&path)));
            }
            continue;
        };
        for (line, used) in crate_paths(&fs::read_to_string(&path).unwrap()) {
            checked += 1;
            if !allowed(&used, list) {
                problems.push(format!("{}:{line}: {floor} must not use {used}", shown(&path)));
            }
        }
    }
    assert!(checked > 20, "only {checked} paths found: the reader of paths is broken");
    report(problems);
}

#[test]
fn an_upward_import_is_found() {
    let paths = crate_paths(
        "use crate::{time::Instant, engine::Engine};\nlet x = crate::sim::Y; // crate::z\n",
    );
    let names: Vec<_> = paths.iter().map(|(line, path)| (*line, path.as_str())).collect();
    assert_eq!(names, [(1, "time::Instant"), (1, "engine::Engine"), (2, "sim::Y")]);
    assert!(!allowed("engine::Engine", &["sim", "time"]));
    assert!(!allowed("link::direct", &["link::clock"]));
    assert!(allowed("link::clock::now", &["link::clock"]));
}

#[test]
fn only_the_clock_names_a_system_clock() {
    let words =
        ["std::time::Instant", "SystemTime", "clock_gettime", "Instant::now(", "time::now("];
    let mut problems = Vec::new();
    for path in files("src", &["rs"]) {
        if shown(&path) == "src/link/clock.rs" {
            continue;
        }
        for (line, code) in code_lines(&fs::read_to_string(&path).unwrap()) {
            for word in words.iter().filter(|word| code.contains(**word)) {
                problems.push(format!(
                    "{}:{line}: `{word}` belongs in src/link/clock.rs",
                    shown(&path)
                ));
            }
        }
    }
    report(problems);
}

/// Whether `code` indexes a slice: an opening bracket right behind a name or a closing bracket.
fn indexes(code: &str) -> bool {
    let bytes = code.as_bytes();
    code.match_indices('[').any(|(at, _)| {
        at > 0
            && (bytes[at - 1].is_ascii_alphanumeric()
                || matches!(bytes[at - 1], b'_' | b')' | b']'))
    })
}

#[test]
fn an_index_is_found() {
    assert!(indexes("let x = bytes[0];"));
    assert!(indexes("call()[1..]"));
    assert!(!indexes("let x: [u8; 4] = [0; 4];"));
    assert!(!indexes("#[derive(Debug)]"));
    assert!(!indexes("vec![1]"));
}

#[test]
fn lower_floors_do_not_panic() {
    let words = [".unwrap()", ".expect(", "panic!(", "unreachable!(", "todo!(", "unimplemented!("];
    let mut problems = Vec::new();
    for path in files("src", &["rs"]) {
        if !PANIC_FREE.contains(&floor_of(&path).as_str()) {
            continue;
        }
        for (line, code) in code_lines(&fs::read_to_string(&path).unwrap()) {
            for word in words.iter().filter(|word| code.contains(**word)) {
                problems.push(format!("{}:{line}: `{word}`", shown(&path)));
            }
            if indexes(code) {
                problems.push(format!("{}:{line}: indexing: {}", shown(&path), code.trim()));
            }
        }
    }
    report(problems);
}

#[test]
fn no_file_is_too_long() {
    let mut problems = Vec::new();
    for folder in ["src", "tests", "benches", "examples", "fuzz"] {
        for path in files(folder, &["rs", "c", "py"]) {
            let lines = fs::read_to_string(&path).unwrap().lines().count();
            if lines > MAX_LINES {
                problems.push(format!("{}: {lines} lines, at most {MAX_LINES}", shown(&path)));
            }
        }
    }
    report(problems);
}

#[test]
fn every_source_key_is_defined() {
    let sources = fs::read_to_string(root().join("SOURCES.md")).unwrap();
    let mut problems = Vec::new();
    let mut used = 0;
    for path in files("src", &["rs"]) {
        for (index, line) in fs::read_to_string(&path).unwrap().lines().enumerate() {
            let Some((_, rest)) = line.split_once("Source: ") else { continue };
            // A key may hold a dot itself (ETG.1000), a sentence ends with one.
            let key = rest.split([' ', ',', ';']).next().unwrap_or("").trim_end_matches('.');
            used += 1;
            if !sources.contains(&format!("| {key} |")) {
                problems.push(format!(
                    "{}:{}: source `{key}` is not in SOURCES.md",
                    shown(&path),
                    index + 1
                ));
            }
        }
    }
    assert!(used > 10, "only {used} sources found: the reader of sources is broken");
    report(problems);
}

#[test]
fn nothing_is_left_unfinished() {
    // Spelled apart so that this file does not find itself.
    let marks =
        [concat!("TO", "DO"), concat!("FIX", "ME"), concat!("X", "XX"), concat!("#[ig", "nore]")];
    let mut problems = Vec::new();
    for folder in ["src", "tests", "benches", "examples", "fuzz"] {
        for path in files(folder, &["rs"]) {
            for (index, line) in fs::read_to_string(&path).unwrap().lines().enumerate() {
                if let Some(mark) = marks.iter().find(|mark| line.contains(**mark)) {
                    problems.push(format!("{}:{}: `{mark}`", shown(&path), index + 1));
                }
            }
        }
    }
    report(problems);
}
