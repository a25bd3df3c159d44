//! What the PLC receives: 252 bytes (TxPDO, T->O assembly, input CR).

use super::block::{BitField, block, flags, image};
use super::field::{Field, FieldType, Part, Placed, Row, Support};
use super::{Int16, Int32, Real};
use crate::wire::WireError;
use crate::wire::order::{Big, ImageOrder};
use zerocopy::byteorder::{LittleEndian, U16, U32};

image! {
    /// The input image: what the PLC receives each bus cycle. Source: PM Tables 13 to 25.
    InputImage<O>: 252 bytes as INPUT_LEN, values InputValues, fields INPUT_FIELDS {
        /// State bits and error code.
        robot_status: RobotStatus<O> => RobotStatusValues, at 0 ROBOT_STATUS {
            "RobotStatus" at 0, object 0x6010, pdo 0x1A00, table 13;
        }
        /// Checkpoints, handshake echo, queue space, motion bits.
        motion_status: MotionStatus<O> => MotionStatusValues, at 4 MOTION_STATUS {
            "MotionStatus" at 4, object 0x6015, pdo 0x1A01, table 14;
        }
        /// Calculated joint positions.
        target_joint_set: TargetJointSet<O> => TargetJointSetValues, at 16 TARGET_JOINT_SET {
            "TargetJointSet" at 16, object 0x6030, pdo 0x1A02, table 15;
        }
        /// Calculated pose of the TRF in the WRF.
        target_end_effector_pose: PoseBlock<O> => PoseBlockValues, at 40 POSE {
            "TargetEndEffectorPose" at 40, object 0x6031, pdo 0x1A03, table 16;
        }
        /// Posture and turn of the calculated joint set.
        target_configuration: TargetConfiguration => TargetConfigurationValues,
            at 64 TARGET_CONFIGURATION {
            "TargetConfiguration" at 64, object 0x6046, pdo 0x1A08, table 17;
        }
        /// The WRF in the BRF.
        target_wrf: PoseBlock<O> => PoseBlockValues, at 68 POSE {
            "TargetWrf" at 68, object 0x6050, pdo 0x1A09, table 18;
        }
        /// The TRF in the FRF.
        target_trf: PoseBlock<O> => PoseBlockValues, at 92 POSE {
            "TargetTrf" at 92, object 0x6051, pdo 0x1A0A, table 19;
        }
        /// The robot's monotonic time.
        robot_timestamp: RobotTimestamp<O> => RobotTimestampValues, at 116 ROBOT_TIMESTAMP {
            "RobotTimestamp" at 116, object 0x6060, pdo 0x1A10, table 20;
        }
        /// Safety signals.
        safety_status: SafetyStatus => SafetyStatusValues, at 128 SAFETY_STATUS {
            "SafetyStatus" at 128, object 0x6065, pdo 0x1A11, table 21;
        }
        /// The four dynamic slots, DynamicData0 to DynamicData3.
        dynamic_data: [DynamicDataSlot<O>; 4] => [DynamicDataSlotValues; 4], at 140 DYNAMIC_DATA {
            "DynamicData0" at 140, object 0x6070, pdo 0x1A20, table 22;
            "DynamicData1" at 168, object 0x6071, pdo 0x1A21, table 23;
            "DynamicData2" at 196, object 0x6072, pdo 0x1A22, table 24;
            "DynamicData3" at 224, object 0x6073, pdo 0x1A23, table 25;
        }
    }
}

/// Sets MonitoringMode in an input image: what a connection that may only watch is told. It is a bit field,
/// so the byte order of the image does not matter; bytes of another length stay as they are.
/// Source: PM Table 13.
pub fn mark_monitoring(inputs: &mut [u8]) {
    if let Ok(image) = InputImage::<Big>::from_bytes_mut(inputs) {
        image.robot_status.flags.assign(RobotStatusFlags::MONITORING_MODE, true);
    }
}

block! {
    /// State bits and error code. Source: PM Table 13.
    RobotStatus<O>: 4 bytes, values RobotStatusValues, parts ROBOT_STATUS {
        /// The state bits.
        flags: BitField<RobotStatusFlags> => RobotStatusBits, at 0, rows RobotStatusFlags::ROWS;
        /// Code of the error the robot is in; 0 if there is none.
        error_code: Int16<O> => u16, at 2, rows &[
            Row::value("ErrorCode", FieldType::U16, 1, "", "Code of the error the robot is in; 0 if none."),
        ];
    }
}

flags! {
    /// Bits of [`RobotStatus`]. Source: PM Table 13.
    RobotStatusFlags: u16 as U16<LittleEndian>, bools RobotStatusBits {
        /// Being activated, homed or deactivated.
        BUSY busy = 0 "Busy" sub 2;
        /// Motors are on.
        ACTIVATED activated = 1 "Activated" sub 3;
        /// Homed: ready for motion commands.
        HOMED homed = 2 "Homed" sub 4;
        /// Simulation mode is on; its type is not reported.
        SIM_ACTIVATED sim_activated = 3 "SimActivated" sub 5;
        /// Brakes of joints 1 to 3 are engaged.
        BRAKES_ENGAGED brakes_engaged = 4 "BrakesEngaged" sub 6;
        /// Recovery mode is on.
        RECOVERY_MODE recovery_mode = 5 "RecoveryMode" sub 7;
        /// E-Stop signal; superseded by SafetyStatus.
        E_STOP e_stop = 6 "EStop (deprecated)" sub 8 support Deprecated;
        /// An imminent collision was detected.
        COLLISION_STATUS collision_status = 7 "CollisionStatus" sub 9;
        /// A breach of the work zone was detected.
        WORK_ZONE_STATUS work_zone_status = 8 "WorkZoneStatus" sub 10;
        /// This connection may only watch, not control.
        MONITORING_MODE monitoring_mode = 9 "MonitoringMode" sub 11;
    }
    reserved { 10 + 6 }
}

block! {
    /// Checkpoints, handshake echo, queue space and motion bits. Source: PM Table 14.
    MotionStatus<O>: 12 bytes, values MotionStatusValues, parts MOTION_STATUS {
        /// Last checkpoint reached, 1 to 8000; holds until another one is reached.
        checkpoint_reached: Int16<O> => u16, at 0, rows &[
            Row::value("CheckpointReached", FieldType::U16, 1, "", "Last checkpoint reached."),
        ];
        /// Last checkpoint discarded, 1 to 8000; holds until another one is discarded.
        checkpoint_discarded: Int16<O> => u16, at 2, rows &[
            Row::value("CheckpointDiscarded", FieldType::U16, 2, "", "Last checkpoint discarded."),
        ];
        /// Echo of the last command received: accepted, not executed.
        move_id: Int16<O> => u16, at 4, rows &[
            Row::value("MoveID", FieldType::U16, 3, "", "Echo of the last command received."),
        ];
        /// Commands the motion queue can still take, 0 to 13,000; at 0 commands are ignored.
        fifo_space: Int16<O> => u16, at 6, rows &[
            Row::value("FifoSpace", FieldType::U16, 4, "", "Commands the motion queue can still take."),
        ];
        /// The motion bits.
        flags: BitField<MotionStatusFlags> => MotionStatusBits, at 8, rows MotionStatusFlags::ROWS;
        /// ID of the running offline program; 0 if none.
        offline_program_id: Int16<O> => u16, at 10, rows &[
            Row::value("OfflineProgramID", FieldType::U16, 5, "", "ID of the running offline program; 0 if none."),
        ];
    }
}

flags! {
    /// Bits of [`MotionStatus`]. Source: PM Table 14.
    MotionStatusFlags: u16 as U16<LittleEndian>, bools MotionStatusBits {
        /// Motion is paused, until resumed.
        PAUSED paused = 0 "Paused" sub 6;
        /// End of block: standing still with an empty queue. Never proves completion.
        EOB eob = 1 "EOB" sub 7;
        /// End of motion: standing still. Never proves completion.
        EOM eom = 2 "EOM" sub 8;
        /// The queue was cleared; holds until resumed or activated again.
        CLEARED cleared = 3 "Cleared" sub 9;
        /// P-Stop 2 (SWStop) signal; superseded by SafetyStatus.
        P_STOP2 p_stop2 = 4 "PStop2 (deprecated)" sub 10 support Deprecated;
        /// A joint torque exceeds the user's limit.
        EXCESSIVE_TORQUE excessive_torque = 5 "ExcessiveTorque" sub 11;
    }
    reserved { 6 + 10 }
}

block! {
    /// Calculated joint positions. Source: PM Table 15.
    TargetJointSet<O>: 24 bytes, values TargetJointSetValues, parts TARGET_JOINT_SET {
        /// Joints 1 to 6, in degrees.
        joint: [Real<O>; 6] => [f32; 6], at 0, rows &[
            Row::value("Joint 1", FieldType::F32, 1, "deg", "Calculated position of joint 1."),
            Row::value("Joint 2", FieldType::F32, 2, "deg", "Calculated position of joint 2."),
            Row::value("Joint 3", FieldType::F32, 3, "deg", "Calculated position of joint 3."),
            Row::value("Joint 4", FieldType::F32, 4, "deg", "Calculated position of joint 4."),
            Row::value("Joint 5", FieldType::F32, 5, "deg", "Calculated position of joint 5."),
            Row::value("Joint 6", FieldType::F32, 6, "deg", "Calculated position of joint 6."),
        ];
    }
}

block! {
    /// A frame: position in mm, mobile XYZ Euler angles in degrees. Source: PM Tables 16, 18, 19.
    PoseBlock<O>: 24 bytes, values PoseBlockValues, parts POSE {
        /// X coordinate, in mm.
        x: Real<O> => f32, at 0, rows &[Row::value("X coordinate", FieldType::F32, 1, "mm", "X of the origin.")];
        /// Y coordinate, in mm.
        y: Real<O> => f32, at 4, rows &[Row::value("Y coordinate", FieldType::F32, 2, "mm", "Y of the origin.")];
        /// Z coordinate, in mm.
        z: Real<O> => f32, at 8, rows &[Row::value("Z coordinate", FieldType::F32, 3, "mm", "Z of the origin.")];
        /// First Euler angle, about x, in degrees.
        alpha: Real<O> => f32, at 12, rows &[Row::value("alpha angle", FieldType::F32, 4, "deg", "Euler angle about x.")];
        /// Second Euler angle, about the turned y, in degrees.
        beta: Real<O> => f32, at 16, rows &[Row::value("beta angle", FieldType::F32, 5, "deg", "Euler angle about the turned y.")];
        /// Third Euler angle, about the turned z, in degrees.
        gamma: Real<O> => f32, at 20, rows &[Row::value("gamma angle", FieldType::F32, 6, "deg", "Euler angle about the turned z.")];
    }
}

block! {
    /// Posture and turn of the calculated joint set. Source: PM Table 17.
    TargetConfiguration: 4 bytes, values TargetConfigurationValues, parts TARGET_CONFIGURATION {
        /// Shoulder: 1 front, -1 back, 0 near the singularity.
        shoulder: i8 => i8, at 0, rows &[Row::value("Shoulder", FieldType::I8, 1, "", "1 front, -1 back, 0 near the singularity.")];
        /// Elbow: 1 up, -1 down, 0 near the singularity.
        elbow: i8 => i8, at 1, rows &[Row::value("Elbow", FieldType::I8, 2, "", "1 up, -1 down, 0 near the singularity.")];
        /// Wrist: 1 no flip, -1 flip, 0 near the singularity.
        wrist: i8 => i8, at 2, rows &[Row::value("Wrist", FieldType::I8, 3, "", "1 no flip, -1 flip, 0 near the singularity.")];
        /// Turn of joint 6, -100 to 100.
        turn: i8 => i8, at 3, rows &[Row::value("Turn", FieldType::I8, 4, "turn", "Turn of joint 6, -100 to 100.")];
    }
}

block! {
    /// The robot's monotonic time and the count of dynamic rotations. Source: PM Table 20.
    RobotTimestamp<O>: 12 bytes, values RobotTimestampValues, parts ROBOT_TIMESTAMP {
        /// Whole seconds since an arbitrary reference; never set back.
        seconds: Int32<O> => u32, at 0, rows &[Row::value("Seconds", FieldType::U32, 1, "s", "Monotonic time, whole seconds.")];
        /// Microseconds within the second, 0 to 999,999.
        microseconds: Int32<O> => u32, at 4, rows &[Row::value("Microseconds", FieldType::U32, 2, "us", "Monotonic time, microseconds within the second.")];
        /// Completed rotations through the dynamic types; counts while a slot is automatic.
        dynamic_data_cycles: Int32<O> => u32, at 8, rows &[Row::value("DynamicDataCycles", FieldType::U32, 3, "", "Completed rotations through the dynamic types.")];
    }
}

block! {
    /// Safety signals. Source: PM Table 21.
    SafetyStatus: 12 bytes, values SafetyStatusValues, parts SAFETY_STATUS {
        /// Signals: 1 while present or still to be reset.
        signals: BitField<SafetySignals> => SafetySignalBits, at 0, rows SafetySignals::ROWS;
        /// Signals that may be reset now.
        resettable: BitField<SafetyResettable> => SafetyResettableBits, at 4, rows SafetyResettable::ROWS;
        /// Operation mode; not on the Meca500.
        operation_mode: u8 => u8, at 8, rows &[
            Row::value("OperationMode", FieldType::U8, 65, "", "Operation mode; not on the Meca500.").support(Support::No),
        ];
        /// Motor power.
        power: BitField<SafetyPower> => SafetyPowerBits, at 9, rows SafetyPower::ROWS;
        /// Inputs of the power supply.
        psu_inputs: BitField<PsuInputs> => PsuInputBits, at 10, rows PsuInputs::ROWS;
    }
}

flags! {
    /// Safety signals: 1 while present or still to be reset. Source: PM Table 21.
    SafetySignals: u32 as U32<LittleEndian>, bools SafetySignalBits {
        /// E-Stop; the Meca500 cannot tell it from P-Stop 1.
        E_STOP e_stop = 0 "EStop" sub 1;
        /// P-Stop 1; not on the Meca500.
        P_STOP1 p_stop1 = 1 "PStop1" sub 2 support No;
        /// P-Stop 2, wired as SWStop on the Meca500.
        P_STOP2 p_stop2 = 2 "PStop2" sub 3;
        /// Operation mode changed; not on the Meca500.
        OPERATION_MODE_CHANGE operation_mode_change = 4 "OperationModeChange" sub 5 support No;
        /// Enabling device released; not on the Meca500.
        ENABLING_DEVICE_RELEASED enabling_device_released = 5 "EnablingDeviceReleased" sub 6 support No;
        /// Supply voltage fluctuates; not on the Meca500.
        VOLTAGE_FLUCTUATION voltage_fluctuation = 6 "VoltageFluctuation" sub 7 support No;
        /// The robot has rebooted; not on the Meca500 by this table (but see PM L916).
        REBOOT reboot = 7 "Reboot" sub 8 support No;
        /// Redundant inputs disagree; not on the Meca500 by this table (but see PM L920).
        REDUNDANCY_FAULT redundancy_fault = 8 "RedundancyFault" sub 9 support No;
        /// Moved while it should stand still; not on the Meca500.
        STANDSTILL_FAULT standstill_fault = 9 "StandstillFault" sub 10 support No;
        /// The TCP/IP connection dropped.
        CONNECTION_DROPPED connection_dropped = 10 "ConnectionDropped" sub 11;
        /// Minor error; not on the Meca500.
        MINOR_ERROR minor_error = 11 "MinorError" sub 12 support No;
    }
    reserved { 3 + 1, 12 + 20 }
}

flags! {
    /// Safety signals that may be reset now. Source: PM Table 21.
    SafetyResettable: u32 as U32<LittleEndian>, bools SafetyResettableBits {
        /// E-Stop may be reset with the Reset button; revision 4 only.
        E_STOP e_stop = 0 "EStopResettable" sub 33 support R4Only;
        /// Not on the Meca500.
        P_STOP1 p_stop1 = 1 "PStop1Resettable" sub 34 support No;
        /// P-Stop 2 may be reset with ResumeMotion.
        P_STOP2 p_stop2 = 2 "PStop2Resettable" sub 35;
        /// Not on the Meca500.
        OPERATION_MODE_CHANGE operation_mode_change = 4 "OperationModeChangeResettable" sub 37 support No;
        /// Not on the Meca500.
        ENABLING_DEVICE_RELEASED enabling_device_released = 5 "EnablingDeviceReleasedResettable" sub 38 support No;
        /// Not on the Meca500.
        VOLTAGE_FLUCTUATION voltage_fluctuation = 6 "VoltageFluctuationResettable" sub 39 support No;
        /// Not on the Meca500.
        REBOOT reboot = 7 "RebootResettable" sub 40 support No;
        /// Always 0: this fault needs a reboot.
        REDUNDANCY_FAULT redundancy_fault = 8 "RedundancyFaultResettable" sub 41;
        /// Not on the Meca500.
        STANDSTILL_FAULT standstill_fault = 9 "StandstillFaultResettable" sub 42 support No;
        /// The dropped connection may be reset with ResumeMotion.
        CONNECTION_DROPPED connection_dropped = 10 "ConnectionDroppedResettable" sub 43;
        /// Not on the Meca500.
        MINOR_ERROR minor_error = 11 "MinorErrorResettable" sub 44 support No;
    }
    reserved { 3 + 1, 12 + 20 }
}

flags! {
    /// Motor power. Source: PM Table 21.
    SafetyPower: u8 as u8, bools SafetyPowerBits {
        /// No signal holds motor power off any more: the Reset button may be pressed; revision 4 only.
        RESET_READY reset_ready = 0 "ResetReady" sub 66 support R4Only;
        /// Motors are powered.
        V_MOTOR_ON v_motor_on = 1 "VMotorOn" sub 67;
    }
    reserved { 2 + 6 }
}

flags! {
    /// Inputs of the power supply; not on the Meca500. Source: PM Table 21.
    PsuInputs: u16 as U16<LittleEndian>, bools PsuInputBits {
        /// Not on the Meca500.
        E_STOP e_stop = 0 "PsuInputs_EStop" sub 74 support No;
        /// Not on the Meca500.
        P_STOP1 p_stop1 = 1 "PsuInputs_PStop1" sub 75 support No;
        /// Not on the Meca500.
        P_STOP2 p_stop2 = 2 "PsuInputs_PStop2" sub 76 support No;
        /// Not on the Meca500.
        RESET_EXTERNAL reset_external = 3 "PsuInputs_ResetExternal" sub 77 support No;
        /// Not on the Meca500.
        RESET_KEYPAD reset_keypad = 4 "PsuInputs_ResetKeypad" sub 78 support No;
        /// Not on the Meca500.
        ENABLING_DEVICE enabling_device = 5 "PsuInputs_EnablingDevice" sub 79 support No;
    }
    reserved { 6 + 10 }
}

block! {
    /// One dynamic slot: which type it carries, and six values of that type.
    /// Source: PM Tables 22 to 25, types in PM Table 12.
    DynamicDataSlot<O>: 28 bytes, values DynamicDataSlotValues, parts DYNAMIC_DATA {
        /// The type the values belong to (PM Table 12).
        dynamic_type: Int32<O> => u32, at 0, rows &[
            Row::value("DynamicType", FieldType::U32, 1, "", "The type the values belong to (Table 12)."),
        ];
        /// Six values; unused ones are 0. The second of type 3 is an integer in a Real's place.
        value_idx: [Real<O>; 6] => [f32; 6], at 4, rows &[
            Row::value("ValueIdx_0", FieldType::F32, 2, "", "First value of the type."),
            Row::value("ValueIdx_1", FieldType::F32, 3, "", "Second value of the type; an integer for type 3."),
            Row::value("ValueIdx_2", FieldType::F32, 4, "", "Third value of the type."),
            Row::value("ValueIdx_3", FieldType::F32, 5, "", "Fourth value of the type."),
            Row::value("ValueIdx_4", FieldType::F32, 6, "", "Fifth value of the type."),
            Row::value("ValueIdx_5", FieldType::F32, 7, "", "Sixth value of the type."),
        ];
    }
}
