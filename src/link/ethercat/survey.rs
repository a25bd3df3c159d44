//! What stands on a segment and how its robots lay out their images, without cycling them.
//!
//! [`survey`] goes the first steps of a start, up to PRE-OP, and back to INIT. Unlike a start it does
//! not end with the first robot that cannot be driven: each has its own answer.

use std::vec::Vec;

use ethercrab::Command;
use ethercrab::error::Error;

use super::driver::Driver;
use super::error::EthercatError;
use super::layout::{Direction, Layout};
use super::pdu_core::PduCore;
use super::register;
use super::robot::SubDeviceFound;
use super::search::{choose, sleep_until};
use super::segment::{START_ATTEMPTS, StartFailure, is_worth_another_attempt};
use super::settings::{RobotChoice, SegmentSettings};
use super::start::Starter;
use super::wire::Wire;
use crate::time::Duration;
use crate::wire::ethercat::al::AlState;

/// How long the subdevices may take to INIT; robots do it at once.
///
/// Source: choice
const LEAVE_LIMIT: Duration = Duration::from_millis(200);
/// Time between two looks at their states.
const LOOK_AGAIN: Duration = Duration::from_millis(2);
/// Acknowledges an error, in AL control.
const ACKNOWLEDGE: u16 = 0x10;
/// The state in AL status, beside the error bit.
const STATE_BITS: u16 = 0x0F;

/// What stands on a segment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Survey {
    /// Every subdevice, in the order of the segment, with the state it was found in.
    pub subdevices: Vec<SubDeviceFound>,
    /// The robots that were asked for, in their order.
    pub robots: Vec<RobotSurveyed>,
}

/// The images of one robot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RobotSurveyed {
    /// Its place on the segment, counted from 0.
    pub position: u16,
    /// What it takes: RxPDOs.
    pub outputs: Result<MappingFound, EthercatError>,
    /// What it sends: TxPDOs.
    pub inputs: Result<MappingFound, EthercatError>,
}

/// What a robot maps in one direction.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MappingFound {
    /// Length in bytes.
    pub bytes: usize,
    /// Where our fields lie in it, or the first difference that makes it unusable
    /// ([`EthercatError::Layout`]).
    pub layout: Result<Layout, EthercatError>,
}

impl RobotSurveyed {
    /// Why this robot cannot be driven.
    #[must_use]
    pub fn refusal(&self) -> Option<EthercatError> {
        [&self.outputs, &self.inputs].into_iter().find_map(|found| match found {
            Ok(found) => found.layout.as_ref().err().copied(),
            Err(error) => Some(*error),
        })
    }
}

/// Looks at a segment up to PRE-OP: who is there, and how the robots lay out their images. All
/// subdevices are reset and left in INIT. Of `settings` count the robots, the assignment, `take_over`
/// and the limit of time. A segment without robots is no error here.
///
/// # Errors
///
/// Why nothing can be said about the segment, with the wire. Losses on the wire are tried three times.
pub fn survey<W: Wire>(
    wire: W,
    settings: &SegmentSettings,
) -> Result<(Survey, W), StartFailure<W>> {
    let mut driver = Driver::new(wire, PduCore::take(false));
    let mut attempt = 1;
    loop {
        match once(&mut driver, settings) {
            Ok(survey) => {
                leave(&mut driver);
                return Ok((survey, driver.into_wire()));
            }
            Err(error) if attempt == START_ATTEMPTS || !is_worth_another_attempt(error) => {
                return Err(StartFailure { error, wire: driver.into_wire() });
            }
            Err(_) => attempt += 1,
        }
    }
}

fn once<W: Wire>(
    driver: &mut Driver<W>,
    settings: &SegmentSettings,
) -> Result<Survey, EthercatError> {
    let deadline = driver.now() + settings.start_limit;
    let main_device = driver.main_device();
    let mut starter = Starter { driver, settings, deadline };
    let states = starter.search(&main_device)?;
    let (groups, mut seats) = starter.pre_op(&main_device, &states)?;
    let order = match settings.robots {
        RobotChoice::All => (0..seats.len())
            .filter(|seat| seats.get(*seat).is_some_and(|seat| seat.place.is_some()))
            .collect(),
        _ => choose(&settings.robots, &seats)?,
    };
    let mut robots = Vec::new();
    for (robot, index) in order.into_iter().enumerate() {
        let Some(seat) = seats.get_mut(index) else { continue };
        seat.found.robot = Some(robot);
        let position = seat.found.position;
        let mut look = |direction| match starter.mapping(&main_device, &groups, seat, direction) {
            Ok(entries) => Ok(Ok(MappingFound {
                bytes: entries.iter().map(|e| usize::from(e.bits)).sum::<usize>().div_ceil(8),
                layout: Layout::compare(direction, &entries)
                    .map_err(|mismatch| EthercatError::Layout { position, mismatch }),
            })),
            // What the robot itself said. The rest may be the wire's fault.
            Err(error @ EthercatError::Aborted { .. }) => Ok(Err(error)),
            Err(error) => Err(error),
        };
        let (outputs, inputs) = (look(Direction::Outputs)?, look(Direction::Inputs)?);
        robots.push(RobotSurveyed { position, outputs, inputs });
    }
    Ok(Survey { subdevices: seats.into_iter().map(|seat| seat.found).collect(), robots })
}

/// Asks every subdevice of the segment for INIT, whatever it is in, and waits until all are there or
/// have had the time. For the end of a visit: what a start left behind, in PRE-OP or with an error
/// shown, is gone then.
pub fn release<W: Wire>(wire: W) -> W {
    let mut driver = Driver::new(wire, PduCore::take(false));
    leave(&mut driver);
    driver.into_wire()
}

fn leave<W: Wire>(driver: &mut Driver<W>) {
    let main_device = driver.main_device();
    let time = driver.time();
    let init = u16::from(AlState::Init.to_wire());
    let to_init = async {
        let ask = Command::bwr(register::AL_CONTROL).ignore_wkc();
        ask.send(&main_device, init | ACKNOWLEDGE).await?;
        loop {
            let states = Command::brd(register::AL_STATUS).ignore_wkc();
            // The states of all, one over the other.
            if states.receive::<u16>(&main_device).await? & STATE_BITS == init {
                return Ok::<(), Error>(());
            }
            sleep_until(&time, time.now() + LOOK_AGAIN).await;
        }
    };
    let _ = driver.block_on(LEAVE_LIMIT, to_init);
}
