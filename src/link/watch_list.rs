//! Waiting for the sockets of several servers at once, with deadlines finer than a millisecond.
//!
//! Read [`WatchList`] first. Each server puts its sockets on the list under a number of its own, and
//! is served when one of them is ready or its own time has come.

use std::io;
use std::vec::Vec;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fd::BorrowedFd;
use rustix::io::Errno;

use crate::time::Duration;

/// What is waited for at a socket.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interest {
    /// Something to read, or the socket's end.
    Read,
    /// Room to write.
    Write,
    /// Either.
    ReadAndWrite,
    /// Nothing for now, but for errors.
    Nothing,
}

impl Interest {
    /// As the system is asked for it.
    pub(super) fn at(self, socket: BorrowedFd<'_>) -> PollFd<'_> {
        let flags = match self {
            Self::Read => PollFlags::IN,
            Self::Write => PollFlags::OUT,
            Self::ReadAndWrite => PollFlags::IN.union(PollFlags::OUT),
            Self::Nothing => PollFlags::empty(),
        };
        PollFd::from_borrowed_fd(socket, flags)
    }
}

/// A limit as the system is given it: a second is longer than anybody waits at once; callers come back.
pub(super) fn timespec(limit: Duration) -> Timespec {
    let limit = limit.min(Duration::from_secs(1));
    Timespec::try_from(limit).unwrap_or(Timespec { tv_sec: 1, tv_nsec: 0 })
}

/// Sockets to wait for, each with the number of the server that it belongs to.
#[derive(Debug, Default)]
pub struct WatchList<'a> {
    sockets: Vec<PollFd<'a>>,
    servers: Vec<usize>,
}

impl<'a> WatchList<'a> {
    /// A list without sockets.
    #[must_use]
    pub const fn new() -> Self {
        Self { sockets: Vec::new(), servers: Vec::new() }
    }

    /// Waits for what is of `interest` at `socket`, or for its end.
    pub fn add(&mut self, server: usize, socket: BorrowedFd<'a>, interest: Interest) {
        self.sockets.push(interest.at(socket));
        self.servers.push(server);
    }

    /// Waits until a socket is ready or `limit` is over, a second at most. It may return early.
    ///
    /// # Errors
    ///
    /// The system refuses to wait.
    pub fn wait(mut self, limit: Duration) -> io::Result<Ready> {
        match poll(&mut self.sockets, Some(&timespec(limit))) {
            Ok(0) | Err(Errno::INTR) => return Ok(Ready::default()),
            Ok(_) => {}
            Err(error) => return Err(error.into()),
        }
        let answers = self.sockets.iter().zip(self.servers);
        let ready = answers.filter(|(socket, _)| !socket.revents().is_empty());
        Ok(Ready { servers: ready.map(|(_, server)| server).collect() })
    }
}

/// Which servers have something to do.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Ready {
    servers: Vec<usize>,
}

impl Ready {
    /// Whether a socket of `server` is ready.
    #[must_use]
    pub fn contains(&self, server: usize) -> bool {
        self.servers.contains(&server)
    }
}

#[cfg(test)]
mod tests {
    use std::net::UdpSocket;

    use rustix::fd::AsFd;

    use super::*;

    #[test]
    fn the_server_whose_socket_is_ready_is_told() {
        let [quiet, busy] = [0, 1].map(|_| UdpSocket::bind("127.0.0.1:0").unwrap());
        let wait = |limit| {
            let mut list = WatchList::new();
            list.add(3, quiet.as_fd(), Interest::Read);
            list.add(5, busy.as_fd(), Interest::Read);
            list.wait(limit).unwrap()
        };
        assert_eq!(wait(Duration::from_micros(200)), Ready::default());
        quiet.send_to(&[1], busy.local_addr().unwrap()).unwrap();
        let ready = wait(Duration::from_secs(60));
        assert!(ready.contains(5) && !ready.contains(3));
        let mut list = WatchList::new();
        list.add(3, quiet.as_fd(), Interest::Write);
        assert!(list.wait(Duration::from_secs(60)).unwrap().contains(3), "there is room to write");
    }
}
