//! Bringing a robot back to OP while the others go on: tasks that take one frame a cycle.
//!
//! ```text
//!  not in OP --> look --> [error, SAFE-OP] --> lift ----------------------> OP
//!                  |
//!                  +----> [INIT, PRE-OP] ----> restore
//!  silent -----> find --> [answers again] ---> restore --> as at the start --> lift
//! ```
//!
//! `ethercrab` can start a whole segment only; this starts one robot of it again, with what the first
//! start wrote into its ESC. A task that stops advancing is dropped by the segment and tried again.

use std::sync::Arc;

use ethercrab::error::Error;
use ethercrab::{Command, MainDevice};

use super::coe::{read_mapping, write_assignment};
use super::driver::SharedTime;
use super::group::{Member, RobotGroup, Shared};
use super::layout::{Direction, Layout, LayoutMismatch};
use super::search::sleep_until;
use super::settings::{Assignment, Clocks, SegmentSettings};
use super::start::{SYNC0_DELAY, read_status, set_watchdog};
use crate::time::Duration;
use crate::wire::ethercat::al::{AlState, AlStatusCode};
use crate::wire::ethercat::identity::Identity;
use crate::wire::ethercat::register;
use crate::wire::ethercat::sii::word;

/// How long a robot may take to change state: the longer of the limits that main devices grant it.
///
/// Source: capture.
const TRANSITION_LIMIT: Duration = Duration::from_secs(9);
/// Time between two looks at the state of a robot that is asked to change it.
const LOOK_AGAIN: Duration = Duration::from_millis(2);
/// SII access: to the main device, after cancelling whoever has it.
const SII_CANCEL: u16 = 2;
const SII_TO_MAIN_DEVICE: u16 = 0;
/// Words of the SII.
const SII_VENDOR: u16 = word::VENDOR;
const SII_PRODUCT: u16 = word::VENDOR + 2;
const SII_SERIAL: u16 = word::VENDOR + 6;
/// Looks at the SII before it counts as stuck.
const SII_LOOKS: u32 = 1_000;

/// Cyclic operation with SYNC0.
const SYNC0_ON: u8 = 0x03;

/// How a task ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum CareOutcome {
    /// The robot's state and reason, as far as it answers.
    Seen { state: Option<AlState>, code: AlStatusCode },
    /// A device without a station address answers at the robot's position: it has just restarted.
    Answers,
    /// The robot is where it was, with the address it was given.
    InSight,
    /// Nothing answers.
    Silent,
    /// OP was asked for and reached.
    InOp,
    /// It did not reach the state it was asked for.
    Failed { state: AlState, code: AlStatusCode },
    /// Its image is another one now.
    LayoutChanged(LayoutMismatch),
    /// Its image is another one now, though one that could be used.
    ImageChanged,
    /// It has another identity.
    AnotherDevice,
}

/// Which task a robot needs next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum CareKind {
    /// What state is it in, and why?
    Look,
    /// From SAFE-OP to OP.
    Lift,
    /// Does it answer again?
    Find,
    /// From power-up to OP.
    Restore,
}

/// What a task needs to know.
#[derive(Clone)]
pub(super) struct Carer {
    pub(super) shared: Arc<Shared>,
    pub(super) time: SharedTime,
    pub(super) settings: Arc<SegmentSettings>,
}

impl Carer {
    /// Runs one task for `robot`.
    pub(super) async fn run(self, kind: CareKind, robot: usize) -> CareOutcome {
        let Some(member) = self.shared.members.get(robot) else { return CareOutcome::Silent };
        let done = match kind {
            CareKind::Look => self.look(member).await,
            CareKind::Lift => self.lift(member).await,
            CareKind::Find => self.find(member).await,
            CareKind::Restore => self.restore(member).await,
        };
        // A frame that came back with a wrong counter: the robot has stopped answering.
        done.unwrap_or(CareOutcome::Silent)
    }

    fn main_device(&self) -> &MainDevice<'static> {
        &self.shared.main_device
    }

    async fn look(&self, member: &Member) -> Result<CareOutcome, Error> {
        let (status, code) = read_status(self.main_device(), member.station).await?;
        Ok(CareOutcome::Seen { state: status.state, code })
    }

    async fn find(&self, member: &Member) -> Result<CareOutcome, Error> {
        Ok(match self.station_at(member.position).await? {
            0 => CareOutcome::Answers,
            station if station == member.station => CareOutcome::InSight,
            // Another one has moved up to this position; it is somebody else's.
            _ => CareOutcome::Silent,
        })
    }

    /// Acknowledges what the robot complains about and asks for OP.
    async fn lift(&self, member: &Member) -> Result<CareOutcome, Error> {
        let (status, _) = read_status(self.main_device(), member.station).await?;
        if status.has_error
            && let Some(failed) = self
                .change(member, AlState::SafeOp, u16::from(register::AL_CONTROL_ACKNOWLEDGE))
                .await?
        {
            return Ok(failed);
        }
        Ok(self.change(member, AlState::Op, 0).await?.unwrap_or(CareOutcome::InOp))
    }

    /// Asks for a state and waits for it; `None` when it is reached.
    async fn change(
        &self,
        member: &Member,
        wanted: AlState,
        flags: u16,
    ) -> Result<Option<CareOutcome>, Error> {
        Command::fpwr(member.station, register::AL_CONTROL)
            .send_receive::<u16>(self.main_device(), u16::from(wanted.to_wire()) | flags)
            .await?;
        let deadline = self.time.now() + TRANSITION_LIMIT;
        loop {
            let (status, code) = read_status(self.main_device(), member.station).await?;
            if status.state == Some(wanted) && !status.has_error {
                return Ok(None);
            }
            let is_late = self.time.now() >= deadline;
            if status.has_error || is_late {
                let state = status.state.unwrap_or(AlState::Init);
                return Ok(Some(CareOutcome::Failed { state, code }));
            }
            sleep_until(&self.time, self.time.now() + LOOK_AGAIN).await;
        }
    }

    /// Everything that the start did, for this robot alone.
    async fn restore(&self, member: &Member) -> Result<CareOutcome, Error> {
        let main_device = self.main_device();
        let position = member.position;
        let station = self.station_at(position).await?;
        if station != 0 && station != member.station {
            return Ok(CareOutcome::Silent);
        }
        // Nothing of a device is changed before it is known to be this one, but who reads its SII.
        let identity = Identity {
            vendor: self.read_sii(position, SII_VENDOR).await?,
            product: self.read_sii(position, SII_PRODUCT).await?,
            revision: member.identity.revision,
            serial: self.read_sii(position, SII_SERIAL).await?,
        };
        if identity != member.identity {
            return Ok(CareOutcome::AnotherDevice);
        }
        Command::apwr(position, register::STATION_ADDRESS)
            .send_receive::<u16>(main_device, member.station)
            .await?;
        if let Some(failed) =
            self.change(member, AlState::Init, u16::from(register::AL_CONTROL_ACKNOWLEDGE)).await?
        {
            return Ok(failed);
        }
        let (mailboxes, process_data) = member.setup.sync_managers.split_at(16);
        self.write_sync_managers(member, 0, mailboxes).await?;
        if let Some(failed) = self.change(member, AlState::PreOp, 0).await? {
            return Ok(failed);
        }
        for layout in [&member.outputs, &member.inputs] {
            match self.layout_of(member, layout.direction()).await? {
                Ok(now) if now == *layout => {}
                Ok(_) => return Ok(CareOutcome::ImageChanged),
                Err(mismatch) => return Ok(CareOutcome::LayoutChanged(mismatch)),
            }
        }
        if let Some(watchdog) = self.settings.watchdog {
            set_watchdog(main_device, member.station, watchdog).await?;
        }
        self.write_sync_managers(member, 2, process_data).await?;
        for (index, fmmu) in (0..).zip(member.setup.fmmus.chunks_exact(16)) {
            if let Ok(fmmu) = <[u8; 16]>::try_from(fmmu) {
                Command::fpwr(member.station, register::FMMU + 16 * index)
                    .send_receive::<[u8; 16]>(main_device, fmmu)
                    .await?;
            }
        }
        if let Clocks::Sync0 { .. } = self.settings.clocks {
            self.set_clock(member).await?;
        }
        if let Some(failed) = self.change(member, AlState::SafeOp, 0).await? {
            return Ok(failed);
        }
        Ok(self.change(member, AlState::Op, 0).await?.unwrap_or(CareOutcome::InOp))
    }

    /// Writes sync managers from number `first` on, 8 bytes each.
    async fn write_sync_managers(
        &self,
        member: &Member,
        first: u16,
        setup: &[u8],
    ) -> Result<(), Error> {
        for (index, manager) in (first..).zip(setup.chunks_exact(8)) {
            if let Ok([a, b, c, d, control, _, enable, _]) = <[u8; 8]>::try_from(manager) {
                // The status byte and what the robot's side set are its own.
                let manager = [a, b, c, d, control, 0, enable & 1, 0];
                Command::fpwr(member.station, register::SYNC_MANAGER + 8 * index)
                    .send_receive::<[u8; 8]>(self.main_device(), manager)
                    .await?;
            }
        }
        Ok(())
    }

    async fn layout_of(
        &self,
        member: &Member,
        direction: Direction,
    ) -> Result<Result<Layout, LayoutMismatch>, Error> {
        let is_written = self.settings.assignment == Assignment::Write;
        let main_device = self.main_device();
        let group = self.shared.groups.get(member.group).ok_or(Error::Internal)?;
        let entries = match group {
            RobotGroup::Free(group) => {
                let robot = group.subdevice(main_device, member.index)?;
                if is_written {
                    write_assignment(&robot, direction).await?;
                }
                read_mapping(&robot, direction).await?
            }
            RobotGroup::Clocked(group) => {
                let robot = group.subdevice(main_device, member.index)?;
                if is_written {
                    write_assignment(&robot, direction).await?;
                }
                read_mapping(&robot, direction).await?
            }
        };
        Ok(Layout::compare(direction, &entries))
    }

    /// The station address of whoever stands at `position`.
    async fn station_at(&self, position: u16) -> Result<u16, Error> {
        Command::aprd(position, register::STATION_ADDRESS).receive(self.main_device()).await
    }

    /// Two words of the SII of whoever stands at `position`.
    async fn read_sii(&self, position: u16, word: u16) -> Result<u32, Error> {
        let main_device = self.main_device();
        for owner in [SII_CANCEL, SII_TO_MAIN_DEVICE] {
            Command::apwr(position, register::SII_ACCESS)
                .send_receive::<u16>(main_device, owner)
                .await?;
        }
        let [low, high] = word.to_le_bytes();
        let [command_low, command_high] = register::SII_COMMAND_READ.to_le_bytes();
        Command::apwr(position, register::SII_CONTROL)
            .send_receive::<[u8; 6]>(main_device, [command_low, command_high, low, high, 0, 0])
            .await?;
        for _ in 0..SII_LOOKS {
            let control =
                Command::aprd(position, register::SII_CONTROL).receive::<u16>(main_device).await?;
            if control & register::SII_BUSY == 0 {
                return Command::aprd(position, register::SII_DATA)
                    .receive::<u32>(main_device)
                    .await;
            }
        }
        Err(Error::Internal)
    }

    /// Sets the clock of a robot that comes back to that of the others and starts SYNC0.
    async fn set_clock(&self, member: &Member) -> Result<(), Error> {
        let main_device = self.main_device();
        let read = |station, register| Command::fprd(station, register).receive::<u64>(main_device);
        let write = |register| Command::fpwr(member.station, register);
        write(register::DC_ACTIVATION).send_receive::<u8>(main_device, 0_u8).await?;
        // Alone, its clock is the reference.
        let mut wanted = self.time.now().as_nanos();
        for other in self.shared.members.iter().filter(|other| other.station != member.station) {
            if let Ok(time) = read(other.station, register::DC_SYSTEM_TIME).await {
                wanted = time;
                break;
            }
        }
        let own = read(member.station, register::DC_SYSTEM_TIME).await?;
        let offset = read(member.station, register::DC_OFFSET).await?;
        write(register::DC_OFFSET)
            .send_receive::<u64>(main_device, offset.wrapping_add(wanted).wrapping_sub(own))
            .await?;
        write(register::DC_DELAY).send_receive::<u32>(main_device, member.setup.delay_ns).await?;
        let cycle = u64::try_from(self.settings.cycle.as_nanos()).unwrap_or(u64::MAX).max(1);
        let delay = u64::try_from(SYNC0_DELAY.as_nanos()).unwrap_or(0);
        let start = (wanted + delay) / cycle * cycle;
        write(register::DC_SYNC0_TIME).send_receive::<u64>(main_device, start).await?;
        let cycle = u32::try_from(cycle).unwrap_or(u32::MAX);
        write(register::DC_SYNC0_CYCLE).send_receive::<u32>(main_device, cycle).await?;
        write(register::DC_ACTIVATION).send_receive::<u8>(main_device, SYNC0_ON).await?;
        Ok(())
    }
}
