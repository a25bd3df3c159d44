//! A cell in simulated time: engine, bus with faults, virtual robot, and the checkers that watch
//! every cycle. `step()` is one bus cycle; every run is bounded and told by its seed.

use std::fmt;

use fieldarm::cycle::{CyclicLink, InputQuality};
use fieldarm::engine::meca500::{Config, Engine, Event, SubmitError, Ticket};
use fieldarm::sim::fault::{FaultPlan, FaultyLink};
use fieldarm::sim::meca500::{RobotSettings, VirtualRobot};
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::meca500::command::MotionCommand;
use fieldarm::wire::meca500::image::{INPUT_LEN, InputImage, OUTPUT_LEN, OutputImage};
use fieldarm::wire::order::{Big, BigIntLittleReal, Endian, ImageOrder, Little, LittleIntBigReal};

use crate::checkers::{
    CycleFacts, EXCUSE_CYCLES, PlcChecker, RobotWitness, Submitted, TicketChecker, TicketState,
    excuses, judge_acceptance,
};
use crate::quick_robot::quick_robot;

/// Commands that can wait in the engine of a cell.
pub(crate) const QUEUE: usize = 64;

/// What a cell is made of.
#[derive(Clone, Debug)]
pub(crate) struct Setup {
    pub(crate) config: Config,
    pub(crate) robot: RobotSettings,
    pub(crate) plan: FaultPlan,
    pub(crate) seed: u64,
    pub(crate) cycle: Duration,
}

impl Default for Setup {
    fn default() -> Self {
        Self {
            config: Config::default(),
            robot: quick_robot(),
            plan: FaultPlan::NONE,
            seed: 1,
            cycle: Duration::from_millis(1),
        }
    }
}

/// Engine, bus and robot, with everything that is known about the run so far.
#[derive(Clone)]
pub(crate) struct Cell {
    pub(crate) engine: Engine<QUEUE>,
    pub(crate) link: FaultyLink<VirtualRobot>,
    pub(crate) now: Instant,
    pub(crate) cycles: u64,
    pub(crate) outputs: [u8; OUTPUT_LEN],
    pub(crate) inputs: [u8; INPUT_LEN],
    pub(crate) quality: InputQuality,
    pub(crate) events: Vec<Event>,
    pub(crate) tickets: TicketChecker,
    pub(crate) witness: RobotWitness,
    pub(crate) submitted: Vec<Submitted>,
    /// Whether the bytes that a PLC sends are judged; a corrupting bus excuses them.
    pub(crate) strict: bool,
    plc: PlcChecker,
    setup: Setup,
    excused: u32,
    keep_events: bool,
}

impl fmt::Debug for Cell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let last = self.events.len().saturating_sub(30);
        f.debug_struct("Cell")
            .field("seed", &self.setup.seed)
            .field("readings", &self.setup.robot.readings)
            .field("cycles", &self.cycles)
            .field("fault", &self.link.active())
            .field("status", &self.engine.status())
            .field("last_events", &&self.events[last..])
            .finish_non_exhaustive()
    }
}

impl Cell {
    pub(crate) fn new(setup: Setup) -> Self {
        Self {
            engine: Engine::new(setup.config),
            link: FaultyLink::new(VirtualRobot::new(setup.robot.clone()), setup.plan, setup.seed),
            now: Instant::from_millis(1),
            cycles: 0,
            outputs: [0; OUTPUT_LEN],
            inputs: [0; INPUT_LEN],
            quality: InputQuality::Lost,
            events: Vec::new(),
            tickets: TicketChecker::default(),
            witness: RobotWitness::default(),
            submitted: Vec::new(),
            strict: true,
            plc: PlcChecker::default(),
            setup,
            excused: 0,
            keep_events: true,
        }
    }

    /// A cell whose robot is up: activated, homed, resumed.
    pub(crate) fn running(setup: Setup) -> Self {
        let mut cell = Self::new(setup);
        cell.until("a connection", 1_000, |cell| {
            cell.saw(|e| matches!(e, Event::Connected { .. }))
        });
        cell.engine.bring_up().unwrap();
        cell.until("the robot to be up", 20_000, |cell| {
            cell.saw(|event| matches!(event, Event::ActionDone(_)))
        });
        cell.events.clear();
        cell
    }

    /// For long runs: events are checked and forgotten.
    pub(crate) fn forgetting(mut self) -> Self {
        self.keep_events = false;
        self
    }

    pub(crate) fn setup(&self) -> &Setup {
        &self.setup
    }

    pub(crate) fn robot(&mut self) -> &mut VirtualRobot {
        self.link.device_mut()
    }

    pub(crate) fn submit(&mut self, command: MotionCommand) -> Result<Ticket, SubmitError> {
        let ticket = self.engine.submit(command)?;
        self.tickets.submitted(ticket).unwrap_or_else(|problem| panic!("{problem}\n{self:#?}"));
        self.submitted.push(Submitted::new(ticket, &command));
        Ok(ticket)
    }

    /// One bus cycle.
    pub(crate) fn step(&mut self) {
        let order = self.setup.robot.byte_order;
        match (order.integers, order.reals) {
            (Endian::BigEndian, Endian::BigEndian) => self.step_in::<Big>(),
            (Endian::LittleEndian, Endian::LittleEndian) => self.step_in::<Little>(),
            (Endian::BigEndian, Endian::LittleEndian) => self.step_in::<BigIntLittleReal>(),
            (Endian::LittleEndian, Endian::BigEndian) => self.step_in::<LittleIntBigReal>(),
        }
    }

    fn step_in<O: ImageOrder>(&mut self) {
        self.now += self.setup.cycle;
        self.cycles += 1;
        self.engine
            .cycle_bytes(self.now, self.quality, &self.inputs, &mut self.outputs)
            .expect("the images have their lengths");
        let before = self.events.len();
        while let Some(event) = self.engine.poll_event() {
            if let Err(problem) = self.tickets.event(&event) {
                panic!("{problem}\n{self:#?}");
            }
            if excuses(&event) {
                self.excused = EXCUSE_CYCLES;
            }
            self.events.push(event);
        }
        if !self.keep_events && before > 64 {
            self.events.clear();
        }
        if self.strict {
            let facts = CycleFacts {
                quality: self.quality,
                excused: self.excused > 0,
                bad_cycles_limit: u32::from(self.setup.config.bad_cycles_limit),
            };
            let inputs = InputImage::<O>::from_bytes(&self.inputs).unwrap();
            let outputs = OutputImage::<O>::from_bytes(&self.outputs).unwrap();
            if let Err(problem) = self.plc.check(facts, inputs, outputs) {
                panic!("{problem}\n{self:#?}");
            }
        }
        self.excused = self.excused.saturating_sub(1);
        let Ok(quality) = self.link.exchange(self.now, &self.outputs, &mut self.inputs);
        self.quality = quality;
        self.witness.watch(
            OutputImage::<O>::from_bytes(self.link.held_outputs()).unwrap(),
            InputImage::<O>::from_bytes(self.link.produced_inputs()).unwrap(),
        );
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
        assert!(done(self), "no {what} within {limit} cycles\n{self:#?}");
    }

    pub(crate) fn saw(&self, what: impl FnMut(&Event) -> bool) -> bool {
        self.events.iter().any(what)
    }

    /// Steps until every ticket has its end.
    pub(crate) fn finish(&mut self, limit: u64) {
        self.until("end of all tickets", limit, |cell| cell.tickets.unfinished() == 0);
    }

    pub(crate) fn state(&self, ticket: Ticket) -> TicketState {
        self.tickets.state(ticket)
    }

    /// Restarts the PLC: a new engine that remembers nothing, on the same bus and robot.
    pub(crate) fn restart_plc(&mut self) {
        self.engine = Engine::new(self.setup.config);
        self.plc = PlcChecker::default();
        self.tickets = TicketChecker::default();
        self.submitted.clear();
        self.outputs = [0; OUTPUT_LEN];
        self.quality = InputQuality::Lost;
    }

    /// What the robot took, compared with what was submitted; see [`judge_acceptance`].
    pub(crate) fn judge_acceptance(&self) {
        if let Err(problem) = judge_acceptance(&self.submitted, &self.tickets, &self.witness) {
            panic!("{problem}\n{self:#?}");
        }
    }
}
