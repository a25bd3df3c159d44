//! Several devices on one wire, and frames that are not what they should be.

mod ethercat_support;

use ethercat_support::{Bench, Mock, SOURCE};
use fieldarm::bus::ethercat::{Passage, Settings, SubDevice, pass};
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::ethercat::command::{Command, position_of};
use fieldarm::wire::ethercat::frame::{
    DatagramsMut, FrameBuilder, FrameError, FrameFull, datagrams,
};
use proptest::prelude::*;

/// A frame of these datagrams.
fn frame(questions: &[(Command, &[u8])]) -> Vec<u8> {
    let mut buffer = [0; 1514];
    let mut builder = FrameBuilder::new(&mut buffer, SOURCE).unwrap();
    for (index, (command, data)) in (0..).zip(questions) {
        builder.push(*command, index, data).unwrap();
    }
    let length = builder.finish();
    buffer[..length].to_vec()
}

fn read_at(bench: &mut Bench, index: u16, register: u16, length: usize) -> (Vec<u8>, u16) {
    bench.ask(Command::Aprd { position: position_of(index), register }, &vec![0; length])
}

#[test]
fn a_device_that_leaves_takes_those_behind_it_along() {
    let mut bench = Bench::new(4, Settings::default());
    let count =
        |bench: &mut Bench| bench.ask(Command::Brd { counter: 0, register: 0x0000 }, &[0]).1;
    assert_eq!(count(&mut bench), 4);
    bench.line[2].application_mut().on_bus = false;
    assert_eq!(count(&mut bench), 2);
    bench.line[2].application_mut().on_bus = true;
    assert_eq!(count(&mut bench), 4);
    bench.line[0].application_mut().on_bus = false;
    let mut lost = frame(&[(Command::Brd { counter: 0, register: 0 }, &[0])]);
    assert_eq!(pass(bench.now, &mut lost, &mut bench.line), Passage::Lost);
    assert_eq!(pass(bench.now, &mut lost, &mut [] as &mut [SubDevice<Mock>]), Passage::Lost);
}

#[test]
fn dl_status_shows_the_place_in_the_line() {
    let mut bench = Bench::new(3, Settings::default());
    let status = |bench: &mut Bench, index| {
        let (data, counter) = read_at(bench, index, 0x0110, 2);
        assert_eq!(counter, 1);
        u16::from_le_bytes([data[0], data[1]])
    };
    // Ports 0 and 1 open; and for the last only port 0.
    let (middle, last) = (0x5A33, 0x5613);
    assert_eq!([0, 1, 2].map(|index| status(&mut bench, index)), [middle, middle, last]);
    bench.line[2].application_mut().on_bus = false;
    assert_eq!([0, 1].map(|index| status(&mut bench, index)), [middle, last]);
    assert_eq!(read_at(&mut bench, 1, 0x0310, 4).0, [0, 1, 0, 0]);
    let station = Command::Apwr { position: position_of(1), register: 0x0310 };
    assert_eq!(bench.ask(station, &[0xFF]).1, 1);
    assert_eq!(read_at(&mut bench, 1, 0x0310, 4).0, [0; 4]);
}

#[test]
fn a_main_device_can_close_and_hold_open_port_1() {
    let mut bench = Bench::new(2, Settings::default());
    bench.write(0x0101, &[0x0C]);
    assert_eq!(bench.ask(Command::Brd { counter: 0, register: 0 }, &[0]).1, 1);
    assert_eq!(bench.read_u16(0x0110), 0x5633, "a link, but a closed loop");
    bench.write(0x0101, &[0x08]);
    assert_eq!(bench.ask(Command::Brd { counter: 0, register: 0 }, &[0]).1, 2);
    bench.line[1].application_mut().on_bus = false;
    let mut lost = frame(&[(Command::Brd { counter: 0, register: 0 }, &[0])]);
    assert_eq!(pass(bench.now, &mut lost, &mut bench.line), Passage::Lost);
}

#[test]
fn other_protocols_are_destroyed_or_passed_as_dl_control_says() {
    let mut bench = Bench::new(2, Settings::default());
    let mut other = [0x11; 64];
    other[12..14].copy_from_slice(&[0x08, 0x00]);
    let sent = other;
    assert_eq!(pass(bench.now, &mut other, &mut bench.line), Passage::Lost);
    bench.ask(Command::Bwr { counter: 0, register: 0x0100 }, &[0]);
    assert_eq!(pass(bench.now, &mut other, &mut bench.line), Passage::Returned);
    assert_eq!(other, sent);
    // Nor are EtherCAT frames marked then.
    let mut ours = frame(&[(Command::Brd { counter: 0, register: 0 }, &[0])]);
    assert_eq!(pass(bench.now, &mut ours, &mut bench.line), Passage::Returned);
    assert_eq!(ours[6..12], SOURCE);
}

#[test]
fn ethercat_without_datagrams_passes() {
    let mut bench = Bench::single();
    let mut frame = frame(&[(Command::Brd { counter: 0, register: 0 }, &[0])]);
    frame[15] = 0x50;
    let mut expected = frame.clone();
    expected[6] |= 2;
    assert_eq!(pass(bench.now, &mut frame, &mut bench.line), Passage::Returned);
    assert_eq!(frame, expected);
}

/// Frames of every shape that the tests cut and twist.
fn fixtures() -> Vec<Vec<u8>> {
    let write = Command::Bwr { counter: 0, register: 0x0F80 };
    let mut padded = frame(&[(write, &[1, 2])]);
    padded.resize(60, 0);
    vec![
        frame(&[(write, &[1, 2, 3, 4])]),
        frame(&[(write, &[]), (write, &[9; 20]), (Command::Lrw { address: 0 }, &[7; 312])]),
        padded,
    ]
}

#[test]
fn every_truncation_is_found_counted_and_changes_nothing() {
    for (number, whole) in fixtures().into_iter().enumerate() {
        let needed = whole.len() - if number == 2 { 60 - 30 } else { 0 };
        for length in 0..needed {
            let mut bench = Bench::new(2, Settings::default());
            let mut cut = whole[..length].to_vec();
            assert_eq!(pass(bench.now, &mut cut, &mut bench.line), Passage::Lost, "{length}");
            assert_eq!(cut, whole[..length], "{length}");
            for device in &bench.line {
                assert_eq!(device.register(0x0F80), 0, "{length}");
            }
            let counted = if length < 14 { (0x0300, 0x030C) } else { (0x030C, 0x0300) };
            assert_eq!(read_at(&mut bench, 0, counted.0, 1).0, [1], "{length}");
            assert_eq!(read_at(&mut bench, 0, counted.1, 1).0, [0], "{length}");
            assert_eq!(read_at(&mut bench, 1, 0x0308, 1).0, [1], "{length}");
            bench.write(counted.0, &[0]);
            assert_eq!(read_at(&mut bench, 0, counted.0, 1).0, [0], "cleared");
        }
        for length in needed..=whole.len() {
            let mut bench = Bench::new(2, Settings::default());
            let mut cut = whole[..length].to_vec();
            assert_eq!(pass(bench.now, &mut cut, &mut bench.line), Passage::Returned, "{length}");
        }
    }
}

#[test]
fn a_more_flag_at_the_end_points_past_the_frame() {
    let mut bench = Bench::single();
    let mut wrong = frame(&[(Command::Bwr { counter: 0, register: 0x0F80 }, &[1, 2])]);
    wrong[23] |= 0x80;
    assert_eq!(
        datagrams(&wrong).unwrap_err(),
        FrameError::Truncated { number: 1, offset: 30, needed: 10, found: 0 }
    );
    assert_eq!(pass(bench.now, &mut wrong, &mut bench.line), Passage::Lost);
    assert_eq!(bench.line[0].register(0x0F80), 0);
}

#[test]
fn error_counters_stop_at_255() {
    let mut bench = Bench::single();
    for _ in 0..300 {
        assert_eq!(pass(bench.now, &mut [0; 3], &mut bench.line), Passage::Lost);
    }
    assert_eq!(bench.read(0x0300, 1).0, [255]);
}

#[test]
fn a_builder_says_what_does_not_fit() {
    let mut small = [0; 40];
    assert_eq!(
        FrameBuilder::new(&mut small[..15], SOURCE).unwrap_err(),
        FrameFull { needed: 16, room: 15 }
    );
    let mut builder = FrameBuilder::new(&mut small, SOURCE).unwrap();
    assert_eq!(builder.push(Command::Nop, 0, &[0; 13]), Err(FrameFull { needed: 25, room: 24 }));
    builder.push(Command::Nop, 0, &[0; 12]).unwrap();
    assert!(builder.push(Command::Nop, 0, &[]).is_err());
    assert_eq!(builder.finish(), 40);
    let mut large = vec![0; 5_000];
    let mut builder = FrameBuilder::new(&mut large, SOURCE).unwrap();
    builder.push_zeros(Command::Nop, 0, 2_047 - 12).unwrap();
    assert!(builder.push_zeros(Command::Nop, 0, 0).is_err(), "the header has 11 bits");
}

fn commands() -> impl Strategy<Value = Command> {
    (0_u8..15, any::<[u8; 4]>()).prop_map(|(code, address)| {
        Command::from_wire(code, if code == 0 { [0; 4] } else { address }).unwrap()
    })
}

proptest! {
    #[test]
    fn what_is_built_is_read(
        parts in prop::collection::vec(
            (commands(), any::<u8>(), prop::collection::vec(any::<u8>(), 0..60)),
            1..12,
        )
    ) {
        let mut buffer = [0; 1514];
        let mut builder = FrameBuilder::new(&mut buffer, SOURCE).unwrap();
        for (command, index, data) in &parts {
            builder.push(*command, *index, data).unwrap();
        }
        let length = builder.finish();
        let found: Vec<_> = datagrams(&buffer[..length])
            .unwrap()
            .map(|it| (it.command().unwrap(), it.index, it.data.to_vec()))
            .collect();
        prop_assert_eq!(&found, &parts);
        prop_assert_eq!(DatagramsMut::new(&mut buffer[..length]).count(), parts.len());
    }

    #[test]
    fn random_bytes_do_no_harm(
        mut bytes in prop::collection::vec(any::<u8>(), 0..200),
        ethercat in any::<bool>(),
    ) {
        if let (true, Some(kind)) = (ethercat, bytes.get_mut(12..16)) {
            kind.copy_from_slice(&[0x88, 0xA4, 0, 0x10]);
        }
        let mut bench = Bench::new(2, Settings::default());
        let _ = pass(bench.now, &mut bytes, &mut bench.line);
    }

    /// Whatever is written to all registers, in whatever order and at whatever time, the devices
    /// keep answering.
    #[test]
    fn random_commands_do_no_harm(
        steps in prop::collection::vec(
            (0_u8..15, any::<u16>(), prop_oneof![0_u16..0x1000, any::<u16>()],
             prop::collection::vec(any::<u8>(), 0..80), 0_u64..200_000_000),
            1..40,
        )
    ) {
        let mut bench = Bench::new(2, Settings::default());
        bench.bring_to_safe_op();
        for (code, device, register, data, nanos) in steps {
            let device = if device % 2 == 0 { 0 } else { device };
            let [[a, b], [c, d]] = [device.to_le_bytes(), register.to_le_bytes()];
            let command = Command::from_wire(code, [a, b, c, d]).unwrap();
            bench.now += Duration::from_nanos(nanos);
            let mut frame = frame(&[(command, &data)]);
            let _ = pass(bench.now, &mut frame, &mut bench.line);
        }
        bench.now += Duration::from_secs(1);
        let end = bench.now + Duration::from_secs(u64::from(u32::MAX));
        let _ = pass(end, &mut frame(&[(Command::Brd { counter: 0, register: 0 }, &[0])]),
            &mut bench.line);
        let _ = pass(Instant::ZERO, &mut frame(&[(Command::Nop, &[])]), &mut bench.line);
    }
}
