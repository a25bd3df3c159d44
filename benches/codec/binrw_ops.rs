//! The same images with `binrw`: one struct per section, byte order chosen by the caller, bits as
//! bools through a map from the integer that holds them.

use std::io::Cursor;

use binrw::{BinRead, BinWrite, Endian, binrw};
use fieldarm::wire::meca500::image::{INPUT_LEN, OUTPUT_LEN, OutputValues};

/// A struct of bools, read from and written as an integer; its bytes are lowest first in every
/// byte order.
macro_rules! bits {
    ($name:ident: $bits:ident { $($field:ident = $bit:literal),* $(,)? }) => {
        #[binrw]
        #[br(little, map = Self::from_bits)]
        #[bw(little, map = Self::bits)]
        #[derive(Clone, Copy, Debug, Default)]
        pub(crate) struct $name {
            $(pub(crate) $field: bool,)*
        }

        impl $name {
            fn from_bits(bits: $bits) -> Self {
                Self { $($field: bits >> $bit & 1 == 1),* }
            }

            fn bits(&self) -> $bits {
                0 $(| $bits::from(self.$field) << $bit)*
            }
        }
    };
}

bits!(RobotStatusBits: u16 {
    busy = 0, activated = 1, homed = 2, sim_activated = 3, brakes_engaged = 4, recovery_mode = 5,
    e_stop = 6, collision_status = 7, work_zone_status = 8, monitoring_mode = 9,
});
bits!(MotionStatusBits: u16 {
    paused = 0, eob = 1, eom = 2, cleared = 3, p_stop2 = 4, excessive_torque = 5,
});
bits!(SafetyBits: u32 {
    e_stop = 0, p_stop1 = 1, p_stop2 = 2, operation_mode_change = 4, enabling_device_released = 5,
    voltage_fluctuation = 6, reboot = 7, redundancy_fault = 8, standstill_fault = 9,
    connection_dropped = 10, minor_error = 11,
});
bits!(SafetyPowerBits: u8 { reset_ready = 0, v_motor_on = 1 });
bits!(PsuInputBits: u16 {
    e_stop = 0, p_stop1 = 1, p_stop2 = 2, reset_external = 3, reset_keypad = 4,
    enabling_device = 5,
});
bits!(RobotControlBits: u32 {
    deactivate_robot = 0, activate_robot = 1, home = 2, reset_error = 3, activate_sim = 4,
    enable_recovery_mode = 5, disable_ethercat = 6,
});
bits!(MotionControlBits: u16 {
    set_point = 0, pause_motion = 1, clear_motion = 2, resume_motion = 3, use_variables = 4,
});
bits!(BrakesControlBits: u32 { brakes_control_allowed = 0, brakes_engaged = 1 });

#[binrw]
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pose {
    pub(crate) x: f32,
    pub(crate) y: f32,
    pub(crate) z: f32,
    pub(crate) alpha: f32,
    pub(crate) beta: f32,
    pub(crate) gamma: f32,
}

#[binrw]
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct DynamicSlot {
    pub(crate) dynamic_type: u32,
    pub(crate) value_idx: [f32; 6],
}

#[binrw]
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Input {
    pub(crate) robot_status: RobotStatusBits,
    pub(crate) error_code: u16,
    pub(crate) checkpoint_reached: u16,
    pub(crate) checkpoint_discarded: u16,
    pub(crate) move_id: u16,
    pub(crate) fifo_space: u16,
    pub(crate) motion_status: MotionStatusBits,
    pub(crate) offline_program_id: u16,
    pub(crate) joint: [f32; 6],
    pub(crate) target_end_effector_pose: Pose,
    pub(crate) shoulder: i8,
    pub(crate) elbow: i8,
    pub(crate) wrist: i8,
    pub(crate) turn: i8,
    pub(crate) target_wrf: Pose,
    pub(crate) target_trf: Pose,
    pub(crate) seconds: u32,
    pub(crate) microseconds: u32,
    pub(crate) dynamic_data_cycles: u32,
    pub(crate) signals: SafetyBits,
    pub(crate) resettable: SafetyBits,
    pub(crate) operation_mode: u8,
    pub(crate) power: SafetyPowerBits,
    pub(crate) psu_inputs: PsuInputBits,
    pub(crate) dynamic_data: [DynamicSlot; 4],
}

#[binrw]
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Output {
    pub(crate) robot_control: RobotControlBits,
    pub(crate) move_id: u16,
    pub(crate) motion_control: MotionControlBits,
    pub(crate) motion_command_id: u32,
    pub(crate) argument: [f32; 6],
    pub(crate) host_time: u32,
    pub(crate) brakes_control: BrakesControlBits,
    pub(crate) dynamic_data_type_id: [u32; 4],
}

impl From<&OutputValues> for Output {
    fn from(values: &OutputValues) -> Self {
        let control = values.robot_control.flags;
        let motion = values.motion_control.flags;
        let brakes = values.brakes_control.flags;
        Self {
            robot_control: RobotControlBits {
                deactivate_robot: control.deactivate_robot,
                activate_robot: control.activate_robot,
                home: control.home,
                reset_error: control.reset_error,
                activate_sim: control.activate_sim,
                enable_recovery_mode: control.enable_recovery_mode,
                disable_ethercat: control.disable_ethercat,
            },
            move_id: values.motion_control.move_id,
            motion_control: MotionControlBits {
                set_point: motion.set_point,
                pause_motion: motion.pause_motion,
                clear_motion: motion.clear_motion,
                resume_motion: motion.resume_motion,
                use_variables: motion.use_variables,
            },
            motion_command_id: values.motion_command.motion_command_id,
            argument: values.motion_command_args.argument,
            host_time: values.host_time.host_time,
            brakes_control: BrakesControlBits {
                brakes_control_allowed: brakes.brakes_control_allowed,
                brakes_engaged: brakes.brakes_engaged,
            },
            dynamic_data_type_id: values.dynamic_data_configuration.dynamic_data_type_id,
        }
    }
}

/// Only what an engine looks at in each bus cycle; the rest is skipped.
#[binrw]
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Reads {
    #[brw(little)]
    pub(crate) status_bits: u16,
    pub(crate) error_code: u16,
    pub(crate) checkpoint_reached: u16,
    pub(crate) checkpoint_discarded: u16,
    pub(crate) move_id: u16,
    pub(crate) fifo_space: u16,
    #[brw(little)]
    pub(crate) motion_bits: u16,
    #[brw(pad_before = 102)]
    pub(crate) seconds: u32,
    pub(crate) microseconds: u32,
    #[brw(little, pad_before = 4)]
    pub(crate) signal_bits: u32,
    #[brw(little)]
    pub(crate) resettable_bits: u32,
    #[brw(pad_before = 4)]
    pub(crate) dynamic_type0: u32,
    #[brw(pad_before = 24)]
    pub(crate) dynamic_type1: u32,
    #[brw(pad_before = 24)]
    pub(crate) dynamic_type2: u32,
    #[brw(pad_before = 24)]
    pub(crate) dynamic_type3: u32,
}

#[inline(never)]
pub(crate) fn measured_decode<const BIG: bool>(bytes: &[u8; INPUT_LEN]) -> Input {
    Input::read_options(&mut Cursor::new(bytes), endian(BIG), ()).unwrap_or_default()
}

#[inline(never)]
pub(crate) fn measured_encode<const BIG: bool>(
    values: &Output,
    bytes: &mut [u8; OUTPUT_LEN],
) -> bool {
    values.write_options(&mut Cursor::new(&mut bytes[..]), endian(BIG), ()).is_ok()
}

#[inline(never)]
pub(crate) fn measured_reads<const BIG: bool>(bytes: &[u8; INPUT_LEN]) -> Reads {
    Reads::read_options(&mut Cursor::new(bytes), endian(BIG), ()).unwrap_or_default()
}

fn endian(big: bool) -> Endian {
    if big { Endian::Big } else { Endian::Little }
}
