//! One subdevice: an ESC, and the firmware that joins it to an [`Application`].
//!
//! Time reaches it in two ways: with a frame ([`pass`](super::pass)) or without
//! ([`tick`](super::tick)). What a frame asks of the firmware (a state, a mailbox datagram,
//! a cycle) is done when the frame has passed, so the next frame sees it.
//!
//! The application's cycle runs
//! * in OP without SYNC0: when outputs have come; if none come while the watchdog is off, the last
//!   ones are held and it runs ten times a second;
//! * with SYNC0: in the first frame or tick at or after each, in SAFE-OP and OP;
//! * otherwise every [`Settings::idle_period`], without outputs.

use crate::time::{Duration, Instant};
use crate::wire::ethercat::al::{AlState, AlStatusCode};
use crate::wire::ethercat::register::{
    AL_CONTROL, AL_CONTROL_ACKNOWLEDGE, AL_STATUS, AL_STATUS_CODE, AL_STATUS_ERROR, DC_SYNC0_CYCLE,
    DL_CONTROL, DL_CONTROL_PORT_1_SHIFT, DL_STATUS, DL_STATUS_OPERATIONAL, DL_STATUS_PDI_WATCHDOG,
    DL_STATUS_PORT_0_OPEN, DL_STATUS_PORT_1_CLOSED, DL_STATUS_PORT_1_FRAMES, DL_STATUS_PORT_1_LINK,
    DL_STATUS_PORTS_2_3_CLOSED, ECAT_EVENT_AL_STATUS, ECAT_EVENT_DL_STATUS, LOST_LINKS,
    STATION_ADDRESS,
};
use crate::wire::ethercat::sii::{Description, SiiImage};

use super::application::Application;
use super::clock::Clock;
use super::controller::{Controller, Pending};
use super::eeprom::Eeprom;
use super::mailbox::Mailbox;
use super::memory::MEMORY_LEN;
use super::settings::Settings;
use super::state_machine::{Verdict, judge};
use super::sync_manager::SyncManager;

/// Index of the sync manager with the outputs.
const OUTPUTS: usize = 2;
/// Index of the sync manager with the inputs.
const INPUTS: usize = 3;
/// Most process data of one direction in bytes: three buffers in the process data memory.
const MAX_PROCESS_DATA: usize = (MEMORY_LEN - 0x1000) / 3;
/// How often held outputs are given to the application in OP when the watchdog is off.
const HOLD_PERIOD: Duration = Duration::from_millis(100);

/// An emulated EtherCAT subdevice.
#[derive(Clone, Debug)]
pub struct SubDevice<A> {
    application: A,
    settings: Settings,
    has_mailbox: bool,
    min_sync0_cycle_ns: u32,
    pub(super) controller: Controller,
    mailbox: Mailbox,
    inputs: [u8; MAX_PROCESS_DATA],
    state: AlState,
    error: Option<AlStatusCode>,
    outputs_came: bool,
    /// Since when a request for OP waits for outputs.
    op_requested: Option<Instant>,
    last_cycle: Option<Instant>,
    powered: bool,
    firmware_hangs: bool,
    follower: bool,
}

impl<A: Application> SubDevice<A> {
    /// A subdevice whose power has just come, with `application` behind its ESC. `sii` is what its
    /// SII holds; it should be built from `description`, from which the firmware takes whether
    /// there is a mailbox and how fast SYNC0 may be.
    pub fn new(
        application: A,
        description: &Description,
        sii: SiiImage,
        settings: Settings,
    ) -> Self {
        let eeprom = Eeprom::new(sii, settings.sii_reads_8_bytes);
        let mut device = Self {
            powered: application.is_on_bus(),
            application,
            settings,
            has_mailbox: description.mailbox.is_some(),
            min_sync0_cycle_ns: description.dc.map_or(0, |dc| dc.min_cycle_ns),
            controller: Controller::new(eeprom, None),
            mailbox: Mailbox::new(),
            inputs: [0; MAX_PROCESS_DATA],
            state: AlState::Init,
            error: None,
            outputs_came: false,
            op_requested: None,
            last_cycle: None,
            firmware_hangs: false,
            follower: false,
        };
        device.power_up(Instant::ZERO);
        device
    }

    /// The firmware behind the ESC.
    pub const fn application(&self) -> &A {
        &self.application
    }

    /// The firmware behind the ESC, to be changed.
    pub const fn application_mut(&mut self) -> &mut A {
        &mut self.application
    }

    /// The state it is in.
    pub const fn state(&self) -> AlState {
        self.state
    }

    /// Why AL status shows an error; `None` while it shows none.
    pub const fn error(&self) -> Option<AlStatusCode> {
        self.error
    }

    /// Its station address; 0 until a main device gave it one.
    pub fn station_address(&self) -> u16 {
        self.controller.memory.u16(STATION_ADDRESS)
    }

    /// The value of a 16-bit register, without the effects of a read by a main device; 0 where
    /// there is none. Addresses are in [`register`](crate::wire::ethercat::register).
    pub fn register(&self, address: u16) -> u16 {
        self.controller.memory.u16(address)
    }

    /// What its SII holds now; a main device may have written to it.
    pub const fn sii(&self) -> &SiiImage {
        &self.controller.eeprom.image
    }

    /// System time of its distributed clock in ns; `None` if it has none.
    pub fn system_time(&self, now: Instant) -> Option<u64> {
        let memory = &self.controller.memory;
        self.controller.clock.map(|clock| clock.system(now, memory))
    }

    /// Lets the firmware hang (a fault to be tried) or go on: nothing answers any more, the ESC
    /// alone keeps passing frames, and its watchdog over the firmware expires.
    pub const fn set_firmware_hangs(&mut self, hangs: bool) {
        self.firmware_hangs = hangs;
    }

    pub(super) fn is_on_bus(&self) -> bool {
        self.application.is_on_bus()
    }

    pub(super) const fn line_delay(&self) -> Duration {
        self.settings.line_delay
    }

    /// Registers and states as after power-up; the SII keeps what was written to it.
    fn power_up(&mut self, now: Instant) {
        let settings = &self.settings;
        let clock = settings
            .distributed_clock
            .then(|| Clock::new(now, settings.clock_start_ns, settings.clock_drift_ppb));
        self.controller = Controller::new(self.controller.eeprom.clone(), clock);
        self.mailbox = Mailbox::new();
        self.application.reset_mailbox();
        self.inputs.fill(0);
        self.outputs_came = false;
        self.op_requested = None;
        self.follower = false;
        self.state = AlState::Init;
        self.error = None;
        self.show_state();
        self.show_ports();
        self.controller.events = 0;
    }

    /// Lets time pass up to `now` without a frame.
    pub(super) fn live(&mut self, now: Instant) {
        if !self.application.is_on_bus() {
            self.powered = false;
            self.live_idle(now);
            return;
        }
        if !self.powered {
            self.powered = true;
            self.power_up(now);
        }
        let memory = &mut self.controller.memory;
        if !self.firmware_hangs {
            self.controller.watchdogs.feed_firmware(now);
        }
        self.controller.watchdogs.update(now, memory);
        let sync0 = match &mut self.controller.clock {
            Some(clock) => clock.sync0_came(now, memory),
            None => false,
        };
        self.show_ports();
        if self.firmware_hangs {
            return;
        }
        self.watch_outputs(now);
        let synchronous = self.has_sync0() && self.runs_process_data();
        if synchronous && sync0 {
            self.run_cycle(now);
        } else if !synchronous {
            self.live_idle(now);
        }
    }

    /// Runs the cycle when nothing else sets its pace.
    fn live_idle(&mut self, now: Instant) {
        let fed = self.powered && self.state == AlState::Op && self.application.output_len() > 0;
        let period = if fed { HOLD_PERIOD } else { self.settings.idle_period };
        if self.last_cycle.is_none_or(|last| now - last >= period) {
            self.run_cycle(now);
        }
    }

    fn has_sync0(&self) -> bool {
        self.controller.clock.is_some_and(|clock| clock.has_sync0())
    }

    const fn runs_process_data(&self) -> bool {
        matches!(self.state, AlState::SafeOp | AlState::Op)
    }

    /// Outputs that stopped, or that a request for OP waits for in vain.
    fn watch_outputs(&mut self, now: Instant) {
        let supervised = self.sync_manager(OUTPUTS).is_some_and(SyncManager::feeds_watchdog);
        let expired = self.controller.watchdogs.process_has_expired();
        if self.state == AlState::Op && supervised && expired {
            self.enter(AlState::SafeOp);
            self.fail(AlStatusCode::SYNC_MANAGER_WATCHDOG);
        }
        let waited = self.op_requested.map(|since| now - since);
        if waited.is_some_and(|waited| waited > self.settings.outputs_timeout) {
            self.op_requested = None;
            self.fail(AlStatusCode::SYNC_MANAGER_WATCHDOG);
        }
    }

    /// Does what the frame that has passed asks of the firmware.
    pub(super) fn react(&mut self, now: Instant) {
        self.controller.end_frame();
        if self.firmware_hangs {
            return;
        }
        let pending = core::mem::take(&mut self.controller.pending);
        if pending.sync_managers_changed {
            self.check_running();
        }
        if pending.al_control {
            self.obey(now);
        }
        if self.has_mailbox && self.state != AlState::Init {
            let read = pending.read & 1 << Mailbox::SEND != 0;
            self.mailbox.serve(&mut self.controller, &mut self.application, self.state, read);
        }
        self.take_outputs(now, pending);
    }

    fn take_outputs(&mut self, now: Instant, pending: Pending) {
        if pending.written & 1 << OUTPUTS == 0 {
            return;
        }
        match self.state {
            AlState::SafeOp => {
                self.outputs_came = true;
                if self.op_requested.take().is_some() {
                    self.go_to(now, AlState::Op);
                }
            }
            AlState::Op if !self.has_sync0() => self.run_cycle(now),
            _ => {}
        }
    }

    /// AL control was written.
    fn obey(&mut self, now: Instant) {
        let value = self.controller.memory.u8(AL_CONTROL);
        let requested = AlState::from_wire(value);
        let acknowledged = value & AL_CONTROL_ACKNOWLEDGE != 0;
        if self.error.is_some() {
            // INIT needs no acknowledgement.
            if !acknowledged && requested != Some(AlState::Init) {
                return;
            }
            self.error = None;
            self.show_state();
        }
        self.op_requested = None;
        let Some(to) = requested else { return self.fail(AlStatusCode::UNKNOWN_STATE) };
        match judge(self.state, to) {
            Verdict::Same => {}
            Verdict::Refused(code) => self.fail(code),
            Verdict::Down => self.go_to(now, to),
            Verdict::Up => match self.check(to) {
                Err(code) => self.fail(code),
                Ok(()) if to == AlState::Op && self.must_wait() => self.op_requested = Some(now),
                Ok(()) => self.go_to(now, to),
            },
        }
    }

    /// Whether OP has to wait for outputs.
    fn must_wait(&self) -> bool {
        !self.outputs_came && self.application.output_len() > 0
    }

    /// Makes a step that the rules allow, if the application agrees.
    fn go_to(&mut self, now: Instant, to: AlState) {
        if let Err(code) = self.application.check_transition(self.state, to) {
            return self.fail(code);
        }
        let up = judge(self.state, to) == Verdict::Up;
        self.enter(to);
        // Inputs must be there before the main device reads them, and OP begins with outputs.
        if up && (to == AlState::SafeOp || !self.has_sync0()) && self.runs_process_data() {
            self.run_cycle(now);
        }
    }

    fn enter(&mut self, to: AlState) {
        if to == AlState::Init {
            self.mailbox = Mailbox::new();
            self.application.reset_mailbox();
        }
        if to != AlState::Op {
            self.outputs_came = false;
        }
        self.op_requested = None;
        self.state = to;
        self.show_state();
    }

    fn fail(&mut self, code: AlStatusCode) {
        self.error = Some(code);
        self.show_state();
    }

    /// Copies state and error to AL status.
    fn show_state(&mut self) {
        let flag = if self.error.is_some() { AL_STATUS_ERROR } else { 0 };
        let memory = &mut self.controller.memory;
        memory.set_u16(AL_STATUS, u16::from(self.state.to_wire() | flag));
        memory.set_u16(AL_STATUS_CODE, self.error.unwrap_or_default().0);
        self.controller.events |= ECAT_EVENT_AL_STATUS;
    }

    fn sync_manager(&self, index: usize) -> Option<&SyncManager> {
        self.controller.sync_managers.get(index)
    }

    /// A sync manager was switched or changed: the state may have lost its ground.
    fn check_running(&mut self) {
        if self.state != AlState::Init
            && let Err(code) = self.check(AlState::PreOp)
        {
            self.enter(AlState::Init);
            self.fail(code);
        } else if self.runs_process_data()
            && let Err(code) = self.check_process_data()
        {
            self.enter(AlState::PreOp);
            self.fail(code);
        }
    }

    /// Whether the ESC is set up as `to` needs it.
    fn check(&self, to: AlState) -> Result<(), AlStatusCode> {
        match to {
            AlState::PreOp if self.has_mailbox && !Mailbox::is_set_up(&self.controller) => {
                Err(AlStatusCode::INVALID_MAILBOX_CONFIGURATION)
            }
            AlState::SafeOp => self.check_process_data().and_then(|()| self.check_sync0()),
            AlState::Op => self.check_sync0(),
            _ => Ok(()),
        }
    }

    fn check_process_data(&self) -> Result<(), AlStatusCode> {
        let fits = |index: usize, length: usize, output: bool| {
            self.sync_manager(index).is_some_and(|manager| {
                if length == 0 {
                    return !manager.is_enabled();
                }
                manager.is_usable()
                    && !manager.is_mailbox()
                    && manager.is_output() == output
                    && manager.length() == length
            })
        };
        if !fits(OUTPUTS, self.application.output_len(), true) {
            return Err(AlStatusCode::INVALID_OUTPUT_CONFIGURATION);
        }
        if !fits(INPUTS, self.application.input_len(), false) {
            return Err(AlStatusCode::INVALID_INPUT_CONFIGURATION);
        }
        let managers = &self.controller.sync_managers;
        let overlap = managers.iter().enumerate().any(|(index, one)| {
            managers.iter().skip(index + 1).any(|other| {
                one.is_usable()
                    && other.is_usable()
                    && usize::from(one.start()) < other.end()
                    && usize::from(other.start()) < one.end()
            })
        });
        if overlap { Err(AlStatusCode::INVALID_SYNC_MANAGER_CONFIGURATION) } else { Ok(()) }
    }

    /// A SYNC0 that is active must not be faster than the device.
    fn check_sync0(&self) -> Result<(), AlStatusCode> {
        let cycle_ns = self.controller.memory.u32(DC_SYNC0_CYCLE);
        if self.has_sync0() && cycle_ns < self.min_sync0_cycle_ns {
            return Err(AlStatusCode::INVALID_SYNC_CYCLE);
        }
        Ok(())
    }

    /// One cycle of the application, with outputs in OP.
    fn run_cycle(&mut self, now: Instant) {
        self.last_cycle = Some(now);
        let controller = &mut self.controller;
        let outputs = if self.powered && self.state == AlState::Op {
            let length = self.application.output_len();
            let address =
                controller.sync_managers.get(OUTPUTS).and_then(SyncManager::newest_address);
            address.and_then(|address| controller.memory.get(address, length))
        } else {
            None
        };
        let length = self.application.input_len();
        let inputs = self.inputs.get_mut(..length).unwrap_or_default();
        self.application.cycle(now, outputs, inputs);
        if let (true, Some(manager)) =
            (outputs.is_some(), controller.sync_managers.get_mut(OUTPUTS))
        {
            manager.take();
            controller.show_sync_manager(OUTPUTS);
        }
        if self.runs_process_data() {
            self.publish(length);
        }
    }

    /// Hands the inputs to the ESC.
    fn publish(&mut self, length: usize) {
        let controller = &mut self.controller;
        let Some(manager) = controller.sync_managers.get_mut(INPUTS) else { return };
        if !manager.is_usable() || manager.length() != length {
            return;
        }
        let target = controller.memory.get_mut(manager.free_address(), length);
        if let (Some(target), Some(inputs)) = (target, self.inputs.get(..length)) {
            target.copy_from_slice(inputs);
            manager.put();
            controller.show_sync_manager(INPUTS);
        }
    }

    /// Says whether there is a device behind; a link that goes away is counted.
    pub(super) fn set_follower(&mut self, follower: bool) {
        if self.follower && !follower {
            self.controller.memory.count(LOST_LINKS + 1);
        }
        self.follower = follower;
        self.show_ports();
    }

    /// What becomes of a frame behind this device.
    pub(super) fn onward(&self) -> Onward {
        match self.controller.memory.u32(DL_CONTROL) >> DL_CONTROL_PORT_1_SHIFT & 3 {
            3 => Onward::TurnsBack,
            2 if !self.follower => Onward::IsLost,
            _ if self.follower => Onward::GoesOn,
            _ => Onward::TurnsBack,
        }
    }

    /// Copies the state of the ports to DL status.
    fn show_ports(&mut self) {
        let mut status = DL_STATUS_OPERATIONAL | DL_STATUS_PORT_0_OPEN | DL_STATUS_PORTS_2_3_CLOSED;
        if !self.controller.watchdogs.firmware_has_expired() {
            status |= DL_STATUS_PDI_WATCHDOG;
        }
        if self.follower {
            status |= DL_STATUS_PORT_1_LINK;
        }
        status |= match self.onward() {
            Onward::GoesOn => DL_STATUS_PORT_1_FRAMES,
            Onward::TurnsBack => DL_STATUS_PORT_1_CLOSED,
            Onward::IsLost => 0,
        };
        if status != self.controller.memory.u16(DL_STATUS) {
            self.controller.memory.set_u16(DL_STATUS, status);
            self.controller.events |= ECAT_EVENT_DL_STATUS;
        }
    }
}

/// What becomes of a frame behind a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Onward {
    /// It reaches the next device.
    GoesOn,
    /// The loop is closed.
    TurnsBack,
    /// The loop is held open and nothing is behind it.
    IsLost,
}
