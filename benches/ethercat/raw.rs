//! The baseline: a packet socket that sends a ready-made frame and waits for it, two system calls.

use std::io;
use std::os::fd::{AsRawFd, OwnedFd};
use std::time::{Duration, Instant};

use rustix::net::sockopt::{Timeout, set_socket_timeout};
use rustix::net::{AddressFamily, Protocol, RecvFlags, SendFlags, SocketType, recv, send, socket};

use crate::beat::{Beat, Exchanged, Figures};
use crate::frame::Frame;

/// EtherCAT's EtherType.
const ETHERTYPE: u16 = 0x88A4;
/// Far longer than a frame takes. The kernel counts it in ticks of milliseconds: no deadline of a
/// cycle can be kept with it, which is why nobody but a baseline would do so.
const PATIENCE: Duration = Duration::from_millis(100);

/// Sends `frame` in each cycle to `robots` robots that are in OP.
pub(crate) fn run(
    interface: &str,
    frame: &Frame,
    robots: usize,
    beat: Beat,
) -> io::Result<Figures> {
    let socket = open(interface)?;
    let mut buffer = [0; 1514];
    Ok(beat.keep(|| {
        let began = Instant::now();
        let is_sent = send(&socket, frame.bytes(), SendFlags::empty()).is_ok();
        let received = recv(&socket, &mut buffer[..], RecvFlags::empty());
        let took = began.elapsed();
        let is_back = received.is_ok_and(|(_, length)| length == frame.bytes().len());
        let is_whole = is_sent && is_back && Frame::working_counter(&buffer) == Some(3 * robots);
        Exchanged { took, engine: None, is_whole }
    }))
}

fn open(interface: &str) -> io::Result<OwnedFd> {
    let address = nix::ifaddrs::getifaddrs()?
        .filter(|entry| entry.interface_name == interface)
        .find_map(|entry| entry.address?.as_link_addr().copied())
        .ok_or_else(|| io::Error::other(format!("no interface {interface}")))?;
    let protocol = core::num::NonZeroU32::new(u32::from(ETHERTYPE.to_be()));
    let protocol = protocol.map(Protocol::from_raw);
    let socket = socket(AddressFamily::PACKET, SocketType::RAW, protocol)?;
    nix::sys::socket::bind(socket.as_raw_fd(), &address)?;
    set_socket_timeout(&socket, Timeout::Recv, Some(PATIENCE))?;
    Ok(socket)
}
