//! A robot just large enough to test the engine, written from the manual, with a switch for each
//! open reading of it; and the bench that joins the two with checkers looking at every image.
//!
//! It moves nothing: a queued command "runs" for a number of cycles. It shares only `wire` with the
//! engine.

// Each test file uses its own part of the bench, and none of it outside of itself.
#![allow(dead_code, unreachable_pub)]

use std::collections::{HashMap, VecDeque};

use fieldarm::cycle::InputQuality;
use fieldarm::engine::meca500::{Action, Config, Engine, Event, Ticket};
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::meca500::command::MotionCommand;
use fieldarm::wire::meca500::image::{
    BrakesControlFlags, InputImage, MotionControlFlags, MotionStatusFlags, OutputImage,
    RobotControlFlags, RobotStatusFlags, SafetyResettable, SafetySignals,
};
use fieldarm::wire::order::Big;

/// What the robot compares MoveID with (open reading 19).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trigger {
    /// With the last value it accepted.
    LastAccepted,
    /// With that of the previous cycle, whatever SetPoint was.
    PreviousCycle,
    /// With that of the previous cycle, if SetPoint was 1 then.
    PreviousWhileSet,
}

pub const TRIGGERS: [Trigger; 3] =
    [Trigger::LastAccepted, Trigger::PreviousCycle, Trigger::PreviousWhileSet];

/// A command as the robot took it: MoveID, ID, arguments.
pub type Taken = (u16, u32, [f32; 6]);

pub struct Robot {
    pub trigger: Trigger,
    pub acknowledges_no_movement: bool,
    pub acknowledges_refused: bool,
    pub acknowledges: bool,
    /// ErrorCode of a refusal; 0 for none.
    pub refusal_code: u16,
    pub run_cycles: u32,
    pub action_cycles: u32,
    pub ignores_actions: bool,
    pub fifo_size: usize,
    pub clears_on_error: bool,
    pub shows_cleared_on_error: bool,
    pub resume_needs_second_edge: bool,
    pub clock_us: u64,
    pub cycle_us: u64,

    pub activated: bool,
    pub homed: bool,
    pub sim: bool,
    pub recovery: bool,
    pub brakes: bool,
    pub busy: u32,
    pub error: u16,
    pub paused: bool,
    pub cleared: bool,
    pub monitoring: bool,
    pub signals: SafetySignals,
    pub resettable: SafetyResettable,
    pub echo: u16,
    pub last_accepted: u16,
    pub reached: u16,
    pub discarded: u16,
    pub queue: VecDeque<(u32, [f32; 6])>,
    pub running: u32,
    pub previous: Option<(u16, MotionControlFlags)>,
    pub busy_with: RobotControlFlags,
    pub robot_before: RobotControlFlags,

    pub taken: Vec<Taken>,
    pub executed: Vec<(u32, [f32; 6])>,
    pub velocity: Option<(u32, [f32; 6])>,
    pub resumes: u32,
    pub dynamic: fn(u32) -> Option<[f32; 6]>,
    pub dynamic_asked: [u32; 4],
}

impl Robot {
    pub fn new() -> Self {
        Self {
            trigger: Trigger::LastAccepted,
            acknowledges_no_movement: true,
            acknowledges_refused: false,
            acknowledges: true,
            refusal_code: 0,
            run_cycles: 3,
            action_cycles: 5,
            ignores_actions: false,
            fifo_size: 13_000,
            clears_on_error: true,
            shows_cleared_on_error: false,
            resume_needs_second_edge: false,
            clock_us: 5_000_000,
            cycle_us: 1000,
            activated: false,
            homed: false,
            sim: false,
            recovery: false,
            brakes: true,
            busy: 0,
            error: 0,
            paused: false,
            cleared: false,
            monitoring: false,
            signals: SafetySignals::empty(),
            resettable: SafetyResettable::empty(),
            echo: 0,
            last_accepted: 0,
            reached: 0,
            discarded: 0,
            queue: VecDeque::new(),
            running: 0,
            previous: None,
            busy_with: RobotControlFlags::empty(),
            robot_before: RobotControlFlags::empty(),
            taken: Vec::new(),
            executed: Vec::new(),
            velocity: None,
            resumes: 0,
            dynamic: |_| None,
            dynamic_asked: [0; 4],
        }
    }

    /// Activated and homed.
    pub fn ready() -> Self {
        Self { activated: true, homed: true, brakes: false, ..Self::new() }
    }

    /// Everything as after power-up; what was taken stays known to the test.
    pub fn reboot(&mut self) {
        let taken = std::mem::take(&mut self.taken);
        let executed = std::mem::take(&mut self.executed);
        *self = Self {
            trigger: self.trigger,
            acknowledges_no_movement: self.acknowledges_no_movement,
            clock_us: 1000,
            taken,
            executed,
            ..Self::new()
        };
    }

    pub fn lose_queue(&mut self) {
        for (id, arguments) in self.queue.drain(..) {
            if id == 17 {
                self.discarded = arguments[0] as u16;
            }
        }
        self.running = 0;
    }

    pub fn fail(&mut self, code: u16) {
        self.error = code;
        if self.clears_on_error {
            self.lose_queue();
        }
        self.paused = true;
        self.cleared |= self.shows_cleared_on_error;
    }

    pub fn p_stop2(&mut self, clears: bool) {
        self.signals |= SafetySignals::P_STOP2;
        self.paused = true;
        if clears {
            self.lose_queue();
            self.cleared = true;
        }
    }

    fn ready_for_motion(&self) -> bool {
        self.activated && (self.homed || self.recovery) && self.error == 0
    }

    /// Takes one output image (`None`: no controller) and lives for a cycle.
    pub fn live(&mut self, outputs: Option<&OutputImage<Big>>) {
        self.clock_us += self.cycle_us;
        self.velocity = None;
        if let Some(outputs) = outputs {
            self.control(outputs);
            self.motion_bits(outputs);
            self.command(outputs);
            self.dynamic_asked =
                outputs.dynamic_data_configuration.dynamic_data_type_id.map(|ty| ty.get());
            let flags = outputs.motion_control.flags.get();
            self.previous = Some((outputs.motion_control.move_id.get(), flags));
            self.robot_before = outputs.robot_control.flags.get();
        }
        self.run();
    }

    fn control(&mut self, outputs: &OutputImage<Big>) {
        let bits = outputs.robot_control.flags.get();
        let brakes = outputs.brakes_control.flags.get();
        if !self.activated && brakes.contains(BrakesControlFlags::BRAKES_CONTROL_ALLOWED) {
            self.brakes = brakes.contains(BrakesControlFlags::BRAKES_ENGAGED);
        }
        if self.ignores_actions {
            return;
        }
        if self.busy > 0 {
            self.busy -= 1;
            if self.busy == 0 {
                match std::mem::take(&mut self.busy_with) {
                    RobotControlFlags::ACTIVATE_ROBOT => {
                        self.activated = true;
                        self.brakes = false;
                        self.cleared = false;
                    }
                    RobotControlFlags::DEACTIVATE_ROBOT => {
                        self.activated = false;
                        self.brakes = true;
                        self.lose_queue();
                        self.cleared = true;
                    }
                    _ => self.homed = true,
                }
            }
            return;
        }
        let begins = if bits.contains(RobotControlFlags::DEACTIVATE_ROBOT) && self.activated {
            RobotControlFlags::DEACTIVATE_ROBOT
        } else if bits.contains(RobotControlFlags::ACTIVATE_ROBOT)
            && !bits.contains(RobotControlFlags::DEACTIVATE_ROBOT)
            && !self.activated
        {
            RobotControlFlags::ACTIVATE_ROBOT
        } else if bits.contains(RobotControlFlags::HOME) && self.activated && !self.homed {
            RobotControlFlags::HOME
        } else {
            RobotControlFlags::empty()
        };
        if !begins.is_empty() {
            self.busy = self.action_cycles.max(1);
            self.busy_with = begins;
        }
        if bits.contains(RobotControlFlags::RESET_ERROR) {
            self.error = 0;
        }
        if !self.activated {
            self.sim = bits.contains(RobotControlFlags::ACTIVATE_SIM);
        }
        self.recovery = bits.contains(RobotControlFlags::ENABLE_RECOVERY_MODE);
    }

    fn motion_bits(&mut self, outputs: &OutputImage<Big>) {
        let flags = outputs.motion_control.flags.get();
        let stops = MotionControlFlags::PAUSE_MOTION | MotionControlFlags::CLEAR_MOTION;
        if self.ignores_actions {
            return;
        }
        self.paused |= flags.intersects(stops);
        if flags.contains(MotionControlFlags::CLEAR_MOTION) {
            self.lose_queue();
            self.cleared = true;
        }
        let before = self.previous.map_or(MotionControlFlags::all(), |(_, flags)| flags);
        let rising = flags.contains(MotionControlFlags::RESUME_MOTION)
            && !before.contains(MotionControlFlags::RESUME_MOTION);
        let resets = SafetySignals::from_bits_retain(self.resettable.bits());
        if rising && !flags.intersects(stops) && self.signals.difference(resets).is_empty() {
            self.resumes += 1;
            let had_signals = !self.signals.is_empty();
            self.signals = SafetySignals::empty();
            self.resettable = SafetyResettable::empty();
            if !(had_signals && self.resume_needs_second_edge) {
                self.paused = false;
                self.cleared = false;
            }
        }
    }

    fn command(&mut self, outputs: &OutputImage<Big>) {
        let move_id = outputs.motion_control.move_id.get();
        let set_point = outputs.motion_control.flags.contains(MotionControlFlags::SET_POINT);
        let id = outputs.motion_command.motion_command_id.get();
        let arguments = outputs.motion_command_args.argument.map(|value| value.get());
        if !set_point {
            return;
        }
        if move_id == 0 {
            self.velocity = Some((id, arguments));
            self.echo = 0;
            return;
        }
        let triggered = match (self.trigger, self.previous) {
            (Trigger::LastAccepted, _) => move_id != self.last_accepted,
            (_, None) => false,
            (Trigger::PreviousCycle, Some((previous, _))) => move_id != previous,
            (Trigger::PreviousWhileSet, Some((previous, flags))) => {
                flags.contains(MotionControlFlags::SET_POINT) && move_id != previous
            }
        };
        if !triggered || !self.acknowledges {
            return;
        }
        let queued = matches!(id, 1..=20 | 24..=33 | 49..=60);
        let refused = queued && !self.ready_for_motion() || self.queue.len() >= self.fifo_size;
        if refused {
            if self.refusal_code != 0 {
                self.error = self.refusal_code;
            }
            if self.acknowledges_refused {
                self.echo = move_id;
                self.last_accepted = move_id;
            }
            return;
        }
        self.last_accepted = move_id;
        if id == 0 {
            if self.acknowledges_no_movement {
                self.echo = move_id;
            }
            return;
        }
        self.echo = move_id;
        self.taken.push((move_id, id, arguments));
        if queued {
            self.queue.push_back((id, arguments));
        } else if id == 200 {
            self.reboot();
        } else if id == 1002 {
            self.homed = false;
        }
    }

    fn run(&mut self) {
        if self.paused || !self.ready_for_motion() {
            return;
        }
        let mut budget = if self.run_cycles == 0 { usize::MAX } else { 1 };
        while budget > 0 {
            budget -= 1;
            if self.queue.is_empty() {
                return;
            }
            self.running += 1;
            if self.running < self.run_cycles {
                return;
            }
            self.running = 0;
            if let Some((id, arguments)) = self.queue.pop_front() {
                self.executed.push((id, arguments));
                if id == 17 {
                    self.reached = arguments[0] as u16;
                }
            }
        }
    }

    pub fn show(&self, inputs: &mut InputImage<Big>) {
        let mut flags = RobotStatusFlags::empty();
        flags.set(RobotStatusFlags::BUSY, self.busy > 0);
        flags.set(RobotStatusFlags::ACTIVATED, self.activated);
        flags.set(RobotStatusFlags::HOMED, self.homed);
        flags.set(RobotStatusFlags::SIM_ACTIVATED, self.sim);
        flags.set(RobotStatusFlags::BRAKES_ENGAGED, self.brakes);
        flags.set(RobotStatusFlags::RECOVERY_MODE, self.recovery);
        flags.set(RobotStatusFlags::MONITORING_MODE, self.monitoring);
        inputs.robot_status.flags.set(flags);
        inputs.robot_status.error_code.set(self.error);
        let mut motion = MotionStatusFlags::empty();
        motion.set(MotionStatusFlags::PAUSED, self.paused);
        motion.set(MotionStatusFlags::CLEARED, self.cleared);
        motion.set(MotionStatusFlags::EOB, self.queue.is_empty());
        motion.set(MotionStatusFlags::EOM, self.queue.is_empty());
        inputs.motion_status.flags.set(motion);
        inputs.motion_status.move_id.set(self.echo);
        inputs.motion_status.checkpoint_reached.set(self.reached);
        inputs.motion_status.checkpoint_discarded.set(self.discarded);
        let space = self.fifo_size.saturating_sub(self.queue.len());
        inputs.motion_status.fifo_space.set(space as u16);
        inputs.safety_status.signals.set(self.signals);
        inputs.safety_status.resettable.set(self.resettable);
        inputs.robot_timestamp.seconds.set((self.clock_us / 1_000_000) as u32);
        inputs.robot_timestamp.microseconds.set((self.clock_us % 1_000_000) as u32);
        for (slot, asked) in inputs.dynamic_data.iter_mut().zip(self.dynamic_asked) {
            if let Some(values) = (self.dynamic)(asked) {
                slot.dynamic_type.set(asked);
                for (field, value) in slot.value_idx.iter_mut().zip(values) {
                    field.set(value);
                }
            }
        }
    }
}

/// What must hold for every image the engine writes.
#[derive(Default)]
struct Checker {
    carried: HashMap<u16, (u32, [u32; 6])>,
    open: Option<(u16, u32, [u32; 6])>,
}

impl Checker {
    fn look(&mut self, outputs: &OutputImage<Big>, echo: u16) {
        let move_id = outputs.motion_control.move_id.get();
        let set_point = outputs.motion_control.flags.contains(MotionControlFlags::SET_POINT);
        let id = outputs.motion_command.motion_command_id.get();
        let arguments = outputs.motion_command_args.argument.map(|value| value.get().to_bits());
        let robot = outputs.robot_control.flags.get();
        assert!(
            !robot
                .contains(RobotControlFlags::ACTIVATE_ROBOT | RobotControlFlags::DEACTIVATE_ROBOT),
            "activate and deactivate together"
        );
        assert!(RobotControlFlags::all().contains(robot), "reserved bits");
        if set_point && move_id == 0 {
            assert!(matches!(id, 21..=23), "MoveID 0 with command {id}");
        }
        if !set_point || move_id == 0 {
            if !set_point {
                // Frozen while withdrawn, or all zero.
                if let Some(open) = self.open
                    && open.0 == move_id
                {
                    assert_eq!(open, (move_id, id, arguments), "changed while withdrawn");
                }
            }
            if move_id == 0 {
                self.open = None;
            }
            return;
        }
        if id != 0 {
            let carried = self.carried.entry(move_id).or_insert((id, arguments));
            assert_eq!(*carried, (id, arguments), "MoveID {move_id} carries two commands");
        }
        if let Some(open) = self.open
            && open.1 != 0
            && open.0 != echo
        {
            assert_eq!(open, (move_id, id, arguments), "changed before the echo");
        }
        self.open = Some((move_id, id, arguments));
    }
}

/// An engine and a robot on a bus with a delay.
pub struct Bench {
    pub engine: Engine<64>,
    pub robot: Robot,
    pub now: Instant,
    pub cycle: Duration,
    pub quality: InputQuality,
    /// Cycles an output image is under way.
    pub out_delay: usize,
    /// Cycles an input image is under way.
    pub in_delay: usize,
    /// Whether images reach the robot and come back.
    pub linked: bool,
    pub inputs: InputImage<Big>,
    pub outputs: OutputImage<Big>,
    pub events: Vec<Event>,
    pub polls: bool,
    under_way: VecDeque<OutputImage<Big>>,
    coming_back: VecDeque<InputImage<Big>>,
    checker: Checker,
}

impl Bench {
    pub fn new(config: Config, robot: Robot) -> Self {
        Self {
            engine: Engine::new(config),
            robot,
            now: Instant::from_millis(100),
            cycle: Duration::from_millis(1),
            quality: InputQuality::Fresh,
            out_delay: 0,
            in_delay: 0,
            linked: true,
            inputs: InputImage::zeroed(),
            outputs: OutputImage::zeroed(),
            events: Vec::new(),
            polls: true,
            under_way: VecDeque::new(),
            coming_back: VecDeque::new(),
            checker: Checker::default(),
        }
    }

    /// A connected bench with a robot that is ready.
    pub fn connected(config: Config) -> Self {
        Self::connected_to(config, Robot::ready())
    }

    pub fn connected_to(config: Config, robot: Robot) -> Self {
        let mut bench = Self::new(config, robot);
        bench.until(100, |bench| bench.saw(|event| matches!(event, Event::Connected { .. })));
        bench
    }

    /// One bus cycle: the robot lives on what reached it, the engine on what came back.
    pub fn step(&mut self) {
        self.now += self.cycle;
        if self.linked {
            self.under_way.push_back(self.outputs);
            let arrived = if self.under_way.len() > self.out_delay {
                self.under_way.pop_front()
            } else {
                None
            };
            self.robot.live(arrived.as_ref());
            let mut shown = InputImage::zeroed();
            self.robot.show(&mut shown);
            self.coming_back.push_back(shown);
            if self.coming_back.len() > self.in_delay
                && let Some(inputs) = self.coming_back.pop_front()
            {
                self.inputs = inputs;
            }
        } else {
            self.robot.live(None);
            self.under_way.clear();
            self.coming_back.clear();
        }
        let inputs = self.inputs;
        let mut outputs = self.outputs;
        self.engine.cycle(self.now, self.quality, &inputs, &mut outputs);
        self.checker.look(&outputs, inputs.motion_status.move_id.get());
        self.outputs = outputs;
        if self.polls {
            self.poll();
        }
    }

    pub fn poll(&mut self) {
        while let Some(event) = self.engine.poll_event() {
            self.events.push(event);
        }
    }

    pub fn steps(&mut self, count: usize) {
        for _ in 0..count {
            self.step();
        }
    }

    /// Steps until `reached`; panics with the events if it takes longer than `limit` cycles.
    #[track_caller]
    pub fn until(&mut self, limit: usize, reached: impl Fn(&Self) -> bool) -> usize {
        for cycles in 0..limit {
            if reached(self) {
                return cycles;
            }
            self.step();
        }
        assert!(reached(self), "not within {limit} cycles; events: {:#?}", self.events);
        limit
    }

    pub fn saw(&self, is: impl Fn(&Event) -> bool) -> bool {
        self.events.iter().any(is)
    }

    pub fn saw_event(&self, event: Event) -> bool {
        self.events.contains(&event)
    }

    pub fn submit(&mut self, command: MotionCommand) -> Ticket {
        self.engine.submit(command).expect("the command is taken")
    }

    /// A move that can be told from others by `number`.
    pub fn submit_move(&mut self, number: u16) -> Ticket {
        self.submit(move_number(number))
    }

    /// Asks for an action and steps until it ends; whether it was done.
    #[track_caller]
    pub fn act(&mut self, action: Action, limit: usize) -> bool {
        let before = self.events.len();
        self.engine.request(action).expect("the action is taken");
        let done = Event::ActionDone(action);
        for _ in 0..limit {
            self.step();
            for event in &self.events[before..] {
                if *event == done {
                    return true;
                }
                if matches!(event, Event::ActionFailed { action: failed, .. } if *failed == action)
                {
                    return false;
                }
            }
        }
        panic!("{action:?} did not end; events: {:#?}", self.events);
    }

    pub fn lose_link(&mut self) {
        self.linked = false;
        self.quality = InputQuality::Lost;
    }

    pub fn restore_link(&mut self) {
        self.linked = true;
        self.quality = InputQuality::Fresh;
    }

    /// The final event of a ticket; panics if there are two.
    #[track_caller]
    pub fn final_event(&self, ticket: Ticket) -> Option<Event> {
        let mut finals = self.events.iter().filter(|event| final_ticket(event) == Some(ticket));
        let first = finals.next().copied();
        assert_eq!(finals.next(), None, "two final events for {ticket:?}");
        first
    }

    pub fn set_point(&self) -> bool {
        self.outputs.motion_control.flags.contains(MotionControlFlags::SET_POINT)
    }

    pub fn is_silent(&self) -> bool {
        use fieldarm::wire::meca500::image::OUTPUT_LEN;
        let bytes: &[u8] = zerocopy::IntoBytes::as_bytes(&self.outputs);
        bytes == [0; OUTPUT_LEN]
    }

    /// Moves the robot took, by the number of `submit_move`.
    pub fn moves_taken(&self) -> Vec<u16> {
        self.robot.taken.iter().filter(|(_, id, _)| *id == 1).map(|(_, _, a)| a[0] as u16).collect()
    }

    pub fn moves_executed(&self) -> Vec<u16> {
        self.robot.executed.iter().filter(|(id, _)| *id == 1).map(|(_, a)| a[0] as u16).collect()
    }
}

/// A joint move whose first angle is `number` degrees, 0 to 175.
pub fn move_number(number: u16) -> MotionCommand {
    MotionCommand::MoveJoints([f32::from(number), 0.0, 0.0, 0.0, 0.0, 0.0])
}

pub fn final_ticket(event: &Event) -> Option<Ticket> {
    match event {
        Event::Done { ticket } | Event::Aborted { ticket, .. } | Event::Unknown { ticket, .. } => {
            Some(*ticket)
        }
        _ => None,
    }
}
