//! Forward Close, and what a target answers.

use fieldarm::wire::enip::connection::*;
use fieldarm::wire::enip::message::Service;
use fieldarm::wire::enip::path::ConnectionPath;
use fieldarm::wire::enip::status::GeneralStatus;

use super::explicit::{Body, Explicit, SendRrData, header};
use super::harness::check;

const TRIAD: Triad =
    Triad { connection_serial: 0xABCD, vendor: 0x061D, originator_serial: 0x0000_2A2A };

fn explicit(length: u16, body: Body<'_>) -> Explicit<'_> {
    Explicit {
        header: header(length, 7, b"goodbye!"),
        timeout_s: 5,
        o2t_address: None,
        t2o_address: None,
        body,
    }
}

/// Unlike in a Forward Open, a reserved byte stands between the size of the path and the path.
#[test]
fn close() {
    let object = [0x20, 0x06, 0x24, 0x01];
    let bytes = [0x20, 0x04, 0x24, 0x97, 0x2C, 0x96, 0x2C, 0x64];
    let close =
        ForwardClose { priority_tick: 0x0A, timeout_ticks: 0x0E, triad: TRIAD, path: &bytes };
    let path = ConnectionPath {
        config: Some(151),
        o2t: Some(150),
        t2o: Some(100),
        ..ConnectionPath::default()
    };
    check::<SendRrData>(
        "6F 00  2A 00  07 00 00 00  00 00 00 00  67 6F 6F 64 62 79 65 21  00 00 00 00
         00 00 00 00
         05 00              # timeout 5 s
         02 00  00 00 00 00  B2 00  1A 00
         4E!                # Forward Close
         02  20 06 24 01
         0A 0E
         CD AB  1D 06  2A 2A 00 00  # triad
         04                 # 4 words of path
         00~                # reserved
         20 04  24 97  2C 96  2C 64",
        &explicit(0x2A, Body::Close { object: &object, close, path }),
    );
}

#[test]
fn closed() {
    let reply = ForwardCloseReply { triad: TRIAD, application: &[] };
    check::<SendRrData>(
        "6F 00  1E 00  07 00 00 00  00 00 00 00  67 6F 6F 64 62 79 65 21  00 00 00 00
         00 00 00 00  05 00  02 00  00 00 00 00  B2 00  0E 00
         CE 00~  00 00
         CD AB  1D 06  2A 2A 00 00
         00 00~             # no words of the application, reserved",
        &explicit(0x1E, Body::Closed { reply }),
    );
}

#[test]
fn closed_with_words_of_the_application() {
    let reply = ForwardCloseReply { triad: TRIAD, application: &[1, 2, 3, 4] };
    check::<SendRrData>(
        "6F 00  22 00  07 00 00 00  00 00 00 00  67 6F 6F 64 62 79 65 21  00 00 00 00
         00 00 00 00  05 00  02 00  00 00 00 00  B2 00  12 00
         CE 00~  00 00
         CD AB  1D 06  2A 2A 00 00
         02 00~  01 02 03 04",
        &explicit(0x22, Body::Closed { reply }),
    );
}

/// Nothing to close: it timed out before, or a restart forgot it.
#[test]
fn not_found() {
    let body = Body::Refused {
        service: Service::FORWARD_CLOSE,
        status: GeneralStatus::CONNECTION_FAILURE,
        words: &[0x07, 0x01],
        refusal: ConnectionRefusal { triad: TRIAD, remaining_path_words: 0 },
    };
    check::<SendRrData>(
        "6F 00  20 00  07 00 00 00  00 00 00 00  67 6F 6F 64 62 79 65 21  00 00 00 00
         00 00 00 00  05 00  02 00  00 00 00 00  B2 00  10 00
         CE 00~  01  01  07 01  # connection failure: target connection not found
         CD AB  1D 06  2A 2A 00 00  00  00~",
        &explicit(0x20, body),
    );
}
