//! Connection manager (class 6): what it has counted: 1 opens, 2 malformed, 3 without room, 4 refused
//! otherwise; 5 closes, 6 malformed, 7 refused otherwise; 8 connections that timed out.

use crate::bus::enip::adapter::target::Target;
use crate::wire::enip::bytes::Writer;

pub(super) const ALL: &[u32] = &[1, 2, 3, 4, 5, 6, 7, 8];

pub(super) fn put(target: &Target, attribute: u32, writer: &mut Writer<'_>) -> bool {
    let counters = &target.counters;
    writer.u16(match attribute {
        1 => counters.opens,
        2 => counters.malformed_opens,
        3 => counters.opens_without_room,
        4 => counters.refused_opens,
        5 => counters.closes,
        6 => counters.malformed_closes,
        7 => counters.refused_closes,
        8 => counters.timeouts,
        _ => return false,
    });
    true
}
