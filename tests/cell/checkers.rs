//! Checkers that stand apart from engine and robot: they look at the bytes of each cycle and at
//! the events, and know only the manual's rules of the handshake.

use std::collections::{BTreeMap, BTreeSet};

use fieldarm::cycle::InputQuality;
use fieldarm::engine::meca500::{Event, Ticket};
use fieldarm::wire::meca500::command::{MotionCommand, MotionCommandId};
use fieldarm::wire::meca500::image::{
    InputImage, MotionControlFlags, MotionStatusFlags, OutputImage, RobotControlFlags,
    RobotStatusFlags, SafetySignals,
};
use fieldarm::wire::order::ImageOrder;

/// A command as it stands in the output image.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Command {
    id: u32,
    argument_bits: [u32; 6],
    use_variables: bool,
}

impl Command {
    const NO_MOVEMENT: Self = Self { id: 0, argument_bits: [0; 6], use_variables: false };

    fn of<O: ImageOrder>(outputs: &OutputImage<O>) -> Self {
        Self {
            id: outputs.motion_command.motion_command_id.get(),
            argument_bits: outputs.motion_command_args.argument.map(|value| value.get().to_bits()),
            use_variables: outputs.motion_control.flags.contains(MotionControlFlags::USE_VARIABLES),
        }
    }
}

/// The command a MoveID carries, and whether the robot was seen to echo it.
#[derive(Clone, Copy, Debug)]
struct Carried {
    move_id: u16,
    command: Command,
    echoed: bool,
}

/// Watches what the PLC sends, given what it received.
#[derive(Clone, Debug, Default)]
pub(crate) struct PlcChecker {
    carried: Option<Carried>,
    set_point_before: bool,
    control_before: RobotControlFlags,
    resume_before: bool,
    /// Safety signals when ResumeMotion rose.
    stops_at_resume: SafetySignals,
    bad_cycles: u32,
    seen_fresh: bool,
}

/// What the checker needs to know of the cycle besides the images.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CycleFacts {
    pub(crate) quality: InputQuality,
    /// The engine told of a fault, a failed action, a loss or a reboot in this cycle: a trigger bit
    /// may fall without its confirmation.
    pub(crate) excused: bool,
    /// Bad cycles after which the outputs must be safe.
    pub(crate) bad_cycles_limit: u32,
}

impl PlcChecker {
    /// Judges `outputs`, which the engine made from `inputs`.
    pub(crate) fn check<O: ImageOrder>(
        &mut self,
        facts: CycleFacts,
        inputs: &InputImage<O>,
        outputs: &OutputImage<O>,
    ) -> Result<(), String> {
        let fresh = facts.quality.is_fresh();
        self.seen_fresh |= fresh;
        self.bad_cycles = if fresh { 0 } else { self.bad_cycles + 1 };
        let motion = outputs.motion_control.flags.get();
        let control = outputs.robot_control.flags.get();
        let set_point = motion.contains(MotionControlFlags::SET_POINT);

        if !self.seen_fresh && outputs.as_bytes().iter().any(|&byte| byte != 0) {
            return Err("outputs are not zero before the first fresh inputs".into());
        }
        if self.bad_cycles > facts.bad_cycles_limit
            && (set_point || control.intersects(TRIGGERS) || resume(motion))
        {
            return Err(format!("outputs still act after {} bad cycles", self.bad_cycles));
        }
        if fresh
            && inputs.robot_status.flags.contains(RobotStatusFlags::MONITORING_MODE)
            && (set_point || control.intersects(TRIGGERS) || resume(motion))
        {
            return Err("control attempted on a monitoring connection".into());
        }
        if !(RobotControlFlags::all().contains(control)
            && MotionControlFlags::all().contains(motion))
        {
            return Err("a reserved bit is set".into());
        }
        self.check_handshake(fresh, set_point, inputs, outputs)?;
        if fresh && !facts.excused {
            self.check_releases(inputs, control, motion)?;
        }
        self.set_point_before = set_point;
        self.control_before = control;
        if resume(motion) && !self.resume_before {
            self.stops_at_resume = inputs.safety_status.signals.get();
        }
        self.resume_before = resume(motion);
        Ok(())
    }

    fn check_handshake<O: ImageOrder>(
        &mut self,
        fresh: bool,
        set_point: bool,
        inputs: &InputImage<O>,
        outputs: &OutputImage<O>,
    ) -> Result<(), String> {
        let move_id = outputs.motion_control.move_id.get();
        let command = Command::of(outputs);
        let echo = inputs.motion_status.move_id.get();
        if let Some(carried) = &mut self.carried {
            carried.echoed |= fresh && echo == carried.move_id;
        }
        if !set_point {
            return Ok(());
        }
        if move_id == 0 {
            let velocity = [
                MotionCommandId::MOVE_JOINTS_VEL,
                MotionCommandId::MOVE_LIN_VEL_WRF,
                MotionCommandId::MOVE_LIN_VEL_TRF,
            ];
            if velocity.iter().all(|id| id.0 != command.id) {
                return Err(format!("command {} in cyclic mode", command.id));
            }
            self.carried = None;
            return Ok(());
        }
        match self.carried {
            Some(carried) if carried.move_id == move_id && self.set_point_before => {
                let unchanged = command == carried.command;
                let defused = carried.echoed && command == Command::NO_MOVEMENT;
                if !unchanged && !defused {
                    return Err(format!(
                        "MoveID {move_id} carried {:?} and now {command:?} (echoed: {})",
                        carried.command, carried.echoed
                    ));
                }
                if defused {
                    self.carried = Some(Carried { command, ..carried });
                }
            }
            // "No movement" arms the handshake; whether it is acknowledged is not stated.
            Some(carried)
                if self.set_point_before
                    && !carried.echoed
                    && carried.command != Command::NO_MOVEMENT =>
            {
                return Err(format!(
                    "MoveID went from {} to {move_id} without an echo",
                    carried.move_id
                ));
            }
            _ => {
                if fresh && echo == move_id {
                    return Err(format!("MoveID {move_id} starts a command but is the echo"));
                }
                self.carried = Some(Carried { move_id, command, echoed: false });
            }
        }
        Ok(())
    }

    /// A trigger bit falls only when its status bit confirms.
    fn check_releases<O: ImageOrder>(
        &self,
        inputs: &InputImage<O>,
        control: RobotControlFlags,
        motion: MotionControlFlags,
    ) -> Result<(), String> {
        let robot = inputs.robot_status.flags.get();
        let confirmed = [
            (RobotControlFlags::ACTIVATE_ROBOT, robot.contains(RobotStatusFlags::ACTIVATED)),
            (RobotControlFlags::DEACTIVATE_ROBOT, !robot.contains(RobotStatusFlags::ACTIVATED)),
            (RobotControlFlags::HOME, robot.contains(RobotStatusFlags::HOMED)),
            (RobotControlFlags::RESET_ERROR, inputs.robot_status.error_code.get() == 0),
        ];
        let fallen = self.control_before.difference(control);
        for (bit, confirmed) in confirmed {
            if fallen.contains(bit) && !confirmed {
                return Err(format!("{bit:?} released without its confirmation"));
            }
        }
        // An edge may be spent on a safety signal; motion then needs one of its own.
        let paused = inputs.motion_status.flags.contains(MotionStatusFlags::PAUSED);
        let stops = inputs.safety_status.signals.get();
        // Before the robot is ready nothing confirms an edge that only resets signals.
        let ready = robot.contains(RobotStatusFlags::ACTIVATED)
            && robot.intersects(RobotStatusFlags::HOMED | RobotStatusFlags::RECOVERY_MODE);
        let spent = stops != self.stops_at_resume;
        if self.resume_before && !resume(motion) && ready && paused && !spent {
            return Err("ResumeMotion released while still paused".into());
        }
        Ok(())
    }
}

/// The bits that are held until confirmed.
const TRIGGERS: RobotControlFlags = RobotControlFlags::ACTIVATE_ROBOT
    .union(RobotControlFlags::DEACTIVATE_ROBOT)
    .union(RobotControlFlags::HOME)
    .union(RobotControlFlags::RESET_ERROR);

fn resume(motion: MotionControlFlags) -> bool {
    motion.contains(MotionControlFlags::RESUME_MOTION)
}

/// Watches what the robot takes from the bytes that reach it: an echo that becomes the MoveID in
/// its outputs is an acceptance. Knows nothing of the robot's inside.
#[derive(Clone, Debug, Default)]
pub(crate) struct RobotWitness {
    echo_before: u16,
    acknowledged: Vec<(u32, [u32; 6])>,
    accepted: Vec<(u32, [u32; 6])>,
}

impl RobotWitness {
    /// Looks at the outputs the robot has and at the inputs it produced from them.
    pub(crate) fn watch<O: ImageOrder>(
        &mut self,
        outputs: &OutputImage<O>,
        inputs: &InputImage<O>,
    ) {
        let echo = inputs.motion_status.move_id.get();
        let taken = outputs.motion_control.flags.contains(MotionControlFlags::SET_POINT)
            && outputs.motion_control.move_id.get() == echo
            && echo != 0
            && echo != self.echo_before;
        self.echo_before = echo;
        let command = Command::of(outputs);
        if !taken || command.id == 0 {
            return;
        }
        self.acknowledged.push((command.id, command.argument_bits));
        // Acknowledging what it refuses is one reading; a robot that is not ready refuses.
        let robot = inputs.robot_status.flags.get();
        let ready = robot.contains(RobotStatusFlags::ACTIVATED)
            && robot.intersects(RobotStatusFlags::HOMED | RobotStatusFlags::RECOVERY_MODE)
            && inputs.robot_status.error_code.get() == 0;
        if ready {
            self.accepted.push((command.id, command.argument_bits));
        }
    }

    /// Everything the robot returned the MoveID of, refused or not.
    pub(crate) fn acknowledged(&self) -> &[(u32, [u32; 6])] {
        &self.acknowledged
    }

    /// Everything the robot took, in order: command ID and the bits of its arguments.
    pub(crate) fn accepted(&self) -> &[(u32, [u32; 6])] {
        &self.accepted
    }
}

/// The life of each ticket: accepted at most once and in order, ended exactly once.
#[derive(Clone, Debug, Default)]
pub(crate) struct TicketChecker {
    tickets: BTreeMap<Ticket, TicketState>,
    last_accepted: Option<Ticket>,
}

/// Where a ticket stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct TicketState {
    pub(crate) accepted: bool,
    pub(crate) end: Option<End>,
}

/// How a ticket ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum End {
    Done,
    Aborted,
    Unknown,
}

impl TicketChecker {
    pub(crate) fn submitted(&mut self, ticket: Ticket) -> Result<(), String> {
        match self.tickets.insert(ticket, TicketState::default()) {
            None => Ok(()),
            Some(_) => Err(format!("{ticket:?} handed out twice")),
        }
    }

    pub(crate) fn event(&mut self, event: &Event) -> Result<(), String> {
        match *event {
            Event::Accepted { ticket, .. } => {
                if self.last_accepted.is_some_and(|last| last >= ticket) {
                    return Err(format!("{ticket:?} accepted after {:?}", self.last_accepted));
                }
                self.last_accepted = Some(ticket);
                self.open(ticket)?.accepted = true;
                Ok(())
            }
            Event::Done { ticket } => self.end(ticket, End::Done),
            Event::Aborted { ticket, .. } => self.end(ticket, End::Aborted),
            Event::Unknown { ticket, .. } => self.end(ticket, End::Unknown),
            _ => Ok(()),
        }
    }

    fn open(&mut self, ticket: Ticket) -> Result<&mut TicketState, String> {
        match self.tickets.get_mut(&ticket) {
            Some(state) if state.end.is_none() => Ok(state),
            Some(state) => Err(format!("{ticket:?} goes on after its end: {state:?}")),
            None => Err(format!("{ticket:?} was never submitted")),
        }
    }

    fn end(&mut self, ticket: Ticket, end: End) -> Result<(), String> {
        let state = self.open(ticket)?;
        if end == End::Done && !state.accepted {
            return Err(format!("{ticket:?} done but never accepted"));
        }
        state.end = Some(end);
        Ok(())
    }

    /// Tickets without an end.
    pub(crate) fn unfinished(&self) -> usize {
        self.tickets.values().filter(|state| state.end.is_none()).count()
    }

    pub(crate) fn state(&self, ticket: Ticket) -> TicketState {
        self.tickets.get(&ticket).copied().unwrap_or_default()
    }
}

/// A command as the engine got it: for comparison with what the robot took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Submitted {
    pub(crate) ticket: Ticket,
    pub(crate) id: u32,
    pub(crate) argument_bits: [u32; 6],
}

impl Submitted {
    pub(crate) fn new(ticket: Ticket, command: &MotionCommand) -> Self {
        let (id, arguments) = command.encode();
        Self { ticket, id: id.0, argument_bits: arguments.map(f32::to_bits) }
    }
}

/// What the robot took, compared with what was submitted: each at most once, in order, and every
/// finished one really taken. Works on commands whose ID and arguments differ.
pub(crate) fn judge_acceptance(
    submitted: &[Submitted],
    tickets: &TicketChecker,
    witness: &RobotWitness,
) -> Result<(), String> {
    // Commands that were submitted twice cannot be told apart.
    let mut places = BTreeMap::new();
    let mut twice = BTreeSet::new();
    for (at, s) in submitted.iter().enumerate() {
        if places.insert((s.id, s.argument_bits), at).is_some() {
            twice.insert((s.id, s.argument_bits));
        }
    }
    places.retain(|command, _| !twice.contains(command));
    // What is not ours: the engine's checkpoints, and what an earlier PLC sent.
    let order: Vec<usize> =
        witness.accepted().iter().filter_map(|taken| places.get(taken).copied()).collect();
    if let Some(pair) = order.windows(2).find(|pair| pair[0] >= pair[1]) {
        let [first, second] = [pair[0], pair[1]].map(|at| submitted[at]);
        return Err(format!("the robot took {first:?} and then {second:?}"));
    }
    let acknowledged: BTreeSet<_> = witness.acknowledged().iter().copied().collect();
    for (at, submitted) in submitted.iter().enumerate() {
        let state = tickets.state(submitted.ticket);
        let command = (submitted.id, submitted.argument_bits);
        let is_taken = twice.contains(&command) || order.binary_search(&at).is_ok();
        let is_acknowledged = acknowledged.contains(&command);
        if !is_taken && state.end == Some(End::Done) {
            return Err(format!("{submitted:?} is done, but the robot never took it"));
        }
        if !is_acknowledged && state.accepted {
            return Err(format!("{submitted:?} is accepted, but the robot never returned it"));
        }
    }
    Ok(())
}

/// Cycles after a told fault in which a trigger bit may fall unconfirmed.
pub(crate) const EXCUSE_CYCLES: u32 = 4;

/// Events after which a trigger bit may fall without its confirmation.
pub(crate) fn excuses(event: &Event) -> bool {
    matches!(
        event,
        Event::ActionFailed { .. }
            | Event::ConnectionLost { .. }
            | Event::RobotRebooted
            | Event::MonitoringOnly
            | Event::Merged { .. }
            | Event::Fault(_)
    )
}
