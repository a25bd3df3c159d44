//! Waiting for many sockets at once, to the nanosecond.
//!
//! On Linux the kernel keeps the list of sockets, so that a wait costs the same for one robot as for 64. The
//! kernel's list is itself waited for with `ppoll`, whose time limit is in nanoseconds on every kernel. Other
//! systems are not asked who is ready: every socket counts as ready, and is looked at once per wait.
//!
//! Invariant: a wait never lasts longer than it was told to, but for what the system adds.

use std::io;
use std::vec::Vec;

use crate::time::Duration;

/// What a socket is waited for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Interest {
    /// Something to read.
    Read,
    /// Room to write.
    Write,
    /// Nothing for now; that the peer is gone is told even so.
    Nothing,
}

/// Which sockets are ready, by the keys they were added with.
#[cfg(target_os = "linux")]
pub(super) use linux::Readiness;

#[cfg(target_os = "linux")]
mod linux {
    use std::os::fd::{AsFd, OwnedFd};

    use rustix::event::epoll::{self, CreateFlags, Event, EventData, EventFlags};
    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    use rustix::io::Errno;

    use super::{Duration, Interest, Vec, io};

    /// Sockets that are told of in one wait.
    const AT_ONCE: usize = 128;

    /// A list of sockets in the kernel.
    pub(in super::super) struct Readiness {
        list: OwnedFd,
        events: Vec<Event>,
    }

    fn flags(interest: Interest) -> EventFlags {
        match interest {
            Interest::Read => EventFlags::IN,
            Interest::Write => EventFlags::OUT,
            Interest::Nothing => EventFlags::empty(),
        }
    }

    impl Readiness {
        /// An empty list.
        ///
        /// # Errors
        ///
        /// The process may not open one more file.
        pub(in super::super) fn new() -> io::Result<Self> {
            let list = epoll::create(CreateFlags::CLOEXEC)?;
            Ok(Self { list, events: Vec::with_capacity(AT_ONCE) })
        }

        /// Waits for `socket` too, from now on; it leaves the list by being closed.
        ///
        /// # Errors
        ///
        /// The system has no room for it.
        pub(in super::super) fn add(
            &self,
            socket: impl AsFd,
            key: u64,
            interest: Interest,
        ) -> io::Result<()> {
            Ok(epoll::add(&self.list, socket, EventData::new_u64(key), flags(interest))?)
        }

        /// Waits for something else of a socket.
        ///
        /// # Errors
        ///
        /// It was never added.
        pub(in super::super) fn modify(
            &self,
            socket: impl AsFd,
            key: u64,
            interest: Interest,
        ) -> io::Result<()> {
            Ok(epoll::modify(&self.list, socket, EventData::new_u64(key), flags(interest))?)
        }

        /// Waits until a socket is ready, at most for `limit`, and puts the keys of those that are into `ready`.
        ///
        /// # Errors
        ///
        /// The system refuses to wait.
        pub(in super::super) fn wait(
            &mut self,
            limit: Duration,
            ready: &mut Vec<u64>,
        ) -> io::Result<()> {
            ready.clear();
            if limit > Duration::ZERO {
                let limit = Timespec {
                    tv_sec: i64::try_from(limit.as_secs()).unwrap_or(i64::MAX),
                    tv_nsec: i64::from(limit.subsec_nanos()),
                };
                let mut list = [PollFd::new(&self.list, PollFlags::IN)];
                match poll(&mut list, Some(&limit)) {
                    Ok(0) | Err(Errno::INTR) => return Ok(()),
                    Ok(_) => {}
                    Err(error) => return Err(error.into()),
                }
            }
            self.events.clear();
            match epoll::wait(
                &self.list,
                rustix::buffer::spare_capacity(&mut self.events),
                Some(&Timespec { tv_sec: 0, tv_nsec: 0 }),
            ) {
                Ok(_) | Err(Errno::INTR) => {}
                Err(error) => return Err(error.into()),
            }
            ready.extend(self.events.iter().map(|event| event.data.u64()));
            Ok(())
        }
    }
}

#[cfg(not(target_os = "linux"))]
pub(super) use others::Readiness;

#[cfg(not(target_os = "linux"))]
mod others {
    use super::{Duration, Interest, Vec, io};

    /// Every socket there is.
    pub(in super::super) struct Readiness {
        keys: core::cell::RefCell<Vec<u64>>,
    }

    impl Readiness {
        pub(in super::super) fn new() -> io::Result<Self> {
            Ok(Self { keys: core::cell::RefCell::default() })
        }

        pub(in super::super) fn add<S>(&self, _: S, key: u64, _: Interest) -> io::Result<()> {
            let mut keys = self.keys.borrow_mut();
            if !keys.contains(&key) {
                keys.push(key);
            }
            Ok(())
        }

        pub(in super::super) fn modify<S>(&self, _: S, _: u64, _: Interest) -> io::Result<()> {
            Ok(())
        }

        pub(in super::super) fn wait(
            &mut self,
            limit: Duration,
            ready: &mut Vec<u64>,
        ) -> io::Result<()> {
            std::thread::sleep(limit);
            ready.clear();
            ready.extend(self.keys.borrow().iter());
            Ok(())
        }
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use std::net::UdpSocket;

    use super::*;

    #[test]
    fn who_has_something_to_read_is_told_by_its_key() {
        let mut readiness = Readiness::new().expect("a list");
        let sockets: Vec<_> =
            (0..3).map(|_| UdpSocket::bind("127.0.0.1:0").expect("a socket")).collect();
        for (key, socket) in (7..).zip(&sockets) {
            readiness.add(socket, key, Interest::Read).expect("added");
        }
        let mut ready = Vec::new();
        readiness.wait(Duration::from_micros(100), &mut ready).expect("waited");
        assert!(ready.is_empty());
        let to = sockets[1].local_addr().expect("an address");
        sockets[0].send_to(&[1], to).expect("sent");
        readiness.wait(Duration::from_secs(5), &mut ready).expect("waited");
        assert_eq!(ready, [8]);
        readiness.modify(&sockets[1], 8, Interest::Nothing).expect("modified");
        readiness.wait(Duration::ZERO, &mut ready).expect("asked");
        assert!(ready.is_empty());
        readiness.modify(&sockets[1], 8, Interest::Write).expect("modified");
        readiness.wait(Duration::ZERO, &mut ready).expect("asked");
        assert_eq!(ready, [8]);
    }
}
