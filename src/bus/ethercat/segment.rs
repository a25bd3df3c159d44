//! Subdevices in a row on one wire: the way of a frame through all of them and back.
//!
//! The first device that is not on the bus ends the line; those behind it are out of reach. A frame
//! that cannot be read is treated as an ESC would: it counts in the error counters and is lost,
//! since an ESC spoils its checksum.

use crate::time::{Duration, Instant};
use crate::wire::ethercat::frame::{DatagramsMut, FrameError, datagrams, mark_as_passed};
use crate::wire::ethercat::register::{
    DL_CONTROL, DL_CONTROL_ETHERCAT_ONLY, FORWARDED_ERRORS, PROCESSING_ERRORS, RX_ERRORS,
};

use super::application::Application;
use super::sub_device::{Onward, SubDevice};

/// What became of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum Passage {
    /// It came back, changed where it stands.
    Returned,
    /// It did not come back; what it holds now means nothing.
    Lost,
}

/// Lets the devices of `line` live until `now` without a frame: watchdogs run, SYNC0 comes, and the
/// applications have their cycles. To be called about every millisecond when no frames pass.
pub fn tick<A: Application>(now: Instant, line: &mut [SubDevice<A>]) {
    for device in line.iter_mut() {
        device.live(now);
    }
    join(line);
}

/// Passes a frame, which starts at the Ethernet header and leaves the main device at `now`, through
/// the devices of `line` and back, and lets them act on it. `now` must not go backwards.
pub fn pass<A: Application>(now: Instant, frame: &mut [u8], line: &mut [SubDevice<A>]) -> Passage {
    let passage = carry(now, frame, line);
    act(now, line);
    passage
}

/// Passes a frame as [`pass`] does, and leaves it to [`act`] what its firmware makes of it: an ESC
/// sends a frame on before its firmware has seen it. [`act`] comes before the next frame.
pub fn carry<A: Application>(now: Instant, frame: &mut [u8], line: &mut [SubDevice<A>]) -> Passage {
    tick(now, line);
    let (reached, passage) = reach(line);
    let Some(reached) = line.get_mut(..reached).filter(|reached| !reached.is_empty()) else {
        return Passage::Lost;
    };
    let marks = reached.iter().any(|device| destroys_others(device));
    let passage = match datagrams(frame) {
        Ok(_) => {
            process(now, frame, reached);
            passage
        }
        Err(FrameError::NotDatagrams { .. }) => passage,
        Err(FrameError::NotEtherCat { .. }) if marks => return Passage::Lost,
        Err(FrameError::NotEtherCat { .. }) => return passage,
        Err(error) => {
            count_error(error, reached);
            return Passage::Lost;
        }
    };
    if marks {
        mark_as_passed(frame);
    }
    passage
}

/// Lets the firmware of all devices act on the frame that was carried last.
pub fn act<A: Application>(now: Instant, line: &mut [SubDevice<A>]) {
    for device in line.iter_mut().filter(|device| device.is_on_bus()) {
        device.react(now);
    }
}

/// Tells each device whether another one is behind it.
fn join<A: Application>(line: &mut [SubDevice<A>]) {
    let mut follower = false;
    for device in line.iter_mut().rev() {
        let on_bus = device.is_on_bus();
        if on_bus {
            device.set_follower(follower);
        }
        follower = on_bus;
    }
}

/// How many devices a frame reaches, and whether it finds back.
fn reach<A: Application>(line: &[SubDevice<A>]) -> (usize, Passage) {
    for (index, device) in line.iter().enumerate() {
        if !device.is_on_bus() {
            return (index, Passage::Returned);
        }
        match device.onward() {
            Onward::GoesOn => {}
            Onward::TurnsBack => return (index + 1, Passage::Returned),
            Onward::IsLost => return (index + 1, Passage::Lost),
        }
    }
    (line.len(), Passage::Returned)
}

fn destroys_others<A: Application>(device: &SubDevice<A>) -> bool {
    device.controller.memory.u32(DL_CONTROL) & DL_CONTROL_ETHERCAT_ONLY != 0
}

/// Lets each device process the datagrams when the frame reaches it, and see it come back.
fn process<A: Application>(now: Instant, frame: &mut [u8], reached: &mut [SubDevice<A>]) {
    let mut at = now;
    for device in reached.iter_mut() {
        at += device.line_delay();
        for mut datagram in DatagramsMut::new(frame) {
            device.controller.process(at, &mut datagram);
        }
    }
    // The last device has no frame coming in at port 1.
    let mut behind: Option<Duration> = None;
    for device in reached.iter_mut().rev() {
        if let Some(delay) = behind {
            at += delay;
            device.controller.returned(at);
        }
        behind = Some(device.line_delay());
    }
}

/// The first device finds the error, the others are told.
fn count_error<A: Application>(error: FrameError, reached: &mut [SubDevice<A>]) {
    let found = match error {
        FrameError::Truncated { .. } => PROCESSING_ERRORS,
        _ => RX_ERRORS,
    };
    for (index, device) in reached.iter_mut().enumerate() {
        let counter = if index == 0 { found } else { FORWARDED_ERRORS };
        device.controller.memory.count(counter);
    }
}
