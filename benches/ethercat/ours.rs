//! Our link, with an engine for each robot.

use std::time::Instant;

use fieldarm::cycle::CyclicSegment;
use fieldarm::engine::meca500::{Config, Engine, Event};
use fieldarm::link::clock::MonotonicClock;
use fieldarm::link::ethercat::raw_socket::RawSocket;
use fieldarm::link::ethercat::wire::Wire;
use fieldarm::link::ethercat::{EthercatSegment, SegmentSettings};
use fieldarm::time::Duration;
use fieldarm::wire::meca500::image::{INPUT_LEN, OUTPUT_LEN};

use crate::beat::{Beat, Exchanged, Figures};
use crate::frame::{Frame, Remembering};

/// Cycles until every engine is connected: far more than it takes.
const PATIENCE: u32 = 20_000;

/// One robot's images and engine.
struct Seat {
    engine: Engine<64>,
    inputs: [u8; INPUT_LEN],
    outputs: [u8; OUTPUT_LEN],
    is_connected: bool,
}

impl Seat {
    fn new() -> Self {
        Self {
            engine: Engine::new(Config::default()),
            inputs: [0; INPUT_LEN],
            outputs: [0; OUTPUT_LEN],
            is_connected: false,
        }
    }
}

/// A segment in OP and the engines of its robots.
pub(crate) struct Cell<W> {
    segment: EthercatSegment<W>,
    seats: Vec<Seat>,
    clock: MonotonicClock,
    period: Duration,
}

/// The settings of every start here.
pub(crate) fn settings(period: Duration) -> SegmentSettings {
    SegmentSettings {
        // The contender before has left its robots in OP.
        take_over: true,
        // A busy machine may not run us for a while.
        watchdog: Some(Duration::from_secs(1)),
        ..SegmentSettings::with_cycle(period)
    }
}

impl<W: Wire> Cell<W> {
    fn start(wire: W, period: Duration) -> Result<Self, String> {
        let segment = EthercatSegment::start(wire, settings(period))
            .map_err(|failure| failure.error.to_string())?;
        let seats = segment.robots().iter().map(|_| Seat::new()).collect();
        let mut cell = Self { segment, seats, clock: MonotonicClock::new(), period };
        for _ in 0..PATIENCE {
            cell.exchange();
            let due = cell.clock.now() + cell.period;
            if cell.seats.iter().all(|seat| seat.is_connected) {
                return Ok(cell);
            }
            cell.clock.sleep_until(due);
        }
        Err("an engine does not connect".into())
    }

    fn exchange(&mut self) -> Exchanged {
        let now = self.clock.now();
        let began = Instant::now();
        for (robot, seat) in self.seats.iter().enumerate() {
            self.segment.write_outputs(robot, &seat.outputs);
        }
        let mut is_whole = self.segment.exchange(now).is_ok();
        let mut qualities = [fieldarm::cycle::InputQuality::Lost; 16];
        for ((robot, seat), quality) in self.seats.iter_mut().enumerate().zip(&mut qualities) {
            *quality = self.segment.read_inputs(robot, &mut seat.inputs);
            is_whole &= quality.is_fresh();
        }
        let exchanged = Instant::now();
        for (seat, quality) in self.seats.iter_mut().zip(qualities) {
            let done = seat.engine.cycle_bytes(now, quality, &seat.inputs, &mut seat.outputs);
            is_whole &= done.is_ok();
            while let Some(event) = seat.engine.poll_event() {
                seat.is_connected |= matches!(event, Event::Connected { .. });
            }
        }
        let engine = exchanged.elapsed();
        Exchanged { took: exchanged - began, engine: Some(engine), is_whole }
    }
}

/// The frame that a cycle sends, as the interface sees it.
pub(crate) fn frame(interface: &str, period: Duration) -> Result<Frame, String> {
    let socket = RawSocket::open(interface).map_err(|error| error.to_string())?;
    let cell = Cell::start(Remembering::new(socket), period)?;
    Ok(cell.segment.wire().last())
}

/// Brings all robots to OP and leaves them there.
pub(crate) fn bring_to_op(interface: &str, period: Duration) -> Result<(), String> {
    frame(interface, period).map(drop)
}

/// Brings all robots to OP, cycles, and leaves them there.
pub(crate) fn run(interface: &str, beat: Beat) -> Result<Figures, String> {
    let socket = RawSocket::open(interface).map_err(|error| error.to_string())?;
    let mut cell = Cell::start(socket, beat.period)?;
    let figures = beat.keep(|| cell.exchange());
    drop(cell.segment.abandon());
    Ok(figures)
}
