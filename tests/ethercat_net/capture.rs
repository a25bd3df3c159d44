//! What passes on the cable, as a dissector that nobody here wrote reads it.

use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

use crate::namespaces::{Cable, End, INTERFACE, Running, skip};

/// Far longer than the dissector takes.
const LONG: Duration = Duration::from_secs(60);
/// What a frame must not be: not as its protocol says, or read with an error.
const FAULTY: &str =
    "_ws.malformed || ((ecat || ecatf || ecat_mailbox) && _ws.expert.severity == 8388608)";
/// The severity "error" of the filter above; tshark knows expert severities as numbers only.
const _ERROR: u32 = 0x0080_0000;

/// A recording of everything on a cable.
pub(crate) struct Capture {
    recorder: Running,
    file: PathBuf,
}

impl Capture {
    /// Begins to record at the main device's end; `None` where there is no dissector, which the
    /// test has been told then.
    pub(crate) fn start(cable: &Cable, name: &str) -> Option<Self> {
        if Command::new("tshark").arg("-v").output().is_err() {
            return skip("needs tshark (package tshark)");
        }
        let file = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
        let file = file.join(format!("{name}-{}.pcapng", std::process::id()));
        let mut command = cable.command(End::Main, "dumpcap");
        command.args(["-i", INTERFACE, "-f", "ether proto 0x88a4", "-B", "64", "-w"]).arg(&file);
        let mut recorder = Running::start(&mut command);
        recorder.wait_for("File:", LONG);
        Some(Self { recorder, file })
    }

    /// Ends the recording: at least `expected` EtherCAT frames passed and every one is well-formed.
    pub(crate) fn check(self, expected: usize) {
        let (_, said) = self.recorder.interrupt(LONG);
        let frames = read(&self.file, "ecatf").lines().count();
        let faulty = read(&self.file, FAULTY);
        let _ = std::fs::remove_file(&self.file);
        assert!(frames >= expected, "{frames} frames recorded, not {expected}: {said}");
        assert_eq!(faulty, "", "frames that tshark finds fault with");
        println!("tshark: {frames} EtherCAT frames, none malformed");
    }
}

/// The frames of a recording that a display filter finds, one a line.
fn read(file: &PathBuf, filter: &str) -> String {
    let mut command = Command::new("tshark");
    command.args(["-n", "-Y", filter, "-T", "fields", "-e", "frame.number", "-e", "_ws.col.Info"]);
    command.arg("-e").arg("_ws.expert.message").arg("-r").arg(file);
    let read = command.output().expect("tshark starts");
    assert!(read.status.success(), "{}", String::from_utf8_lossy(&read.stderr));
    String::from_utf8_lossy(&read.stdout).into_owned()
}
