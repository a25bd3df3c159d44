//! A [`Wire`] on a network interface: a raw packet socket for EtherType 88A4h (Linux).
//!
//! Read [`RawSocket::open`] first. Waiting is giving way once and then `ppoll` with a deadline in
//! nanoseconds, so that a cycle of 250 us can be kept; nothing allocates once the socket is open.
//!
//! Invariants: only frames that arrived on this interface come out, never those this end sent; an
//! interface that goes down and comes back needs nothing from the caller but patience.
//!
//! Leaves out: the address of the interface (a main device chooses its source address itself), and
//! promiscuous mode: EtherCAT frames are broadcast.

use std::io;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, OwnedFd};
use std::path::PathBuf;
use std::prelude::v1::*;

use nix::ifaddrs::getifaddrs;
use nix::sys::socket::{LinkAddr, bind};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::net::netdevice::index_to_name_inlined;
use rustix::net::sockopt::{Timeout, set_socket_timeout};
use rustix::net::{
    AddressFamily, Protocol, RecvFlags, SendFlags, SocketFlags, SocketType, recv, send, socket_with,
};
use rustix::thread::sched_yield;

use super::wire::Wire;
use crate::link::clock::MonotonicClock;
use crate::time::{Duration, Instant};

/// EtherCAT's EtherType. Source: ETG.1000 part 4.
const ETHERTYPE: u16 = 0x88A4;
/// Hardware type of Ethernet in a link address (ARPHRD_ETHER).
const HARDWARE_ETHERNET: u16 = 1;
/// Wait for a frame that is all but certain to come; the system rounds it up to ticks of its own.
const CARELESS_WAIT: Duration = Duration::from_millis(1);
/// Most frames that are thrown away at opening; far more than a socket's buffer holds.
const MOST_DRAINED: u32 = 100_000;

/// Why no EtherCAT frames can be exchanged on an interface.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OpenError {
    /// No interface has this name.
    #[error("there is no network interface `{name}`; there are: {}", list(.there_are))]
    NoSuchInterface {
        /// The name asked for.
        name: String,
        /// Names of the Ethernet interfaces there are.
        there_are: Vec<String>,
    },
    /// The interface has no Ethernet frames: a loopback or a tunnel.
    #[error("network interface `{name}` is not Ethernet; there are: {}", list(.there_are))]
    NotEthernet {
        /// The name asked for.
        name: String,
        /// Names of the Ethernet interfaces there are.
        there_are: Vec<String>,
    },
    /// The process lacks the capability CAP_NET_RAW.
    #[error(
        "no permission to open a raw socket on `{name}`: the capability CAP_NET_RAW is missing; \
         run as root, or grant it once with: sudo setcap cap_net_raw+ep {}",
        .executable.display()
    )]
    NotPermitted {
        /// The name asked for.
        name: String,
        /// Path of this process's executable, to which the capability can be given.
        executable: PathBuf,
    },
    /// The system refused for another reason.
    #[error("cannot open a raw socket on `{name}`: {}", io::Error::from_raw_os_error(*.errno))]
    System {
        /// The name asked for.
        name: String,
        /// The system's number of the error.
        errno: i32,
    },
}

impl OpenError {
    /// Whether trying again can help without anybody acting: memory or descriptors were short.
    #[must_use]
    pub fn is_transient(&self) -> bool {
        match self {
            Self::System { errno, .. } => [Errno::NOBUFS, Errno::NOMEM, Errno::MFILE, Errno::NFILE]
                .iter()
                .any(|transient| transient.raw_os_error() == *errno),
            _ => false,
        }
    }
}

fn list(names: &[String]) -> String {
    if names.is_empty() { "none with Ethernet".into() } else { names.join(", ") }
}

/// Whether an error of [`RawSocket`]'s `send` or `receive` passes by itself: the interface is down
/// and may come up again, or buffers were full. An interface that was removed does not come back.
#[must_use]
pub fn is_transient(error: &io::Error) -> bool {
    let gone = [Errno::NODEV, Errno::NXIO, Errno::BADF];
    !gone.iter().any(|errno| error.raw_os_error() == Some(errno.raw_os_error()))
}

/// The Ethernet interfaces of this machine (of this network namespace), by name.
///
/// # Errors
///
/// The system does not list them.
pub fn interfaces() -> io::Result<Vec<String>> {
    let mut names: Vec<String> = link_addresses()?
        .into_iter()
        .filter(|(_, address)| address.hatype() == HARDWARE_ETHERNET)
        .map(|(name, _)| name)
        .collect();
    names.sort();
    names.dedup();
    Ok(names)
}

fn link_addresses() -> io::Result<Vec<(String, LinkAddr)>> {
    Ok(getifaddrs()?
        .filter_map(|entry| {
            let address = entry.address?.as_link_addr().copied()?;
            Some((entry.interface_name, address))
        })
        .collect())
}

/// EtherCAT frames on one network interface.
#[derive(Debug)]
pub struct RawSocket {
    socket: OwnedFd,
    index: u32,
    clock: MonotonicClock,
    /// Whether the system said that the interface is down, and nothing has passed since.
    is_down: bool,
}

impl RawSocket {
    /// Opens the interface called `name`; it may be down. Frames that arrived before are not seen.
    ///
    /// # Errors
    ///
    /// See [`OpenError`]: each says what to do about it.
    pub fn open(name: &str) -> Result<Self, OpenError> {
        let system = |errno: i32| OpenError::System { name: name.into(), errno };
        let os = |error: io::Error| system(error.raw_os_error().unwrap_or(0));
        let address = link_addresses().map_err(os)?.into_iter().find(|(known, _)| known == name);
        let Some((_, address)) = address else {
            let there_are = interfaces().map_err(os)?;
            return Err(OpenError::NoSuchInterface { name: name.into(), there_are });
        };
        if address.hatype() != HARDWARE_ETHERNET {
            let there_are = interfaces().map_err(os)?;
            return Err(OpenError::NotEthernet { name: name.into(), there_are });
        }
        let index = u32::try_from(address.ifindex()).map_err(|_| system(0))?;
        let socket = packet_socket().map_err(|errno| match errno {
            Errno::PERM | Errno::ACCESS => OpenError::NotPermitted {
                name: name.into(),
                executable: std::env::current_exe().unwrap_or_else(|_| "PROGRAM".into()),
            },
            errno => system(errno.raw_os_error()),
        })?;
        // The address has protocol 0, by which the socket keeps the one it was made with.
        bind(socket.as_raw_fd(), &address).map_err(|errno| system(errno as i32))?;
        let mut socket = Self { socket, index, clock: MonotonicClock::new(), is_down: false };
        socket.drain().map_err(os)?;
        Ok(socket)
    }

    /// The clock that [`Wire::now`] reads.
    #[must_use]
    pub const fn clock(&self) -> MonotonicClock {
        self.clock
    }

    /// Whether the system said that the interface is down, and no frame has passed since.
    #[must_use]
    pub const fn is_down(&self) -> bool {
        self.is_down
    }

    /// Throws away what arrived on any interface before the socket was bound to its own.
    fn drain(&mut self) -> io::Result<()> {
        for _ in 0..MOST_DRAINED {
            match recv(&self.socket, &mut [0; 1][..], RecvFlags::DONTWAIT) {
                Ok(_) | Err(Errno::INTR) => {}
                Err(Errno::AGAIN) => break,
                // An interface that is down may come up later.
                Err(Errno::NETDOWN) => self.is_down = true,
                Err(errno) => return Err(errno.into()),
            }
        }
        Ok(())
    }

    /// The next frame in the system's buffer.
    fn take_frame(&mut self, buffer: &mut [u8]) -> io::Result<Option<usize>> {
        self.take(buffer, RecvFlags::DONTWAIT)
    }

    fn take(&mut self, buffer: &mut [u8], flags: RecvFlags) -> io::Result<Option<usize>> {
        loop {
            let room = buffer.len();
            match recv(&self.socket, &mut *buffer, flags | RecvFlags::TRUNC) {
                Ok((_, length)) if length > room => {}
                Ok((_, length)) => {
                    self.is_down = false;
                    return Ok(Some(length));
                }
                Err(Errno::INTR) => {}
                Err(Errno::AGAIN) => return Ok(None),
                Err(errno) => {
                    self.is_down |= errno == Errno::NETDOWN;
                    self.check_presence()?;
                    return Err(errno.into());
                }
            }
        }
    }

    /// The system tells a reader that an interface went down, but not that it was removed then.
    fn check_presence(&self) -> io::Result<()> {
        if self.is_down && index_to_name_inlined(&self.socket, self.index).is_err() {
            return Err(Errno::NODEV.into());
        }
        Ok(())
    }
}

impl AsFd for RawSocket {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.socket.as_fd()
    }
}

fn packet_socket() -> Result<OwnedFd, Errno> {
    let protocol = u32::from(ETHERTYPE.to_be());
    let protocol = core::num::NonZeroU32::new(protocol).map(Protocol::from_raw);
    let socket =
        socket_with(AddressFamily::PACKET, SocketType::RAW, SocketFlags::CLOEXEC, protocol)?;
    set_socket_timeout(&socket, Timeout::Recv, Some(CARELESS_WAIT))?;
    Ok(socket)
}

impl Wire for RawSocket {
    fn send(&mut self, frame: &[u8]) -> io::Result<()> {
        loop {
            match send(&self.socket, frame, SendFlags::DONTWAIT) {
                Ok(_) => {
                    self.is_down = false;
                    return Ok(());
                }
                Err(Errno::INTR) => {}
                Err(errno) => {
                    self.is_down |= errno == Errno::NETDOWN;
                    return Err(errno.into());
                }
            }
        }
    }

    fn receive(&mut self, buffer: &mut [u8], deadline: Instant) -> io::Result<Option<usize>> {
        // To wait with a deadline takes a timer, and setting one costs several microseconds on a
        // virtual machine. Who answers on this core has answered after giving way once.
        sched_yield();
        loop {
            if let Some(length) = self.take_frame(buffer)? {
                return Ok(Some(length));
            }
            let remaining = deadline.saturating_duration_since(self.clock.now());
            if remaining.is_zero() {
                return Ok(None);
            }
            let timeout = Timespec::try_from(remaining).ok();
            let mut sockets = [PollFd::new(&self.socket, PollFlags::IN)];
            match poll(&mut sockets, timeout.as_ref()) {
                Ok(0) => self.check_presence()?,
                Ok(_) | Err(Errno::INTR) => {}
                Err(errno) => return Err(errno.into()),
            }
        }
    }

    fn receive_now(&mut self, buffer: &mut [u8]) -> io::Result<Option<usize>> {
        self.take_frame(buffer)
    }

    fn receive_next(&mut self, buffer: &mut [u8], _: Instant) -> io::Result<Option<usize>> {
        // The system counts this wait in ticks of its own: no timer is set for it and none taken back.
        match self.take(buffer, RecvFlags::empty())? {
            None => self.check_presence().map(|()| None),
            length => Ok(length),
        }
    }

    fn now(&self) -> Instant {
        self.clock.now()
    }

    fn pause_until(&mut self, deadline: Instant) {
        self.clock.sleep_until(deadline);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_interface_is_answered_with_those_there_are() {
        let error = RawSocket::open("no-such-name").unwrap_err();
        assert!(!error.is_transient());
        let there_are = interfaces().unwrap();
        assert_eq!(error, OpenError::NoSuchInterface { name: "no-such-name".into(), there_are });
        let none = OpenError::NoSuchInterface { name: "x".into(), there_are: Vec::new() };
        assert_eq!(
            none.to_string(),
            "there is no network interface `x`; there are: none with Ethernet"
        );
    }

    #[test]
    fn the_loopback_is_refused_since_it_returns_what_was_sent() {
        if link_addresses().unwrap().iter().any(|(name, _)| name == "lo") {
            let error = RawSocket::open("lo").unwrap_err();
            assert!(matches!(error, OpenError::NotEthernet { .. }), "{error}");
        }
    }

    #[test]
    fn a_missing_capability_is_named_together_with_the_way_to_grant_it() {
        let error =
            OpenError::NotPermitted { name: "eth0".into(), executable: "/opt/fieldarm".into() };
        let text = error.to_string();
        assert!(text.contains("CAP_NET_RAW"), "{text}");
        assert!(text.ends_with("sudo setcap cap_net_raw+ep /opt/fieldarm"), "{text}");
    }

    #[test]
    fn only_a_removed_interface_is_beyond_hope() {
        for (errno, transient) in [
            (Errno::NETDOWN, true),
            (Errno::NOBUFS, true),
            (Errno::AGAIN, true),
            (Errno::NODEV, false),
            (Errno::NXIO, false),
        ] {
            assert_eq!(is_transient(&io::Error::from(errno)), transient, "{errno}");
        }
        assert!(!OpenError::System { name: "x".into(), errno: 22 }.is_transient());
        let short = Errno::NOBUFS.raw_os_error();
        assert!(OpenError::System { name: "x".into(), errno: short }.is_transient());
    }
}
