//! The text face and the cyclic face drive one robot: the same commands through either give the same
//! trajectory, the same settings, the same checkpoints, and the same answers to whoever asks afterwards.
//!
//! The commands are those of the table that both faces have ([`commands`]); what is left out is named
//! in [`LEFT_OUT`].

use fieldarm::cycle::CyclicDevice;
use fieldarm::sim::meca500::{
    FittedTool, MotionSettings, RobotEvent, RobotSettings, SavedVariable, VirtualRobot,
};
use fieldarm::text_device::TextDevice;
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::meca500::command::{ArgumentRange, MotionCommand, MotionCommandId};
use fieldarm::wire::meca500::image::{
    INPUT_LEN, MotionControlFlags, OutputImage, RobotControlFlags,
};
use fieldarm::wire::meca500::revision::Revision;
use fieldarm::wire::meca500::text::{
    Category, CyclicEquivalent, Statement, TextArgumentKind, TextCommandSpec, parse_line,
};
use fieldarm::wire::order::Big;
use proptest::prelude::*;
use proptest::sample::Index;

use crate::desk::content;
#[path = "../support/quick_robot.rs"]
mod quick_robot;

/// How long the arm has to finish, in ms.
const REST_MS: u32 = 4_000;
/// The same after a single command.
const SHORT_REST_MS: u32 = 500;
/// Longer than an activation, a homing or a deactivation of the quick robot.
const CHANGE_MS: u32 = 100;
/// The variable that a command sets.
const VARIABLE: (&str, u16) = ("both", 10_001);
/// Commands of both faces that have a test of their own.
const LEFT_OUT: [&str; 1] = ["RebootRobot"];

/// What a controller does in one millisecond.
#[derive(Clone, Debug)]
enum Act {
    /// A command with a cyclic ID.
    Command(String),
    /// A bit of the images, or its command.
    Bit(Bit),
    /// Nothing, for so many milliseconds.
    Wait(u32),
}

#[derive(Clone, Copy, Debug)]
enum Bit {
    Activate,
    Deactivate,
    Home,
    Pause,
    Clear,
    Resume,
    ResetError,
    Recovery(bool),
    Simulation(bool),
}

impl Bit {
    const fn line(self) -> &'static str {
        match self {
            Self::Activate => "ActivateRobot",
            Self::Deactivate => "DeactivateRobot",
            Self::Home => "Home",
            Self::Pause => "PauseMotion",
            Self::Clear => "ClearMotion",
            Self::Resume => "ResumeMotion",
            Self::ResetError => "ResetError",
            Self::Recovery(true) => "SetRecoveryMode(1)",
            Self::Recovery(false) => "SetRecoveryMode(0)",
            Self::Simulation(true) => "ActivateSim",
            Self::Simulation(false) => "DeactivateSim",
        }
    }
}

/// The commands of the Meca500 that have an ID over the cyclic images.
fn commands() -> impl Iterator<Item = &'static TextCommandSpec> {
    TextCommandSpec::all().filter(|spec| {
        let is_command = matches!(spec.equivalent, CyclicEquivalent::Motion(_));
        is_command && !LEFT_OUT.contains(&spec.name)
    })
}

/// Lowest and highest value of each argument that makes sense for the arm, where the table's range is
/// wider than that or is none.
fn sensible(name: &str, position: usize) -> Option<[f32; 2]> {
    let of_pose = |around: [f32; 6], by: [f32; 6]| {
        let (middle, by) = (around.get(position)?, by.get(position)?);
        Some([middle - by, middle + by])
    };
    match name {
        "MoveJoints" => Some([-25.0, 25.0]),
        "MoveJointsRel" => Some([-8.0, 8.0]),
        "MoveJointsVel" => Some([-15.0, 15.0]),
        "MoveLin" | "MovePose" => {
            of_pose([190.0, 0.0, 290.0, 0.0, 90.0, 0.0], [15.0, 40.0, 30.0, 4.0, 4.0, 20.0])
        }
        "MoveLinRelTrf" | "MoveLinRelWrf" => of_pose([0.0; 6], [20.0, 20.0, 20.0, 5.0, 5.0, 5.0]),
        "MoveLinVelTrf" | "MoveLinVelWrf" => of_pose([0.0; 6], [30.0, 30.0, 30.0, 5.0, 5.0, 5.0]),
        "SetTrf" | "SetWrf" => of_pose([0.0; 6], [20.0, 20.0, 20.0, 2.0, 2.0, 2.0]),
        "SetPayload" => Some(if position == 0 { [0.0, 0.5] } else { [-20.0, 20.0] }),
        "Delay" => Some([0.0, 0.2]),
        "SetMoveDuration" => Some([0.05, 1.0]),
        "SetJointVel" | "SetJointVelLimit" => Some([5.0, 100.0]),
        "SetJointAcc" | "SetCartAcc" => Some([10.0, 150.0]),
        "SetCartLinVel" => Some([20.0, 500.0]),
        "SetCartAngVel" => Some([20.0, 300.0]),
        "SetTimeScaling" => Some([30.0, 100.0]),
        "SetTorqueLimits" => Some([20.0, 100.0]),
        "SetGripperRange" => Some(if position == 0 { [0.0, 2.0] } else { [3.0, 6.0] }),
        "MoveGripper" => Some([0.0, 6.0]),
        "SetGripperVel" => Some([5.0, 100.0]),
        "SetJointLimits" => {
            [None, Some([-60.0, -30.0]), Some([30.0, 60.0])].get(position)?.to_owned()
        }
        "SetWorkZoneLimits" => Some(if position < 3 { [-900.0, -500.0] } else { [500.0, 900.0] }),
        "SetToolSphere" => Some(if position < 3 { [-10.0, 10.0] } else { [0.0, 10.0] }),
        "StartProgram" => Some([6.6, 8.4]),
        _ => None,
    }
}

/// A line of a command with arguments made of `raw`.
fn line(spec: &TextCommandSpec, raw: &[u16; 6]) -> String {
    let at = |[low, high]: [f32; 2], raw: u16| low + (high - low) * f32::from(raw) / 65_535.0;
    if spec.name == "SetVariable" {
        let [a, b, c, ..] = raw.map(|raw| f32::from(raw) / 16.0);
        return format!("SetVariable({},[{a},{b},{c}])", VARIABLE.0);
    }
    if spec.name == "StartProgram" {
        return format!("StartProgram({})", at([6.6, 8.4], raw[0]).round());
    }
    let argument =
        |(position, argument): (usize, fieldarm::wire::meca500::text::TextArgumentSpec)| {
            let raw = raw[position];
            let TextArgumentKind::Number(range) = argument.kind else { panic!("{spec:?}") };
            let value = match (range, sensible(spec.name, position)) {
                (ArgumentRange::OneOf(choices), _) => {
                    f32::from(choices[usize::from(raw) % choices.len()].value)
                }
                (ArgumentRange::Integer { min, max }, _) => {
                    (min + i32::from(raw) % (max - min + 1)) as f32
                }
                (_, Some(within)) => at(within, raw),
                (range, None) => {
                    let low = range.min().unwrap_or(-50.0);
                    at([low, range.max(Revision::R4).unwrap_or(low + 100.0)], raw)
                }
            };
            value.to_string()
        };
    let arguments: Vec<String> = spec.arguments().enumerate().map(argument).collect();
    format!("{}({})", spec.name, arguments.join(","))
}

/// What the cyclic images hold for a line.
fn encoded(line: &str) -> (MotionCommandId, [f32; 6]) {
    let parsed = parse_line(line, Revision::R4).unwrap().unwrap();
    if parsed.spec.name == "SetVariable" {
        let list = line.split(['[', ']']).nth(1).unwrap();
        let mut values = [0.0; 6];
        for (slot, value) in values.iter_mut().zip(list.split(',')) {
            *slot = value.parse().unwrap();
        }
        return (MotionCommandId(VARIABLE.1.into()), values);
    }
    let command: MotionCommand = match Statement::from_parsed(&parsed, Revision::R4).unwrap() {
        Statement::Motion(command) => command,
        Statement::Velocity(velocity) => velocity.into(),
        other => panic!("{other:?}"),
    };
    command.encode()
}

/// What a robot did.
#[derive(Debug, PartialEq)]
struct Record {
    /// Joints and the opening of the gripper, each millisecond.
    trajectory: Vec<[f64; 7]>,
    motion: MotionSettings,
    settings: RobotSettings,
    variable: Vec<f32>,
    events: Vec<RobotEvent>,
    /// Requests and what they were answered with.
    answers: Vec<(&'static str, Vec<String>)>,
}

/// A robot and one way to command it.
struct Rig {
    robot: VirtualRobot,
    now: Instant,
    by_text: bool,
    outputs: OutputImage<Big>,
    inputs: [u8; INPUT_LEN],
    move_id: u16,
    trajectory: Vec<[f64; 7]>,
    events: Vec<RobotEvent>,
}

impl Rig {
    fn new(tool: FittedTool, by_text: bool) -> Self {
        let settings = RobotSettings { tool, ..quick_robot::quick_robot() };
        let mut robot = VirtualRobot::new(settings);
        let (name, cyclic_id) = (VARIABLE.0.to_owned(), VARIABLE.1);
        robot
            .restore_variable(&SavedVariable { name, value: "[1,2,3]".into(), cyclic_id })
            .unwrap();
        let program = ["MoveJointsRel(1,2,3,4,5,6)", "SetCheckpoint(77)", "SetBlending(50)"];
        robot.restore_program(7, program.map(str::to_owned).to_vec()).unwrap();
        let mut rig = Self {
            robot,
            now: Instant::ZERO,
            by_text,
            outputs: OutputImage::zeroed(),
            inputs: [0; INPUT_LEN],
            move_id: 0,
            trajectory: Vec::new(),
            events: Vec::new(),
        };
        rig.act(&Act::Wait(1));
        if by_text {
            assert!(rig.robot.open_control(rig.now));
        } else {
            rig.outputs.motion_control.flags.assign(MotionControlFlags::SET_POINT, true);
        }
        rig
    }

    fn note(&mut self) {
        let [a, b, c, d, e, f] = self.robot.target_joints();
        self.trajectory.push([a, b, c, d, e, f, self.robot.gripper_state().opening_mm]);
        self.events.extend(self.robot.panel().drain_events());
    }

    /// A cycle with a bit at 1 that was at 0 before and will be afterwards, unless it is one that holds
    /// a mode.
    fn cycle_with(&mut self, bit: Option<Bit>) {
        let robot_control = &mut self.outputs.robot_control.flags;
        let motion_control = &mut self.outputs.motion_control.flags;
        for (is_set, flag) in [
            (matches!(bit, Some(Bit::Activate)), RobotControlFlags::ACTIVATE_ROBOT),
            (matches!(bit, Some(Bit::Deactivate)), RobotControlFlags::DEACTIVATE_ROBOT),
            (matches!(bit, Some(Bit::Home)), RobotControlFlags::HOME),
            (matches!(bit, Some(Bit::ResetError)), RobotControlFlags::RESET_ERROR),
        ] {
            robot_control.assign(flag, is_set);
        }
        for (is_set, flag) in [
            (matches!(bit, Some(Bit::Pause)), MotionControlFlags::PAUSE_MOTION),
            (matches!(bit, Some(Bit::Clear)), MotionControlFlags::CLEAR_MOTION),
            (matches!(bit, Some(Bit::Resume)), MotionControlFlags::RESUME_MOTION),
        ] {
            motion_control.assign(flag, is_set);
        }
        match bit {
            Some(Bit::Recovery(on)) => {
                robot_control.assign(RobotControlFlags::ENABLE_RECOVERY_MODE, on);
            }
            Some(Bit::Simulation(on)) => robot_control.assign(RobotControlFlags::ACTIVATE_SIM, on),
            _ => {}
        }
        let Self { robot, outputs, inputs, now, .. } = self;
        robot.cycle(*now, Some(outputs.as_bytes()), inputs);
    }

    fn act(&mut self, act: &Act) {
        self.do_it(act);
        if let Act::Bit(_) = act {
            // A bit rises the next time only if it was low before.
            self.do_it(&Act::Wait(1));
        }
    }

    fn do_it(&mut self, act: &Act) {
        let count = if let Act::Wait(count) = act { *count } else { 1 };
        for _ in 0..count {
            self.now += Duration::from_millis(1);
            if self.by_text {
                self.act_by_text(act);
            } else {
                self.act_cyclically(act);
            }
            self.note();
        }
    }

    fn act_by_text(&mut self, act: &Act) {
        TextDevice::advance(&mut self.robot, self.now);
        self.events.extend(self.robot.panel().drain_events());
        match act {
            Act::Command(line) => {
                self.robot.command(self.now, line);
                if line.starts_with("SetCheckpoint") {
                    // One that the state refuses is told as discarded, over TCP only (`motion`).
                    self.robot.panel().drain_events().for_each(drop);
                }
            }
            Act::Bit(bit) => self.robot.command(self.now, bit.line()),
            Act::Wait(_) => {}
        }
        let mut message = String::new();
        while self.robot.next_control_message(&mut message) {}
    }

    fn act_cyclically(&mut self, act: &Act) {
        if let Act::Command(line) = act {
            let (id, arguments) = encoded(line);
            self.outputs.motion_command.motion_command_id.set(id.0);
            let slots = self.outputs.motion_command_args.argument.iter_mut();
            slots.zip(arguments).for_each(|(slot, value)| slot.set(value));
            self.move_id += 1;
            self.outputs.motion_control.move_id.set(self.move_id);
        }
        self.cycle_with(if let Act::Bit(bit) = act { Some(*bit) } else { None });
    }

    /// What it did, and what it says when it is asked.
    fn record(mut self) -> Record {
        if !self.by_text {
            // The images say nothing any more; nobody took them away, which would be a lost connection.
            assert!(self.robot.open_control(self.now));
        }
        let mut answers = Vec::new();
        let mut message = String::new();
        while self.robot.next_control_message(&mut message) {}
        for spec in TextCommandSpec::all() {
            let asks = spec.name.starts_with("Get") && spec.arguments().next().is_none();
            // Refused checkpoints, the time of day, and who asked for what on which connection.
            let differs = ["GetCheckpointDiscarded", "GetRealTimeMonitoring"].contains(&spec.name);
            if !asks || differs || spec.category == Category::Variable {
                continue;
            }
            self.robot.command(self.now, spec.name);
            let mut said = Vec::new();
            message.clear();
            while self.robot.next_control_message(&mut message) {
                said.push(std::mem::take(&mut message));
            }
            answers.push((spec.name, said));
        }
        let is_known = |event: &RobotEvent| !matches!(event, RobotEvent::Refused(_));
        Record {
            trajectory: self.trajectory,
            motion: *self.robot.motion_settings(),
            settings: self.robot.settings().clone(),
            variable: self.robot.variable(VARIABLE.1).unwrap_or_default().to_vec(),
            events: self.events.into_iter().filter(is_known).collect(),
            answers,
        }
    }
}

/// The life of a robot: configured, brought up, driven, brought down, configured.
fn live(by_text: bool, tool: FittedTool, [resting, driven]: [&[Act]; 2], rest_ms: u32) -> Record {
    let mut rig = Rig::new(tool, by_text);
    let up = [Bit::Activate, Bit::Home].map(|bit| [Act::Bit(bit), Act::Wait(CHANGE_MS)]);
    let begin = resting.iter().chain(up.iter().flatten()).chain(driven);
    begin.for_each(|act| rig.act(act));
    rig.act(&Act::Wait(rest_ms));
    rig.record()
}

fn same(told: [&[Act]; 2], tool: FittedTool, rest_ms: u32) -> Result<(), TestCaseError> {
    let [cyclic, text] = [false, true].map(|by_text| live(by_text, tool, told, rest_ms));
    prop_assert_eq!(&cyclic.events, &text.events);
    prop_assert_eq!(&cyclic.motion, &text.motion);
    prop_assert_eq!(&cyclic.settings, &text.settings);
    prop_assert_eq!(&cyclic.variable, &text.variable);
    prop_assert_eq!(&cyclic.answers, &text.answers);
    prop_assert_eq!(cyclic.trajectory.len(), text.trajectory.len());
    for (index, (one, other)) in cyclic.trajectory.iter().zip(&text.trajectory).enumerate() {
        for (one, other) in one.iter().zip(other) {
            prop_assert!((one - other).abs() < 1e-9, "at {} ms: {} {}", index, one, other);
        }
    }
    Ok(())
}

fn any_command(among: &'static [fn(&TextCommandSpec) -> bool]) -> impl Strategy<Value = Act> {
    (any::<Index>(), any::<Index>(), any::<[u16; 6]>()).prop_map(|(kind, index, raw)| {
        let wanted = among[kind.index(among.len())];
        let specs: Vec<_> = commands().filter(|spec| wanted(spec)).collect();
        Act::Command(line(specs[index.index(specs.len())], &raw))
    })
}

/// What a resting robot is told.
fn resting() -> impl Strategy<Value = Act> {
    let bits =
        [Bit::Recovery(true), Bit::Recovery(false), Bit::Simulation(true), Bit::Simulation(false)];
    prop_oneof![
        4 => any_command(&[|spec| spec.motion_command().is_some_and(|row| row.persistent)]),
        1 => any_command(&[|_| true]),
        2 => prop::sample::select(bits.to_vec()).prop_map(Act::Bit),
    ]
}

/// What a robot is told that is ready, moves, or is in error.
fn driven() -> impl Strategy<Value = Act> {
    let bits = [
        Bit::Pause,
        Bit::Clear,
        Bit::Resume,
        Bit::ResetError,
        Bit::Recovery(true),
        Bit::Recovery(false),
        Bit::Home,
        Bit::Activate,
    ];
    prop_oneof![
        // As many moves as settings; what the robot must refuse now and then.
        12 => any_command(&[|spec| spec.name.starts_with("Move"), |spec| spec.category == Category::Motion]),
        3 => any_command(&[|_| true]),
        1 => prop::sample::select(bits.to_vec()).prop_map(Act::Bit),
        2 => (1_u32..400).prop_map(Act::Wait),
        // Out of error mode, and on.
        1 => Just(Act::Bit(Bit::ResetError)),
        2 => Just(Act::Bit(Bit::Resume)),
    ]
}

#[test]
fn every_command_of_both_faces_is_among_those_compared() {
    let mut names: Vec<_> = commands().map(|spec| spec.name).collect();
    names.sort_unstable();
    // The table of the cyclic interface, of which 1002 is an argument of ActivateRobot in text.
    let mut cyclic: Vec<_> = fieldarm::wire::meca500::command::COMMANDS
        .iter()
        .filter(|row| row.available && !LEFT_OUT.contains(&row.name))
        .flat_map(|row| match row.name {
            "NoMovement" | "ClearHoming" => vec![],
            "Gripper" => vec!["GripperClose", "GripperOpen"],
            name => vec![name],
        })
        .collect();
    cyclic.sort_unstable();
    assert_eq!(names, cyclic);
    for spec in commands() {
        for raw in [[0; 6], [u16::MAX; 6], [30_000; 6]] {
            encoded(&line(spec, &raw));
        }
    }
}

/// Each command alone, so that none is left to chance: on a resting robot and on a ready one.
#[test]
fn each_command_does_the_same_over_either_face() {
    for spec in commands() {
        for (tool, raw) in [(FittedTool::Megp25E, [40_000; 6]), (FittedTool::Mpm500, [20_000; 6])] {
            let told = [Act::Command(line(spec, &raw)), Act::Wait(300)];
            same([&told, &told], tool, SHORT_REST_MS)
                .unwrap_or_else(|error| panic!("{told:?}: {error}"));
        }
    }
}

#[test]
fn a_reboot_is_the_same_over_either_face() {
    let told = [
        Act::Command("SetToolSphere(1,2,3,4)".into()),
        Act::Command("RebootRobot".into()),
        Act::Wait(500),
    ];
    let reboots = |by_text| {
        let mut rig = Rig::new(FittedTool::None, by_text);
        for act in &told {
            rig.act(act);
            // A MoveID that is held over a boot is new again.
            let goes_on = !matches!(act, Act::Command(line) if line == "RebootRobot");
            rig.outputs.motion_control.flags.assign(MotionControlFlags::SET_POINT, goes_on);
        }
        (rig.robot.settings().clone(), rig.robot.lifecycle(), rig.events)
    };
    let (cyclic, text) = (reboots(false), reboots(true));
    assert_eq!(cyclic.0, text.0);
    assert_eq!((cyclic.1, cyclic.2), (text.1, text.2));
}

/// ClearHoming over the images is ActivateRobot(1) in text.
#[test]
fn the_homing_is_forgotten_over_either_face() {
    let homed = |by_text: bool| {
        let mut rig = Rig::new(FittedTool::None, by_text);
        for bit in [Bit::Activate, Bit::Home, Bit::Deactivate] {
            rig.act(&Act::Bit(bit));
            rig.act(&Act::Wait(CHANGE_MS));
        }
        assert!(rig.robot.is_homed());
        if by_text {
            rig.robot.command(rig.now, "ActivateRobot(1)");
        } else {
            rig.outputs.motion_command.motion_command_id.set(MotionCommandId::CLEAR_HOMING.0);
            rig.outputs.motion_control.move_id.set(1);
            rig.act(&Act::Wait(1));
            rig.act(&Act::Bit(Bit::Activate));
        }
        rig.act(&Act::Wait(CHANGE_MS));
        (rig.robot.lifecycle(), rig.robot.is_homed())
    };
    assert_eq!(homed(false), homed(true));
    assert!(!homed(true).1);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 16, ..ProptestConfig::default() })]

    #[test]
    fn the_same_commands_do_the_same(
        resting in prop::collection::vec(resting(), 0..6),
        driven in prop::collection::vec(driven(), 1..40),
        tool in prop::sample::select(vec![FittedTool::None, FittedTool::Megp25E, FittedTool::Mpm500]),
    ) {
        same([&resting, &driven], tool, REST_MS)?;
    }

    #[test]
    fn no_line_breaks_the_robot(lines in prop::collection::vec(".{0,60}", 1..40)) {
        let mut rig = Rig::new(FittedTool::None, true);
        for line in lines {
            rig.act(&Act::Command(line));
        }
        rig.robot.command(rig.now, "GetStatusRobot");
        let mut all = String::new();
        while rig.robot.next_control_message(&mut all) {}
        prop_assert!(all.contains("[2007]["));
    }
}

#[test]
fn what_one_face_does_the_other_tells() {
    let mut rig = Rig::new(FittedTool::None, false);
    for bit in [Bit::Activate, Bit::Home] {
        rig.act(&Act::Bit(bit));
        rig.act(&Act::Wait(CHANGE_MS));
    }
    let mut told = Vec::new();
    rig.robot.monitoring_snapshot(rig.now, &mut |message| told.push(message.to_owned()));
    assert!(told.contains(&"[2007][1,1,0,0,0,1,1]".to_owned()));
    rig.act(&Act::Bit(Bit::Pause));
    rig.act(&Act::Bit(Bit::Recovery(true)));
    let mut heard = String::new();
    while rig.robot.next_monitoring_message(&mut heard) {}
    assert!(heard.contains("[2007][1,1,0,0,1,1,1]"), "{heard}");
    assert!(!heard.contains("[2042]"), "{heard}");
    rig.robot.advance(rig.now + Duration::from_millis(1));
    while rig.robot.next_monitoring_message(&mut heard) {}
    assert!(heard.contains("[2049]"), "{heard}");
    assert_eq!(content(told.iter().find(|one| one.starts_with("[2095]")).unwrap()), "m500");
}
