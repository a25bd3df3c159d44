//! Who is on the segment, and which of them are the robots that were asked for.

use core::future::poll_fn;
use core::task::Poll;
use std::borrow::ToOwned;
use std::vec::Vec;

use ethercrab::error::Error;
use ethercrab::{Command, MainDevice, SubDevice};

use super::driver::SharedTime;
use super::error::EthercatError;
use super::group::GROUP_ROBOTS;
use super::robot::{Seat, SubDeviceFound};
use super::settings::{MAX_ROBOTS, RobotAddress, RobotChoice};
use super::start::FIRST_STATION;
use crate::time::Instant;
use crate::wire::ethercat::al::AlState;
use crate::wire::ethercat::identity::Identity;
use crate::wire::ethercat::register;

/// Lets time pass on the wire.
pub(super) async fn sleep_until(time: &SharedTime, until: Instant) {
    poll_fn(|_| if time.now() >= until { Poll::Ready(()) } else { Poll::Pending }).await;
}

/// The state of each subdevice, in the order of the segment; changes nothing.
pub(super) async fn read_states(
    main_device: &MainDevice<'_>,
) -> Result<Vec<Option<AlState>>, Error> {
    // Every subdevice counts a broadcast; asking for a count that cannot be tells the true one.
    let count = match Command::brd(register::AL_STATUS)
        .with_wkc(u16::MAX)
        .receive::<u16>(main_device)
        .await
    {
        Err(Error::WorkingCounter { received, .. }) => received,
        Ok(_) => u16::MAX,
        Err(error) => return Err(error),
    };
    let mut states = Vec::new();
    for position in 0..count {
        let status =
            Command::aprd(position, register::AL_STATUS).receive::<u16>(main_device).await?;
        let [state, _] = status.to_le_bytes();
        states.push(AlState::from_wire(state));
    }
    Ok(states)
}

/// Decides what to do with a subdevice, given those before it.
pub(super) fn seat_of(
    subdevice: &SubDevice,
    states: &[Option<AlState>],
    choice: &RobotChoice,
    before: &[Seat],
) -> Seat {
    let position = subdevice.configured_address().saturating_sub(FIRST_STATION);
    let numbers = subdevice.identity();
    let identity = Identity {
        vendor: numbers.vendor_id,
        product: numbers.product_id,
        revision: numbers.revision,
        serial: numbers.serial,
    };
    let found = SubDeviceFound {
        position,
        identity,
        name: subdevice.name().to_owned(),
        alias: subdevice.alias_address(),
        has_clock: subdevice.dc_support().enhanced(),
        state_before: states.get(usize::from(position)).copied().flatten(),
        robot: None,
    };
    let robots_before = before.iter().filter(|seat| seat.place.is_some()).count();
    let is_wanted = identity.is_meca500()
        && robots_before < MAX_ROBOTS
        && match choice {
            RobotChoice::All => true,
            RobotChoice::First(count) => robots_before < *count,
            RobotChoice::These(these) => these.iter().any(|address| address.is_of(&found)),
        };
    let place = is_wanted.then_some((robots_before / GROUP_ROBOTS, robots_before % GROUP_ROBOTS));
    Seat { found, place }
}

impl RobotAddress {
    fn is_of(self, found: &SubDeviceFound) -> bool {
        match self {
            Self::Position(position) => found.position == position,
            Self::Alias(alias) => alias != 0 && found.alias == alias,
        }
    }
}

/// The chosen robots in their order, as indices into `seats`.
pub(super) fn choose(choice: &RobotChoice, seats: &[Seat]) -> Result<Vec<usize>, EthercatError> {
    let subdevices = u16::try_from(seats.len()).unwrap_or(u16::MAX);
    let all = || {
        let robots = seats.iter().enumerate().filter(|(_, seat)| seat.place.is_some());
        robots.map(|(index, _)| index).collect::<Vec<_>>()
    };
    let order = match choice {
        RobotChoice::All => {
            let there = seats.iter().filter(|seat| seat.found.identity.is_meca500()).count();
            if there > MAX_ROBOTS {
                return Err(EthercatError::TooManyRobots { wanted: there });
            }
            all()
        }
        RobotChoice::First(wanted) => {
            let (wanted, found) = (*wanted, all().len());
            if wanted > MAX_ROBOTS {
                return Err(EthercatError::TooManyRobots { wanted });
            }
            if found < wanted && found > 0 {
                return Err(EthercatError::TooFewRobots { wanted, found });
            }
            all()
        }
        RobotChoice::These(these) => {
            if these.len() > MAX_ROBOTS {
                return Err(EthercatError::TooManyRobots { wanted: these.len() });
            }
            let mut order = Vec::new();
            for address in these {
                let index = one(*address, seats)?;
                if order.contains(&index) {
                    let position = u16::try_from(index).unwrap_or(u16::MAX);
                    return Err(EthercatError::Twice { position });
                }
                order.push(index);
            }
            order
        }
    };
    if order.is_empty() {
        return Err(EthercatError::NoRobot { subdevices });
    }
    Ok(order)
}

fn one(address: RobotAddress, seats: &[Seat]) -> Result<usize, EthercatError> {
    let found = u16::try_from(seats.len()).unwrap_or(u16::MAX);
    let at = seats.iter().position(|seat| address.is_of(&seat.found));
    let index = at.ok_or(match address {
        RobotAddress::Position(position) => EthercatError::NoSuchPosition { position, found },
        RobotAddress::Alias(alias) => EthercatError::NoSuchAlias { alias },
    })?;
    match seats.get(index).map(|seat| &seat.found) {
        Some(found) if !found.identity.is_meca500() => Err(EthercatError::NotMeca500 {
            position: found.position,
            vendor: found.identity.vendor,
            product: found.identity.product,
        }),
        _ => Ok(index),
    }
}
