//! Instruction counts: the bench runs itself once more under valgrind's callgrind, which collects
//! only inside functions named `measured_*` and writes a part of its profile after each subject.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::Subject;

/// Set in the process that callgrind runs.
const COUNTING: &str = "FIELDARM_BENCH_COUNTING";
/// Operations per subject: enough that a count is exact to a hundredth.
const OPERATIONS: u64 = 200;
/// Parts per subject. The first holds what happens once, such as the binding of symbols.
const PARTS: usize = 2;

/// Whether this process is the one that callgrind runs.
pub(crate) fn is_counting() -> bool {
    std::env::var_os(COUNTING).is_some()
}

/// Runs the subjects for callgrind.
pub(crate) fn count_here(subjects: &mut [&mut Subject]) {
    for subject in subjects {
        for _ in 0..PARTS {
            dump_after_counted_batch(subject);
        }
    }
}

/// Callgrind writes a part whenever this function returns.
#[inline(never)]
fn dump_after_counted_batch(subject: &mut Subject) {
    subject.run(std::hint::black_box(OPERATIONS));
}

/// Instructions of one operation of each subject.
///
/// # Errors
///
/// Why there are no counts, e.g. that valgrind is missing.
pub(crate) fn count_in_child(subjects: usize) -> Result<Vec<f64>, String> {
    let directory =
        Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("callgrind-{}", std::process::id()));
    std::fs::create_dir_all(&directory).map_err(|error| error.to_string())?;
    let counts = run(&directory.join("out"))
        .and_then(|()| (0..subjects).map(|subject| read_count(&directory, subject)).collect());
    let _ = std::fs::remove_dir_all(&directory);
    counts
}

fn run(out_file: &Path) -> Result<(), String> {
    let bench = std::env::current_exe().map_err(|error| error.to_string())?;
    let status = Command::new("valgrind")
        .args(["--tool=callgrind", "--collect-atstart=no", "--toggle-collect=*measured_*"])
        .arg("--dump-after=*dump_after_counted_batch*")
        .arg(format!("--callgrind-out-file={}", out_file.display()))
        .arg(bench)
        .env(COUNTING, "1")
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .map_err(|error| format!("valgrind does not start ({error})"))?;
    if status.success() { Ok(()) } else { Err(format!("valgrind ended with {status}")) }
}

fn read_count(directory: &Path, subject: usize) -> Result<f64, String> {
    let part: PathBuf = directory.join(format!("out.{}", PARTS * (subject + 1)));
    let text = std::fs::read_to_string(&part)
        .map_err(|error| format!("callgrind wrote no {} ({error})", part.display()))?;
    text.lines()
        .find_map(|line| line.strip_prefix("totals: ").or(line.strip_prefix("summary: ")))
        .and_then(|total| total.trim().parse::<u64>().ok())
        .filter(|&total| total > 0)
        .map(|total| total as f64 / OPERATIONS as f64)
        .ok_or_else(|| format!("callgrind counted nothing for subject {subject}"))
}
