//! Arbitrary controllers and people around the virtual robot: nothing panics, the joints stay within
//! the model's limits, and what it shows is finite.
#![no_main]

use arbitrary::Arbitrary;
use fieldarm::cycle::CyclicDevice;
use fieldarm::sim::meca500::kinematics::{MODEL_MAX, MODEL_MIN};
use fieldarm::sim::meca500::readings::Readings;
use fieldarm::sim::meca500::{
    CyclicBus, FittedTool, LifecycleTimes, Part, RobotSettings, VirtualRobot,
};
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::meca500::dynamic::DynamicType;
use fieldarm::wire::meca500::image::{
    FieldType, FieldValue, INPUT_FIELDS, INPUT_LEN, InputImage, MotionControlFlags, OUTPUT_LEN,
    OutputImage, RobotControlFlags,
};
use fieldarm::wire::meca500::revision::Revision;
use fieldarm::wire::order::{Big, ByteOrder};
use libfuzzer_sys::fuzz_target;

/// Simulated time of one case: the robot lives in steps of a millisecond, and a case shall be quick.
const LIFE_MS: u64 = 3_000;
/// Slack of an angle that was rounded to a Real.
const ROUNDING_DEG: f64 = 1e-2;

#[derive(Arbitrary, Debug)]
struct Settings {
    variation: u8,
    tool: u8,
    bus: u8,
    is_r3: bool,
    homed: bool,
    monitoring_only: bool,
    joints: [i16; 6],
}

#[derive(Arbitrary, Debug)]
enum Op {
    Noise([u8; OUTPUT_LEN]),
    Bytes(Vec<u8>),
    Command { id: u8, arguments: [i16; 6], bits: u8 },
    Reals { id: u8, arguments: [f32; 6] },
    Variable { id: u16, value: f32 },
    UseVariables { id: u8, variables: [u8; 6] },
    Control(u8),
    Motion(u8),
    Brakes(u8),
    HostTime(u32),
    Dynamic([u8; 4]),
    Lost,
    Wait(u8),
    WaitLong(u8),
    Back(u32),
    Person(Person),
}

#[derive(Arbitrary, Debug)]
enum Person {
    EStop(bool),
    PStop2(bool),
    Reset,
    Mismatch(bool),
    Power(bool),
    Start,
    Tool(u8),
    OutdatedTool(bool),
    Part { size_mm: Option<f64>, inner: bool },
    Overheated(bool),
    Block { joint: u8, blocked: bool },
    Push { joint: u8, percent: f64 },
    BreakDrives,
    Hand([f64; 6]),
}

fn tool(number: u8) -> FittedTool {
    match number % 4 {
        0 => FittedTool::None,
        1 => FittedTool::Megp25E,
        2 => FittedTool::Megp25Ls,
        _ => FittedTool::Mpm500,
    }
}

fn robot(settings: &Settings) -> VirtualRobot {
    let count = Readings::variations().len();
    let variation = Readings::variations().nth(usize::from(settings.variation) % (count + 1));
    let short = Duration::from_millis(20);
    VirtualRobot::new(RobotSettings {
        readings: variation.map_or_else(Readings::default, |variation| variation.readings),
        tool: tool(settings.tool),
        bus: match settings.bus % 4 {
            0 => CyclicBus::Direct,
            1 => CyclicBus::EtherCat,
            2 => CyclicBus::EtherNetIp,
            _ => CyclicBus::Profinet,
        },
        revision: if settings.is_r3 { Revision::R3 } else { Revision::R4 },
        homed: settings.homed,
        monitoring_only: settings.monitoring_only,
        // Far enough from every limit that homing has room.
        joints: settings.joints.map(|joint| f64::from(joint) / 1_000.0),
        times: LifecycleTimes {
            activation: short,
            deactivation: short,
            homing: short,
            boot: short,
        },
        ..RobotSettings::default()
    })
}

struct Bench {
    robot: VirtualRobot,
    now: Instant,
    lived_ms: u64,
    outputs: OutputImage<Big>,
    inputs: [u8; INPUT_LEN],
}

impl Bench {
    fn cycle(&mut self, step_ms: u64, outputs: Option<&[u8]>) {
        self.lived_ms += step_ms;
        if self.lived_ms > LIFE_MS {
            return;
        }
        self.now += Duration::from_millis(step_ms);
        self.robot.cycle(self.now, outputs, &mut self.inputs);
        self.judge();
    }

    /// A cycle with the outputs as they are.
    fn step(&mut self) {
        let outputs = self.outputs;
        self.cycle(1, Some(outputs.as_bytes()));
    }

    /// The command under the next MoveID.
    fn send(&mut self, id: u32, arguments: [f32; 6], flags: MotionControlFlags) {
        self.outputs.motion_command.motion_command_id.set(id);
        for (field, value) in self.outputs.motion_command_args.argument.iter_mut().zip(arguments) {
            field.set(value);
        }
        let move_id = self.outputs.motion_control.move_id.get().wrapping_add(1);
        self.outputs.motion_control.move_id.set(move_id);
        self.outputs.motion_control.flags.set_raw(flags | MotionControlFlags::SET_POINT);
        self.step();
    }

    fn judge(&self) {
        let target = self.robot.target_joints();
        for (index, joint) in target.iter().enumerate() {
            let (min, max) = (MODEL_MIN[index] - ROUNDING_DEG, MODEL_MAX[index] + ROUNDING_DEG);
            assert!((min..=max).contains(joint), "joint {} at {joint}", index + 1);
        }
        for field in INPUT_FIELDS.iter().filter(|field| field.field_type == FieldType::F32) {
            // What a variable holds is the controller's business.
            if field.section.starts_with("DynamicData") {
                continue;
            }
            let Some(FieldValue::Real(value)) = field.read(&self.inputs, ByteOrder::BIG) else {
                panic!("{} has no value", field.name);
            };
            assert!(value.is_finite(), "{}.{} is {value}", field.section, field.name);
        }
        let image = InputImage::<Big>::from_bytes(&self.inputs).unwrap();
        assert!(image.motion_status.fifo_space.get() <= 13_000);
        assert!(image.robot_timestamp.microseconds.get() < 1_000_000);
        for slot in &image.dynamic_data {
            // Below 1000 lies what the robot measures or was told in checked commands.
            if slot.dynamic_type.get() < 1_000 {
                let ty = DynamicType(slot.dynamic_type.get());
                // A configuration that is chosen automatically is NaN, and a serial number lies in
                // the bits of a Real.
                let may_be_odd = [
                    DynamicType::DESIRED_CONF,
                    DynamicType::ACTUAL_CONF,
                    DynamicType::SERIAL_NUMBER,
                ];
                let values = slot.value_idx.each_ref().map(|value| value.get());
                let is_finite = values.iter().all(|value| value.is_finite());
                assert!(is_finite || may_be_odd.contains(&ty), "{ty:?}: {values:?}");
            }
        }
    }

    fn person(&mut self, person: Person) {
        let mut panel = self.robot.panel();
        match person {
            Person::EStop(true) => panel.press_e_stop(),
            Person::EStop(false) => panel.release_e_stop(),
            Person::PStop2(true) => panel.press_p_stop2(),
            Person::PStop2(false) => panel.release_p_stop2(),
            Person::Reset => panel.press_reset(),
            Person::Mismatch(mismatch) => panel.set_safety_mismatch(mismatch),
            Person::Power(true) => panel.switch_on(),
            Person::Power(false) => panel.switch_off(),
            Person::Start => {
                let _ = panel.press_start();
            }
            Person::Tool(number) => {
                panel.fit_tool(tool(number));
            }
            Person::OutdatedTool(outdated) => panel.set_tool_firmware_outdated(outdated),
            Person::Part { size_mm, inner } => {
                panel.place_part(size_mm.map(if inner { Part::Inner } else { Part::Outer }));
            }
            Person::Overheated(hot) => panel.set_gripper_overheated(hot),
            Person::Block { joint, blocked } => panel.block_joint(joint.into(), blocked),
            Person::Push { joint, percent } => panel.push_joint(joint.into(), percent),
            Person::BreakDrives => panel.break_drives(),
            Person::Hand(joints) => {
                panel.move_by_hand(joints);
            }
        }
        while self.robot.poll_event().is_some() {}
    }
}

fn apply(bench: &mut Bench, op: Op) {
    match op {
        Op::Noise(bytes) => bench.cycle(1, Some(&bytes)),
        Op::Bytes(bytes) => bench.cycle(1, Some(&bytes)),
        Op::Command { id, arguments, bits } => {
            let arguments = arguments.map(|value| f32::from(value) / 64.0);
            // Mostly SetPoint alone, rarely pause, clear, resume or variables.
            let bits = if bits % 16 == 0 { u16::from(bits >> 3) } else { 0 };
            bench.send(id.into(), arguments, MotionControlFlags::from_bits_retain(bits));
        }
        Op::Reals { id, arguments } => {
            bench.send(id.into(), arguments, MotionControlFlags::empty());
        }
        Op::Variable { id, value } => {
            bench.send(id.into(), [value; 6], MotionControlFlags::empty());
        }
        Op::UseVariables { id, variables } => {
            let arguments = variables.map(|variable| 10_000.0 + f32::from(variable));
            bench.send(id.into(), arguments, MotionControlFlags::USE_VARIABLES);
        }
        Op::Control(bits) => {
            let flags = RobotControlFlags::from_bits_retain(bits.into());
            bench.outputs.robot_control.flags.set_raw(flags);
            bench.step();
        }
        Op::Motion(bits) => {
            let flags = MotionControlFlags::from_bits_retain(bits.into());
            bench.outputs.motion_control.flags.set_raw(flags);
            bench.step();
        }
        Op::Brakes(bits) => {
            let mut bytes = [0; OUTPUT_LEN];
            bytes.copy_from_slice(bench.outputs.as_bytes());
            bytes[40] = bits;
            bench.cycle(1, Some(&bytes));
        }
        Op::HostTime(seconds) => {
            bench.outputs.host_time.host_time.set(seconds);
            bench.step();
        }
        Op::Dynamic(types) => {
            let fields = &mut bench.outputs.dynamic_data_configuration.dynamic_data_type_id;
            for (field, ty) in fields.iter_mut().zip(types) {
                field.set(ty.into());
            }
            bench.step();
        }
        Op::Lost => bench.cycle(1, None),
        Op::Wait(cycles) => (0..cycles).for_each(|_| bench.step()),
        Op::WaitLong(step_ms) => {
            let outputs = bench.outputs;
            bench.cycle(u64::from(step_ms) * 4, Some(outputs.as_bytes()));
        }
        Op::Back(micros) => {
            let past = bench.now.as_nanos().saturating_sub(u64::from(micros) * 1_000);
            let outputs = bench.outputs;
            bench.robot.cycle(
                Instant::from_nanos(past),
                Some(outputs.as_bytes()),
                &mut bench.inputs,
            );
            bench.judge();
        }
        Op::Person(person) => bench.person(person),
    }
}

fuzz_target!(|case: (Settings, Vec<Op>)| {
    let (settings, ops) = case;
    let mut bench = Bench {
        robot: robot(&settings),
        now: Instant::ZERO,
        lived_ms: 0,
        outputs: OutputImage::zeroed(),
        inputs: [0; INPUT_LEN],
    };
    // Activated and homed soon, unless the case is about something else.
    bench.outputs.robot_control.flags.set_raw(
        RobotControlFlags::ACTIVATE_ROBOT
            | RobotControlFlags::HOME
            | RobotControlFlags::RESET_ERROR,
    );
    (0..60).for_each(|_| bench.step());
    for op in ops {
        apply(&mut bench, op);
    }
});
