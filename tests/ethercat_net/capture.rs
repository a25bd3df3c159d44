//! What passes on the cable, as a dissector that nobody here wrote reads it.

use std::path::PathBuf;
use std::process::Command;
use std::thread;
use std::time::Duration;

use fieldarm::link::ethercat::raw_socket::RawSocket;
use fieldarm::link::ethercat::wire::Wire;

use crate::namespaces::{Cable, End, INTERFACE, Running, skip};

/// Far longer than the dissector takes.
const LONG: Duration = Duration::from_secs(60);
/// What a frame must not be: not as its protocol says, or read with an error. Severities are numbers
/// in a filter; this one is "error".
const FAULTY: &str =
    "_ws.malformed || ((ecat || ecatf || ecat_mailbox) && _ws.expert.severity == 8388608)";

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
        let (frames, faulty) = self.judge();
        assert!(frames >= expected, "{frames} frames recorded, not {expected}");
        assert_eq!(faulty, "", "frames that tshark finds fault with");
        println!("tshark: {frames} EtherCAT frames, none malformed");
    }

    /// Waits until nothing more is written: frames reach the file some time after the cable.
    fn settle(&self) {
        let mut length = None;
        for _ in 0..40 {
            let before = length;
            thread::sleep(Duration::from_millis(500));
            length = std::fs::metadata(&self.file).ok().map(|file| file.len());
            if length == before {
                return;
            }
        }
    }

    /// Ends the recording: the number of EtherCAT frames, and those that are not well-formed.
    fn judge(self) -> (usize, String) {
        self.settle();
        let (_, said) = self.recorder.interrupt(LONG);
        assert!(said.contains("Packets received/dropped"), "{said}");
        let frames = read(&self.file, "ecatf").lines().count();
        let faulty = read(&self.file, FAULTY);
        let _ = std::fs::remove_file(&self.file);
        (frames, faulty)
    }
}

#[test]
fn a_malformed_frame_is_found() {
    let Some(cable) = Cable::plug() else { return };
    let Some(capture) = Capture::start(&cable, "malformed") else { return };
    let mut socket = cable.inside(End::Main, LONG, || RawSocket::open(INTERFACE)).expect("opens");
    let mut frame = [0; 60];
    frame[..12].fill(0xFF);
    // BRD of one byte, then one that says it is longer than the frame.
    frame[12..27].copy_from_slice(&[0x88, 0xA4, 13, 0x10, 7, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0]);
    socket.send(&frame).expect("sent");
    frame[22] = 0xFF;
    socket.send(&frame).expect("sent");
    let (frames, faulty) = capture.judge();
    assert_eq!((frames, faulty.lines().count()), (2, 1), "{faulty}");
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
