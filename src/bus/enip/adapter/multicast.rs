//! Which groups belong to an adapter.
//!
//! Source: CIP volume 2, chapter 3: 32 groups for each host number, from 239.192.1.0 on; the host number is
//! counted from 1 and taken modulo 1024.

use core::net::Ipv4Addr;

/// Groups of one host.
pub(super) const GROUPS: u16 = 32;
/// First group of host 1.
const FIRST_GROUP: Ipv4Addr = Ipv4Addr::new(239, 192, 1, 0);
/// Host numbers that are told apart, less one.
const HOST_MASK: u32 = 0x3FF;

/// The first group of the host at `address` in a network with `netmask`.
pub(super) fn first_group(address: Ipv4Addr, netmask: Ipv4Addr) -> Ipv4Addr {
    let host = address.to_bits() & !netmask.to_bits();
    let index = host.wrapping_sub(1) & HOST_MASK;
    Ipv4Addr::from_bits(FIRST_GROUP.to_bits() + index * u32::from(GROUPS))
}

/// Group number `number` of those that begin with `first`.
pub(super) fn group(first: Ipv4Addr, number: u16) -> Ipv4Addr {
    Ipv4Addr::from_bits(first.to_bits().saturating_add(u32::from(number.min(GROUPS - 1))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_follow_the_host_number() {
        let mask = Ipv4Addr::new(255, 255, 255, 0);
        let cases = [
            ([192, 168, 0, 1], mask, [239, 192, 1, 0]),
            ([192, 168, 0, 2], mask, [239, 192, 1, 32]),
            ([192, 168, 0, 100], mask, [239, 192, 13, 96]),
            ([192, 168, 0, 254], mask, [239, 192, 32, 160]),
            // 0x0401 - 1 = 0x400 is 0 modulo 1024.
            ([10, 0, 4, 1], Ipv4Addr::new(255, 0, 0, 0), [239, 192, 1, 0]),
            ([10, 0, 4, 0], Ipv4Addr::new(255, 0, 0, 0), [239, 192, 128, 224]),
        ];
        for (address, mask, first) in cases {
            assert_eq!(first_group(address.into(), mask), Ipv4Addr::from(first), "{address:?}");
        }
        assert_eq!(group(Ipv4Addr::new(239, 192, 1, 32), 31), Ipv4Addr::new(239, 192, 1, 63),);
    }
}
