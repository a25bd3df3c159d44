//! Ethernet link (class F6h): 1 speed in Mbit/s, 2 flags, 3 hardware address, 7 type of the interface.
//!
//! One instance stands for both ports, which the robot switches. Source: choice.

use crate::bus::enip::adapter::target::Target;
use crate::wire::enip::bytes::Writer;

pub(super) const ALL: &[u32] = &[1, 2, 3];

/// Mbit/s.
const SPEED: u32 = 100;
/// Link up, full duplex, both negotiated.
const FLAGS: u32 = 0b0_1111;
/// Twisted pair.
const TWISTED_PAIR: u8 = 2;

pub(super) fn put(target: &Target, attribute: u32, writer: &mut Writer<'_>) -> bool {
    match attribute {
        1 => writer.u32(SPEED),
        2 => writer.u32(FLAGS),
        3 => writer.put(&target.settings.mac),
        7 => writer.u8(TWISTED_PAIR),
        _ => return false,
    }
    true
}
