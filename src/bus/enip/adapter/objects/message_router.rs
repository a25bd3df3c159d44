//! Message router (class 2): 1 which classes there are, 2 how many connections there may be, 3 how many
//! there are.

use super::CLASSES;
use crate::bus::enip::adapter::CONNECTIONS;
use crate::bus::enip::adapter::target::Target;
use crate::wire::enip::bytes::Writer;

pub(super) fn put(target: &Target, attribute: u32, writer: &mut Writer<'_>) -> bool {
    let put_count = |writer: &mut Writer<'_>, count: usize| {
        writer.u16(u16::try_from(count).unwrap_or(u16::MAX));
    };
    match attribute {
        1 => {
            put_count(writer, CLASSES.len());
            for (number, _) in CLASSES {
                writer.u16(number);
            }
        }
        2 => put_count(writer, CONNECTIONS),
        3 => put_count(writer, target.connections.iter().count()),
        _ => return false,
    }
    true
}
