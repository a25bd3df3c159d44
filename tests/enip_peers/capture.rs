//! What passes on the loopback, as a dissector reads it.

use std::net::{Ipv4Addr, UdpSocket};
use std::process::Command;
use std::thread;
use std::time::Duration;

use crate::namespaces::skip;
use crate::recording::{self, Recorded, Recording};

/// What a frame must not be: not as its protocol says, or read with an error. Severities are numbers
/// in a filter; this one is "error". What ICMP quotes of a datagram that nobody took is cut off.
const FAULTY: &str = "!icmp && \
    (_ws.malformed || ((enip || cip || cipcm || cipio || cipm) && _ws.expert.severity == 8388608))";

/// A recording of everything from and to one address.
pub(crate) struct Capture {
    recording: Recording,
    address: Ipv4Addr,
}

impl Capture {
    /// Begins to record; `None` where that cannot be done, which the test has been told then.
    pub(crate) fn start(address: Ipv4Addr, name: &str) -> Option<Self> {
        if !rustix::process::geteuid().is_root() {
            return skip("the dissector's part needs root (to record the loopback)");
        }
        if !recording::is_there() {
            return skip("the dissector's part needs tshark (package tshark)");
        }
        let dumpcap = Command::new("dumpcap");
        let recording = Recording::start(dumpcap, "lo", &format!("host {address}"), name);
        let capture = Self { recording, address };
        capture.await_recording();
        Some(capture)
    }

    /// A recorder that says it records may not do so yet: knocks until something was written.
    fn await_recording(&self) {
        let knocker = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).expect("an ephemeral port");
        let empty = self.recording.length().unwrap_or(0);
        for _ in 0..200 {
            // Port 9 is that of the discard protocol: nobody minds.
            let _ = knocker.send_to(b"?", (self.address, 9));
            thread::sleep(Duration::from_millis(50));
            if self.recording.length().is_some_and(|length| length > empty) {
                return;
            }
        }
        panic!("nothing is recorded");
    }

    /// Ends the recording, once nothing more is written.
    pub(crate) fn end(self) -> Recorded {
        self.recording.end()
    }
}

/// At least `expected` class 1 frames passed, and nothing that was said is malformed.
pub(crate) fn check(recorded: &Recorded, expected: usize) {
    let frames = recorded.count("cipio");
    assert!(frames >= expected, "{frames} class 1 frames recorded, not {expected}");
    assert_eq!(recorded.told(FAULTY), "", "frames that tshark finds fault with");
    println!("tshark: {frames} class 1 frames, nothing malformed");
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
    assert_eq!(recorded.count("enip && !icmp"), 2);
    assert_eq!(recorded.count(FAULTY), 1);
}
