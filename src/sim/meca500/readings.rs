//! Where the manual leaves a behaviour open: one switch each, with every reading as a value.
//!
//! Read first: [`Readings`]. Its default holds the reading that follows the manual's wording most
//! closely, which says nothing about what a real robot does. A PLC-side program must be right under
//! all of them; [`Readings::variations`] lists each reading that differs from the default, for
//! tests that run the matrix.
//!
//! The number beside a switch is that of the open question in the project's list of contradictions
//! (`meca500_contradictions.md`).

/// A reading that differs from the default in one switch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Variation {
    /// Number of the open question.
    pub contradiction: u16,
    /// Name of the switch: the field of [`Readings`].
    pub switch: &'static str,
    /// Name of the value.
    pub value: &'static str,
    /// The default readings with this one changed.
    pub readings: Readings,
}

macro_rules! readings {
    ($(
        $number:literal
        $(#[doc = $doc:literal])+
        $field:ident: $name:ident {
            $(#[doc = $first_doc:literal])+
            $first:ident,
            $(
                $(#[doc = $value_doc:literal])+
                $value:ident,
            )+
        }
    )*) => {
        $(
            $(#[doc = $doc])+
            #[doc = ""]
            #[doc = concat!("Open question ", stringify!($number), ".")]
            #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
            pub enum $name {
                $(#[doc = $first_doc])+
                #[default]
                $first,
                $(
                    $(#[doc = $value_doc])+
                    $value,
                )+
            }
        )*

        /// One value for each open question.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub struct Readings {
            $(
                $(#[doc = $doc])+
                #[doc = ""]
                #[doc = concat!("Open question ", stringify!($number), ".")]
                pub $field: $name,
            )*
        }

        const VARIATIONS: &[(u16, &str, &str, fn() -> Readings)] = &[$($(
            (
                $number,
                stringify!($field),
                stringify!($value),
                || Readings { $field: $name::$value, ..Readings::default() },
            ),
        )+)*];
    };
}

impl Readings {
    /// Every reading that is not the default, one switch changed at a time.
    pub fn variations() -> impl ExactSizeIterator<Item = Variation> {
        VARIATIONS.iter().map(|(contradiction, switch, value, readings)| Variation {
            contradiction: *contradiction,
            switch,
            value,
            readings: readings(),
        })
    }
}

readings! {
    17
    /// Activate, Deactivate, Home and ResetError held at 1.
    held_triggered_bits: HeldTriggeredBits {
        /// Act in every cycle in which they are 1 and can act.
        Level,
        /// Act once, when they change from 0 to 1.
        Edge,
    }
    18
    /// ClearMotion held at 1.
    held_clear_motion: HeldClearMotion {
        /// Empties the queue in every cycle, so that nothing can be queued meanwhile.
        EachCycle,
        /// Empties the queue once, when it changes from 0 to 1.
        Once,
    }
    19
    /// What a MoveID must differ from to send a command.
    move_id_trigger: MoveIdTrigger {
        /// From the last accepted one, whenever SetPoint is 1.
        LastAccepted,
        /// From that of the previous cycle, whatever SetPoint was then.
        PreviousCycle,
        /// From that of the previous cycle, in which SetPoint was already 1.
        PreviousCycleWithSetPoint,
    }
    20
    /// MoveID returned when a connection begins.
    echo_at_connection: EchoAtConnection {
        /// The one of the last command, also over a lost connection.
        Kept,
        /// Zero.
        Zero,
        /// Any number: 0xA5C3 here.
        Arbitrary,
    }
    20
    /// The last accepted MoveID, when the connection is lost.
    move_id_memory: MoveIdMemory {
        /// Is remembered: the same number again sends no command.
        Kept,
        /// Is forgotten: any non-zero number is new.
        Forgotten,
    }
    21
    /// MoveID returned while the PLC sends MoveID 0 with SetPoint 1.
    echo_in_cyclic_mode: EchoInCyclicMode {
        /// The one of the last non-cyclic command.
        Kept,
        /// Zero.
        Zero,
    }
    22
    /// A velocity command with a MoveID that is not 0.
    velocity_with_move_id: VelocityWithMoveId {
        /// Is queued and runs until the velocity timeout.
        RunsForTimeout,
        /// Is received and has no effect.
        Ignored,
    }
    22
    /// A command that is neither velocity nor position mode, with MoveID 0 and SetPoint 1.
    configuration_without_move_id: ConfigurationWithoutMoveId {
        /// Is executed (or queued) again in every cycle, as a position-mode command is.
        EachCycle,
        /// Has no effect.
        Ignored,
    }
    23
    /// MoveID of a command that the robot refuses.
    refused_command: RefusedCommand {
        /// Is returned: the robot has received it.
        Acknowledged,
        /// Is not returned.
        NotAcknowledged,
    }
    23
    /// The code of a refusal (1003, 1005, 1006, 1011 ...).
    refusal_code: RefusalCode {
        /// Does not appear in ErrorCode.
        Hidden,
        /// Appears in ErrorCode for one cycle, if nothing else is there.
        ShownForOneCycle,
        /// Appears in ErrorCode until ResetError or until the next command is accepted.
        ShownUntilReset,
    }
    24
    /// MotionCommandID 0 with a new MoveID.
    no_movement: NoMovementCommand {
        /// Is acknowledged and has no effect.
        Acknowledged,
        /// Is not acknowledged.
        NotAcknowledged,
    }
    27
    /// A velocity motion of MoveID 0 whose SetPoint becomes 0.
    set_point_drop: SetPointDrop {
        /// Decelerates at once.
        StopsAtOnce,
        /// Decelerates after the velocity timeout.
        StopsAfterTimeout,
    }
    28
    /// StartProgram.
    start_program: StartProgramClass {
        /// Puts the program's commands into the queue at once.
        Immediate,
        /// Waits in the queue and puts the program's commands in its own place.
        Queued,
    }
    29
    /// ResumeMotion while a safety stop is resettable.
    resume_after_safety_stop: ResumeAfterSafetyStop {
        /// Resets the stop and resumes.
        ResetsAndResumes,
        /// Resets the stop; a second rising edge resumes.
        ResetsOnly,
    }
    29
    /// A released P-Stop 2 or a dropped connection that was not reset, while the robot is not
    /// activated and homed.
    released_stop_before_ready: ReleasedStopBeforeReady {
        /// Does not keep the robot from becoming so; ResumeMotion resets it afterwards.
        KeepsNothing,
        /// Keeps the robot from it until ResumeMotion has reset it, which it then does in any state.
        NeedsResume,
    }
    30
    /// Paused in error mode, and until ResumeMotion after it.
    paused_in_error_mode: PausedInErrorMode {
        /// 1.
        Set,
        /// 0 unless paused by something else.
        Clear,
    }
    30
    /// Paused and the need to resume, after an activation.
    paused_after_activation: PausedAfterActivation {
        /// 0: commands run at once.
        Clear,
        /// 1 until ResumeMotion.
        Set,
    }
    30
    /// Paused while the robot is deactivated and was never activated.
    paused_at_power_up: PausedAtPowerUp {
        /// 0.
        Clear,
        /// 1.
        Set,
    }
    30
    /// Cleared while the robot is deactivated and was never activated.
    cleared_at_power_up: ClearedAtPowerUp {
        /// 0: nothing was cleared yet.
        Clear,
        /// 1, as after any deactivation.
        Set,
    }
    33
    /// A command refused for its arguments, its state or its ID.
    refusal: Refusal {
        /// Leaves the robot as it was.
        Harmless,
        /// Puts an activated robot in error mode.
        StartsErrorMode,
    }
    33
    /// SetTimeScaling and the setting of a variable, allowed in any state, in error mode, in which
    /// every later command is answered with 1011.
    any_state_in_error_mode: AnyStateInErrorMode {
        /// Are taken.
        Taken,
        /// Are refused (1011) until ResetError.
        Refused,
    }
    34
    /// MoveID of a command ignored because FifoSpace is 0.
    full_queue: FullQueue {
        /// Is not returned; the command is taken when there is space again.
        NotAcknowledged,
        /// Is returned although the command is lost.
        AcknowledgedAndLost,
    }
    34
    /// The about 25 commands compiled ahead.
    compiled_commands: CompiledCommands {
        /// Take space of the queue.
        Counted,
        /// Do not.
        NotCounted,
    }
    36
    /// RobotTimestamp after a boot; its reference is arbitrary.
    timestamp_after_boot: TimestampAfterBoot {
        /// Counts from 0 again.
        Restarts,
        /// Goes on.
        Continues,
    }
    38
    /// Homed, in recovery mode with an activated robot that was not homed.
    homed_in_recovery: HomedInRecovery {
        /// 0: it is not homed.
        Clear,
        /// 1: it is ready to receive motion commands.
        Set,
    }
    39
    /// HostTime held at the same non-zero value.
    host_time: HostTimeReading {
        /// Sets the clock in every cycle, so that it stands still.
        EachCycle,
        /// Sets the clock when it changes.
        OnChange,
    }
    40
    /// The deprecated bits EStop and PStop2.
    deprecated_bits: DeprecatedBits {
        /// 1 while the signal is present.
        Present,
        /// 1 while the signal is present or resettable, as in SafetyStatus.
        PresentOrResettable,
    }
    42
    /// Several automatic dynamic slots.
    automatic_slots: AutomaticSlots {
        /// Share one rotation: each takes the next type.
        Share,
        /// Rotate together: all show the same type.
        Together,
    }
    42
    /// Variables with a cyclic ID, in the automatic rotation.
    variables_in_rotation: VariablesInRotation {
        /// Take no part.
        Absent,
        /// Take part, after the other types.
        Present,
    }
    42
    /// Types 4 to 10, 26 to 28, 72 and 73, in the automatic rotation.
    unavailable_in_rotation: UnavailableInRotation {
        /// Take no part.
        Absent,
        /// Take part with zeros.
        Present,
    }
    43
    /// A request for a dynamic type that does not exist.
    unknown_dynamic_type: UnknownDynamicType {
        /// Is echoed with zeros.
        EchoedWithZeros,
        /// Leaves the slot with the type it had.
        KeepsPrevious,
        /// Counts as automatic.
        Automatic,
    }
    45
    /// The tool that dynamic type 52 names while a tool is emulated.
    external_tool_type: ExternalToolType {
        /// The emulated one.
        Emulated,
        /// The fitted one.
        Fitted,
    }
    48
    /// A 0 before the last variable ID, with UseVariables.
    zero_variable_id: ZeroVariableId {
        /// Ends the list.
        EndsList,
        /// Is skipped.
        Skipped,
        /// Stands for the value 0.
        IsZero,
    }
    48
    /// More than six values, with UseVariables.
    too_many_values: TooManyValues {
        /// Are cut after the sixth.
        Cut,
        /// Are refused (1003).
        Refused,
    }
    48
    /// UseVariables on EtherCAT.
    use_variables_on_ethercat: UseVariablesOnEtherCat {
        /// Has no effect: the arguments are taken as they are.
        Ignored,
        /// Is refused (1040).
        Refused,
        /// Works.
        Works,
    }
    49
    /// Setting a variable by its cyclic ID.
    set_variable: SetVariableClass {
        /// Happens at once.
        Immediate,
        /// Waits in the queue.
        Queued,
    }
    50
    /// Real-time dynamic values before homing.
    dynamic_before_homing: DynamicBeforeHoming {
        /// Are given, as accurate as they can be.
        Given,
        /// Are zero.
        Zero,
    }
    56
    /// SafetyStatus.Reboot after a reboot.
    reboot_signal: RebootSignal {
        /// 0: not on this robot.
        Absent,
        /// 1 until the Reset button is pressed.
        Reported,
    }
    56
    /// Motor power after a reboot.
    power_after_reboot: PowerAfterReboot {
        /// Off until the Reset button is pressed.
        NeedsReset,
        /// On.
        On,
    }
    57
    /// SafetyStatus.RedundancyFault.
    redundancy_signal: RedundancySignal {
        /// 0: not on this robot.
        Absent,
        /// 1 from the fault to the reboot.
        Reported,
    }
    61
    /// P-Stop 2 and Paused.
    p_stop2_paused: PStop2Paused {
        /// Sets it.
        Set,
        /// Leaves it.
        Unchanged,
    }
    61
    /// P-Stop 2 in clear mode and Cleared.
    p_stop2_cleared: PStop2Cleared {
        /// Sets it.
        Set,
        /// Leaves it.
        Unchanged,
    }
    63
    /// The loss of the controlling cyclic connection.
    cyclic_connection_loss: CyclicConnectionLoss {
        /// Stops a moving robot with ConnectionDropped, as the loss of a TCP connection.
        Stops,
        /// Changes nothing: the queue runs on.
        Ignored,
    }
    66
    /// ResetError of an activated robot that is not ready for motion.
    reset_before_ready: ResetBeforeReady {
        /// Resets the error.
        Allowed,
        /// Does nothing: only deactivation helps.
        Refused,
    }
    69
    /// Activation with a joint outside its user limits.
    activation_outside_limits: ActivationOutsideLimits {
        /// Fails (1013).
        Fails,
        /// Succeeds; homing fails (1032).
        HomingFails,
    }
    33
    /// Error code of a failed activation (1013), which is no error mode.
    activation_failure_code: ActivationFailureCode {
        /// Appears in ErrorCode until ResetError or the next activation.
        Shown,
        /// Does not appear.
        Hidden,
    }
    121
    /// SetJointVelLimit and velocity mode.
    joint_vel_limit: JointVelLimit {
        /// Reduces velocities above the limit only.
        Limits,
        /// Scales every requested joint velocity by the percentage as well.
        Scales,
    }
    104
    /// Code of the answer to GetWrf.
    wrf_code: WrfCode {
        /// 2013, as Table 2 has it.
        Table,
        /// 2014, as its chapter prints; also that of GetTrf.
        Chapter,
    }
    111
    /// Code of the answer to GetPStop2Cfg.
    p_stop2_cfg_code: PStop2CfgCode {
        /// 2179, as Table 2 has it.
        Table,
        /// 2178, as its chapter prints; also that of SetPStop2Cfg.
        Chapter,
    }
    108
    /// Code of the answer to GetExtToolFwVersion.
    tool_version_code: ToolVersionCode {
        /// 2086, as its chapter prints.
        Chapter,
        /// 2088, as one of two rows of Table 2 has it.
        Table,
    }
    106
    /// Value of 2047, the answer to SetExtToolSim and GetExtToolSim.
    tool_simulation_value: ToolSimulationValue {
        /// The number of the tool.
        Number,
        /// The text of Table 2.
        Text,
    }
    60
    /// Code of the safety signal of a dropped connection.
    connection_drop_code: ConnectionDropCode {
        /// 3086, as the tables and the chapters of commands have it.
        Tables,
        /// 3081, as section 4 prints.
        Section4,
    }
    35
    /// 3004 after PauseMotion of a moving robot.
    end_of_movement_after_pause: EndOfMovementAfterPause {
        /// Is sent even while SetEom is off.
        Always,
        /// Is sent if SetEom is on.
        WhenEnabled,
    }
    33
    /// Text commands that depend on what the robot is ready for, while it is being activated, homed
    /// or deactivated.
    commands_while_busy: CommandsWhileBusy {
        /// Wait for the end of it, in their order.
        Wait,
        /// Are judged by the state at their arrival.
        Judged,
    }
    33
    /// Requests and other text commands for any state, in error mode, in which every later command
    /// is answered with 1011.
    text_in_error_mode: TextInErrorMode {
        /// Are answered.
        Answered,
        /// Are refused until ResetError, but for GetStatusRobot and what leads out of the error.
        Refused,
    }
    42
    /// Delay of a change of a requested dynamic type: "one or two cycles" (PM L1278).
    dynamic_delay: DynamicDelay {
        /// One cycle.
        OneCycle,
        /// Two cycles.
        TwoCycles,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_variation_differs_from_the_default_and_from_each_other() {
        let variations: alloc::vec::Vec<_> = Readings::variations().collect();
        assert_eq!(Readings::variations().len(), variations.len());
        for (index, variation) in variations.iter().enumerate() {
            assert_ne!(variation.readings, Readings::default(), "{}", variation.switch);
            for other in variations.iter().skip(index + 1) {
                assert_ne!(variation.readings, other.readings);
            }
        }
    }
}
