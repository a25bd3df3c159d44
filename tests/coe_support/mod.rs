//! A firmware to talk to, datagram by datagram, in hexadecimal.

#![allow(dead_code)] // each test uses its part

use fieldarm::bus::ethercat::application::Application;
use fieldarm::bus::ethercat::meca500::{Meca500Application, Meca500Settings};
use fieldarm::cycle::CyclicDevice;
use fieldarm::time::Instant;
use fieldarm::wire::ethercat::al::AlState;

/// Length of the robot's mailboxes in bytes.
pub(crate) const MAILBOX: usize = 128;

/// A device that writes fixed inputs and keeps the outputs it was given.
#[derive(Debug)]
pub(crate) struct Still {
    pub(crate) inputs: [u8; 252],
    pub(crate) outputs: Option<Vec<u8>>,
    pub(crate) on_bus: bool,
}

impl CyclicDevice for Still {
    const OUTPUT_LEN: usize = 60;
    const INPUT_LEN: usize = 252;

    fn cycle(&mut self, _: Instant, outputs: Option<&[u8]>, inputs: &mut [u8]) {
        self.outputs = outputs.map(<[u8]>::to_vec);
        inputs.copy_from_slice(&self.inputs);
    }

    fn is_on_bus(&self) -> bool {
        self.on_bus
    }
}

pub(crate) type Firmware = Meca500Application<Still>;

/// A robot whose input byte `n` holds `n`.
pub(crate) fn firmware(settings: Meca500Settings) -> Firmware {
    let mut inputs = [0; 252];
    for (byte, n) in inputs.iter_mut().zip(0..) {
        *byte = n;
    }
    let mut firmware =
        Meca500Application::new(Still { inputs, outputs: None, on_bus: true }, settings);
    let mut assigned = vec![0; firmware.input_len()];
    firmware.cycle(Instant::ZERO, None, &mut assigned);
    firmware
}

pub(crate) fn bytes(hex: &str) -> Vec<u8> {
    let digits: Vec<char> = hex.chars().filter(|c| !c.is_whitespace()).collect();
    assert!(digits.len().is_multiple_of(2), "an odd number of digits: {hex}");
    digits
        .chunks(2)
        .map(|pair| u8::from_str_radix(&pair.iter().collect::<String>(), 16).unwrap())
        .collect()
}

pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" ")
}

/// Sends `datagram` (filled up to the mailbox's length) and returns the answer.
pub(crate) fn ask_bytes(
    firmware: &mut impl Application,
    state: AlState,
    datagram: &[u8],
) -> Option<Vec<u8>> {
    let mut full = datagram.to_vec();
    full.resize(MAILBOX.max(full.len()), 0xEE);
    firmware.receive_mailbox(state, &full);
    fetch(firmware, MAILBOX)
}

/// The next datagram from the firmware.
pub(crate) fn fetch(firmware: &mut impl Application, room: usize) -> Option<Vec<u8>> {
    let mut room = vec![0xAA; room];
    let len = firmware.next_mailbox(&mut room)?;
    room.truncate(len);
    Some(room)
}

/// Wraps service data of CoE into a datagram without a counter.
pub(crate) fn coe(data: &[u8]) -> Vec<u8> {
    let mut datagram = u16::try_from(data.len()).unwrap().to_le_bytes().to_vec();
    datagram.extend([0, 0, 0, 3]);
    datagram.extend(data);
    datagram
}

/// Sends CoE service data in PRE-OP; returns the answer's, its mailbox header checked and cut off.
pub(crate) fn ask(firmware: &mut impl Application, data: &str) -> String {
    ask_in(firmware, AlState::PreOp, data)
}

pub(crate) fn ask_in(firmware: &mut impl Application, state: AlState, data: &str) -> String {
    let answer = ask_bytes(firmware, state, &coe(&bytes(data))).expect("an answer");
    hex(service_data(&answer))
}

/// The service data of a CoE datagram from the firmware.
pub(crate) fn service_data(answer: &[u8]) -> &[u8] {
    let (header, data) = answer.split_at(6);
    assert_eq!(usize::from(u16::from_le_bytes([header[0], header[1]])), data.len());
    assert_eq!(header[2..5], [0, 0, 0], "address, channel, priority");
    assert_eq!(header[5] & 0x8F, 3, "CoE");
    assert_ne!(header[5] >> 4, 0, "the subdevice counts");
    data
}

/// Asserts one answer after another: request, answer.
pub(crate) fn dialogue(firmware: &mut impl Application, steps: &[(&str, &str)]) {
    for (step, (request, answer)) in steps.iter().enumerate() {
        assert_eq!(ask(firmware, request), *answer, "step {step}: {request}");
    }
}
