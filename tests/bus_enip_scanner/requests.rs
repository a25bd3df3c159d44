//! Explicit requests of the caller on the target's session.

use fieldarm::bus::enip::scanner::{RequestError, ScannerEvent};
use fieldarm::time::Duration;
use fieldarm::wire::enip::message::Service;
use fieldarm::wire::enip::path::ObjectPath;
use fieldarm::wire::enip::status::{ExtendedStatus, GeneralStatus};

use crate::bench::{Bench, Deed, SESSION, context, hex, ms, packet, unconnected};

const ASSEMBLY: ObjectPath = ObjectPath { class: 4, instance: 100, attribute: Some(3) };

fn ask(bench: &mut Bench, data: &[u8]) -> Result<(), RequestError> {
    bench.scanner.request(bench.now, 0, Service::GET_ATTRIBUTE_SINGLE, ASSEMBLY, data)
}

fn answered(status: u8, extended: Option<u16>) -> ScannerEvent {
    ScannerEvent::Answered {
        target: 0,
        status: GeneralStatus(status),
        extended: extended.map(ExtendedStatus),
    }
}

#[test]
fn a_request_is_asked_and_answered_while_frames_go_on() {
    let mut bench = Bench::meca500();
    assert_eq!(ask(&mut bench, &[]), Err(RequestError::NoSession));
    bench.open(0);
    bench.events();
    bench.frames();
    assert_eq!(ask(&mut bench, &[1, 2]), Ok(()));
    assert_eq!(ask(&mut bench, &[]), Err(RequestError::Busy));
    let request = bench.sent();
    assert_eq!(request[40..], hex("0E 03 20 04 24 64 30 03 01 02"));
    assert_eq!(ask(&mut bench, &[]), Err(RequestError::Busy));
    assert!(bench.scanner.answer(0).is_empty());
    bench.answer(0, &request, &[0x8E, 0, 0, 0, 9, 8, 7]);
    assert_eq!(bench.events(), [answered(0, None)]);
    assert_eq!(bench.scanner.answer(0), [9, 8, 7]);
    // A refusal comes with its status and without data.
    assert_eq!(ask(&mut bench, &[]), Ok(()));
    let request = bench.sent();
    bench.answer(0, &request, &[0x8E, 0, 0x14, 1, 0x34, 0x12]);
    assert_eq!(bench.events(), [answered(0x14, Some(0x1234))]);
    assert!(bench.scanner.answer(0).is_empty());
    assert!(bench.status().is_open);
}

#[test]
fn data_that_do_not_fit_are_refused_with_the_room_there_is() {
    let mut bench = Bench::meca500();
    bench.open(0);
    let refusal = ask(&mut bench, &[0; 505]);
    assert_eq!(refusal, Err(RequestError::TooLong { room: 504 }));
    assert_eq!(ask(&mut bench, &[5; 504]), Ok(()));
    let request = bench.sent();
    assert_eq!(request.len(), 40 + 8 + 504);
    let mut message = vec![0x8E, 0, 0, 0];
    message.extend([6; 504]);
    bench.answer(0, &request, &message);
    assert_eq!(bench.scanner.answer(0), [6; 504]);
    let nobody = bench.scanner.request(bench.now, 1, Service::RESET, ASSEMBLY, &[]);
    assert_eq!(nobody, Err(RequestError::NoSuchTarget));
}

#[test]
fn an_answer_that_never_comes_is_told_and_a_late_one_is_nobodys() {
    let mut bench = Bench::meca500();
    let id = bench.open(0);
    ask(&mut bench, &[]).expect("there is a session");
    let request = bench.sent();
    bench.events();
    bench.receive(&crate::bench::frame(id, 1, 1, &[0; 252]));
    for step in 0..20 {
        bench.pass(ms(100));
        bench.receive(&crate::bench::frame(id, 2 + step, 2, &[0; 252]));
    }
    let events = bench.events();
    assert!(events.contains(&answered(1, Some(0x0204))), "{events:?}");
    // The stream is kept: what comes late is told from what is waited for by its context.
    ask(&mut bench, &[]).expect("the session is there");
    let next = bench.sent();
    bench.answer(0, &request, &[0x8E, 0, 0, 0, 1]);
    assert_eq!(bench.events(), []);
    bench.answer(0, &next, &[0x8E, 0, 0, 0, 2]);
    assert_eq!(bench.events(), [answered(0, None)]);
    assert_eq!(bench.scanner.answer(0), [2]);
}

#[test]
fn a_request_ends_with_the_stream() {
    let mut bench = Bench::meca500();
    bench.open(0);
    bench.events();
    ask(&mut bench, &[]).expect("there is a session");
    bench.sent();
    bench.scanner.handle_disconnected(bench.now, 0);
    let lost = ScannerEvent::StreamLost { target: 0 };
    assert_eq!(bench.events(), [answered(1, Some(0x0204)), lost]);
    assert_eq!(ask(&mut bench, &[]), Err(RequestError::NoSession));
}

#[test]
fn requests_go_on_while_the_connection_is_refused() {
    let mut bench = Bench::meca500();
    let open = bench.up_to_open(0);
    bench.refuse(0, &open, &[0x0114]);
    bench.events();
    ask(&mut bench, &[]).expect("there is a session");
    let request = bench.sent();
    let data = unconnected(&[0x8E, 0, 0, 0, 1], &[]);
    // Not with another session handle.
    bench.stream(0, &packet(0x6F, [1; 4], 0, context(&request), &data));
    assert_eq!(bench.events(), []);
    bench.stream(0, &packet(0x6F, SESSION, 0, context(&request), &data));
    assert_eq!(bench.events(), [answered(0, None)]);
    assert_eq!(bench.pass(Duration::from_secs(5)), Vec::<(_, Deed)>::new());
}
