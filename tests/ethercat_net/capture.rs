//! What passes on the cable, as a dissector reads it.

use std::time::Duration;

use fieldarm::link::ethercat::raw_socket::RawSocket;
use fieldarm::link::ethercat::wire::Wire;

use crate::namespaces::{Cable, End, INTERFACE, skip};
use crate::recording::{self, Recording};

/// Far longer than a socket takes to open.
const LONG: Duration = Duration::from_secs(60);
/// What a frame must not be: not as its protocol says, or read with an error. Severities are numbers
/// in a filter; this one is "error".
const FAULTY: &str =
    "_ws.malformed || ((ecat || ecatf || ecat_mailbox) && _ws.expert.severity == 8388608)";

/// A recording of everything on a cable.
pub(crate) struct Capture(Recording);

impl Capture {
    /// Begins to record at the main device's end; `None` where there is no dissector, which the
    /// test has been told then.
    pub(crate) fn start(cable: &Cable, name: &str) -> Option<Self> {
        if !recording::is_there() {
            return skip("needs tshark (package tshark)");
        }
        let dumpcap = cable.command(End::Main, "dumpcap");
        Some(Self(Recording::start(dumpcap, INTERFACE, "ether proto 0x88a4", name)))
    }

    /// Ends the recording: at least `expected` EtherCAT frames passed and every one is well-formed.
    pub(crate) fn check(self, expected: usize) {
        let (frames, faulty) = self.judge();
        assert!(frames >= expected, "{frames} frames recorded, not {expected}");
        assert_eq!(faulty, "", "frames that tshark finds fault with");
        println!("tshark: {frames} EtherCAT frames, none malformed");
    }

    /// Ends the recording: the number of EtherCAT frames, and those that are not well-formed.
    fn judge(self) -> (usize, String) {
        let recorded = self.0.end();
        (recorded.count("ecatf"), recorded.told(FAULTY))
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
