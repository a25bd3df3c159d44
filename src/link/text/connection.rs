//! A connection with a thread that reads it: what clients of both ports are made of.
//!
//! Commands are written by whoever sends them, under the lock; the thread writes what did not fit, reads,
//! feeds the watchdog and tells everybody who waits. It sleeps in the system until something arrives, for
//! [`IDLE`] at most, so that bytes left over by a sender leave soon.
//!
//! Invariants: nobody waits for a connection that has ended; the lock is never held while waiting for
//! the network or while waking others.

use core::task::Waker;
use std::collections::HashMap;
use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, Weak};
use std::thread::{self, JoinHandle};
use std::vec;
use std::vec::Vec;

use rustix::event::{PollFd, PollFlags, Timespec, poll};

use super::answer::Reply;
use super::error::{AnswerError, ConnectError, EndReason};
use super::message::{OwnedMessage, Queue};
use crate::bus::text::client::{
    ClientSession, ClientSettings, Incoming, Outcome, Phase, Received, RequestId, SubmitError,
};
use crate::link::clock::MonotonicClock;
use crate::time::{Duration, Instant};

/// Longest sleep of the thread.
const IDLE: Duration = Duration::from_millis(20);
const ROOM: usize = 16_384;

/// Requests that wait at once, and bytes that wait to be sent.
pub(super) type Session = ClientSession<1024, 65_536>;

/// Somebody who waits for the end of a request.
#[derive(Debug, Default)]
struct Wait {
    result: Option<Result<Reply, AnswerError>>,
    waker: Option<Waker>,
    /// Whether the acceptance of a command that has no answer ends it.
    takes_acceptance: bool,
}

/// Everything behind the lock.
#[derive(Debug)]
pub(super) struct Inner {
    pub(super) session: Session,
    stream: Option<TcpStream>,
    pub(super) ended: Option<EndReason>,
    waits: HashMap<RequestId, Wait>,
    watchers: Vec<Waker>,
    queues: Vec<Weak<Queue>>,
}

#[derive(Debug)]
pub(super) struct Shared {
    inner: Mutex<Inner>,
    changed: Condvar,
    clock: MonotonicClock,
    /// Whether this end may speak.
    controls: bool,
}

/// Which port a connection is to.
#[derive(Clone, Copy, Debug)]
pub(super) enum Role<'a> {
    /// All messages go there from the first on, if it is somewhere.
    Control(Option<&'a Arc<Queue>>),
    /// All messages go there from the first on.
    Monitoring(&'a Arc<Queue>),
}

/// The connection and its thread. Dropping it closes the one and ends the other.
#[derive(Debug)]
pub(super) struct Connection {
    pub(super) shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Shared {
    pub(super) fn lock(&self) -> MutexGuard<'_, Inner> {
        // A panic of a reader of the state leaves everything as it was.
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits until `done` has something, at most for `limit`.
    pub(super) fn wait_for<T>(
        &self,
        limit: Duration,
        mut done: impl FnMut(&mut Inner) -> Option<T>,
    ) -> Option<T> {
        let deadline = self.clock.now() + limit;
        let mut inner = self.lock();
        loop {
            if let Some(done) = done(&mut inner) {
                return Some(done);
            }
            let left = deadline.saturating_duration_since(self.clock.now());
            if left.is_zero() {
                return None;
            }
            let waited = self.changed.wait_timeout(inner, left);
            inner = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Submits a command and says whose its end is.
    pub(super) fn submit(
        &self,
        takes_acceptance: bool,
        submit: impl FnOnce(&mut Session) -> Result<RequestId, SubmitError>,
    ) -> Result<RequestId, AnswerError> {
        let mut inner = self.lock();
        if let Some(reason) = inner.ended {
            return Err(AnswerError::Ended(reason));
        }
        let id = submit(&mut inner.session)?;
        let wait = Wait { takes_acceptance, ..Wait::default() };
        inner.waits.insert(id, wait);
        inner.flush();
        Ok(id)
    }

    /// The end of a request, once it is there.
    pub(super) fn take_result(
        inner: &mut Inner,
        id: RequestId,
    ) -> Option<Result<Reply, AnswerError>> {
        let wait = inner.waits.get_mut(&id)?;
        let result = wait.result.take()?;
        inner.waits.remove(&id);
        Some(result)
    }

    /// Feeds the connection watchdog from now on, or not any more.
    pub(super) fn set_watchdog(&self, period: Option<Duration>) -> Result<(), AnswerError> {
        let mut inner = self.lock();
        if let Some(reason) = inner.ended {
            return Err(AnswerError::Ended(reason));
        }
        inner.session.set_watchdog(self.clock.now(), period);
        inner.flush();
        Ok(())
    }

    /// Forgets a request that nobody waits for any more.
    pub(super) fn forget(&self, id: RequestId) {
        self.lock().waits.remove(&id);
    }
}

impl Inner {
    /// Remembers who is to be woken for a request.
    pub(super) fn set_waker(&mut self, id: RequestId, waker: &Waker) {
        if let Some(wait) = self.waits.get_mut(&id) {
            wait.waker = Some(waker.clone());
        }
    }

    /// Remembers who is to be woken by the next message.
    pub(super) fn watch(&mut self, waker: &Waker) {
        if !self.watchers.iter().any(|other| other.will_wake(waker)) {
            self.watchers.push(waker.clone());
        }
    }

    pub(super) fn subscribe(&mut self, queue: &Arc<Queue>) {
        self.queues.retain(|queue| queue.strong_count() > 0);
        self.queues.push(Arc::downgrade(queue));
        if let Some(reason) = self.ended {
            queue.end(reason);
        }
    }

    /// Sends what waits, as far as the system takes it now.
    fn flush(&mut self) {
        let Some(stream) = &mut self.stream else { return };
        while !self.session.waiting().is_empty() {
            match stream.write(self.session.waiting()) {
                Ok(0) => break,
                Ok(count) => self.session.sent(count),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                // Not now; what is broken shows when reading.
                Err(_) => break,
            }
        }
    }

    fn end_wait(
        &mut self,
        id: RequestId,
        result: Result<Reply, AnswerError>,
        woken: &mut Vec<Waker>,
    ) {
        if let Some(wait) = self.waits.get_mut(&id)
            && wait.result.is_none()
        {
            wait.result = Some(result);
            woken.extend(wait.waker.take());
        }
    }

    /// The connection is gone: nobody waits for it any longer.
    fn end(&mut self, reason: EndReason, woken: &mut Vec<Waker>) {
        if self.ended.is_some() {
            return;
        }
        self.ended = Some(reason);
        self.session.disconnected();
        if let Some(stream) = self.stream.take() {
            let _ = stream.shutdown(Shutdown::Both);
        }
        let waiting: Vec<RequestId> = self.waits.keys().copied().collect();
        for id in waiting {
            self.end_wait(id, Err(AnswerError::Ended(reason)), woken);
        }
        for queue in self.queues.drain(..).filter_map(|queue| queue.upgrade()) {
            queue.end(reason);
        }
        woken.append(&mut self.watchers);
    }

    /// Tells everybody what a message means to them.
    fn deliver(&mut self, message: &OwnedMessage, ends: Ends, woken: &mut Vec<Waker>) {
        if let Some((id, outcome)) = ends.request {
            match outcome {
                Outcome::Answered => self.end_wait(id, Ok(Reply::Message(message.clone())), woken),
                Outcome::Discarded => self.end_wait(id, Err(AnswerError::Discarded), woken),
                Outcome::Refused(code) => {
                    let text = message.body.clone();
                    self.end_wait(id, Err(AnswerError::Refused { code, text }), woken);
                }
            }
        }
        if let Some(before) = ends.accepts_before {
            let accepted = self.waits.iter().filter(|(id, wait)| {
                **id < before && wait.takes_acceptance && wait.result.is_none()
            });
            let accepted: Vec<RequestId> = accepted.map(|(id, _)| *id).collect();
            for id in accepted {
                self.end_wait(id, Ok(Reply::Accepted), woken);
            }
        }
        self.queues.retain(|queue| match queue.upgrade() {
            Some(queue) => {
                queue.push(message.clone());
                true
            }
            None => false,
        });
        woken.append(&mut self.watchers);
    }
}

/// What a message ends.
#[derive(Clone, Copy, Debug)]
struct Ends {
    request: Option<(RequestId, Outcome)>,
    accepts_before: Option<RequestId>,
}

impl Connection {
    /// Connects and starts the thread; the robot has not greeted yet.
    pub(super) fn open(
        address: SocketAddr,
        settings: ClientSettings,
        limit: Duration,
        role: Role<'_>,
    ) -> Result<Self, ConnectError> {
        let failed = |cause| ConnectError::Socket { address, cause };
        let stream = TcpStream::connect_timeout(&address, limit).map_err(failed)?;
        stream.set_nodelay(true).map_err(failed)?;
        stream.set_nonblocking(true).map_err(failed)?;
        let reading = stream.try_clone().map_err(failed)?;
        let clock = MonotonicClock::new();
        let mut session = Session::new(settings);
        session.connected(clock.now());
        let inner = Inner {
            session,
            stream: Some(stream),
            ended: None,
            waits: HashMap::new(),
            watchers: Vec::new(),
            queues: match role {
                Role::Control(queue) => queue.map(Arc::downgrade).into_iter().collect(),
                Role::Monitoring(queue) => vec![Arc::downgrade(queue)],
            },
        };
        let controls = matches!(role, Role::Control(_));
        let (inner, changed) = (Mutex::new(inner), Condvar::new());
        let shared = Arc::new(Shared { inner, changed, clock, controls });
        let with_thread = Arc::clone(&shared);
        let thread = thread::Builder::new()
            .name("robot text".into())
            .spawn(move || read_until_end(&with_thread, reading))
            .map_err(failed)?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// Waits until the robot has greeted, or refused.
    pub(super) fn wait_for_greeting(
        &self,
        address: SocketAddr,
        limit: Duration,
    ) -> Result<(), ConnectError> {
        let greeted =
            self.shared.wait_for(limit, |inner| match (inner.session.phase(), inner.ended) {
                (Phase::Ready, _) => Some(Ok(())),
                (Phase::Refused(code), _) => Some(Err(ConnectError::Refused(code))),
                (_, Some(reason)) => Some(Err(ConnectError::Ended(reason))),
                _ => None,
            });
        greeted.unwrap_or(Err(ConnectError::NoGreeting { address }))
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        self.shared.finish(EndReason::Closed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl Shared {
    pub(super) fn finish(&self, reason: EndReason) {
        let mut woken = Vec::new();
        self.lock().end(reason, &mut woken);
        self.wake(woken);
    }

    fn wake(&self, woken: Vec<Waker>) {
        self.changed.notify_all();
        woken.into_iter().for_each(Waker::wake);
    }

    /// What is to be done between two reads: bytes to send, the watchdog, silence. How long the thread
    /// may sleep and whether bytes wait; `None` when the connection has ended.
    fn care(&self) -> Option<(Duration, bool)> {
        let now = self.clock.now();
        let mut inner = self.lock();
        if inner.ended.is_some() {
            return None;
        }
        let next = if self.controls { inner.session.advance(now) } else { None };
        let next = next.unwrap_or(now + IDLE);
        inner.flush();
        let is_silent = inner.session.is_silent(now);
        let has_more = !inner.session.waiting().is_empty();
        drop(inner);
        if is_silent {
            self.finish(EndReason::Silent);
            return None;
        }
        Some((next.saturating_duration_since(now).min(IDLE), has_more))
    }

    fn take_in(&self, now: Instant, mut bytes: &[u8]) {
        let mut woken = Vec::new();
        let mut inner = self.lock();
        while let Some(incoming) = inner.session.receive(now, &mut bytes) {
            // Lines that are no messages are of no use to anybody.
            let Incoming::Message(Received { message, ends, accepts_before }) = incoming else {
                continue;
            };
            let message = OwnedMessage::from(message);
            inner.deliver(&message, Ends { request: ends, accepts_before }, &mut woken);
        }
        drop(inner);
        self.wake(woken);
    }
}

/// What the thread does.
fn read_until_end(shared: &Shared, mut stream: TcpStream) {
    let mut room = vec![0; ROOM];
    while let Some((sleep, has_more)) = shared.care() {
        let flags = if has_more { PollFlags::IN | PollFlags::OUT } else { PollFlags::IN };
        let sleep = sleep.max(Duration::from_micros(100));
        let timeout =
            Timespec::try_from(sleep).unwrap_or(Timespec { tv_sec: 0, tv_nsec: 1_000_000 });
        // An error shows when reading.
        let _ = poll(&mut [PollFd::new(&stream, flags)], Some(&timeout));
        match stream.read(&mut room) {
            Ok(0) => shared.finish(EndReason::ByRobot),
            Ok(count) => shared.take_in(shared.clock.now(), &room[..count]),
            Err(error) if error.kind() == ErrorKind::WouldBlock => {}
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => shared.finish(EndReason::Broken(error.kind())),
        }
    }
}
