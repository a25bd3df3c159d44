//! Quality of service (class 48h): code points of outgoing frames: 4 urgent, 5 scheduled, 6 high, 7 low,
//! 8 explicit messages. The values are the standard's defaults.

use crate::wire::enip::bytes::Writer;

pub(super) fn put(attribute: u32, writer: &mut Writer<'_>) -> bool {
    writer.u8(match attribute {
        4 => 55,
        5 => 47,
        6 => 43,
        7 => 31,
        8 => 27,
        _ => return false,
    });
    true
}
