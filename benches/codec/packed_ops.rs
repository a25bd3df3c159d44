//! The same images with `packed_struct`: one struct per section and byte order. It knows no floats,
//! so Reals stay the bits of one.

use fieldarm::wire::meca500::image::OutputValues;
use packed_struct::derive::PackedStruct;

/// A struct of bools in `$bytes` bytes. Bits are counted from the most significant one of each
/// byte: bit 0 of the manual is 7 here.
macro_rules! bits {
    ($name:ident: $bytes:tt { $($field:ident = $bit:tt),* $(,)? }) => {
        #[derive(PackedStruct, Clone, Copy, Debug, Default, PartialEq)]
        #[packed_struct(bit_numbering = "msb0", size_bytes = $bytes)]
        pub(crate) struct $name {
            $(
                #[packed_field(bits = $bit)]
                pub(crate) $field: bool,
            )*
        }
    };
}

bits!(RobotStatusBits: "2" {
    busy = "7", activated = "6", homed = "5", sim_activated = "4", brakes_engaged = "3",
    recovery_mode = "2", e_stop = "1", collision_status = "0", work_zone_status = "15",
    monitoring_mode = "14",
});
bits!(MotionStatusBits: "2" {
    paused = "7", eob = "6", eom = "5", cleared = "4", p_stop2 = "3", excessive_torque = "2",
});
bits!(SafetyBits: "4" {
    e_stop = "7", p_stop1 = "6", p_stop2 = "5", operation_mode_change = "3",
    enabling_device_released = "2", voltage_fluctuation = "1", reboot = "0",
    redundancy_fault = "15", standstill_fault = "14", connection_dropped = "13",
    minor_error = "12",
});
bits!(SafetyPowerBits: "1" { reset_ready = "7", v_motor_on = "6" });
bits!(PsuInputBits: "2" {
    e_stop = "7", p_stop1 = "6", p_stop2 = "5", reset_external = "4", reset_keypad = "3",
    enabling_device = "2",
});
bits!(RobotControlBits: "4" {
    deactivate_robot = "7", activate_robot = "6", home = "5", reset_error = "4",
    activate_sim = "3", enable_recovery_mode = "2", disable_ethercat = "1",
});
bits!(MotionControlBits: "2" {
    set_point = "7", pause_motion = "6", clear_motion = "5", resume_motion = "4",
    use_variables = "3",
});
bits!(BrakesControlBits: "4" { brakes_control_allowed = "7", brakes_engaged = "6" });

macro_rules! images {
    ($order:ident, $endian:tt) => {
        pub(crate) mod $order {
            use fieldarm::wire::meca500::image::{INPUT_LEN, OUTPUT_LEN};
            use packed_struct::PackedStruct;

            use super::*;

            #[derive(PackedStruct, Clone, Copy, Debug, Default, PartialEq)]
            #[packed_struct(endian = $endian)]
            pub(crate) struct SixReals {
                pub(crate) first: u32,
                pub(crate) second: u32,
                pub(crate) third: u32,
                pub(crate) fourth: u32,
                pub(crate) fifth: u32,
                pub(crate) sixth: u32,
            }

            #[derive(PackedStruct, Clone, Copy, Debug, Default, PartialEq)]
            #[packed_struct(endian = $endian)]
            pub(crate) struct DynamicSlot {
                pub(crate) dynamic_type: u32,
                #[packed_field(size_bytes = "24")]
                pub(crate) value_idx: SixReals,
            }

            #[derive(PackedStruct, Clone, Copy, Debug, Default, PartialEq)]
            #[packed_struct(endian = $endian)]
            pub(crate) struct Input {
                #[packed_field(size_bytes = "2")]
                pub(crate) robot_status: RobotStatusBits,
                pub(crate) error_code: u16,
                pub(crate) checkpoint_reached: u16,
                pub(crate) checkpoint_discarded: u16,
                pub(crate) move_id: u16,
                pub(crate) fifo_space: u16,
                #[packed_field(size_bytes = "2")]
                pub(crate) motion_status: MotionStatusBits,
                pub(crate) offline_program_id: u16,
                #[packed_field(size_bytes = "24")]
                pub(crate) joint: SixReals,
                #[packed_field(size_bytes = "24")]
                pub(crate) target_end_effector_pose: SixReals,
                pub(crate) shoulder: i8,
                pub(crate) elbow: i8,
                pub(crate) wrist: i8,
                pub(crate) turn: i8,
                #[packed_field(size_bytes = "24")]
                pub(crate) target_wrf: SixReals,
                #[packed_field(size_bytes = "24")]
                pub(crate) target_trf: SixReals,
                pub(crate) seconds: u32,
                pub(crate) microseconds: u32,
                pub(crate) dynamic_data_cycles: u32,
                #[packed_field(size_bytes = "4")]
                pub(crate) signals: SafetyBits,
                #[packed_field(size_bytes = "4")]
                pub(crate) resettable: SafetyBits,
                pub(crate) operation_mode: u8,
                #[packed_field(size_bytes = "1")]
                pub(crate) power: SafetyPowerBits,
                #[packed_field(size_bytes = "2")]
                pub(crate) psu_inputs: PsuInputBits,
                #[packed_field(element_size_bytes = "28")]
                pub(crate) dynamic_data: [DynamicSlot; 4],
            }

            #[derive(PackedStruct, Clone, Copy, Debug, Default, PartialEq)]
            #[packed_struct(endian = $endian)]
            pub(crate) struct Output {
                #[packed_field(size_bytes = "4")]
                pub(crate) robot_control: RobotControlBits,
                pub(crate) move_id: u16,
                #[packed_field(size_bytes = "2")]
                pub(crate) motion_control: MotionControlBits,
                pub(crate) motion_command_id: u32,
                #[packed_field(size_bytes = "24")]
                pub(crate) argument: SixReals,
                pub(crate) host_time: u32,
                #[packed_field(size_bytes = "4")]
                pub(crate) brakes_control: BrakesControlBits,
                pub(crate) dynamic_data_type_id1: u32,
                pub(crate) dynamic_data_type_id2: u32,
                pub(crate) dynamic_data_type_id3: u32,
                pub(crate) dynamic_data_type_id4: u32,
            }

            impl From<&OutputValues> for Output {
                fn from(values: &OutputValues) -> Self {
                    let [first, second, third, fourth, fifth, sixth] =
                        values.motion_command_args.argument.map(f32::to_bits);
                    let [type1, type2, type3, type4] =
                        values.dynamic_data_configuration.dynamic_data_type_id;
                    Self {
                        robot_control: values.into(),
                        move_id: values.motion_control.move_id,
                        motion_control: values.into(),
                        motion_command_id: values.motion_command.motion_command_id,
                        argument: SixReals { first, second, third, fourth, fifth, sixth },
                        host_time: values.host_time.host_time,
                        brakes_control: values.into(),
                        dynamic_data_type_id1: type1,
                        dynamic_data_type_id2: type2,
                        dynamic_data_type_id3: type3,
                        dynamic_data_type_id4: type4,
                    }
                }
            }

            /// Only what an engine looks at in each bus cycle.
            #[derive(PackedStruct, Clone, Copy, Debug, Default, PartialEq)]
            #[packed_struct(endian = $endian, bit_numbering = "msb0", size_bytes = "252")]
            pub(crate) struct Reads {
                #[packed_field(bytes = "0:1", endian = "lsb")]
                pub(crate) status_bits: u16,
                #[packed_field(bytes = "2:3")]
                pub(crate) error_code: u16,
                #[packed_field(bytes = "4:5")]
                pub(crate) checkpoint_reached: u16,
                #[packed_field(bytes = "6:7")]
                pub(crate) checkpoint_discarded: u16,
                #[packed_field(bytes = "8:9")]
                pub(crate) move_id: u16,
                #[packed_field(bytes = "10:11")]
                pub(crate) fifo_space: u16,
                #[packed_field(bytes = "12:13", endian = "lsb")]
                pub(crate) motion_bits: u16,
                #[packed_field(bytes = "116:119")]
                pub(crate) seconds: u32,
                #[packed_field(bytes = "120:123")]
                pub(crate) microseconds: u32,
                #[packed_field(bytes = "128:131", endian = "lsb")]
                pub(crate) signal_bits: u32,
                #[packed_field(bytes = "132:135", endian = "lsb")]
                pub(crate) resettable_bits: u32,
                #[packed_field(bytes = "140:143")]
                pub(crate) dynamic_type0: u32,
                #[packed_field(bytes = "168:171")]
                pub(crate) dynamic_type1: u32,
                #[packed_field(bytes = "196:199")]
                pub(crate) dynamic_type2: u32,
                #[packed_field(bytes = "224:227")]
                pub(crate) dynamic_type3: u32,
            }

            #[inline(never)]
            pub(crate) fn measured_decode(bytes: &[u8; INPUT_LEN]) -> Input {
                Input::unpack(bytes).unwrap_or_default()
            }

            #[inline(never)]
            pub(crate) fn measured_encode(values: &Output, bytes: &mut [u8; OUTPUT_LEN]) {
                if let Ok(packed) = values.pack() {
                    *bytes = packed;
                }
            }

            #[inline(never)]
            pub(crate) fn measured_reads(bytes: &[u8; INPUT_LEN]) -> Reads {
                Reads::unpack(bytes).unwrap_or_default()
            }
        }
    };
}

images!(big, "msb");
images!(little, "lsb");

impl From<&OutputValues> for RobotControlBits {
    fn from(values: &OutputValues) -> Self {
        let flags = values.robot_control.flags;
        Self {
            deactivate_robot: flags.deactivate_robot,
            activate_robot: flags.activate_robot,
            home: flags.home,
            reset_error: flags.reset_error,
            activate_sim: flags.activate_sim,
            enable_recovery_mode: flags.enable_recovery_mode,
            disable_ethercat: flags.disable_ethercat,
        }
    }
}

impl From<&OutputValues> for MotionControlBits {
    fn from(values: &OutputValues) -> Self {
        let flags = values.motion_control.flags;
        Self {
            set_point: flags.set_point,
            pause_motion: flags.pause_motion,
            clear_motion: flags.clear_motion,
            resume_motion: flags.resume_motion,
            use_variables: flags.use_variables,
        }
    }
}

impl From<&OutputValues> for BrakesControlBits {
    fn from(values: &OutputValues) -> Self {
        let flags = values.brakes_control.flags;
        Self {
            brakes_control_allowed: flags.brakes_control_allowed,
            brakes_engaged: flags.brakes_engaged,
        }
    }
}
