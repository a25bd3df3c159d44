//! A PLC on a bus under test, in simulated time: `step()` is one bus cycle, every run is bounded.

use std::collections::BTreeSet;
use std::fmt;

use fieldarm::cycle::CyclicLink;
use fieldarm::engine::meca500::{Config, Ticket};
use fieldarm::sim::meca500::RobotSettings;
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::meca500::command::MotionCommand;
use fieldarm::wire::order::ByteOrder;

use crate::contract::{Bus, BusKind, Cable, PlcEnd};
use crate::plc::Plc;
use crate::quick_robot::quick_robot;

/// Time between two cycles.
pub(crate) const CYCLE: Duration = Duration::from_millis(1);

/// ID of SetCartLinVel, which [`numbered`] makes.
const NUMBERED_ID: u32 = 11;

/// A settings command unlike any other of the run.
pub(crate) fn numbered(number: u32) -> MotionCommand {
    MotionCommand::SetCartLinVel(100.0 + number as f32 * 0.0625)
}

/// The next cycle after `now` of a bus that wants it `nudge_ns` later.
pub(crate) fn next_cycle(now: Instant, nudge_ns: i64) -> Instant {
    let size = Duration::from_nanos(nudge_ns.unsigned_abs());
    now + if nudge_ns >= 0 { CYCLE + size } else { CYCLE.saturating_sub(size) }
}

/// A PLC, a bus and a robot.
pub(crate) struct Cell<B> {
    /// `None` only while the PLC is restarted.
    bus: Option<B>,
    pub(crate) plc: Plc,
    pub(crate) now: Instant,
    pub(crate) cycles: u64,
    next_number: u32,
    order: ByteOrder,
    /// The bus, and whatever else tells this run from others.
    pub(crate) label: String,
}

impl<B> fmt::Debug for Cell<B> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Cell")
            .field("label", &self.label)
            .field("cycles", &self.cycles)
            .field("plc", &self.plc)
            .finish_non_exhaustive()
    }
}

impl<B: Bus> Cell<B> {
    /// A cell whose link is up and whose engine has not seen a cycle yet.
    pub(crate) fn open(kind: impl BusKind<Bus = B>, robot: RobotSettings) -> Self {
        let order = robot.byte_order;
        let label = format!("{kind:?}");
        let bus = kind.open(robot).unwrap_or_else(|error| panic!("{label}: {error}"));
        Self::over(bus, order, label)
    }

    /// A cell on a bus that is up already, whose robot speaks `order`.
    pub(crate) fn over(bus: B, order: ByteOrder, label: String) -> Self {
        Self {
            bus: Some(bus),
            plc: Plc::new(order, Config::default()),
            now: Instant::from_millis(1),
            cycles: 0,
            next_number: 0,
            order,
            label,
        }
    }

    /// A cell with a little-endian robot that is up: activated, homed, resumed.
    pub(crate) fn running(kind: impl BusKind<Bus = B>) -> Self {
        let byte_order = ByteOrder::LITTLE;
        let mut cell = Self::open(kind, RobotSettings { byte_order, ..quick_robot() });
        cell.bring_up();
        cell
    }

    /// Waits for the connection and brings the robot up.
    pub(crate) fn bring_up(&mut self) {
        self.until("a connection", 5_000, |cell| cell.plc.is_connected());
        self.until("a robot that is up", 20_000, |cell| {
            cell.insist();
            cell.plc.is_up()
        });
    }

    pub(crate) fn bus(&mut self) -> &mut B {
        self.bus.as_mut().expect("a PLC is not restarted twice at once")
    }

    pub(crate) fn robot(&mut self) -> &mut crate::watched::WatchedRobot {
        self.bus().robot()
    }

    pub(crate) fn set_cable(&mut self, cable: Cable) {
        self.bus().set_cable(cable);
    }

    /// What those around a robot do to bring it back: the reset button, then the PLC's caller.
    pub(crate) fn insist(&mut self) {
        if self.plc.is_connected() && !self.plc.is_up() {
            self.robot().robot.panel().press_reset();
        }
        self.plc.insist();
    }

    /// Submits a command that no other of this run is like, if there is room.
    pub(crate) fn submit_next(&mut self) -> Option<Ticket> {
        let ticket = self.plc.submit(numbered(self.next_number)).ok()?;
        self.next_number += 1;
        Some(ticket)
    }

    /// One bus cycle.
    pub(crate) fn step(&mut self) {
        self.cycles += 1;
        let nudge = self.bus().nudge_ns();
        self.now = next_cycle(self.now, nudge);
        let now = self.now;
        if let Err(problem) = self.plc.think(now) {
            panic!("{problem}\n{self:#?}");
        }
        let link = self.bus.as_mut().expect("there is a bus").link();
        match link.exchange(now, &self.plc.outputs, &mut self.plc.inputs) {
            Ok(quality) => self.plc.quality = quality,
            Err(error) => panic!("{error}\n{self:#?}"),
        }
    }

    pub(crate) fn steps(&mut self, cycles: u64) {
        for _ in 0..cycles {
            self.step();
        }
    }

    /// Steps until `done`, at most `limit` cycles.
    pub(crate) fn until(
        &mut self,
        what: &str,
        limit: u64,
        mut done: impl FnMut(&mut Self) -> bool,
    ) {
        for _ in 0..limit {
            if done(self) {
                return;
            }
            self.step();
        }
        assert!(done(self), "not {what} within {limit} cycles\n{self:#?}");
    }

    /// Steps until every ticket has its end, deciding and recovering as a caller would; then judges.
    pub(crate) fn finish(&mut self, limit: u64) {
        self.until("an end of all tickets", limit, |cell| {
            if cell.plc.tickets.unfinished() > 0 {
                cell.insist();
            }
            cell.plc.tickets.unfinished() == 0
        });
        self.judge();
    }

    /// The engine's verdicts against the witness, and no command twice in all lives of the PLC.
    pub(crate) fn judge(&mut self) {
        let witness = self.robot().witness.clone();
        if let Err(problem) = self.plc.judge(&witness) {
            panic!("{problem}\n{self:#?}");
        }
        let mut seen = BTreeSet::new();
        let numbered = witness.accepted().iter().filter(|(id, _)| *id == NUMBERED_ID);
        for command in numbered {
            assert!(seen.insert(command), "the robot took {command:?} twice\n{self:#?}");
        }
    }

    /// How many commands of this run the robot took.
    pub(crate) fn taken(&mut self) -> usize {
        let accepted = self.robot().witness.accepted();
        accepted.iter().filter(|(id, _)| *id == NUMBERED_ID).count()
    }

    /// Ends the PLC and starts a new one that remembers nothing, on the same robot.
    pub(crate) fn restart_plc(&mut self, end: PlcEnd, away: Duration) {
        self.judge();
        let bus = self.bus.take().expect("there is a bus");
        match bus.restart_plc(end, self.now, away) {
            Ok(bus) => self.bus = Some(bus),
            Err(error) => panic!("the new PLC gets no link: {error}\n{self:#?}"),
        }
        self.now += away;
        self.plc = Plc::new(self.order, Config::default());
    }
}
