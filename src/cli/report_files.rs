//! The files of `--report`: made whole beside the older ones, then put in their place.

use std::path::{Path, PathBuf};
use std::prelude::v1::*;
use std::{fs, io, process};

use super::exit::Failure;
use super::plots;
use super::report::Report;
use crate::run::recording::Recording;

/// Makes sure that the report will have a place, before anything moves. What is there stays.
pub(super) fn prepare(directory: &Path) -> Result<(), Failure> {
    let failed = |error: io::Error| {
        Failure::internal(format!("cannot write a report into {}: {error}", directory.display()))
    };
    fs::create_dir_all(directory).map_err(failed)?;
    let probe = unfinished(directory, "report.json");
    fs::File::create(&probe).map_err(failed)?;
    fs::remove_file(probe).map_err(failed)
}

/// Where a file is written before it takes the place of an older one.
fn unfinished(directory: &Path, name: &str) -> PathBuf {
    directory.join(format!(".{name}.{}", process::id()))
}

/// Writes the report and its plots, which carry `title`; the paths written.
pub(super) fn write(
    directory: &Path,
    title: &str,
    report: &Report,
    recording: &Recording,
) -> Result<Vec<String>, Failure> {
    let json = serde_json::to_string_pretty(report)
        .map_err(|error| Failure::internal(format!("cannot write the report: {error}")))?;
    let mut files = vec![("report.json", json + "\n")];
    for (name, plot) in plots::all(title, recording) {
        let svg =
            plot.map_err(|error| Failure::internal(format!("cannot draw {name}: {error}")))?;
        files.push((name, svg));
    }
    let mut paths = Vec::new();
    for (name, content) in files {
        let path = directory.join(name);
        // Whoever reads the directory meanwhile finds the old file or the new one, both whole.
        let unfinished = unfinished(directory, name);
        let written = fs::write(&unfinished, content).and_then(|()| fs::rename(&unfinished, &path));
        written.map_err(|error| {
            // It may not even have been made.
            let _ = fs::remove_file(&unfinished);
            Failure::internal(format!("cannot write {}: {error}", path.display()))
        })?;
        paths.push(path.display().to_string());
    }
    Ok(paths)
}
