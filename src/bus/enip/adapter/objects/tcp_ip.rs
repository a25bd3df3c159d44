//! TCP/IP interface (class F5h): 1 status, 2 capability, 3 control, 4 path of the link, 5 address, mask,
//! gateway, name servers and domain, 6 host name, 8 time to live of multicast frames, 9 groups, 13 seconds
//! without a message after which a TCP connection is closed; 0 is never.

use core::net::Ipv4Addr;

use crate::bus::enip::adapter::multicast::{GROUPS, first_group};
use crate::bus::enip::adapter::target::Target;
use crate::wire::enip::bytes::Writer;

pub(super) const ALL: &[u32] = &[1, 2, 3, 4, 5, 6];

/// Status: the configuration is valid.
const CONFIGURED: u32 = 1;
/// Capability: nothing of the configuration can be set here.
const NOTHING_SETTABLE: u32 = 0;
/// Control: the configuration is fixed.
const STATIC: u32 = 0;
/// The Ethernet link object, behind its size in words.
const LINK_PATH: &[u8] = &[2, 0, 0x20, 0xF6, 0x24, 1];
/// Groups are chosen by the usual rule.
const DEFAULT_GROUPS: u8 = 0;

pub(super) fn put(target: &Target, attribute: u32, writer: &mut Writer<'_>) -> bool {
    let settings = &target.settings;
    match attribute {
        1 => writer.u32(CONFIGURED),
        2 => writer.u32(NOTHING_SETTABLE),
        3 => writer.u32(STATIC),
        4 => writer.put(LINK_PATH),
        5 => {
            let none = Ipv4Addr::UNSPECIFIED;
            for address in [target.address, settings.netmask, none, none, none] {
                writer.u32(address.to_bits());
            }
            put_string(writer, b"");
        }
        6 => put_string(writer, settings.host_name.as_bytes()),
        8 => writer.u8(1),
        9 => {
            writer.put(&[DEFAULT_GROUPS, 0]);
            writer.u16(GROUPS);
            writer.u32(first_group(target.address, settings.netmask).to_bits());
        }
        13 => writer.u16(u16::try_from(settings.inactivity.as_secs()).unwrap_or(u16::MAX)),
        _ => return false,
    }
    true
}

/// Puts a string with two bytes of length in front, padded to whole words.
fn put_string(writer: &mut Writer<'_>, text: &[u8]) {
    writer.u16(u16::try_from(text.len()).unwrap_or(u16::MAX));
    writer.put(text);
    if text.len() % 2 == 1 {
        writer.u8(0);
    }
}
