//! Loopback addresses that nobody else uses: every role of a test has one of its own, with the usual
//! ports free, so that tests and processes do not meet.

use std::net::{Ipv4Addr, TcpListener, UdpSocket};
use std::sync::atomic::{AtomicU32, Ordering};

static NEXT: AtomicU32 = AtomicU32::new(0);

/// The next address whose ports 2222 (UDP) and 44818 (TCP, UDP) are free.
pub(crate) fn address() -> Ipv4Addr {
    for _ in 0..1_000 {
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        // Spread over 127.0.0.0/8 by process; multiplying by an odd number keeps the numbers apart.
        let mixed = (std::process::id() << 7).wrapping_add(number).wrapping_mul(0x9E37_79B1);
        let [a, b, c, _] = mixed.to_be_bytes();
        let address = Ipv4Addr::new(127, a.max(1), b, c.clamp(1, 254));
        let is_free = UdpSocket::bind((address, 2_222)).is_ok()
            && UdpSocket::bind((address, 44_818)).is_ok()
            && TcpListener::bind((address, 44_818)).is_ok();
        if is_free {
            return address;
        }
    }
    panic!("no loopback address with free ports");
}
