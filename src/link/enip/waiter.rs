//! Waiting for any of several sockets, with deadlines finer than a millisecond.
//!
//! Linux keeps the list of sockets in the kernel; elsewhere it is handed over with each wait. A socket
//! that is closed needs no removal.

use std::io;

use rustix::fd::BorrowedFd;

pub(super) use crate::link::watch_list::Interest;
use crate::link::watch_list::timespec;
use crate::time::Duration;

/// A socket to wait for, with the number that tells it apart.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source<'a> {
    pub(super) key: usize,
    pub(super) socket: BorrowedFd<'a>,
    pub(super) interest: Interest,
}

#[cfg(target_os = "linux")]
pub(super) use in_kernel::Waiter;
#[cfg(not(target_os = "linux"))]
pub(super) use listed::Waiter;

#[cfg(target_os = "linux")]
mod in_kernel {
    use core::mem::MaybeUninit;

    use rustix::event::{PollFd, PollFlags, Timespec, epoll, poll};
    use rustix::fd::{AsFd, BorrowedFd, OwnedFd};
    use rustix::io::Errno;

    use super::{Duration, Interest, Source, io, timespec};

    /// Sockets that one wait tells of at most.
    const MOST: usize = 64;

    /// Waits for sockets that were put on a list in the kernel.
    pub(in crate::link::enip) struct Waiter {
        epoll: OwnedFd,
    }

    impl core::fmt::Debug for Waiter {
        fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
            f.debug_struct("Waiter").field("epoll", &self.epoll).finish_non_exhaustive()
        }
    }

    impl Waiter {
        pub(in crate::link::enip) fn new() -> io::Result<Self> {
            let epoll = epoll::create(epoll::CreateFlags::CLOEXEC)?;
            Ok(Self { epoll })
        }

        /// The list as one file: ready when one of its sockets is.
        pub(in crate::link::enip) fn as_fd(&self) -> BorrowedFd<'_> {
            self.epoll.as_fd()
        }

        /// Puts a socket on the list.
        pub(in crate::link::enip) fn add(&mut self, source: Source<'_>) -> io::Result<()> {
            let data = epoll::EventData::new_u64(source.key as u64);
            Ok(epoll::add(&self.epoll, source.socket, data, flags(source.interest))?)
        }

        /// Waits for something else at a socket of the list.
        pub(in crate::link::enip) fn change(&mut self, source: Source<'_>) -> io::Result<()> {
            let data = epoll::EventData::new_u64(source.key as u64);
            Ok(epoll::modify(&self.epoll, source.socket, data, flags(source.interest))?)
        }

        /// Takes a socket off the list that is kept open.
        pub(in crate::link::enip) fn remove(&mut self, socket: BorrowedFd<'_>) -> io::Result<()> {
            Ok(epoll::delete(&self.epoll, socket)?)
        }

        /// Waits until a socket is ready or `timeout` is over, whichever is first, and tells the keys of
        /// those that are. It may return early.
        pub(in crate::link::enip) fn wait<'a>(
            &mut self,
            _: impl Iterator<Item = Source<'a>>,
            timeout: Duration,
            mut ready: impl FnMut(usize),
        ) -> io::Result<()> {
            // The list itself is a file that is ready when one of its sockets is. `poll` takes nanoseconds;
            // waiting for the list directly would round up to milliseconds, and frames would leave late by
            // a part of one that changes from frame to frame.
            let mut list = [PollFd::new(&self.epoll, PollFlags::IN)];
            match poll(&mut list, Some(&timespec(timeout))) {
                Ok(0) | Err(Errno::INTR) => return Ok(()),
                Ok(_) => {}
                Err(error) => return Err(error.into()),
            }
            // On the stack: an event may hold a pointer, and would keep the waiter from moving between threads.
            let mut room = [MaybeUninit::uninit(); MOST];
            let at_once = Timespec { tv_sec: 0, tv_nsec: 0 };
            let events = match epoll::wait(&self.epoll, &mut room, Some(&at_once)) {
                Ok((events, _)) => events,
                Err(Errno::INTR) => return Ok(()),
                Err(error) => return Err(error.into()),
            };
            for event in events {
                let data = event.data;
                ready(usize::try_from(data.u64()).unwrap_or(usize::MAX));
            }
            Ok(())
        }
    }

    fn flags(interest: Interest) -> epoll::EventFlags {
        match interest {
            Interest::Read => epoll::EventFlags::IN,
            Interest::Write => epoll::EventFlags::OUT,
            Interest::ReadAndWrite => epoll::EventFlags::IN | epoll::EventFlags::OUT,
            Interest::Nothing => epoll::EventFlags::empty(),
        }
    }
}

#[cfg(any(test, not(target_os = "linux")))]
mod listed {
    use std::vec::Vec;

    use rustix::event::{PollFd, poll};
    use rustix::io::Errno;

    use super::{Duration, Source, io, timespec};

    /// Waits for the sockets that are named in each call.
    #[derive(Debug)]
    pub(in crate::link::enip) struct Waiter;

    impl Waiter {
        pub(in crate::link::enip) const fn new() -> io::Result<Self> {
            Ok(Self)
        }

        /// Nothing: see [`wait`](Self::wait).
        #[cfg(not(test))]
        pub(in crate::link::enip) const fn add(&mut self, _: Source<'_>) -> io::Result<()> {
            Ok(())
        }

        /// Nothing: see [`wait`](Self::wait).
        #[cfg(not(test))]
        pub(in crate::link::enip) const fn change(&mut self, _: Source<'_>) -> io::Result<()> {
            Ok(())
        }

        /// Waits until one of `sources` is ready or `timeout` is over, whichever is first, and tells the
        /// keys of those that are. It may return early.
        pub(in crate::link::enip) fn wait<'a>(
            &mut self,
            sources: impl Iterator<Item = Source<'a>>,
            timeout: Duration,
            mut ready: impl FnMut(usize),
        ) -> io::Result<()> {
            let sources: Vec<Source<'a>> = sources.collect();
            let asked = |source: &Source<'a>| source.interest.at(source.socket);
            let mut list: Vec<PollFd<'_>> = sources.iter().map(asked).collect();
            match poll(&mut list, Some(&timespec(timeout))) {
                Ok(_) | Err(Errno::INTR) => {}
                Err(error) => return Err(error.into()),
            }
            for (source, answer) in sources.iter().zip(&list) {
                if !answer.revents().is_empty() {
                    ready(source.key);
                }
            }
            Ok(())
        }
    }
}

#[cfg(test)]
mod tests {
    use std::net::UdpSocket;
    use std::vec;
    use std::vec::Vec;

    use rustix::fd::AsFd;

    use super::*;

    fn pair() -> (UdpSocket, UdpSocket) {
        let (one, other) =
            (UdpSocket::bind("127.0.0.1:0").unwrap(), UdpSocket::bind("127.0.0.1:0").unwrap());
        one.connect(other.local_addr().unwrap()).unwrap();
        (one, other)
    }

    #[test]
    fn both_ways_of_waiting_tell_which_socket_is_ready() {
        let (_quiet_sender, quiet) = pair();
        let (sender, receiver) = pair();
        let source = |key, socket: &'static UdpSocket| Source {
            key,
            socket: socket.as_fd(),
            interest: Interest::Read,
        };
        let quiet: &'static UdpSocket = std::boxed::Box::leak(std::boxed::Box::new(quiet));
        let receiver: &'static UdpSocket = std::boxed::Box::leak(std::boxed::Box::new(receiver));
        let sources = || [source(3, quiet), source(7, receiver)].into_iter();
        let mut listed = listed::Waiter::new().unwrap();
        let mut own = Waiter::new().unwrap();
        for each in sources() {
            own.add(each).unwrap();
        }
        let short = Duration::from_micros(300);
        let mut keys = Vec::new();
        listed.wait(sources(), short, |key| keys.push(key)).unwrap();
        for _ in 0..2 {
            own.wait(sources(), short, |key| keys.push(key)).unwrap();
        }
        assert!(keys.is_empty(), "{keys:?}");
        sender.send(&[1]).unwrap();
        let long = Duration::from_secs(1);
        listed.wait(sources(), long, |key| keys.push(key)).unwrap();
        own.wait(sources(), long, |key| keys.push(key)).unwrap();
        assert_eq!(keys, vec![7, 7]);
        // A socket that may be written to is ready at once.
        own.change(Source { interest: Interest::ReadAndWrite, ..source(3, quiet) }).unwrap();
        keys.clear();
        own.wait(sources(), long, |key| keys.push(key)).unwrap();
        keys.sort_unstable();
        assert_eq!(keys, vec![3, 7]);
    }
}
