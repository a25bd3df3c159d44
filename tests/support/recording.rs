//! What passes on an interface, recorded and read by a dissector that nobody here wrote.

use std::path::PathBuf;
use std::process::Command;
use std::thread;
use std::time::Duration;

use crate::namespaces::Running;

/// Far longer than the dissector takes.
const LONG: Duration = Duration::from_secs(120);

/// Whether the dissector and its recorder are installed.
pub(crate) fn is_there() -> bool {
    Command::new("tshark").arg("-v").output().is_ok()
}

/// A recording under way.
pub(crate) struct Recording {
    recorder: Running,
    file: PathBuf,
}

impl Recording {
    /// Begins to record what passes `filter` on an interface; `dumpcap` is the recorder where that is.
    pub(crate) fn start(mut dumpcap: Command, interface: &str, filter: &str, name: &str) -> Self {
        let file = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
        let file = file.join(format!("{name}-{}.pcapng", std::process::id()));
        dumpcap.args(["-i", interface, "-f", filter, "-B", "64", "-w"]).arg(&file);
        let mut recorder = Running::start(&mut dumpcap);
        recorder.wait_for("File:", LONG);
        Self { recorder, file }
    }

    /// How much was written so far, in bytes.
    pub(crate) fn length(&self) -> Option<u64> {
        std::fs::metadata(&self.file).ok().map(|file| file.len())
    }

    /// Ends the recording, once nothing more is written: frames reach the file some time after the wire.
    pub(crate) fn end(self) -> Recorded {
        let mut length = None;
        for _ in 0..40 {
            let before = length;
            thread::sleep(Duration::from_millis(500));
            length = self.length();
            if length == before {
                break;
            }
        }
        let (_, said) = self.recorder.interrupt(LONG);
        assert!(said.contains("Packets received/dropped"), "{said}");
        Recorded { file: self.file }
    }
}

/// What was recorded; the file goes with it.
pub(crate) struct Recorded {
    file: PathBuf,
}

impl Recorded {
    /// Those fields of the frames that a display filter finds, one frame a line.
    pub(crate) fn read(&self, filter: &str, fields: &[&str]) -> String {
        let mut command = Command::new("tshark");
        command.args(["-n", "-Y", filter, "-T", "fields", "-E", "separator=,"]);
        command.args(fields.iter().flat_map(|field| ["-e", field])).arg("-r").arg(&self.file);
        let read = command.output().expect("tshark starts");
        assert!(read.status.success(), "{}", String::from_utf8_lossy(&read.stderr));
        String::from_utf8_lossy(&read.stdout).into_owned()
    }

    /// The number of frames that a display filter finds.
    pub(crate) fn count(&self, filter: &str) -> usize {
        self.read(filter, &["frame.number"]).lines().count()
    }

    /// The frames that a display filter finds, each with what the dissector says of it.
    pub(crate) fn told(&self, filter: &str) -> String {
        self.read(filter, &["frame.number", "_ws.col.Info", "_ws.expert.message"])
    }
}

impl Drop for Recorded {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.file);
    }
}
