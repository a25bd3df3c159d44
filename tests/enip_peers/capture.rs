//! What passes on the loopback, as a dissector that nobody here wrote reads it.

use std::net::{Ipv4Addr, UdpSocket};
use std::path::PathBuf;
use std::process::Command;
use std::thread;
use std::time::Duration;

use crate::namespaces::{Running, skip};

/// Far longer than the dissector takes.
const LONG: Duration = Duration::from_secs(120);
/// What a frame must not be: not as its protocol says, or read with an error. Severities are numbers
/// in a filter; this one is "error". What ICMP quotes of a datagram that nobody took is cut off.
const FAULTY: &str = "!icmp && \
    (_ws.malformed || ((enip || cip || cipcm || cipio || cipm) && _ws.expert.severity == 8388608))";

/// A recording of everything from and to one address.
pub(crate) struct Capture {
    recorder: Running,
    file: PathBuf,
    address: Ipv4Addr,
}

/// What was recorded.
pub(crate) struct Recorded {
    file: PathBuf,
}

impl Capture {
    /// Begins to record; `None` where that cannot be done, which the test has been told then.
    pub(crate) fn start(address: Ipv4Addr, name: &str) -> Option<Self> {
        if !rustix::process::geteuid().is_root() {
            return skip("the dissector's part needs root (to record the loopback)");
        }
        if Command::new("tshark").arg("-v").output().is_err() {
            return skip("the dissector's part needs tshark (package tshark)");
        }
        let file = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
        let file = file.join(format!("{name}-{}.pcapng", std::process::id()));
        let mut command = Command::new("dumpcap");
        command.args(["-i", "lo", "-f", &format!("host {address}"), "-B", "64", "-w"]).arg(&file);
        let mut recorder = Running::start(&mut command);
        recorder.wait_for("File:", LONG);
        let capture = Self { recorder, file, address };
        capture.await_recording();
        Some(capture)
    }

    /// A recorder that says it records may not do so yet: knocks until something was written.
    fn await_recording(&self) {
        let knocker = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).expect("an ephemeral port");
        let empty = std::fs::metadata(&self.file).map_or(0, |file| file.len());
        for _ in 0..200 {
            // Port 9 is that of the discard protocol: nobody minds.
            let _ = knocker.send_to(b"?", (self.address, 9));
            thread::sleep(Duration::from_millis(50));
            if std::fs::metadata(&self.file).is_ok_and(|file| file.len() > empty) {
                return;
            }
        }
        panic!("nothing is recorded");
    }

    /// Ends the recording, once nothing more is written.
    pub(crate) fn end(self) -> Recorded {
        let mut length = None;
        for _ in 0..40 {
            let before = length;
            thread::sleep(Duration::from_millis(500));
            length = std::fs::metadata(&self.file).ok().map(|file| file.len());
            if length == before {
                break;
            }
        }
        let (_, said) = self.recorder.interrupt(LONG);
        assert!(said.contains("Packets received/dropped"), "{said}");
        Recorded { file: self.file }
    }
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

    /// At least `expected` class 1 frames passed, and nothing that was said is malformed.
    pub(crate) fn check(&self, expected: usize) {
        let frames = self.read("cipio", &["frame.number"]).lines().count();
        assert!(frames >= expected, "{frames} class 1 frames recorded, not {expected}");
        let faulty = self.read(FAULTY, &["frame.number", "_ws.col.Info", "_ws.expert.message"]);
        assert_eq!(faulty, "", "frames that tshark finds fault with");
        println!("tshark: {frames} class 1 frames, nothing malformed");
    }
}

impl Drop for Recorded {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.file);
    }
}

#[test]
fn a_malformed_frame_is_found() {
    let address = crate::loopback::address();
    let Some(capture) = Capture::start(address, "enip-malformed") else { return };
    let socket = UdpSocket::bind((address, 0)).expect("an ephemeral port");
    // ListIdentity, whole and then with more data promised than there are.
    let mut frame = [0; 24];
    frame[0] = 0x63;
    socket.send_to(&frame, (address, 44_818)).expect("sent");
    frame[0] = 0x6F;
    frame[2] = 12;
    socket.send_to(&frame, (address, 44_818)).expect("sent");
    let recorded = capture.end();
    assert_eq!(recorded.read("enip && !icmp", &["frame.number"]).lines().count(), 2);
    assert_eq!(recorded.read(FAULTY, &["frame.number"]).lines().count(), 1);
}
