//! The state machine: every request in every state, what each step needs, and how states are lost.

mod ethercat_support;

use ethercat_support::{Bench, OUTPUTS};
use fieldarm::bus::ethercat::{Passage, Settings, pass, tick};
use fieldarm::time::Duration;
use fieldarm::wire::ethercat::al::{AlState, AlStatusCode};

/// A bench with one device in this state; the process data watchdog is off.
fn in_state(state: u16) -> Bench {
    let mut bench = Bench::single();
    bench.write_u16(0x0420, 0);
    match state {
        1 => {}
        2 => bench.bring_to_pre_op(),
        4 => bench.bring_to_safe_op(),
        8 => bench.bring_to_op(),
        _ => panic!("no such state"),
    }
    bench
}

#[test]
fn every_request_in_every_state() {
    // From, requested, AL status, AL status code. Everything is set up, so only the rules speak.
    const TABLE: &[(u16, u16, u16, u16)] = &[
        (1, 1, 0x01, 0),
        (1, 2, 0x02, 0),
        (1, 3, 0x11, 0x13),
        (1, 4, 0x11, 0x11),
        (1, 8, 0x11, 0x11),
        (2, 1, 0x01, 0),
        (2, 2, 0x02, 0),
        (2, 3, 0x12, 0x11),
        (2, 4, 0x04, 0),
        (2, 8, 0x12, 0x11),
        (4, 1, 0x01, 0),
        (4, 2, 0x02, 0),
        (4, 3, 0x14, 0x11),
        (4, 4, 0x04, 0),
        (4, 8, 0x08, 0),
        (8, 1, 0x01, 0),
        (8, 2, 0x02, 0),
        (8, 3, 0x18, 0x11),
        (8, 4, 0x04, 0),
        (8, 8, 0x08, 0),
    ];
    for &(from, to, status, code) in TABLE {
        let mut bench = in_state(from);
        for index in 0..4 {
            if bench.read(0x0806 + 8 * index, 1).0 == [0] {
                bench.set_sync_manager(index, true);
            }
        }
        bench.write(0x1100, &[0; OUTPUTS]);
        assert_eq!(bench.request(to), (status, code), "{from} to {to}");
    }
    for from in [1, 2, 4, 8] {
        for to in [0, 5, 6, 7, 9, 10, 11, 12, 13, 14, 15] {
            assert_eq!(in_state(from).request(to), (from | 0x10, 0x12), "{from} to {to}");
        }
    }
}

#[test]
fn an_error_must_be_acknowledged_except_on_the_way_to_init() {
    let mut bench = in_state(2);
    assert_eq!(bench.request(8), (0x12, 0x11));
    assert_eq!(bench.request(2), (0x12, 0x11), "not acknowledged");
    assert_eq!(bench.request(4), (0x12, 0x11), "not acknowledged");
    assert_eq!(bench.request(0x12), (0x02, 0));
    assert_eq!(bench.request(8), (0x12, 0x11));
    bench.set_sync_manager(2, true);
    bench.set_sync_manager(3, true);
    assert_eq!(bench.request(0x14), (0x04, 0), "acknowledged and on in one step");
    assert_eq!(bench.request(3), (0x14, 0x11));
    assert_eq!(bench.request(1), (0x01, 0));
    // An acknowledgement without an error is a plain request.
    assert_eq!(bench.request(0x11), (0x01, 0));
}

#[test]
fn pre_op_needs_both_mailboxes() {
    // Sync manager, start, length, control, activation.
    type Wrong = (u16, u16, u16, u8, bool);
    const WRONG: &[Wrong] = &[
        (0, 0x1000, 32, 0x26, false),
        (1, 0x1080, 32, 0x22, false),
        (0, 0x1000, 32, 0x24, true),
        (0, 0x1000, 32, 0x22, true),
        (1, 0x1080, 32, 0x26, true),
        (1, 0x1080, 32, 0x20, true),
        (0, 0x1000, 32, 0x2E, true),
        (0, 0x1000, 0, 0x26, true),
        (0, 0x1000, 15, 0x26, true),
        (1, 0x1080, 1487, 0x22, true),
        (1, 0x1010, 32, 0x22, true),
        (1, 0x0F80, 32, 0x22, true),
        (1, 0x1FF0, 32, 0x22, true),
    ];
    for &(index, start, length, control, enable) in WRONG {
        let mut bench = Bench::single();
        bench.set_sync_manager(1 - index, true);
        bench.write_sync_manager(index, start, length, control, enable);
        assert_eq!(bench.request(2), (0x11, 0x16), "{index} {start:04X} {length} {control:02X}");
        bench.set_sync_manager(index, true);
        assert_eq!(bench.request(0x12), (0x02, 0));
    }
}

#[test]
fn safe_op_needs_process_data_as_assigned() {
    type Wrong = (u16, u16, u16, u8, bool, u16);
    const WRONG: &[Wrong] = &[
        (2, 0x1100, 4, 0x64, false, 0x1D),
        (2, 0x1100, 3, 0x64, true, 0x1D),
        (2, 0x1100, 5, 0x64, true, 0x1D),
        (2, 0x1100, 4, 0x60, true, 0x1D),
        (2, 0x1100, 4, 0x66, true, 0x1D),
        (2, 0x1FF8, 4, 0x64, true, 0x1D),
        (3, 0x1400, 6, 0x20, false, 0x1E),
        (3, 0x1400, 7, 0x20, true, 0x1E),
        (3, 0x1400, 5, 0x20, true, 0x1E),
        (3, 0x1400, 6, 0x24, true, 0x1E),
        (3, 0x1400, 6, 0x22, true, 0x1E),
        (3, 0x1108, 6, 0x20, true, 0x17),
        (2, 0x1078, 4, 0x64, true, 0x17),
    ];
    for &(index, start, length, control, enable, code) in WRONG {
        let mut bench = in_state(2);
        bench.set_sync_manager(5 - index, true);
        bench.write_sync_manager(index, start, length, control, enable);
        assert_eq!(bench.request(4), (0x12, code), "{index} {start:04X} {length} {control:02X}");
        bench.set_sync_manager(index, true);
        assert_eq!(bench.request(0x14), (0x04, 0));
    }
}

#[test]
fn a_device_without_outputs_needs_none() {
    let mut bench = in_state(2);
    bench.line[0].application_mut().output_len = 0;
    bench.set_sync_manager(3, true);
    assert_eq!(bench.request(4), (0x04, 0));
    assert_eq!(bench.request(8), (0x08, 0));
    bench.millis(5);
    let cycles = &bench.line[0].application().cycles;
    assert!(
        cycles.len() >= 5
            && cycles.iter().all(|(_, outputs)| { outputs.as_ref().is_none_or(Vec::is_empty) })
    );
    // Nor may it have any.
    let mut bench = in_state(2);
    bench.line[0].application_mut().output_len = 0;
    bench.set_sync_manager(2, true);
    bench.set_sync_manager(3, true);
    assert_eq!(bench.request(4), (0x12, 0x1D));
}

#[test]
fn op_waits_for_the_first_outputs() {
    let mut bench = in_state(4);
    assert_eq!(bench.request(8), (0x04, 0));
    bench.millis(100);
    assert_eq!(bench.line[0].state(), AlState::SafeOp);
    assert_eq!(bench.write(0x1100, &[1, 2, 3, 4]), 1);
    assert_eq!(bench.read_u16(0x0130), 0x08);
    assert_eq!(
        bench.line[0].application().cycles.last().unwrap().1,
        Some(vec![1, 2, 3, 4]),
        "the outputs that it waited for are not lost"
    );
    // Back in SAFE-OP they are old.
    assert_eq!(bench.request(4), (0x04, 0));
    assert_eq!(bench.request(8), (0x04, 0));
}

#[test]
fn op_is_refused_when_no_outputs_come() {
    let mut bench = in_state(4);
    assert_eq!(bench.request(8), (0x04, 0));
    bench.millis(8_990);
    assert_eq!(bench.read_u16(0x0130), 0x04);
    bench.millis(20);
    assert_eq!((bench.read_u16(0x0130), bench.read_u16(0x0134)), (0x14, 0x1B));
    bench.write(0x1100, &[0; OUTPUTS]);
    assert_eq!(bench.read_u16(0x0130), 0x14, "the request is over");
    assert_eq!(bench.request(0x18), (0x08, 0));
}

#[test]
fn another_request_ends_the_waiting() {
    let mut bench = in_state(4);
    assert_eq!(bench.request(8), (0x04, 0));
    assert_eq!(bench.request(4), (0x04, 0));
    bench.write(0x1100, &[0; OUTPUTS]);
    assert_eq!(bench.read_u16(0x0130), 0x04);
}

#[test]
fn the_application_can_refuse() {
    let mut bench = in_state(2);
    bench.set_sync_manager(2, true);
    bench.set_sync_manager(3, true);
    bench.line[0].application_mut().refuse =
        Some((AlState::SafeOp, AlStatusCode::INVALID_PROCESS_DATA_MAPPING));
    assert_eq!(bench.request(4), (0x12, 0x25));
    assert_eq!(bench.line[0].error(), Some(AlStatusCode(0x0025)));
    bench.line[0].application_mut().refuse = None;
    assert_eq!(bench.request(0x14), (0x04, 0));
    assert_eq!(bench.line[0].error(), None);
}

#[test]
fn a_sync_manager_switched_off_takes_the_state_with_it() {
    let mut bench = in_state(8);
    bench.write(0x0816, &[0]);
    assert_eq!((bench.read_u16(0x0130), bench.read_u16(0x0134)), (0x12, 0x1D));
    let mut bench = in_state(8);
    bench.write(0x081E, &[0]);
    assert_eq!((bench.read_u16(0x0130), bench.read_u16(0x0134)), (0x12, 0x1E));
    let mut bench = in_state(8);
    let resets = bench.line[0].application().mailbox_resets;
    bench.write(0x0806, &[0]);
    assert_eq!((bench.read_u16(0x0130), bench.read_u16(0x0134)), (0x11, 0x16));
    assert_eq!(bench.line[0].application().mailbox_resets, resets + 1);
}

#[test]
fn outputs_that_stop_end_op() {
    let mut bench = Bench::single();
    bench.bring_to_op();
    assert_eq!(bench.read_u16(0x0440), 1);
    for _ in 0..20 {
        bench.millis(90);
        bench.write(0x1100, &[7; OUTPUTS]);
    }
    assert_eq!(bench.read_u16(0x0130), 0x08);
    bench.millis(99);
    assert_eq!(bench.read_u16(0x0130), 0x08);
    bench.millis(3);
    assert_eq!((bench.read_u16(0x0130), bench.read_u16(0x0134)), (0x14, 0x1B));
    assert_eq!((bench.read_u16(0x0440), bench.read(0x0442, 1).0[0]), (0, 1));
    assert_eq!(bench.line[0].application().cycles.last().unwrap().1, None);
    // Outputs alone do not bring OP back.
    bench.write(0x1100, &[7; OUTPUTS]);
    assert_eq!(bench.read_u16(0x0130), 0x14);
    assert_eq!(bench.request(8), (0x14, 0x1B));
    assert_eq!(bench.request(0x14), (0x04, 0));
    assert_eq!(bench.request(8), (0x08, 0));
    bench.write(0x0442, &[0]);
    assert_eq!(bench.read(0x0442, 1).0[0], 0);
}

#[test]
fn the_watchdog_follows_its_registers() {
    // (9998 + 2) * 40 ns = 400 us, times 10 = 4 ms.
    let mut bench = Bench::single();
    bench.bring_to_op();
    bench.write_u16(0x0400, 9_998);
    bench.write_u16(0x0420, 10);
    bench.write(0x1100, &[0; OUTPUTS]);
    bench.millis(3);
    assert_eq!(bench.line[0].state(), AlState::Op);
    bench.millis(2);
    assert_eq!(bench.line[0].state(), AlState::SafeOp);
    // Zero switches it off; the outputs are held.
    let mut bench = Bench::single();
    bench.bring_to_op();
    bench.write_u16(0x0420, 0);
    bench.write(0x1100, &[3; OUTPUTS]);
    bench.millis(10_000);
    assert_eq!(bench.line[0].state(), AlState::Op);
    assert_eq!(bench.line[0].application().cycles.last().unwrap().1, Some(vec![3; OUTPUTS]));
    // A sync manager that does not feed it is not watched.
    let mut bench = Bench::single();
    bench.bring_to_pre_op();
    bench.write_sync_manager(2, 0x1100, OUTPUTS as u16, 0x24, true);
    bench.set_sync_manager(3, true);
    assert_eq!(bench.request(4), (4, 0));
    bench.write(0x1100, &[0; OUTPUTS]);
    assert_eq!(bench.request(8), (8, 0));
    bench.millis(1_000);
    assert_eq!(bench.line[0].state(), AlState::Op);
}

#[test]
fn a_hanging_firmware_is_seen_by_the_esc() {
    let mut bench = in_state(8);
    assert_eq!(bench.read_u16(0x0110) & 0x0002, 0x0002);
    let cycles = bench.line[0].application().cycles.len();
    bench.line[0].set_firmware_hangs(true);
    bench.millis(99);
    assert_eq!(bench.read(0x0443, 1).0, [0]);
    bench.millis(2);
    assert_eq!(bench.read(0x0443, 1).0, [1]);
    assert_eq!(bench.read_u16(0x0110) & 0x0002, 0);
    bench.write(0x1100, &[1; OUTPUTS]);
    bench.write_u16(0x0120, 1);
    assert_eq!(bench.read_u16(0x0130), 8, "nobody acts on the request");
    let events = bench.read(0x0220, 4).0;
    assert_eq!((events[0] & 0x01, events[1] & 0x04), (0x01, 0x04), "but it is seen");
    assert_eq!(bench.line[0].application().cycles.len(), cycles);
    bench.line[0].set_firmware_hangs(false);
    bench.millis(1);
    bench.read(0x0000, 1);
    assert_eq!(bench.read_u16(0x0130), 1, "the request is taken up");
    assert_eq!(bench.read_u16(0x0110) & 0x0002, 0x0002);
}

#[test]
fn inputs_flow_in_safe_op_and_outputs_do_not() {
    let mut bench = in_state(4);
    let before = bench.read(0x1400, 6).0;
    bench.millis(3);
    bench.write(0x1100, &[9; OUTPUTS]);
    bench.millis(1);
    let after = bench.read(0x1400, 6).0;
    assert_ne!(before[0], after[0]);
    assert_eq!(after[1..], [0; 5]);
    assert!(bench.line[0].application().cycles.iter().all(|(_, outputs)| outputs.is_none()));
}

#[test]
fn in_op_the_cycle_follows_the_outputs() {
    let mut bench = in_state(8);
    bench.line[0].application_mut().cycles.clear();
    for value in 0..10 {
        bench.millis(1);
        bench.write(0x1100, &[value; OUTPUTS]);
        let written_at = bench.now;
        bench.read(0x1400, 6);
        let (at, outputs) = bench.line[0].application().cycles.last().unwrap().clone();
        assert_eq!((at, outputs), (written_at, Some(vec![value; OUTPUTS])));
    }
    assert_eq!(bench.line[0].application().cycles.len(), 10);
}

#[test]
fn a_power_cycle_forgets_all_but_the_sii() {
    let mut bench = in_state(8);
    bench.write_u16(0x0010, 0x1001);
    bench.write(0x0600, &[1; 16]);
    bench.line[0].application_mut().on_bus = false;
    let mut frame = [0; 60];
    assert_eq!(pass(bench.now, &mut frame, &mut bench.line), Passage::Lost);
    bench.millis(500);
    assert!(bench.line[0].application().cycles.last().unwrap().1.is_none());
    bench.line[0].application_mut().on_bus = true;
    assert_eq!((bench.read_u16(0x0130), bench.read_u16(0x0134)), (1, 0));
    assert_eq!((bench.read_u16(0x0010), bench.read_u16(0x0012)), (0, 0x0123));
    assert_eq!(bench.read(0x0600, 16).0, [0; 16]);
    assert_eq!(bench.read(0x0800, 8).0[6], 0);
    assert_eq!(bench.read_u16(0x0420), 0x03E8);
    bench.bring_to_op();
}

#[test]
fn devices_live_behind_a_broken_line() {
    let mut bench = Bench::new(3, Settings::default());
    bench.line[1].application_mut().on_bus = false;
    bench.millis(10);
    for device in &bench.line {
        assert!(device.application().cycles.len() >= 10);
    }
    let mut line = bench.line.split_off(2);
    tick(bench.now + Duration::from_millis(1), &mut line);
    assert!(line[0].application().cycles.len() >= 11);
}
