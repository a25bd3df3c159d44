//! The cyclic face: what the 60 bytes do to the robot in each cycle.
//!
//! Read first: [`CyclicDevice::cycle`] below. A cycle at `now` lets the robot live until `now`,
//! then takes the outputs, then writes the inputs: a command written in a cycle is acknowledged in
//! the inputs of the same cycle.
//!
//! ```text
//!  outputs --> RobotControl --> BrakesControl, HostTime --> MotionControl --> handshake --> inputs
//! ```
//!
//! Invariants: outputs are looked at only while the robot is on the bus and the connection may
//! control; without outputs nothing changes but time. Source: PM L940-1064, L1096-1135.

use super::readings::{
    CyclicConnectionLoss, EchoAtConnection, HeldClearMotion, HeldTriggeredBits, HostTimeReading,
    MoveIdMemory, RefusalCode,
};
use super::robot::VirtualRobot;
use super::safety::Signal;
use super::settings::CyclicBus;
use super::{dynamic::DynamicSlots, handshake::Handshake, inputs::Place};
use crate::cycle::CyclicDevice;
use crate::time::Instant;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::image::{
    BrakesControlFlags, INPUT_LEN, MotionControlFlags, OUTPUT_LEN, OutputImage, RobotControlFlags,
};
use crate::wire::order::{Big, BigIntLittleReal, Endian, ImageOrder, Little, LittleIntBigReal};

/// MoveID shown at connection under the reading "arbitrary".
const ARBITRARY_ECHO: u16 = 0xA5C3;

/// What the robot remembers of its cyclic connection.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CyclicFace {
    connected: bool,
    robot_control: RobotControlFlags,
    motion_control: MotionControlFlags,
    host_time: u32,
    pub(super) handshake: Handshake,
    pub(super) slots: DynamicSlots,
    pub(super) place: Option<Place>,
}

/// The outputs of one cycle as plain values.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outputs {
    robot_control: RobotControlFlags,
    pub(super) motion_control: MotionControlFlags,
    pub(super) move_id: u16,
    pub(super) motion_command_id: u32,
    pub(super) arguments: [f32; 6],
    host_time: u32,
    brakes: BrakesControlFlags,
    dynamic_types: [u32; 4],
}

impl Outputs {
    fn read<O: ImageOrder>(image: &OutputImage<O>) -> Self {
        Self {
            robot_control: image.robot_control.flags.get(),
            motion_control: image.motion_control.flags.get(),
            move_id: image.motion_control.move_id.get(),
            motion_command_id: image.motion_command.motion_command_id.get(),
            arguments: image.motion_command_args.argument.map(|value| value.get()),
            host_time: image.host_time.host_time.get(),
            brakes: image.brakes_control.flags.get(),
            dynamic_types: image
                .dynamic_data_configuration
                .dynamic_data_type_id
                .map(|value| value.get()),
        }
    }
}

impl CyclicDevice for VirtualRobot {
    const OUTPUT_LEN: usize = OUTPUT_LEN;
    const INPUT_LEN: usize = INPUT_LEN;

    fn cycle(&mut self, now: Instant, outputs: Option<&[u8]>, inputs: &mut [u8]) {
        let order = self.settings.byte_order;
        match (order.integers, order.reals) {
            (Endian::BigEndian, Endian::BigEndian) => self.cycle_in::<Big>(now, outputs, inputs),
            (Endian::LittleEndian, Endian::LittleEndian) => {
                self.cycle_in::<Little>(now, outputs, inputs);
            }
            (Endian::BigEndian, Endian::LittleEndian) => {
                self.cycle_in::<BigIntLittleReal>(now, outputs, inputs);
            }
            (Endian::LittleEndian, Endian::BigEndian) => {
                self.cycle_in::<LittleIntBigReal>(now, outputs, inputs);
            }
        }
    }

    /// On, booted, and not switched from EtherCAT to TCP/IP.
    fn is_on_bus(&self) -> bool {
        let left =
            self.settings.bus == CyclicBus::EtherCat && !self.settings.persistent.ethercat_enabled;
        self.is_online() && !left
    }
}

impl VirtualRobot {
    fn cycle_in<O: ImageOrder>(&mut self, now: Instant, outputs: Option<&[u8]>, inputs: &mut [u8]) {
        self.advance(now);
        if !self.is_on_bus() {
            return;
        }
        let outputs = outputs
            .and_then(|bytes| OutputImage::<O>::from_bytes(bytes).ok())
            .map(|image| Outputs::read(image));
        let requested = match outputs {
            Some(outputs) => {
                self.take(&outputs);
                outputs.dynamic_types
            }
            None => {
                self.lose_connection();
                [0; 4]
            }
        };
        if !self.is_on_bus() {
            // Rebooting, or another protocol from now on: the last inputs stay. What this cycle
            // wrote into the handshake after the boot had emptied it is forgotten too.
            self.forget_connection();
            return;
        }
        let Self { face, settings, variables, .. } = self;
        let shown = face.slots.next(requested, &settings.readings, variables);
        self.write_inputs::<O>(&shown, inputs);
        if settings_show_for_one_cycle(self) {
            self.shown_code = Code(0);
        }
    }

    fn take(&mut self, outputs: &Outputs) {
        if !self.face.connected {
            self.connect();
        }
        if self.settings.monitoring_only {
            return;
        }
        self.take_robot_control(outputs.robot_control);
        if !self.is_on_bus() {
            return;
        }
        self.take_brakes(outputs.brakes);
        self.take_host_time(outputs.host_time);
        self.take_motion_control(outputs.motion_control);
        self.face.robot_control = outputs.robot_control;
        self.face.motion_control = outputs.motion_control;
        self.take_command(outputs);
    }

    fn connect(&mut self) {
        let readings = self.settings.readings;
        self.face.connected = true;
        self.face.handshake.connect(match readings.echo_at_connection {
            EchoAtConnection::Kept => None,
            EchoAtConnection::Zero => Some(0),
            EchoAtConnection::Arbitrary => Some(ARBITRARY_ECHO),
        });
        if self.safety.connection_dropped == Signal::Present {
            self.safety.connection_dropped.set_present(false);
        }
    }

    fn lose_connection(&mut self) {
        if !self.face.connected {
            return;
        }
        let readings = self.settings.readings;
        self.face.connected = false;
        self.face.robot_control = RobotControlFlags::empty();
        self.face.motion_control = MotionControlFlags::empty();
        self.face.host_time = 0;
        self.face.slots = DynamicSlots::default();
        self.face.handshake.disconnect(readings.move_id_memory == MoveIdMemory::Forgotten);
        if readings.cyclic_connection_loss == CyclicConnectionLoss::Stops
            && !self.settings.monitoring_only
        {
            self.drop_connection();
        }
    }

    /// A boot forgets the connection and every MoveID.
    pub(super) fn forget_connection(&mut self) {
        self.face = CyclicFace::default();
    }

    fn take_robot_control(&mut self, bits: RobotControlFlags) {
        let before = self.face.robot_control;
        let acts = match self.settings.readings.held_triggered_bits {
            HeldTriggeredBits::Level => bits,
            HeldTriggeredBits::Edge => bits.difference(before),
        };
        // What cannot act now is refused without a trace in the image but for its status bit.
        if acts.contains(RobotControlFlags::DEACTIVATE_ROBOT) {
            let _ = self.deactivate();
        }
        if acts.contains(RobotControlFlags::ACTIVATE_ROBOT)
            && !bits.contains(RobotControlFlags::DEACTIVATE_ROBOT)
        {
            let _ = self.activate();
        }
        if acts.contains(RobotControlFlags::RESET_ERROR) {
            let _ = self.reset_error();
        }
        if acts.contains(RobotControlFlags::HOME) && !self.is_homed() {
            let _ = self.home();
        }
        let _ = self.set_simulation(bits.contains(RobotControlFlags::ACTIVATE_SIM));
        self.set_recovery_mode(bits.contains(RobotControlFlags::ENABLE_RECOVERY_MODE));
        if bits.contains(RobotControlFlags::DISABLE_ETHERCAT)
            && self.settings.bus == CyclicBus::EtherCat
        {
            self.lose_connection();
            self.leave_ethercat();
        }
    }

    fn take_brakes(&mut self, bits: BrakesControlFlags) {
        if bits.contains(BrakesControlFlags::BRAKES_CONTROL_ALLOWED) {
            self.set_brakes(bits.contains(BrakesControlFlags::BRAKES_ENGAGED));
        }
    }

    fn take_host_time(&mut self, host_time: u32) {
        let changed = host_time != self.face.host_time;
        self.face.host_time = host_time;
        let acts = match self.settings.readings.host_time {
            HostTimeReading::EachCycle => true,
            HostTimeReading::OnChange => changed,
        };
        if host_time != 0 && acts {
            self.set_rtc(host_time.into());
        }
    }

    fn take_motion_control(&mut self, bits: MotionControlFlags) {
        let before = self.face.motion_control;
        if bits.contains(MotionControlFlags::CLEAR_MOTION) {
            let is_new = !before.contains(MotionControlFlags::CLEAR_MOTION);
            let again = self.settings.readings.held_clear_motion == HeldClearMotion::EachCycle
                && !self.queue.is_empty();
            if is_new || again || !self.cleared {
                let _ = self.clear_motion();
            }
        }
        if bits.contains(MotionControlFlags::PAUSE_MOTION) && !self.has_pause() {
            let _ = self.pause_motion();
        }
        let rises = bits.contains(MotionControlFlags::RESUME_MOTION)
            && !before.contains(MotionControlFlags::RESUME_MOTION);
        let held = MotionControlFlags::PAUSE_MOTION | MotionControlFlags::CLEAR_MOTION;
        if rises && !bits.intersects(held) {
            let _ = self.resume_motion();
        }
    }

    fn has_pause(&self) -> bool {
        self.halts.contains(super::halt::Halts::PAUSE)
    }
}

fn settings_show_for_one_cycle(robot: &VirtualRobot) -> bool {
    robot.settings.readings.refusal_code == RefusalCode::ShownForOneCycle
        && robot.failed_activation == Code(0)
}
