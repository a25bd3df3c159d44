//! A PLC at a link: an engine, the images it holds, and the checkers that watch it.

use std::collections::BTreeMap;
use std::fmt;

use fieldarm::cycle::InputQuality;
use fieldarm::engine::meca500::{
    AbortReason, Action, Config, ConnectionPhase, Engine, Event, SubmitError, Ticket,
};
use fieldarm::time::Instant;
use fieldarm::wire::meca500::command::MotionCommand;
use fieldarm::wire::meca500::image::{INPUT_LEN, InputImage, OUTPUT_LEN, OutputImage};
use fieldarm::wire::order::{
    Big, BigIntLittleReal, ByteOrder, Endian, ImageOrder, Little, LittleIntBigReal,
};

use crate::checkers::{
    CycleFacts, EXCUSE_CYCLES, PlcChecker, RobotWitness, Submitted, TicketChecker, TicketState,
    excuses, judge_acceptance,
};

/// Commands that can wait in the engine.
const QUEUE: usize = 64;

/// A PLC and everything that is known about its life so far.
pub(crate) struct Plc {
    pub(crate) engine: Engine<QUEUE>,
    pub(crate) outputs: [u8; OUTPUT_LEN],
    pub(crate) inputs: [u8; INPUT_LEN],
    pub(crate) quality: InputQuality,
    pub(crate) events: Vec<Event>,
    pub(crate) tickets: TicketChecker,
    pub(crate) submitted: Vec<Submitted>,
    aborted: BTreeMap<Ticket, AbortReason>,
    checker: PlcChecker,
    order: ByteOrder,
    excused: u32,
}

impl fmt::Debug for Plc {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let last = self.events.len().saturating_sub(30);
        f.debug_struct("Plc")
            .field("quality", &self.quality)
            .field("status", &self.engine.status())
            .field("last_events", &&self.events[last..])
            .finish_non_exhaustive()
    }
}

impl Plc {
    /// A PLC that was just started, before a robot that speaks `order`. It finds that out by itself;
    /// the checkers are told.
    pub(crate) fn new(order: ByteOrder, config: Config) -> Self {
        Self {
            engine: Engine::new(config),
            outputs: [0; OUTPUT_LEN],
            inputs: [0; INPUT_LEN],
            quality: InputQuality::Lost,
            events: Vec::new(),
            tickets: TicketChecker::default(),
            submitted: Vec::new(),
            aborted: BTreeMap::new(),
            checker: PlcChecker::default(),
            order,
            excused: 0,
        }
    }

    pub(crate) fn submit(&mut self, command: MotionCommand) -> Result<Ticket, SubmitError> {
        let ticket = self.engine.submit(command)?;
        self.tickets.submitted(ticket).unwrap_or_else(|problem| panic!("{problem}\n{self:#?}"));
        self.submitted.push(Submitted::new(ticket, &command));
        Ok(ticket)
    }

    /// What the PLC makes of the newest inputs: one cycle of the engine, judged.
    pub(crate) fn think(&mut self, now: Instant) -> Result<(), String> {
        match (self.order.integers, self.order.reals) {
            (Endian::BigEndian, Endian::BigEndian) => self.think_in::<Big>(now),
            (Endian::LittleEndian, Endian::LittleEndian) => self.think_in::<Little>(now),
            (Endian::BigEndian, Endian::LittleEndian) => self.think_in::<BigIntLittleReal>(now),
            (Endian::LittleEndian, Endian::BigEndian) => self.think_in::<LittleIntBigReal>(now),
        }
    }

    fn think_in<O: ImageOrder>(&mut self, now: Instant) -> Result<(), String> {
        self.engine
            .cycle_bytes(now, self.quality, &self.inputs, &mut self.outputs)
            .map_err(|error| error.to_string())?;
        while let Some(event) = self.engine.poll_event() {
            self.tickets.event(&event)?;
            if excuses(&event) {
                self.excused = EXCUSE_CYCLES;
            }
            if let Event::Aborted { ticket, reason } = event {
                self.aborted.insert(ticket, reason);
            }
            self.events.push(event);
        }
        let facts = CycleFacts {
            quality: self.quality,
            excused: self.excused > 0,
            bad_cycles_limit: u32::from(self.engine.config().bad_cycles_limit),
        };
        let inputs = InputImage::<O>::from_bytes(&self.inputs).map_err(|e| e.to_string())?;
        let outputs = OutputImage::<O>::from_bytes(&self.outputs).map_err(|e| e.to_string())?;
        self.excused = self.excused.saturating_sub(1);
        self.checker.check(facts, inputs, outputs)
    }

    /// What a caller does who wants to go on: decides, and brings the robot back.
    pub(crate) fn insist(&mut self) {
        if self.engine.undecided() {
            self.engine.proceed();
        }
        let status = self.engine.status();
        if self.is_connected() && !status.ready && !status.acting {
            let action = if status.error.is_set() { Action::Recover } else { Action::BringUp };
            // Refused while the robot cannot; the next cycle tries again.
            let _ = self.engine.request(action);
        }
    }

    pub(crate) fn is_connected(&self) -> bool {
        self.engine.status().phase == ConnectionPhase::Connected
    }

    /// Connected, up, and nothing held back.
    pub(crate) fn is_up(&self) -> bool {
        let status = self.engine.status();
        self.is_connected() && status.ready && !status.acting && !self.engine.undecided()
    }

    pub(crate) fn saw(&self, what: impl FnMut(&Event) -> bool) -> bool {
        self.events.iter().any(what)
    }

    pub(crate) fn state(&self, ticket: Ticket) -> TicketState {
        self.tickets.state(ticket)
    }

    /// What the engine says of each command against what the robot's witness saw.
    pub(crate) fn judge(&self, witness: &RobotWitness) -> Result<(), String> {
        judge_acceptance(&self.submitted, &self.tickets, witness)?;
        for submitted in &self.submitted {
            let command = (submitted.id, submitted.argument_bits);
            let is_taken = || witness.accepted().contains(&command);
            match self.aborted.get(&submitted.ticket) {
                Some(reason @ (AbortReason::LinkLost | AbortReason::Discarded)) if is_taken() => {
                    return Err(format!(
                        "{submitted:?} ended by {reason:?}, but the robot took it"
                    ));
                }
                _ => {}
            }
        }
        Ok(())
    }
}
