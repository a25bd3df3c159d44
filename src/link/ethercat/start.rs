//! From a wire to robots in SAFE-OP with OP requested.
//!
//! ```text
//!  search --> PRE-OP --> layout --> configuration --> SAFE-OP --> OP requested
//! ```
//!
//! Each step has its errors; nothing is assumed that can be read. The last step, cycling until every
//! robot is in OP, is the segment's.

use core::cell::RefCell;
use core::future::Future;
use std::vec::Vec;

use ethercrab::error::{DistributedClockError, Error, Item};
use ethercrab::subdevice_group::{DcConfiguration, HasDc, NoDc, PreOp, PreOpPdi};
use ethercrab::{Command, DcSync, MainDevice, SubDeviceGroup, SubDeviceGroupHandle};

use super::coe::{read_mapping, write_assignment};
use super::driver::Driver;
use super::error::{EthercatError, Step};
use super::group::{EscSetup, GROUP_ROBOTS, Group, Member, RobotGroup, Shared};
use super::layout::{Direction, Layout, LayoutMismatch, MappingEntry};
use super::notice::{MailboxNotice, NoticeKind};
use super::robot::Seat;
use super::search::{choose, read_states, seat_of, sleep_until};
use super::settings::{Assignment, Clocks, MAX_ROBOTS, SegmentSettings};
use super::wire::Wire;
use crate::time::{Duration, Instant};
use crate::wire::ethercat::al::{AlState, AlStatusCode};
use crate::wire::ethercat::register;

/// Subdevices that a segment may have. A power of two, as `ethercrab` asks.
const MAX_SUBDEVICES: usize = 64;
/// Station address of the subdevice at position 0; the others follow.
pub(super) const FIRST_STATION: u16 = 0x1000;
/// How long a segment may take to show that it is there.
const SEARCH_LIMIT: Duration = Duration::from_secs(1);
/// How long subdevices in OP are watched before they count as driven by somebody else: longer than the
/// watchdog of a robot whose main device has just gone.
const DRIVEN_AFTER: Duration = Duration::from_millis(400);
/// Time until the first SYNC0, after a start and after a restart of one robot.
pub(super) const SYNC0_DELAY: Duration = Duration::from_millis(100);

/// The power-up value of the watchdog divider: steps of 100 us.
const WATCHDOG_DIVIDER: u16 = 0x09C2;
/// A step of the watchdog with that divider.
const WATCHDOG_STEP: Duration = Duration::from_micros(100);

/// What `ethercrab` sorts the subdevices into.
#[derive(Default)]
pub(super) struct Groups {
    robots: [Group<PreOp>; MAX_ROBOTS / GROUP_ROBOTS],
    others: SubDeviceGroup<MAX_SUBDEVICES, 1>,
}

/// A group that has its process data, with clocks or without.
enum Configured {
    Free(Group<PreOpPdi, NoDc>),
    Clocked(Group<PreOpPdi, HasDc>),
}

/// A segment whose robots have been asked for OP.
pub(super) struct Started {
    pub(super) shared: Shared,
    pub(super) seats: Vec<Seat>,
}

/// Brings a segment up, once.
pub(super) struct Starter<'a, W> {
    pub(super) driver: &'a mut Driver<W>,
    pub(super) settings: &'a SegmentSettings,
    pub(super) deadline: Instant,
}

impl<W: Wire> Starter<'_, W> {
    /// All steps but the last.
    pub(super) fn run(&mut self) -> Result<Started, EthercatError> {
        let main_device = self.driver.main_device();
        let states = self.search(&main_device)?;
        let (groups, mut seats) = self.pre_op(&main_device, &states)?;
        let order = choose(&self.settings.robots, &seats)?;
        for (robot, seat) in order.iter().enumerate() {
            if let Some(seat) = seats.get_mut(*seat) {
                seat.found.robot = Some(robot);
            }
        }
        let mut members = self.members(&main_device, &groups, &seats, &order)?;
        let mut running = Vec::new();
        for (number, group) in groups.robots.into_iter().enumerate() {
            if !group.is_empty() {
                let group = self.configure(&main_device, group, number, &members)?;
                running.push(self.request_op(&main_device, group, &members)?);
            }
        }
        for member in &mut members {
            let setup = read_setup(&main_device, member.station);
            member.setup = self.drive(Step::Configuration, Some(member.position), setup)?;
        }
        Ok(Started { shared: Shared { main_device, groups: running, members }, seats })
    }

    /// The state of each subdevice, in the order of the segment.
    pub(super) fn search(
        &mut self,
        main_device: &MainDevice<'_>,
    ) -> Result<Vec<Option<AlState>>, EthercatError> {
        let states = self
            .driver
            .block_on(SEARCH_LIMIT, read_states(main_device))
            .map_err(|_| EthercatError::Silent)?
            .map_err(|error| self.explain(error, Step::Search, None))?;
        if states.is_empty() {
            return Err(EthercatError::Silent);
        }
        if states.len() > MAX_SUBDEVICES {
            let found = u16::try_from(states.len()).unwrap_or(u16::MAX);
            return Err(EthercatError::TooManySubdevices { found, limit: MAX_SUBDEVICES });
        }
        if self.settings.take_over || driven(&states).is_none() {
            return Ok(states);
        }
        // Perhaps its main device has just ended and the watchdog has not noticed yet.
        let time = self.driver.time();
        let again = time.now() + DRIVEN_AFTER;
        let later = async {
            sleep_until(&time, again).await;
            read_states(main_device).await
        };
        match driven(&self.drive(Step::Search, None, later)?) {
            Some(position) => Err(EthercatError::Driven { position }),
            None => Ok(states),
        }
    }

    /// Addresses, SII and mailboxes of all subdevices.
    pub(super) fn pre_op(
        &mut self,
        main_device: &MainDevice<'_>,
        states: &[Option<AlState>],
    ) -> Result<(Groups, Vec<Seat>), EthercatError> {
        let time = self.driver.time();
        let time = &time;
        let seats = RefCell::new(Vec::new());
        let choice = &self.settings.robots;
        let init = main_device.init::<MAX_SUBDEVICES, _>(
            || time.now().as_nanos(),
            Groups::default(),
            |groups: &Groups, subdevice| {
                let mut seats = seats.borrow_mut();
                let seat = seat_of(subdevice, states, choice, &seats);
                let group = seat.place.and_then(|(group, _)| groups.robots.get(group));
                seats.push(seat);
                let group: &dyn SubDeviceGroupHandle = match group {
                    Some(group) => group,
                    None => &groups.others,
                };
                Ok(group)
            },
        );
        let groups = self.drive(Step::PreOp, None, init)?;
        Ok((groups, seats.into_inner()))
    }

    /// The robots in their order, with the layouts they report.
    fn members(
        &mut self,
        main_device: &MainDevice<'_>,
        groups: &Groups,
        seats: &[Seat],
        order: &[usize],
    ) -> Result<Vec<Member>, EthercatError> {
        let mut members = Vec::new();
        for seat in order.iter().filter_map(|seat| seats.get(*seat)) {
            let Some((number, index)) = seat.place else { continue };
            let found = &seat.found;
            if self.settings.clocks != Clocks::Off && !found.has_clock {
                return Err(EthercatError::NoClocks { position: found.position });
            }
            let position = found.position;
            let mut layout = |direction| {
                let entries = self.mapping(main_device, groups, seat, direction)?;
                Layout::compare(direction, &entries)
                    .map_err(|mismatch| EthercatError::Layout { position, mismatch })
            };
            members.push(Member {
                group: number,
                index,
                station: FIRST_STATION + found.position,
                position: found.position,
                identity: found.identity,
                outputs: layout(Direction::Outputs)?,
                inputs: layout(Direction::Inputs)?,
                setup: EscSetup::default(),
            });
        }
        Ok(members)
    }

    /// What the robot on `seat` maps in one direction, after the assignment was written if that is
    /// wanted.
    pub(super) fn mapping(
        &mut self,
        main_device: &MainDevice<'_>,
        groups: &Groups,
        seat: &Seat,
        direction: Direction,
    ) -> Result<Vec<MappingEntry>, EthercatError> {
        let place =
            seat.place.and_then(|(number, index)| Some((groups.robots.get(number)?, index)));
        let assignment = self.settings.assignment;
        let read = async {
            let (group, index) = place.ok_or(Error::Internal)?;
            let robot = group.subdevice(main_device, index)?;
            if assignment == Assignment::Write {
                write_assignment(&robot, direction).await?;
            }
            read_mapping(&robot, direction).await
        };
        self.drive(Step::Layout, Some(seat.found.position), read)
    }

    /// Sync managers, FMMUs, watchdog and clocks of a group; the lengths of its process data.
    fn configure(
        &mut self,
        main_device: &MainDevice<'_>,
        mut group: Group<PreOp>,
        number: usize,
        members: &[Member],
    ) -> Result<Configured, EthercatError> {
        let clocks = self.settings.clocks;
        if clocks != Clocks::Off {
            group.iter_mut(main_device).for_each(|mut robot| robot.set_dc_sync(DcSync::Sync0));
        }
        let step = Step::Configuration;
        let group = self.drive(step, None, group.into_pre_op_pdi(main_device))?;
        for member in members.iter().filter(|member| member.group == number) {
            let robot = group
                .subdevice(main_device, member.index)
                .map_err(|error| self.explain(error, step, Some(member.position)))?;
            let io = robot.io_raw();
            let lengths =
                [(&member.outputs, io.outputs().len()), (&member.inputs, io.inputs().len())];
            for (layout, found) in lengths {
                if layout.robot_len() != found {
                    let mismatch = LayoutMismatch::ProcessData {
                        direction: layout.direction(),
                        mapped: layout.robot_len(),
                        found,
                    };
                    return Err(EthercatError::Layout { position: member.position, mismatch });
                }
            }
            drop(io);
            if let Some(watchdog) = self.settings.watchdog {
                let set = set_watchdog(main_device, member.station, watchdog);
                self.drive(step, Some(member.position), set)?;
            }
        }
        let Clocks::Sync0 { shift } = clocks else { return Ok(Configured::Free(group)) };
        let cycle = self.settings.cycle;
        let configuration = DcConfiguration {
            start_delay: SYNC0_DELAY,
            sync0_period: cycle,
            // `ethercrab` counts from SYNC0 to the frame, we from the frame to SYNC0.
            sync0_shift: cycle.saturating_sub(shift),
        };
        let group = group.configure_dc_sync(main_device, configuration);
        Ok(Configured::Clocked(self.drive(step, None, group)?))
    }

    /// To SAFE-OP, and the request for OP.
    fn request_op(
        &mut self,
        main_device: &MainDevice<'_>,
        group: Configured,
        members: &[Member],
    ) -> Result<RobotGroup, EthercatError> {
        let moved = match group {
            Configured::Free(group) => self
                .drive(Step::SafeOp, None, async {
                    group.into_safe_op(main_device).await?.request_into_op(main_device).await
                })
                .map(RobotGroup::Free),
            Configured::Clocked(group) => self
                .drive(Step::SafeOp, None, async {
                    group.into_safe_op(main_device).await?.request_into_op(main_device).await
                })
                .map(RobotGroup::Clocked),
        };
        moved.map_err(|error| match self.refusal(main_device, members, AlState::SafeOp) {
            Some(refusal) => refusal,
            None => error,
        })
    }

    /// The first robot that shows an error, with its reason.
    pub(super) fn refusal(
        &mut self,
        main_device: &MainDevice<'_>,
        members: &[Member],
        wanted: AlState,
    ) -> Option<EthercatError> {
        members.iter().find_map(|member| {
            // Short: meanwhile no outputs are sent, and a watchdog runs.
            let limit = Duration::from_millis(20);
            let status = read_status(main_device, member.station);
            let (state, code) = self.driver.block_on(limit, status).ok()?.ok()?;
            let position = member.position;
            let has_error = state.has_error;
            let state = state.state?;
            (has_error && code != AlStatusCode::NO_ERROR).then_some(EthercatError::Refused {
                position,
                wanted,
                state,
                code,
            })
        })
    }

    /// Runs a step within the time that is left.
    pub(super) fn drive<T>(
        &mut self,
        step: Step,
        position: Option<u16>,
        future: impl Future<Output = Result<T, Error>>,
    ) -> Result<T, EthercatError> {
        let left = self.deadline.saturating_duration_since(self.driver.now());
        match self.driver.block_on(left, future) {
            Ok(Ok(value)) => Ok(value),
            Ok(Err(error)) => Err(self.explain(error, step, position)),
            Err(_) => {
                let counters = self.driver.counters();
                Err(EthercatError::TimedOut {
                    step,
                    sent: counters.sent,
                    received: counters.received,
                })
            }
        }
    }

    /// What an error of `ethercrab` means here.
    fn explain(&mut self, error: Error, step: Step, position: Option<u16>) -> EthercatError {
        if let Some(MailboxNotice { station, kind }) = self.driver.take_notice()
            && matches!(error, Error::Mailbox(_) | Error::WorkingCounter { .. })
        {
            let position = station.saturating_sub(FIRST_STATION);
            return match kind {
                NoticeKind::Foreign => {
                    let what = "a subdevice sent another protocol than CoE";
                    EthercatError::Protocol { step, what }
                }
                NoticeKind::Emergency { code, .. } => {
                    EthercatError::Emergency { position, code, step }
                }
                NoticeKind::Abort { index, sub_index, code } => {
                    EthercatError::Aborted { position, index, sub_index, code }
                }
            };
        }
        let what = match error {
            Error::Timeout(_) => {
                let counters = self.driver.counters();
                let (sent, received) = (counters.sent, counters.received);
                return EthercatError::TimedOut { step, sent, received };
            }
            Error::DistributedClock(DistributedClockError::NoReference) => {
                return EthercatError::NoClocks { position: position.unwrap_or(0) };
            }
            Error::WorkingCounter { .. } => "a subdevice did not answer",
            Error::Mailbox(_) => "a mailbox answer makes no sense",
            Error::Eeprom(_) => "the SII cannot be read",
            Error::Capacity(Item::SubDevice) => "more subdevices than before",
            Error::Capacity(_) => "an SII is larger than any known",
            Error::StringTooLong { .. } => "a name in an SII is too long",
            Error::PdiTooLong { .. } => "the process data are longer than a frame holds",
            Error::NotFound { .. } => "an SII lacks what the start needs (sync managers, FMMUs)",
            Error::Topology => "the topology makes no sense",
            Error::StateTransition | Error::InvalidState { .. } | Error::SubDevice(_) => {
                "a subdevice refused a change of state"
            }
            _ => "an answer makes no sense",
        };
        EthercatError::Protocol { step, what }
    }
}

/// Position of the first subdevice in OP.
fn driven(states: &[Option<AlState>]) -> Option<u16> {
    let position = states.iter().position(|state| *state == Some(AlState::Op))?;
    u16::try_from(position).ok()
}

/// AL status as read: the state if it is a known one, and whether the error bit is set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct AlStatus {
    pub(super) state: Option<AlState>,
    pub(super) has_error: bool,
}

/// AL status and its code, from the station address.
pub(super) async fn read_status(
    main_device: &MainDevice<'_>,
    station: u16,
) -> Result<(AlStatus, AlStatusCode), Error> {
    let status = Command::fprd(station, register::AL_STATUS).receive::<u16>(main_device).await?;
    let code = Command::fprd(station, register::AL_STATUS_CODE).receive::<u16>(main_device).await?;
    let [state, _] = status.to_le_bytes();
    let status = AlStatus { state: AlState::from_wire(state), has_error: state & 0x10 != 0 };
    Ok((status, AlStatusCode(code)))
}

/// Asks a subdevice for INIT without waiting for it.
pub(super) async fn request_init(main_device: &MainDevice<'_>, station: u16) -> Result<(), Error> {
    let init = u16::from(AlState::Init.to_wire());
    Command::fpwr(station, register::AL_CONTROL).ignore_wkc().send(main_device, init).await
}

/// Sets the process data watchdog.
pub(super) async fn set_watchdog(
    main_device: &MainDevice<'_>,
    station: u16,
    watchdog: Duration,
) -> Result<(), Error> {
    let steps = watchdog.as_nanos() / WATCHDOG_STEP.as_nanos();
    let steps = u16::try_from(steps).unwrap_or(u16::MAX).max(1);
    Command::fpwr(station, register::WATCHDOG_DIVIDER)
        .send_receive::<u16>(main_device, WATCHDOG_DIVIDER)
        .await?;
    Command::fpwr(station, register::PROCESS_WATCHDOG)
        .send_receive::<u16>(main_device, steps)
        .await?;
    Ok(())
}

/// What an ESC was told by now.
async fn read_setup(main_device: &MainDevice<'_>, station: u16) -> Result<EscSetup, Error> {
    let fmmus = Command::fprd(station, register::FMMU).receive(main_device).await?;
    let sync_managers = Command::fprd(station, register::SYNC_MANAGER).receive(main_device).await?;
    // Without clocks the register is not there.
    let delay_ns =
        Command::fprd(station, register::DC_DELAY).ignore_wkc().receive(main_device).await?;
    Ok(EscSetup { fmmus, sync_managers, delay_ns })
}
