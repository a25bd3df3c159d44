//! Arbitrary callers and robots around the PLC-side engine: nothing panics, every ticket and every
//! action ends at most once, and no image holds what must never be sent.
#![no_main]

use std::collections::BTreeSet;

use arbitrary::Arbitrary;
use fieldarm::cycle::InputQuality;
use fieldarm::engine::meca500::{
    Action, ByteOrderSetting, CheckpointPolicy, CheckpointRange, Config, ConnectionPhase, Engine,
    Event,
};
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::meca500::command::{MotionCommand, MotionCommandId, VelocityCommand};
use fieldarm::wire::meca500::dynamic::DynamicType;
use fieldarm::wire::meca500::image::{
    FieldType, FirmwareLayout, INPUT_LEN, InputImage, MotionControlFlags, MotionStatusFlags,
    OUTPUT_FIELDS, OUTPUT_LEN, OutputImage, RobotControlFlags, RobotStatusFlags, SafetyResettable,
    SafetySignals,
};
use fieldarm::wire::meca500::revision::Revision;
use fieldarm::wire::order::{Big, ByteOrder, Endian, ImageOrder, Little};
use libfuzzer_sys::fuzz_target;

const QUEUE: usize = 8;
/// More events than this can never wait: queue, ledger and event queue together.
const DRAIN_LIMIT: usize = 2_000;

#[derive(Arbitrary, Debug)]
struct Settings {
    order: Order,
    layout_is_old: bool,
    is_r4: bool,
    settle_cycles: u8,
    arm_cycles: u8,
    withdraw_cycles: u8,
    ack_timeout_ms: u8,
    bad_cycles_limit: u8,
    velocity_bad_cycles_limit: u8,
    reboot_confirm_cycles: u8,
    first_move_id: Option<u16>,
    policy: Policy,
    range: Option<(u16, u16)>,
    edge_hold_cycles: u8,
    edge_low_cycles: u8,
    velocity_dead_man_ms: u8,
    mode_gap_cycles: u8,
    allow_brakes: bool,
    host_time_cycles: u8,
    dynamic_patience_cycles: u8,
}

#[derive(Arbitrary, Clone, Copy, Debug)]
enum Order {
    Big,
    Little,
    AutoFromBig,
    AutoFromLittle,
}

#[derive(Arbitrary, Debug)]
enum Policy {
    EachCommand,
    Every(u16),
    WhenEmpty,
}

#[derive(Arbitrary, Debug)]
enum Op {
    Submit {
        id: u8,
        arguments: [i16; 6],
    },
    SubmitMove,
    SubmitCheckpoint(u16),
    SubmitRaw {
        id: u32,
        arguments: [f32; 6],
    },
    Request(Request),
    Velocity {
        frame: u8,
        velocities: [f32; 6],
    },
    StopVelocity,
    Proceed,
    Discard,
    Subscribe(u8),
    Unsubscribe(u8),
    Poll(u8),
    Change(Change),
    /// So many cycles, a millisecond each, of a robot that echoes and reaches its checkpoints.
    Live(u8),
    Cycle(Cycle),
    Raw {
        bytes: Vec<u8>,
        quality: Quality,
    },
    WrongLength {
        inputs: u8,
        outputs: u8,
    },
    Time(u64),
    Back(u32),
    Wait(u32),
}

#[derive(Arbitrary, Clone, Copy, Debug)]
enum Request {
    Activate,
    Deactivate,
    Home,
    ResetError,
    Resume,
    Pause,
    Clear,
    Simulation(bool),
    RecoveryMode(bool),
    Brakes(bool),
    HostTime(u32),
    Reboot,
    ClearHoming,
    BringUp,
    Recover,
    DisableEtherCat,
}

/// What the robot shows from now on.
#[derive(Arbitrary, Clone, Copy, Debug)]
enum Change {
    Robot(u16),
    Up,
    Motion(u8),
    Error(u16),
    Signals(u8, u8),
    FifoSpace(u16),
    MoveId(u16),
    Reached(u16),
    Discarded(u16),
    ClockBack(u16),
    Echoes(bool),
    Confirms(bool),
    ReachesCheckpoints(bool),
    DynamicType(u8, u8),
}

#[derive(Arbitrary, Clone, Copy, Debug)]
struct Cycle {
    quality: Quality,
    micros: u16,
}

#[derive(Arbitrary, Clone, Copy, Debug)]
enum Quality {
    Fresh,
    Stale(u32),
    Lost,
}

impl From<Quality> for InputQuality {
    fn from(quality: Quality) -> Self {
        match quality {
            Quality::Fresh => Self::Fresh,
            Quality::Stale(age_cycles) => Self::Stale { age_cycles },
            Quality::Lost => Self::Lost,
        }
    }
}

impl From<Request> for Action {
    fn from(request: Request) -> Self {
        match request {
            Request::Activate => Self::Activate,
            Request::Deactivate => Self::Deactivate,
            Request::Home => Self::Home,
            Request::ResetError => Self::ResetError,
            Request::Resume => Self::Resume,
            Request::Pause => Self::Pause,
            Request::Clear => Self::Clear,
            Request::Simulation(on) => Self::Simulation(on),
            Request::RecoveryMode(on) => Self::RecoveryMode(on),
            Request::Brakes(engaged) => Self::Brakes { engaged },
            Request::HostTime(seconds) => Self::HostTime(seconds),
            Request::Reboot => Self::Reboot,
            Request::ClearHoming => Self::ClearHoming,
            Request::BringUp => Self::BringUp,
            Request::Recover => Self::Recover,
            Request::DisableEtherCat => Self::DisableEtherCat,
        }
    }
}

fn config(settings: &Settings) -> Config {
    Config {
        byte_order: match settings.order {
            Order::Big => ByteOrderSetting::Fixed(ByteOrder::BIG),
            Order::Little => ByteOrderSetting::Fixed(ByteOrder::LITTLE),
            Order::AutoFromBig | Order::AutoFromLittle => ByteOrderSetting::Auto,
        },
        layout: if settings.layout_is_old { FirmwareLayout::V10_2 } else { FirmwareLayout::V11_3 },
        revision: if settings.is_r4 { Revision::R4 } else { Revision::R3 },
        settle_cycles: (settings.settle_cycles % 16).into(),
        arm_cycles: (settings.arm_cycles % 16).into(),
        withdraw_cycles: (settings.withdraw_cycles % 16).into(),
        ack_timeout: Duration::from_millis(settings.ack_timeout_ms.into()),
        bad_cycles_limit: settings.bad_cycles_limit.into(),
        velocity_bad_cycles_limit: settings.velocity_bad_cycles_limit.into(),
        reboot_confirm_cycles: settings.reboot_confirm_cycles,
        first_move_id: settings.first_move_id,
        checkpoints: match settings.policy {
            Policy::EachCommand => CheckpointPolicy::EachCommand,
            Policy::Every(count) => CheckpointPolicy::Every(count),
            Policy::WhenEmpty => CheckpointPolicy::WhenEmpty,
        },
        checkpoint_range: settings.range.map_or(Config::default().checkpoint_range, |range| {
            CheckpointRange { first: range.0, last: range.1 }
        }),
        edge_hold_cycles: (settings.edge_hold_cycles % 16).into(),
        edge_low_cycles: (settings.edge_low_cycles % 16).into(),
        velocity_dead_man: Duration::from_millis(settings.velocity_dead_man_ms.into()),
        mode_gap_cycles: (settings.mode_gap_cycles % 16).into(),
        allow_brakes: settings.allow_brakes,
        host_time_cycles: settings.host_time_cycles.into(),
        dynamic_patience_cycles: settings.dynamic_patience_cycles.into(),
        ..Config::default()
    }
}

/// What the robot shows, as plain values.
struct Robot {
    status: RobotStatusFlags,
    motion: MotionStatusFlags,
    error: u16,
    signals: u8,
    resettable: u8,
    fifo_space: u16,
    echo: u16,
    reached: u16,
    discarded: u16,
    clock_us: u64,
    dynamic: [u32; 4],
    echoes: bool,
    confirms: bool,
    reaches_checkpoints: bool,
}

impl Robot {
    fn up() -> Self {
        Self {
            status: RobotStatusFlags::ACTIVATED | RobotStatusFlags::HOMED,
            motion: MotionStatusFlags::empty(),
            error: 0,
            signals: 0,
            resettable: 0,
            fifo_space: 13_000,
            echo: 0,
            reached: 0,
            discarded: 0,
            clock_us: 1_000_000,
            dynamic: [0; 4],
            echoes: true,
            confirms: true,
            reaches_checkpoints: true,
        }
    }

    fn change(&mut self, change: Change) {
        match change {
            Change::Robot(bits) => self.status = RobotStatusFlags::from_bits_retain(bits as _),
            Change::Up => *self = Self { clock_us: self.clock_us, echo: self.echo, ..Self::up() },
            Change::Motion(bits) => self.motion = MotionStatusFlags::from_bits_retain(bits as _),
            Change::Error(code) => self.error = code,
            Change::Signals(signals, resettable) => {
                (self.signals, self.resettable) = (signals, resettable);
            }
            Change::FifoSpace(space) => self.fifo_space = space,
            Change::MoveId(echo) => self.echo = echo,
            Change::Reached(number) => self.reached = number,
            Change::Discarded(number) => self.discarded = number,
            Change::ClockBack(millis) => {
                self.clock_us = self.clock_us.saturating_sub(u64::from(millis) * 1_000);
            }
            Change::Echoes(on) => self.echoes = on,
            Change::Confirms(on) => self.confirms = on,
            Change::ReachesCheckpoints(on) => self.reaches_checkpoints = on,
            Change::DynamicType(slot, ty) => self.dynamic[usize::from(slot % 4)] = ty.into(),
        }
    }

    fn take<O: ImageOrder>(&mut self, outputs: &OutputImage<O>) {
        let control = outputs.robot_control.flags.get();
        if self.confirms {
            let has = |flag| control.contains(flag);
            if has(RobotControlFlags::DEACTIVATE_ROBOT) {
                self.status.remove(RobotStatusFlags::ACTIVATED | RobotStatusFlags::HOMED);
            } else if has(RobotControlFlags::ACTIVATE_ROBOT) {
                self.status.insert(RobotStatusFlags::ACTIVATED);
            }
            if has(RobotControlFlags::HOME) {
                self.status.insert(RobotStatusFlags::HOMED);
            }
            if has(RobotControlFlags::RESET_ERROR) {
                self.error = 0;
            }
            self.status.set(RobotStatusFlags::SIM_ACTIVATED, has(RobotControlFlags::ACTIVATE_SIM));
            self.status
                .set(RobotStatusFlags::RECOVERY_MODE, has(RobotControlFlags::ENABLE_RECOVERY_MODE));
            let motion = outputs.motion_control.flags.get();
            if motion.contains(MotionControlFlags::CLEAR_MOTION) {
                self.motion.insert(MotionStatusFlags::CLEARED | MotionStatusFlags::PAUSED);
            } else if motion.contains(MotionControlFlags::PAUSE_MOTION) {
                self.motion.insert(MotionStatusFlags::PAUSED);
            } else if motion.contains(MotionControlFlags::RESUME_MOTION) {
                self.motion.remove(MotionStatusFlags::CLEARED | MotionStatusFlags::PAUSED);
            }
        }
        let flags = outputs.motion_control.flags.get();
        if self.echoes && flags.contains(MotionControlFlags::SET_POINT) {
            self.echo = outputs.motion_control.move_id.get();
            let id = outputs.motion_command.motion_command_id.get();
            if self.reaches_checkpoints && id == MotionCommandId::SET_CHECKPOINT.0 {
                self.reached = outputs.motion_command_args.argument[0].get() as u16;
            }
        }
        for (shown, asked) in
            self.dynamic.iter_mut().zip(outputs.dynamic_data_configuration.dynamic_data_type_id)
        {
            *shown = asked.get();
        }
    }

    fn show<O: ImageOrder>(&self, bytes: &mut [u8; INPUT_LEN]) {
        let image = InputImage::<O>::from_bytes_mut(bytes).unwrap();
        image.robot_status.flags.set_raw(self.status);
        image.robot_status.error_code.set(self.error);
        image.motion_status.flags.set_raw(self.motion);
        image.motion_status.move_id.set(self.echo);
        image.motion_status.fifo_space.set(self.fifo_space);
        image.motion_status.checkpoint_reached.set(self.reached);
        image.motion_status.checkpoint_discarded.set(self.discarded);
        let signals = SafetySignals::from_bits_retain(self.signals.into());
        image.safety_status.signals.set_raw(signals);
        let resettable = SafetyResettable::from_bits_retain(self.resettable.into());
        image.safety_status.resettable.set_raw(resettable);
        image.robot_timestamp.seconds.set((self.clock_us / 1_000_000) as u32);
        image.robot_timestamp.microseconds.set((self.clock_us % 1_000_000) as u32);
        for (slot, ty) in image.dynamic_data.iter_mut().zip(self.dynamic) {
            slot.dynamic_type.set(ty);
        }
    }
}

/// What was sent with a MoveID.
type Sent = (u16, u32, [u32; 6]);

struct Bench {
    engine: Engine<QUEUE>,
    robot: Robot,
    is_little: bool,
    now: Instant,
    inputs: [u8; INPUT_LEN],
    outputs: [u8; OUTPUT_LEN],
    issued: u32,
    open: BTreeSet<u32>,
    actions: Vec<Action>,
    last: Sent,
}

impl Bench {
    fn submit(&mut self, command: MotionCommand) {
        let space = self.engine.queue_space();
        match self.engine.submit(command) {
            Ok(ticket) => {
                self.issued += 1;
                assert_eq!(ticket.number(), self.issued);
                assert!(self.open.insert(ticket.number()));
                assert_eq!(self.engine.queue_space() + 1, space);
            }
            Err(_) => assert_eq!(self.engine.queue_space(), space),
        }
    }

    fn request(&mut self, action: Action) {
        if self.engine.request(action).is_ok() {
            self.actions.push(action);
        }
    }

    /// Polls one event; false if there is none.
    fn poll(&mut self) -> bool {
        let Some(event) = self.engine.poll_event() else { return false };
        match event {
            Event::Done { ticket }
            | Event::Aborted { ticket, .. }
            | Event::Unknown { ticket, .. } => {
                assert!(self.open.remove(&ticket.number()), "{event:?} ends no open ticket");
            }
            Event::Accepted { ticket, .. } | Event::Started { ticket } => {
                assert!(ticket.number() <= self.issued, "{event:?}");
            }
            Event::ActionDone(action) | Event::ActionFailed { action, .. } => {
                let position = self.actions.iter().position(|open| *open == action);
                let position = position.unwrap_or_else(|| panic!("{event:?} ends no open action"));
                self.actions.swap_remove(position);
            }
            _ => {}
        }
        true
    }

    fn live(&mut self, quality: InputQuality, step: Duration) {
        self.now += step;
        let step_us = u64::try_from(step.as_micros()).unwrap_or(u64::MAX);
        self.robot.clock_us = self.robot.clock_us.saturating_add(step_us) % (1 << 50);
        if self.is_little {
            self.robot.take(OutputImage::<Little>::from_bytes(&self.outputs).unwrap());
            self.robot.show::<Little>(&mut self.inputs);
        } else {
            self.robot.take(OutputImage::<Big>::from_bytes(&self.outputs).unwrap());
            self.robot.show::<Big>(&mut self.inputs);
        }
        self.cycle(quality);
    }

    fn cycle(&mut self, quality: InputQuality) {
        // Whatever the buffer held before, the image is the engine's alone.
        self.outputs = [0xFF; OUTPUT_LEN];
        self.engine.cycle_bytes(self.now, quality, &self.inputs, &mut self.outputs).unwrap();
        self.judge();
    }

    fn judge(&mut self) {
        let status = self.engine.status();
        assert_eq!(self.engine.pending(), self.open.len());
        assert_eq!(status.pending, self.open.len());
        let Some(order) = self.engine.byte_order() else {
            assert_eq!(self.outputs, [0; OUTPUT_LEN]);
            return;
        };
        if status.phase != ConnectionPhase::Connected {
            assert_eq!(self.outputs, [0; OUTPUT_LEN], "{status:?}");
        }
        for field in OUTPUT_FIELDS.iter().filter(|field| field.field_type == FieldType::Reserved) {
            let value = field.read(&self.outputs, order).unwrap();
            assert_eq!(value.to_string(), "0", "reserved bits of {}", field.section);
        }
        match (order.integers, order.reals) {
            (Endian::BigEndian, Endian::BigEndian) => self.judge_image::<Big>(),
            (Endian::LittleEndian, Endian::LittleEndian) => self.judge_image::<Little>(),
            // Found in arbitrary bytes: the rules that depend on the order are judged above.
            _ => {}
        }
    }

    fn judge_image<O: ImageOrder>(&mut self) {
        let image = OutputImage::<O>::from_bytes(&self.outputs).unwrap();
        let move_id = image.motion_control.move_id.get();
        let id = image.motion_command.motion_command_id.get();
        let arguments = image.motion_command_args.argument.map(|value| value.get());
        let flags = image.motion_control.flags.get();
        assert!(arguments.iter().all(|value| value.is_finite()), "{arguments:?}");
        if move_id == 0 && flags.contains(MotionControlFlags::SET_POINT) {
            assert!((21..=23).contains(&id), "MoveID 0 with command {id}");
        }
        if move_id != 0 {
            assert!(!(21..=23).contains(&id), "velocity command {id} with MoveID {move_id}");
        }
        if !self.engine.config().allow_brakes {
            assert!(image.brakes_control.flags.get().is_empty());
        }
        let sent = (move_id, id, arguments.map(f32::to_bits));
        let (last_move_id, last_id, _) = self.last;
        if move_id != 0 && move_id == last_move_id && id != 0 && last_id != 0 {
            assert_eq!(sent, self.last, "one MoveID carries two commands");
        }
        self.last = sent;
    }
}

fn velocity(frame: u8, velocities: [f32; 6]) -> VelocityCommand {
    match frame % 3 {
        0 => VelocityCommand::MoveJointsVel(velocities),
        1 => VelocityCommand::MoveLinVelWrf(velocities),
        _ => VelocityCommand::MoveLinVelTrf(velocities),
    }
}

fn apply(bench: &mut Bench, op: Op) {
    match op {
        Op::Submit { id, arguments } => {
            let arguments = arguments.map(|value| f32::from(value) / 16.0);
            bench.submit(MotionCommand::decode(MotionCommandId(id.into()), arguments));
        }
        Op::SubmitMove => bench.submit(MotionCommand::MoveJoints([0.0; 6])),
        Op::SubmitCheckpoint(number) => bench.submit(MotionCommand::SetCheckpoint(number)),
        Op::SubmitRaw { id, arguments } => {
            bench.submit(MotionCommand::Raw { id: MotionCommandId(id), arguments });
        }
        Op::Request(request) => bench.request(request.into()),
        Op::Velocity { frame, velocities } => {
            let _ = bench.engine.set_velocity(velocity(frame, velocities));
        }
        Op::StopVelocity => bench.engine.stop_velocity(),
        Op::Proceed => bench.engine.proceed(),
        Op::Discard => bench.engine.discard_waiting(),
        Op::Subscribe(ty) => {
            let _ = bench.engine.subscribe(DynamicType(ty.into()));
        }
        Op::Unsubscribe(ty) => bench.engine.unsubscribe(DynamicType(ty.into())),
        Op::Poll(count) => {
            for _ in 0..count {
                if !bench.poll() {
                    break;
                }
            }
        }
        Op::Change(change) => bench.robot.change(change),
        Op::Live(cycles) => {
            for _ in 0..cycles {
                bench.live(InputQuality::Fresh, Duration::from_millis(1));
            }
        }
        Op::Cycle(cycle) => {
            bench.live(cycle.quality.into(), Duration::from_micros(cycle.micros.into()));
        }
        Op::Raw { bytes, quality } => {
            for (input, byte) in bench.inputs.iter_mut().zip(bytes) {
                *input = byte;
            }
            bench.cycle(quality.into());
        }
        Op::WrongLength { inputs, outputs } => {
            let (inputs, mut outputs) = (vec![1; inputs.into()], vec![1; outputs.into()]);
            let is_right = inputs.len() == INPUT_LEN && outputs.len() == OUTPUT_LEN;
            if !is_right {
                let before = bench.engine.statistics();
                let quality = InputQuality::Fresh;
                let result = bench.engine.cycle_bytes(bench.now, quality, &inputs, &mut outputs);
                assert!(result.is_err());
                assert!(outputs.iter().all(|byte| *byte == 1));
                assert_eq!(bench.engine.statistics(), before);
            }
        }
        Op::Time(nanos) => bench.now = Instant::from_nanos(nanos),
        Op::Back(micros) => {
            let nanos = u64::from(micros) * 1_000;
            bench.now = Instant::from_nanos(bench.now.as_nanos().saturating_sub(nanos));
        }
        Op::Wait(micros) => bench.now += Duration::from_micros(micros.into()),
    }
    assert_eq!(bench.engine.pending(), bench.open.len());
}

fuzz_target!(|case: (Settings, Vec<Op>)| {
    let (settings, ops) = case;
    let mut bench = Bench {
        engine: Engine::new(config(&settings)),
        robot: Robot::up(),
        is_little: matches!(settings.order, Order::Little | Order::AutoFromLittle),
        now: Instant::ZERO,
        inputs: [0; INPUT_LEN],
        outputs: [0; OUTPUT_LEN],
        issued: 0,
        open: BTreeSet::new(),
        actions: Vec::new(),
        last: (0, 0, [0; 6]),
    };
    for op in ops {
        apply(&mut bench, op);
    }
    // Without a connection every action but a reboot has ended.
    for _ in 0..4 {
        bench.cycle(InputQuality::Lost);
        (0..DRAIN_LIMIT).take_while(|_| bench.poll()).count();
    }
    if bench.engine.byte_order().is_some() {
        assert!(
            bench.actions.iter().all(|action| *action == Action::Reboot),
            "{:?}",
            bench.actions
        );
    }
    let drained = (0..DRAIN_LIMIT).take_while(|_| bench.poll()).count();
    assert!(drained < DRAIN_LIMIT, "events without end");
    assert_eq!(bench.engine.pending(), bench.open.len());
});
