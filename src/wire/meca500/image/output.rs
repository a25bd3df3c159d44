//! What the PLC sends: 60 bytes (RxPDO, O->T assembly, output CR).

use super::block::{BitField, block, flags, image};
use super::field::{Field, FieldType, Part, Placed, Row};
use super::{Int16, Int32, Real};
use crate::wire::WireError;
use crate::wire::order::ImageOrder;
use zerocopy::byteorder::{LittleEndian, U16, U32};

image! {
    /// The output image: what the PLC sends each bus cycle. Source: PM Tables 4 to 11.
    OutputImage<O>: 60 bytes as OUTPUT_LEN, values OutputValues, fields OUTPUT_FIELDS {
        /// Robot state: activation, homing, error reset, simulation, recovery.
        robot_control: RobotControl => RobotControlValues, at 0 ROBOT_CONTROL {
            "RobotControl" at 0, object 0x7200, pdo 0x1600, table 4;
        }
        /// Handshake and motion state: MoveID, SetPoint, pause, clear, resume.
        motion_control: MotionControl<O> => MotionControlValues, at 4 MOTION_CONTROL {
            "MotionControl" at 4, object 0x7310, pdo 0x1601, table 5;
        }
        /// Which command the handshake carries.
        motion_command: MotionCommandField<O> => MotionCommandFieldValues, at 8 MOTION_COMMAND {
            "MotionCommand" at 8, object 0x7305, pdo 0x1602, table 6;
        }
        /// The six arguments of the command.
        motion_command_args: MotionCommandArgs<O> => MotionCommandArgsValues, at 12 MOTION_COMMAND_ARGS {
            "MotionCommandArgs" at 12, object 0x7306, pdo 0x1602, table 7;
        }
        /// Sets the robot's clock.
        host_time: HostTime<O> => HostTimeValues, at 36 HOST_TIME {
            "HostTime" at 36, object 0x7400, pdo 0x1610, table 9;
        }
        /// Brakes of a deactivated robot.
        brakes_control: BrakesControl => BrakesControlValues, at 40 BRAKES_CONTROL {
            "BrakesControl" at 40, object 0x7410, pdo 0x1611, table 10;
        }
        /// What the four dynamic slots shall report.
        dynamic_data_configuration: DynamicDataConfiguration<O> => DynamicDataConfigurationValues,
            at 44 DYNAMIC_DATA_CONFIGURATION {
            "DynamicDataConfiguration" at 44, object 0x7420, pdo 0x1620, table 11;
        }
    }
}

block! {
    /// Bits that act on the robot's state. Source: PM Table 4.
    RobotControl: 4 bytes, values RobotControlValues, parts ROBOT_CONTROL {
        /// The control bits.
        flags: BitField<RobotControlFlags> => RobotControlBits, at 0, rows RobotControlFlags::ROWS;
    }
}

flags! {
    /// Bits of [`RobotControl`]. Source: PM Table 4.
    RobotControlFlags: u32 as U32<LittleEndian>, bools RobotControlBits {
        /// Deactivates the robot; hold until `Activated` is 0.
        DEACTIVATE_ROBOT deactivate_robot = 0 "DeactivateRobot" sub 1;
        /// Activates the robot unless DeactivateRobot is set; hold until `Activated` is 1.
        ACTIVATE_ROBOT activate_robot = 1 "ActivateRobot" sub 2;
        /// Homes an activated robot; hold until `Homed` is 1.
        HOME home = 2 "Home" sub 3;
        /// Leaves error mode; hold until `ErrorCode` is 0.
        RESET_ERROR reset_error = 3 "ResetError" sub 4;
        /// Level: simulation (default type) on or off, while deactivated; confirmed by `SimActivated`.
        ACTIVATE_SIM activate_sim = 4 "ActivateSim" sub 5;
        /// Level: recovery mode on or off; confirmed by `RecoveryMode`.
        ENABLE_RECOVERY_MODE enable_recovery_mode = 5 "EnableRecoveryMode" sub 6;
        /// Leaves EtherCAT for TCP/IP when 1. Meaningful on EtherCAT only.
        DISABLE_ETHERCAT disable_ethercat = 6 "DisableEtherCAT" sub 7;
    }
    reserved { 7 + 25 }
}

block! {
    /// The handshake and the motion bits. Source: PM Table 5.
    MotionControl<O>: 4 bytes, values MotionControlValues, parts MOTION_CONTROL {
        /// Number of the command: 0 is cyclic (velocity) mode, a changed non-zero number queues the
        /// command once. Echoed in the input's MoveID.
        move_id: Int16<O> => u16, at 0, rows &[
            Row::value("MoveID", FieldType::U16, 1, "",
                "Number of the command; 0 is cyclic mode, a changed non-zero number sends the command once."),
        ];
        /// The motion bits.
        flags: BitField<MotionControlFlags> => MotionControlBits, at 2, rows MotionControlFlags::ROWS;
    }
}

flags! {
    /// Bits of [`MotionControl`]. Source: PM Table 5.
    MotionControlFlags: u16 as U16<LittleEndian>, bools MotionControlBits {
        /// The robot looks at MoveID and MotionCommandID only while this is 1.
        SET_POINT set_point = 0 "SetPoint" sub 2;
        /// Level: stops along the path and keeps the queue; confirmed by `Paused`.
        PAUSE_MOTION pause_motion = 1 "PauseMotion" sub 3;
        /// Level: stops and empties the queue; confirmed by `Cleared`.
        CLEAR_MOTION clear_motion = 2 "ClearMotion" sub 4;
        /// Rising edge: resumes motion and resets resettable stops; confirmed by `Paused` = 0.
        RESUME_MOTION resume_motion = 3 "ResumeMotion" sub 5;
        /// The arguments are cyclic IDs of variables. Not on EtherCAT (PM L6834).
        USE_VARIABLES use_variables = 4 "UseVariables" sub 6;
    }
    reserved { 5 + 11 }
}

block! {
    /// Which command the handshake carries. Source: PM Tables 6 and 8.
    MotionCommandField<O>: 4 bytes, values MotionCommandFieldValues, parts MOTION_COMMAND {
        /// ID of the motion-related command (PM Table 8).
        motion_command_id: Int32<O> => u32, at 0, rows &[
            Row::value("MotionCommandID", FieldType::U32, 1, "",
                "ID of the motion-related command (Table 8)."),
        ];
    }
}

block! {
    /// The arguments of the command. Source: PM Table 7.
    MotionCommandArgs<O>: 24 bytes, values MotionCommandArgsValues, parts MOTION_COMMAND_ARGS {
        /// Arguments 1 to 6; unused ones are ignored.
        argument: [Real<O>; 6] => [f32; 6], at 0, rows &[
            Row::value("Argument 1", FieldType::F32, 2, "", "First argument of the command."),
            Row::value("Argument 2", FieldType::F32, 3, "", "Second argument of the command."),
            Row::value("Argument 3", FieldType::F32, 4, "", "Third argument of the command."),
            Row::value("Argument 4", FieldType::F32, 5, "", "Fourth argument of the command."),
            Row::value("Argument 5", FieldType::F32, 6, "", "Fifth argument of the command."),
            Row::value("Argument 6", FieldType::F32, 7, "", "Sixth argument of the command."),
        ];
    }
}

block! {
    /// The PLC's time of day. Source: PM Table 9.
    HostTime<O>: 4 bytes, values HostTimeValues, parts HOST_TIME {
        /// Seconds since 1970-01-01 00:00 UTC; non-zero sets the robot's clock.
        host_time: Int32<O> => u32, at 0, rows &[
            Row::value("HostTime", FieldType::U32, 1, "s",
                "Seconds since 1970-01-01 00:00 UTC; non-zero sets the robot's clock."),
        ];
    }
}

block! {
    /// Brakes of a deactivated robot; to disappear in a later firmware (PM L1257).
    /// Source: PM Table 10.
    BrakesControl: 4 bytes, values BrakesControlValues, parts BRAKES_CONTROL {
        /// The brake bits.
        flags: BitField<BrakesControlFlags> => BrakesControlBits, at 0, rows BrakesControlFlags::ROWS;
    }
}

flags! {
    /// Bits of [`BrakesControl`]. Source: PM Table 10.
    BrakesControlFlags: u32 as U32<LittleEndian>, bools BrakesControlBits {
        /// Lets BrakesEngaged act; an image of zeros therefore never releases the brakes.
        BRAKES_CONTROL_ALLOWED brakes_control_allowed = 0 "BrakesControlAllowed" sub 1;
        /// Level, only while deactivated and allowed: 1 engages, 0 releases (the arm may fall).
        BRAKES_ENGAGED brakes_engaged = 1 "BrakesEngaged" sub 2;
    }
    reserved { 2 + 30 }
}

block! {
    /// Requested types of the dynamic slots. Source: PM Table 11.
    DynamicDataConfiguration<O>: 16 bytes, values DynamicDataConfigurationValues,
        parts DYNAMIC_DATA_CONFIGURATION {
        /// Requested type of slots DynamicData0 to DynamicData3 (PM Table 12); 0 rotates.
        dynamic_data_type_id: [Int32<O>; 4] => [u32; 4], at 0, rows &[
            Row::value("DynamicDataTypeID1", FieldType::U32, 1, "", "Requested type of slot DynamicData0."),
            Row::value("DynamicDataTypeID2", FieldType::U32, 1, "", "Requested type of slot DynamicData1.")
                .object_step(1),
            Row::value("DynamicDataTypeID3", FieldType::U32, 1, "", "Requested type of slot DynamicData2.")
                .object_step(2),
            Row::value("DynamicDataTypeID4", FieldType::U32, 1, "", "Requested type of slot DynamicData3.")
                .object_step(3),
        ];
    }
}
