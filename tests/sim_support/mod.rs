//! A cell for the tests of the virtual robot: raw images, driven by hand, in simulated time.
//!
//! Nothing here comes from the PLC-side engine.

// Each test file uses the part it needs.
#![allow(dead_code)]

use fieldarm::cycle::CyclicDevice;
use fieldarm::sim::meca500::{RobotEvent, RobotSettings, VirtualRobot};
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::meca500::image::{
    BrakesControlFlags, InputImage, MotionControlFlags, MotionStatusFlags, OutputImage,
    RobotControlFlags, RobotStatusFlags, SafetyPower, SafetyResettable, SafetySignals,
};
use fieldarm::wire::order::Big;

pub(crate) const PERIOD: Duration = Duration::from_millis(1);
/// Cycles in which anything reasonable has happened: a minute.
const PATIENCE: u32 = 60_000;

pub(crate) struct Cell {
    pub(crate) robot: VirtualRobot,
    pub(crate) outputs: OutputImage<Big>,
    pub(crate) inputs: InputImage<Big>,
    pub(crate) now: Instant,
    next_move_id: u16,
}

impl Cell {
    pub(crate) fn new(settings: RobotSettings) -> Self {
        Self {
            robot: VirtualRobot::new(settings),
            outputs: OutputImage::zeroed(),
            inputs: InputImage::zeroed(),
            now: Instant::ZERO,
            next_move_id: 0,
        }
    }

    /// A homed robot with the default settings, changed by `change`.
    pub(crate) fn ready_with(change: impl FnOnce(&mut RobotSettings)) -> Self {
        let mut settings = RobotSettings::default();
        change(&mut settings);
        let mut cell = Self::new(settings);
        cell.bring_up();
        cell
    }

    pub(crate) fn ready() -> Self {
        Self::ready_with(|_| {})
    }

    pub(crate) fn cycle(&mut self) {
        self.now += PERIOD;
        let Self { robot, outputs, inputs, now, .. } = self;
        let mut bytes = [0; 252];
        bytes.copy_from_slice(inputs.as_bytes());
        robot.cycle(*now, Some(outputs.as_bytes()), &mut bytes);
        *inputs = *InputImage::from_bytes(&bytes).expect("252 bytes");
    }

    /// A cycle in which no controller feeds the robot.
    pub(crate) fn lost_cycle(&mut self) {
        self.now += PERIOD;
        let mut bytes = [0; 252];
        bytes.copy_from_slice(self.inputs.as_bytes());
        self.robot.cycle(self.now, None, &mut bytes);
        self.inputs = *InputImage::from_bytes(&bytes).expect("252 bytes");
    }

    pub(crate) fn cycles(&mut self, count: u32) {
        for _ in 0..count {
            self.cycle();
        }
    }

    pub(crate) fn until(&mut self, what: &str, mut is_so: impl FnMut(&Self) -> bool) -> u32 {
        for cycle in 0..PATIENCE {
            if is_so(self) {
                return cycle;
            }
            self.cycle();
        }
        panic!("waited in vain for: {what}; {:?}", self.inputs);
    }

    pub(crate) fn control(&mut self, bits: RobotControlFlags, on: bool) {
        self.outputs.robot_control.flags.assign(bits, on);
    }

    pub(crate) fn motion(&mut self, bits: MotionControlFlags, on: bool) {
        self.outputs.motion_control.flags.assign(bits, on);
    }

    pub(crate) fn brakes(&mut self, bits: BrakesControlFlags) {
        self.outputs.brakes_control.flags.set(bits);
    }

    pub(crate) fn status(&self) -> RobotStatusFlags {
        self.inputs.robot_status.flags.get()
    }

    pub(crate) fn is(&self, bits: RobotStatusFlags) -> bool {
        self.status().contains(bits)
    }

    pub(crate) fn motion_status(&self) -> MotionStatusFlags {
        self.inputs.motion_status.flags.get()
    }

    pub(crate) fn has(&self, bits: MotionStatusFlags) -> bool {
        self.motion_status().contains(bits)
    }

    pub(crate) fn signals(&self) -> SafetySignals {
        self.inputs.safety_status.signals.get()
    }

    pub(crate) fn resettable(&self) -> SafetyResettable {
        self.inputs.safety_status.resettable.get()
    }

    pub(crate) fn power(&self) -> SafetyPower {
        self.inputs.safety_status.power.get()
    }

    pub(crate) fn error(&self) -> u16 {
        self.inputs.robot_status.error_code.get()
    }

    pub(crate) fn echo(&self) -> u16 {
        self.inputs.motion_status.move_id.get()
    }

    pub(crate) fn fifo_space(&self) -> u16 {
        self.inputs.motion_status.fifo_space.get()
    }

    pub(crate) fn reached(&self) -> u16 {
        self.inputs.motion_status.checkpoint_reached.get()
    }

    pub(crate) fn discarded(&self) -> u16 {
        self.inputs.motion_status.checkpoint_discarded.get()
    }

    pub(crate) fn joints(&self) -> [f32; 6] {
        self.inputs.target_joint_set.joint.map(|joint| joint.get())
    }

    pub(crate) fn pose(&self) -> [f32; 6] {
        let pose = self.inputs.target_end_effector_pose.values();
        [pose.x, pose.y, pose.z, pose.alpha, pose.beta, pose.gamma]
    }

    pub(crate) fn is_at(&self, joints: [f32; 6]) -> bool {
        close(self.joints(), joints, 1e-3)
    }

    /// Holds a triggered bit until `confirmed`, then releases it.
    pub(crate) fn trigger(
        &mut self,
        bits: RobotControlFlags,
        confirmed: impl FnMut(&Self) -> bool,
    ) {
        self.control(bits, true);
        self.until(&format!("{bits:?}"), confirmed);
        self.control(bits, false);
        self.cycle();
    }

    pub(crate) fn activate(&mut self) {
        self.trigger(RobotControlFlags::ACTIVATE_ROBOT, |cell| {
            cell.is(RobotStatusFlags::ACTIVATED)
        });
    }

    pub(crate) fn deactivate(&mut self) {
        self.trigger(RobotControlFlags::DEACTIVATE_ROBOT, |cell| {
            !cell.is(RobotStatusFlags::ACTIVATED)
        });
    }

    pub(crate) fn home(&mut self) {
        self.trigger(RobotControlFlags::HOME, |cell| cell.is(RobotStatusFlags::HOMED));
    }

    pub(crate) fn reset_error(&mut self) {
        self.trigger(RobotControlFlags::RESET_ERROR, |cell| cell.error() == 0);
    }

    pub(crate) fn bring_up(&mut self) {
        self.cycle();
        self.activate();
        self.home();
    }

    /// A rising edge of ResumeMotion, held for a few cycles.
    pub(crate) fn resume_edge(&mut self) {
        self.motion(MotionControlFlags::RESUME_MOTION, true);
        self.cycles(3);
        self.motion(MotionControlFlags::RESUME_MOTION, false);
        self.cycle();
    }

    pub(crate) fn resume(&mut self) {
        self.motion(MotionControlFlags::RESUME_MOTION, true);
        self.until("resumed", |cell| !cell.has(MotionStatusFlags::PAUSED));
        self.motion(MotionControlFlags::RESUME_MOTION, false);
        self.cycle();
    }

    /// Writes a command with the next MoveID, without a cycle.
    pub(crate) fn write(&mut self, id: u32, arguments: &[f32]) -> u16 {
        self.next_move_id = self.next_move_id % u16::MAX + 1;
        self.write_with(self.next_move_id, id, arguments);
        self.next_move_id
    }

    /// Writes a command with this MoveID and SetPoint 1, without a cycle.
    pub(crate) fn write_with(&mut self, move_id: u16, id: u32, arguments: &[f32]) {
        self.outputs.motion_command.motion_command_id.set(id);
        let slots = &mut self.outputs.motion_command_args.argument;
        for (index, slot) in slots.iter_mut().enumerate() {
            slot.set(arguments.get(index).copied().unwrap_or(0.0));
        }
        self.outputs.motion_control.move_id.set(move_id);
        self.motion(MotionControlFlags::SET_POINT, true);
    }

    /// Sends a command in one cycle; whether it was acknowledged in that cycle.
    pub(crate) fn send(&mut self, id: u32, arguments: &[f32]) -> bool {
        let move_id = self.write(id, arguments);
        self.cycle();
        self.echo() == move_id
    }

    /// Sends a command that the robot must acknowledge.
    pub(crate) fn sent(&mut self, id: u32, arguments: &[f32]) {
        assert!(self.send(id, arguments), "command {id} was not acknowledged");
    }

    /// Places a checkpoint and waits until it is reached.
    pub(crate) fn finish(&mut self, checkpoint: u16) -> u32 {
        if self.reached() == checkpoint {
            // The same number would be there already.
            self.sent(17, &[8000.0]);
            self.until("another checkpoint", |cell| cell.reached() == 8000);
        }
        self.sent(17, &[f32::from(checkpoint)]);
        self.until("the checkpoint", |cell| cell.reached() == checkpoint)
    }

    pub(crate) fn events(&mut self) -> Vec<RobotEvent> {
        self.robot.panel().drain_events().collect()
    }

    pub(crate) fn dynamic(&self, slot: usize) -> (u32, [f32; 6]) {
        let data = &self.inputs.dynamic_data[slot];
        (data.dynamic_type.get(), data.value_idx.map(|value| value.get()))
    }

    pub(crate) fn request(&mut self, types: [u32; 4]) {
        let slots = &mut self.outputs.dynamic_data_configuration.dynamic_data_type_id;
        for (slot, ty) in slots.iter_mut().zip(types) {
            slot.set(ty);
        }
    }

    /// The values of a type, asked for in slot 0.
    pub(crate) fn read(&mut self, ty: u32) -> [f32; 6] {
        self.request([ty; 4]);
        self.cycles(4);
        let (found, values) = self.dynamic(0);
        assert_eq!(found, ty);
        values
    }
}

/// A robot in each of many states, and the state's name.
pub(crate) fn cells_in_many_states() -> Vec<(&'static str, Cell)> {
    let fresh = || {
        let mut cell = Cell::new(RobotSettings::default());
        cell.cycle();
        cell
    };
    let after = |mut cell: Cell, change: &dyn Fn(&mut Cell)| {
        change(&mut cell);
        cell
    };
    vec![
        ("deactivated", fresh()),
        (
            "activating",
            after(fresh(), &|cell| {
                cell.control(RobotControlFlags::ACTIVATE_ROBOT, true);
                cell.cycle();
                assert!(cell.is(RobotStatusFlags::BUSY));
            }),
        ),
        ("not homed", after(fresh(), &Cell::activate)),
        (
            "homing",
            after(fresh(), &|cell| {
                cell.activate();
                cell.control(RobotControlFlags::HOME, true);
                cell.cycle();
                assert!(cell.is(RobotStatusFlags::BUSY));
            }),
        ),
        ("ready", Cell::ready()),
        (
            "moving",
            after(Cell::ready(), &|cell| {
                cell.sent(1, &[90.0]);
                cell.cycles(100);
                assert!(!cell.has(MotionStatusFlags::EOM));
            }),
        ),
        (
            "paused",
            after(Cell::ready(), &|cell| {
                cell.motion(MotionControlFlags::PAUSE_MOTION, true);
                cell.cycles(10);
                assert!(cell.has(MotionStatusFlags::PAUSED));
            }),
        ),
        (
            "in error mode",
            after(Cell::ready(), &|cell| {
                cell.sent(1, &[200.0]);
                cell.until("the error", |cell| cell.error() == 1007);
            }),
        ),
        (
            "stopped by P-Stop 2",
            after(Cell::ready(), &|cell| {
                cell.robot.panel().press_p_stop2();
                cell.cycles(10);
                assert!(cell.signals().contains(SafetySignals::P_STOP2));
            }),
        ),
        (
            "without motor power",
            after(Cell::ready(), &|cell| {
                cell.robot.panel().press_e_stop();
                cell.until("deactivated", |cell| !cell.is(RobotStatusFlags::ACTIVATED));
                assert!(cell.power().is_empty());
            }),
        ),
    ]
}

pub(crate) fn close(found: [f32; 6], expected: [f32; 6], tolerance: f32) -> bool {
    found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() <= tolerance)
}
