//! Identity (class 1): who the robot is. Attributes 1 to 7 are those of ListIdentity, 8 is its state.

use super::put_short_string;
use crate::bus::enip::adapter::target::Target;
use crate::wire::enip::bytes::Writer;

pub(super) const ALL: &[u32] = &[1, 2, 3, 4, 5, 6, 7];

/// State: operational.
const OPERATIONAL: u8 = 3;

pub(super) fn put(target: &Target, attribute: u32, writer: &mut Writer<'_>) -> bool {
    let identity = target.identity();
    match attribute {
        1 => writer.u16(identity.vendor),
        2 => writer.u16(identity.device_type),
        3 => writer.u16(identity.product_code),
        4 => writer.put(&[identity.major, identity.minor]),
        5 => writer.u16(identity.status),
        6 => writer.u32(identity.serial),
        7 => put_short_string(writer, identity.name.as_bytes()),
        8 => writer.u8(OPERATIONAL),
        _ => return false,
    }
    true
}
