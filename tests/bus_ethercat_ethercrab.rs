//! ethercrab as main device, driving the emulated segment in memory: somebody else's reading of
//! SII, mailbox and process data sync managers, FMMUs, states and clocks.

#![cfg(feature = "ethercat")]

mod ethercat_support;

use std::future::Future;
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::task::{Context, Poll, Waker};

use ethercat_support::{Bench, INPUTS, OUTPUTS};
use ethercrab::subdevice_group::{CycleInfo, DcConfiguration};
use ethercrab::{
    DcSync, MainDevice, MainDeviceConfig, PduRx, PduStorage, PduTx, SubDeviceGroup, Timeouts,
};
use fieldarm::bus::ethercat::{Passage, Settings, pass};
use fieldarm::time::Duration;
use fieldarm::wire::ethercat::al::{AlState, AlStatusCode};

/// Polls that a start-up may take; each passes at least one frame or finds none.
const MAX_POLLS: usize = 200_000;

/// The segment, and the two ends of ethercrab's frame storage.
struct Wire {
    bench: Bench,
    tx: PduTx<'static>,
    rx: PduRx<'static>,
    clock: Arc<AtomicU64>,
    /// Time between two frames.
    pace: Duration,
}

impl Wire {
    /// Runs `future` to its end, passing the frames it sends through the segment.
    fn run<F: Future>(&mut self, future: F) -> F::Output {
        let mut future = pin!(future);
        let mut context = Context::from_waker(Waker::noop());
        for _ in 0..MAX_POLLS {
            if let Poll::Ready(output) = future.as_mut().poll(&mut context) {
                return output;
            }
            self.pass_frames();
        }
        panic!("not done after {MAX_POLLS} polls");
    }

    fn pass_frames(&mut self) {
        while let Some(sendable) = self.tx.next_sendable_frame() {
            let mut frame = Vec::new();
            sendable
                .send_blocking(|bytes| {
                    frame.extend_from_slice(bytes);
                    Ok(bytes.len())
                })
                .unwrap();
            self.bench.now += self.pace;
            self.clock.store(self.bench.now.as_nanos(), Ordering::Relaxed);
            let passage = pass(self.bench.now, &mut frame, &mut self.bench.line);
            assert_eq!(passage, Passage::Returned);
            self.rx.receive_frame(&frame).unwrap();
        }
    }
}

type Storage = PduStorage<16, { PduStorage::element_size(1100) }>;

/// A main device and a segment of mocks, joined in memory.
fn join(count: usize, settings: Settings) -> (MainDevice<'static>, Wire) {
    let storage: &'static Storage = Box::leak(Box::new(PduStorage::new()));
    let (tx, rx, pdu_loop) = storage.try_split().unwrap();
    // Nothing waits for real time: the segment answers at once or the number of polls ends it.
    let timeouts = Timeouts {
        state_transition: Duration::MAX,
        pdu: Duration::MAX,
        eeprom: Duration::MAX,
        wait_loop_delay: Duration::ZERO,
        mailbox_echo: Duration::MAX,
        mailbox_response: Duration::MAX,
    };
    let main = MainDevice::new(pdu_loop, timeouts, MainDeviceConfig::default());
    let bench = Bench::new(count, settings);
    let clock = Arc::new(AtomicU64::new(bench.now.as_nanos()));
    (main, Wire { bench, tx, rx, clock, pace: Duration::from_micros(20) })
}

fn bring_up(count: usize, settings: Settings) {
    let (main, mut wire) = join(count, settings);
    let clock = wire.clock.clone();
    let now = move || clock.load(Ordering::Relaxed);
    let group: SubDeviceGroup<4, 64> =
        wire.run(main.init_single_group::<4, 64>(&now)).expect("INIT to PRE-OP");
    assert_eq!(group.len(), count);
    for device in group.iter(&main) {
        assert_eq!(device.name(), "MOCK");
        let identity = device.identity();
        assert_eq!((identity.vendor_id, identity.product_id), (0x1111_2222, 0x3333_4444));
        assert_eq!((identity.revision, identity.serial), (0x0001_0002, 0x0A0B_0C0D));
        assert_eq!(device.alias_address(), 0x0123);
        assert_eq!(device.dc_support().any(), settings.distributed_clock);
    }
    let group = wire.run(group.into_safe_op(&main)).expect("PRE-OP to SAFE-OP");
    assert!(wire.bench.line.iter().all(|device| device.state() == AlState::SafeOp));
    let group = wire.run(group.request_into_op(&main)).expect("request for OP");
    assert!(
        wire.bench.line.iter().all(|device| device.state() == AlState::SafeOp),
        "OP has to wait for outputs"
    );
    for cycle in 1..=50_u8 {
        for (index, device) in (0_u8..).zip(group.iter(&main)) {
            let value = cycle ^ index;
            device.outputs_raw_mut().copy_from_slice(&[value, !value, 0x5A, index]);
        }
        let result = wire.run(group.tx_rx(&main)).expect("cycle");
        assert_eq!(result.working_counter, 3 * count as u16);
        for (index, device) in (0_u8..).zip(group.iter(&main)) {
            let inputs = device.inputs_raw();
            assert_eq!((device.outputs_raw().len(), inputs.len()), (OUTPUTS, INPUTS));
            if cycle > 1 {
                let before = (cycle - 1) ^ index;
                assert_eq!(inputs[1..], [before, !before, 0x5A, index, 1][..]);
            }
        }
        assert!(wire.bench.line.iter().all(|device| device.state() == AlState::Op));
    }
}

#[test]
fn one_device_reaches_op_and_exchanges_values() {
    bring_up(1, Settings::default());
}

#[test]
fn four_devices_reach_op_and_exchange_values() {
    bring_up(4, Settings::default());
}

#[test]
fn a_device_without_distributed_clock_reaches_op() {
    bring_up(2, Settings { distributed_clock: false, ..Settings::default() });
}

#[test]
fn an_sii_that_reads_8_bytes_is_understood() {
    bring_up(1, Settings { sii_reads_8_bytes: true, ..Settings::default() });
}

/// Devices whose clocks start and run apart, far from each other on the wire.
fn apart() -> Vec<Settings> {
    [(400, 0, 0), (900, 7_000_000_000, 30_000), (1_500, 123_456, -50_000)]
        .map(|(delay_ns, clock_start_ns, clock_drift_ppb)| Settings {
            line_delay: Duration::from_nanos(delay_ns),
            clock_start_ns,
            clock_drift_ppb,
            ..Settings::default()
        })
        .to_vec()
}

#[test]
fn clocks_are_aligned_and_sync0_drives_the_cycle() {
    let (main, mut wire) = join(0, Settings::default());
    wire.bench.line = apart().into_iter().map(ethercat_support::device).collect();
    let clock = wire.clock.clone();
    let now = move || clock.load(Ordering::Relaxed);
    let mut group: SubDeviceGroup<4, 64> =
        wire.run(main.init_single_group::<4, 64>(&now)).expect("INIT to PRE-OP");
    let delays: Vec<u32> = group.iter(&main).map(|device| device.propagation_delay()).collect();
    assert_eq!(delays, [0, 900, 2_400]);
    for mut device in group.iter_mut(&main) {
        device.set_dc_sync(DcSync::Sync0);
    }
    let group = wire.run(group.into_pre_op_pdi(&main)).expect("PRE-OP with image");
    wire.pace = Duration::from_millis(2);
    for _ in 0..2_000 {
        wire.run(group.tx_rx_sync_system_time(&main)).expect("alignment");
    }
    let spread = |wire: &Wire| {
        let at = wire.bench.now;
        let times: Vec<u64> =
            wire.bench.line.iter().map(|device| device.system_time(at).unwrap()).collect();
        times.iter().map(|time| time.abs_diff(times[0])).max().unwrap()
    };
    assert!(spread(&wire) < 50, "{} ns apart", spread(&wire));
    let configuration = DcConfiguration {
        start_delay: Duration::from_millis(100),
        sync0_period: Duration::from_millis(2),
        sync0_shift: Duration::from_millis(1),
    };
    let group = wire.run(group.configure_dc_sync(&main, configuration)).expect("SYNC0");
    let group = wire.run(group.into_safe_op(&main)).expect("SAFE-OP");
    let group = wire.run(group.request_into_op(&main)).expect("request for OP");
    let mut waits = Vec::new();
    for cycle in 0..500_u32 {
        for device in group.iter(&main) {
            device.outputs_raw_mut().fill(cycle as u8);
        }
        let result = wire.run(group.tx_rx_dc(&main)).expect("cycle");
        assert_eq!(result.working_counter, 9);
        let info: CycleInfo = result.extra;
        waits.push(info.next_cycle_wait);
        // The next frame leaves when ethercrab says so.
        wire.pace = info.next_cycle_wait;
        if cycle == 400 {
            for device in &mut wire.bench.line {
                device.application_mut().cycles.clear();
            }
        }
    }
    // The frames sit at the shift behind SYNC0, one a period.
    for wait in &waits[100..] {
        assert!(wait.abs_diff(Duration::from_millis(2)) < Duration::from_micros(1), "{wait:?}");
    }
    for device in &wire.bench.line {
        assert_eq!(device.state(), AlState::Op);
        let cycles = &device.application().cycles;
        assert_eq!(cycles.len(), 99, "one a SYNC0");
        assert!(cycles.iter().all(|(_, outputs)| outputs.is_some()));
    }
    assert!(spread(&wire) < 50, "{} ns apart", spread(&wire));
}

#[test]
fn ethercrab_reads_the_fall_to_safe_op() {
    let (main, mut wire) = join(1, Settings::default());
    let clock = wire.clock.clone();
    let now = move || clock.load(Ordering::Relaxed);
    let group: SubDeviceGroup<4, 64> =
        wire.run(main.init_single_group::<4, 64>(&now)).expect("INIT to PRE-OP");
    let group = wire.run(group.into_safe_op(&main)).expect("SAFE-OP");
    let group = wire.run(group.request_into_op(&main)).expect("request for OP");
    wire.run(group.tx_rx(&main)).expect("cycle");
    assert_eq!(wire.bench.line[0].state(), AlState::Op);
    wire.bench.millis(102);
    let device = group.subdevice(&main, 0).unwrap();
    let answer = wire.run(device.status());
    let expected = ethercrab::error::Error::SubDevice(ethercrab::AlStatusCode::SyncManagerWatchdog);
    assert_eq!(answer.map(|_| ()), Err(expected));
    assert_eq!(wire.bench.line[0].state(), AlState::SafeOp);
    assert_eq!(wire.bench.line[0].error(), Some(AlStatusCode::SYNC_MANAGER_WATCHDOG));
}
