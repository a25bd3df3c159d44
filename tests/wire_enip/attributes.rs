//! Reading and writing attributes with unconnected messages.

use fieldarm::wire::enip::message::{Request, Response, Service};
use fieldarm::wire::enip::path::ObjectPath;
use fieldarm::wire::enip::status::GeneralStatus;

use super::explicit::{Body, Explicit, SendRrData, header};
use super::harness::check;

fn explicit(length: u16, body: Body<'_>) -> Explicit<'_> {
    Explicit {
        header: header(length, 0x0001_0203, &[0; 8]),
        timeout_s: 0,
        o2t_address: None,
        t2o_address: None,
        body,
    }
}

fn ask(request: Request<'_>, object: ObjectPath) -> Body<'_> {
    let mut room = [0; 32];
    let len = object.write(&mut room).unwrap();
    assert_eq!(&room[..len], request.path, "the path is written as it was typed");
    Body::Ask { request, object }
}

/// The vendor number: identity, instance 1, attribute 1.
#[test]
fn get_attribute() {
    let request = Request {
        service: Service::GET_ATTRIBUTE_SINGLE,
        path: &[0x20, 0x01, 0x24, 0x01, 0x30, 0x01],
        data: &[],
    };
    let object = ObjectPath { class: 1, instance: 1, attribute: Some(1) };
    check::<SendRrData>(
        "6F 00  18 00  03 02 01 00  00 00 00 00  00 00 00 00 00 00 00 00  00 00 00 00
         00 00 00 00  00 00  02 00  00 00 00 00  B2 00  08 00
         0E!  03  20 01 24 01 30 01",
        &explicit(0x18, ask(request, object)),
    );
}

#[test]
fn attribute_got() {
    let response = Response::success(Service::GET_ATTRIBUTE_SINGLE, &[0x1D, 0x06]);
    check::<SendRrData>(
        "6F 00  16 00  03 02 01 00  00 00 00 00  00 00 00 00 00 00 00 00  00 00 00 00
         00 00 00 00  00 00  02 00  00 00 00 00  B2 00  06 00
         8E 00~ 00 00  1D 06",
        &explicit(0x16, Body::Answer { response }),
    );
}

/// Everything of the identity at once; no attribute in the path.
#[test]
fn get_attributes_all() {
    let request = Request {
        service: Service::GET_ATTRIBUTES_ALL,
        path: &[0x20, 0x01, 0x24, 0x01],
        data: &[],
    };
    let object = ObjectPath { class: 1, instance: 1, attribute: None };
    check::<SendRrData>(
        "6F 00  16 00  03 02 01 00  00 00 00 00  00 00 00 00 00 00 00 00  00 00 00 00
         00 00 00 00  00 00  02 00  00 00 00 00  B2 00  06 00
         01!  02  20 01 24 01",
        &explicit(0x16, ask(request, object)),
    );
}

/// Data of an assembly whose number needs 16 bits: attribute 3, with the bytes to be written.
#[test]
fn set_attribute() {
    let request = Request {
        service: Service::SET_ATTRIBUTE_SINGLE,
        path: &[0x20, 0x04, 0x25, 0x00, 0x2C, 0x01, 0x30, 0x03],
        data: &[0xDE, 0xAD, 0xBE],
    };
    let object = ObjectPath { class: 4, instance: 300, attribute: Some(3) };
    check::<SendRrData>(
        "6F 00  1D 00  03 02 01 00  00 00 00 00  00 00 00 00 00 00 00 00  00 00 00 00
         00 00 00 00  00 00  02 00  00 00 00 00  B2 00  0D 00
         10!  04  20 04 25 00 2C 01 30 03
         DE AD BE           # three bytes: only paths are counted in words",
        &explicit(0x1D, ask(request, object)),
    );
}

#[test]
fn attribute_set() {
    let response = Response::success(Service::SET_ATTRIBUTE_SINGLE, &[]);
    check::<SendRrData>(
        "6F 00  14 00  03 02 01 00  00 00 00 00  00 00 00 00 00 00 00 00  00 00 00 00
         00 00 00 00  00 00  02 00  00 00 00 00  B2 00  04 00
         90 00~ 00 00",
        &explicit(0x14, Body::Answer { response }),
    );
}

#[test]
fn attribute_not_settable() {
    let status = GeneralStatus::ATTRIBUTE_NOT_SETTABLE;
    let response = Response::refusal(Service::SET_ATTRIBUTE_SINGLE, status);
    check::<SendRrData>(
        "6F 00  14 00  03 02 01 00  00 00 00 00  00 00 00 00 00 00 00 00  00 00 00 00
         00 00 00 00  00 00  02 00  00 00 00 00  B2 00  04 00
         90 00~ 0E 00",
        &explicit(0x14, Body::Answer { response }),
    );
}
