//! A connection to the control port.

use core::future::Future;
use core::pin::Pin;
use core::task::{Context, Poll, Waker};
use std::format;
use std::net::SocketAddr;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use super::answer::{Answer, Checkpoint, Reply};
use super::connection::{Connection, Role, Session, Shared};
use super::error::{AnswerError, ConnectError, EndReason};
use super::message::{Messages, Queue};
use crate::bus::text::RobotState;
use crate::bus::text::client::ClientSettings;
use crate::time::Duration;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::command::MotionCommand;
use crate::wire::meca500::text::{CommandText, TextCommandSpec};

/// How to connect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClientOptions {
    /// Watchdog and limit of silence.
    pub settings: ClientSettings,
    /// Longest time for the connection, and again for the robot's greeting.
    pub limit: Duration,
}

impl Default for ClientOptions {
    fn default() -> Self {
        Self { settings: ClientSettings::default(), limit: Duration::from_secs(10) }
    }
}

/// One who controls the robot. Dropping it closes the connection; a robot that moves then stops.
///
/// Every wait has two forms: with a limit, for threads, and as a future, for async code of any runtime. A
/// thread of its own reads and keeps the connection.
#[derive(Debug)]
pub struct Client {
    connection: Connection,
    address: SocketAddr,
    options: ClientOptions,
}

impl Client {
    /// Connects to a control port and waits for the robot's greeting.
    ///
    /// # Errors
    ///
    /// [`ConnectError`]; `Refused` while somebody else controls the robot.
    pub fn connect(address: SocketAddr, options: ClientOptions) -> Result<Self, ConnectError> {
        let connection = Self::open(address, options, None)?;
        Ok(Self { connection, address, options })
    }

    /// The same, with all messages from the first on, which is the robot's greeting.
    ///
    /// # Errors
    ///
    /// As [`connect`](Self::connect).
    pub fn connect_listening(
        address: SocketAddr,
        options: ClientOptions,
    ) -> Result<(Self, Messages), ConnectError> {
        let queue = Arc::new(Queue::default());
        let connection = Self::open(address, options, Some(&queue))?;
        Ok((Self { connection, address, options }, Messages { queue }))
    }

    /// The same as [`connect`](Self::connect), for async code of any runtime; a thread waits meanwhile.
    pub fn connecting(address: SocketAddr, options: ClientOptions) -> Connecting {
        let place = Arc::new(Mutex::new(Place::default()));
        let with_thread = Arc::clone(&place);
        let connect = move || {
            let result = Self::connect(address, options);
            let waker = {
                let mut place = with_thread.lock().unwrap_or_else(PoisonError::into_inner);
                place.result = Some(result);
                place.waker.take()
            };
            if let Some(waker) = waker {
                waker.wake();
            }
        };
        let thread = thread::Builder::new().name("robot text connects".into()).spawn(connect);
        if let Err(cause) = thread {
            let mut place = place.lock().unwrap_or_else(PoisonError::into_inner);
            place.result = Some(Err(ConnectError::Socket { address, cause }));
        }
        Connecting { place }
    }

    fn open(
        address: SocketAddr,
        options: ClientOptions,
        listener: Option<&Arc<Queue>>,
    ) -> Result<Connection, ConnectError> {
        let role = Role::Control(listener);
        let connection = Connection::open(address, options.settings, options.limit, role)?;
        connection.wait_for_greeting(address, options.limit)?;
        Ok(connection)
    }

    /// Connects again, after the connection ended or instead of it. Who still waits for answers is told
    /// that the old connection ended, and streams of messages end with it. The robot stays paused after a
    /// lost connection until ResumeMotion (PM L908), which is not sent here: somebody should look first.
    ///
    /// # Errors
    ///
    /// [`ConnectError`]; it may be tried again.
    pub fn reconnect(&mut self) -> Result<(), ConnectError> {
        // As it is kept now, which is not always how it began.
        let settings = self.shared().lock().session.settings();
        self.options.settings = settings;
        self.connection.shared.finish(EndReason::Closed);
        self.connection = Self::open(self.address, self.options, None)?;
        Ok(())
    }

    pub(super) fn shared(&self) -> &Arc<Shared> {
        &self.connection.shared
    }

    /// Sends a command, as the robot reads it: `SetBlending(50)`. Of a command that has no answer, as motion
    /// commands, [`Answer`] only ends with an error or with the acceptance of a later
    /// [`sync`](Self::sync); [`request`](Self::request) does both at once.
    ///
    /// # Errors
    ///
    /// [`AnswerError::Submit`] or [`AnswerError::Ended`].
    pub fn send(&self, command: &str) -> Result<Answer, AnswerError> {
        let is_silent = has_no_answer(command);
        let id = self.shared().submit(is_silent, |session| session.submit(command))?;
        Ok(Answer::new(Arc::clone(self.shared()), id))
    }

    /// Sends a line that no table knows, whose answer has one of these codes.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send).
    pub fn send_expecting(
        &self,
        line: &str,
        answers: &'static [Code],
    ) -> Result<Answer, AnswerError> {
        let submit = |session: &mut Session| session.submit_expecting(line, answers);
        let id = self.shared().submit(answers.is_empty(), submit)?;
        Ok(Answer::new(Arc::clone(self.shared()), id))
    }

    /// Sends a motion command.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send), and [`AnswerError::NoText`].
    pub fn send_motion(&self, command: &MotionCommand) -> Result<Answer, AnswerError> {
        let text = CommandText::of(command).ok_or(AnswerError::NoText { id: command.id() })?;
        self.send(&format!("{text}"))
    }

    /// Asks the robot to answer when it has read everything that was sent before (SyncCmdQueue).
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send).
    pub fn sync(&self) -> Result<Answer, AnswerError> {
        let submit = Session::submit_sync;
        let id = self.shared().submit(false, submit)?;
        Ok(Answer::new(Arc::clone(self.shared()), id))
    }

    /// Sends a command and waits for its answer, or, where it has none, until the robot has taken it:
    /// queued, not executed.
    ///
    /// # Errors
    ///
    /// [`AnswerError`].
    pub fn request(&self, command: &str, limit: Duration) -> Result<Reply, AnswerError> {
        let mut answer = self.send(command)?;
        if has_no_answer(command) {
            // Its answer, if it comes, ends the command's own wait too.
            let _sync = self.sync()?;
            return answer.wait(limit);
        }
        answer.wait(limit)
    }

    /// Sets a checkpoint behind everything sent so far. The robot takes numbers from 1 to 8000.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send); a number out of range is refused by the robot.
    pub fn checkpoint(&self, number: u16) -> Result<Checkpoint, AnswerError> {
        let line = format!("SetCheckpoint({number})");
        let id = self.shared().submit(false, |session| session.submit(&line))?;
        Ok(Checkpoint { answer: Answer::new(Arc::clone(self.shared()), id), number })
    }

    /// The newest of what the robot told. Without SetCtrlPortMonitoring(1) that is little.
    #[must_use]
    pub fn state(&self) -> RobotState {
        *self.shared().lock().session.state()
    }

    /// Waits until the robot's state is as wanted, as its messages tell it.
    ///
    /// # Errors
    ///
    /// [`AnswerError::TimedOut`] or [`AnswerError::Ended`].
    pub fn wait_until(
        &self,
        limit: Duration,
        is_reached: impl Fn(&RobotState) -> bool,
    ) -> Result<RobotState, AnswerError> {
        let reached = self.shared().wait_for(limit, |inner| match inner.ended {
            _ if is_reached(inner.session.state()) => Some(Ok(*inner.session.state())),
            Some(reason) => Some(Err(AnswerError::Ended(reason))),
            None => None,
        });
        reached.unwrap_or(Err(AnswerError::TimedOut))
    }

    /// The same, for async code of any runtime.
    pub fn until<F: Fn(&RobotState) -> bool + Unpin>(&self, is_reached: F) -> StateReached<'_, F> {
        StateReached { client: self, is_reached }
    }

    /// All messages from now on: answers and news.
    #[must_use]
    pub fn messages(&self) -> Messages {
        let queue = Arc::new(Queue::default());
        self.shared().lock().subscribe(&queue);
        Messages { queue }
    }

    /// Why the connection ended, if it did.
    #[must_use]
    pub fn ended(&self) -> Option<EndReason> {
        self.shared().lock().ended
    }
}

/// Where the thread that connects leaves what came of it.
#[derive(Debug, Default)]
struct Place {
    result: Option<Result<Client, ConnectError>>,
    waker: Option<Waker>,
}

/// A connection that comes up; see [`Client::connecting`]. When it is dropped, the connection is closed
/// as soon as it is there.
#[must_use = "a future does nothing until it is awaited"]
#[derive(Debug)]
pub struct Connecting {
    place: Arc<Mutex<Place>>,
}

impl Future for Connecting {
    type Output = Result<Client, ConnectError>;

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        let mut place = self.place.lock().unwrap_or_else(PoisonError::into_inner);
        match place.result.take() {
            Some(result) => Poll::Ready(result),
            None => {
                place.waker = Some(context.waker().clone());
                Poll::Pending
            }
        }
    }
}

/// Whether the robot does not answer a command that it likes.
fn has_no_answer(command: &str) -> bool {
    let name = command.trim().trim_start_matches('-').trim_start();
    let end = name.find(|letter: char| letter != '_' && !letter.is_ascii_alphanumeric());
    let name = name.split_at(end.unwrap_or(name.len())).0;
    TextCommandSpec::by_name(name).is_none_or(|spec| spec.answers().is_empty())
}

/// Waits until the robot's state is as wanted.
#[must_use = "a future does nothing until it is awaited"]
#[derive(Debug)]
pub struct StateReached<'a, F> {
    client: &'a Client,
    is_reached: F,
}

impl<F: Fn(&RobotState) -> bool + Unpin> Future for StateReached<'_, F> {
    type Output = Result<RobotState, AnswerError>;

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        let mut inner = self.client.shared().lock();
        if (self.is_reached)(inner.session.state()) {
            return Poll::Ready(Ok(*inner.session.state()));
        }
        if let Some(reason) = inner.ended {
            return Poll::Ready(Err(AnswerError::Ended(reason)));
        }
        inner.watch(context.waker());
        Poll::Pending
    }
}
