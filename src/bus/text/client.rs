//! The PC's end of a connection: commands out, messages in, and who waits for which.
//!
//! Read [`ClientSession::submit`] and [`ClientSession::receive`] first. The protocol has no numbers that
//! tie an answer to its command; it is found by its code:
//!
//! * An answer belongs to the oldest request that has its code among
//!   [`answers`](TextCommandSpec::answers); \[2097\] to the SyncCmdQueue with its number.
//! * An error that quotes a command belongs to the oldest request with that name, any other error to
//!   the oldest that may fail with it: one whose chapter names the error or asks for a state, or one
//!   that has no answer, as motion commands. Where none fits it is news, not an answer.
//! * A checkpoint that is reached or discarded is the oldest with its number.
//! * A command without an answer is accepted when a later SyncCmdQueue is answered, or a later checkpoint
//!   reached, and no error came before: the robot reads its lines in order.
//!
//! The rules are choices made from the manual's tables; what a robot does not say cannot be known better.
//! A copy of the monitoring port on the control port (SetCtrlPortMonitoring) may answer a request for the
//! same message early; its values are as new.
//!
//! Keeping the connection: [`ClientSettings`] has the connection watchdog, which is fed three times per
//! period, and the limit of silence, at a quarter of which the robot is asked for its state.

use core::fmt::Write;

use super::lines::{Line, LineSplitter};
use super::outbox::Outbox;
use super::state::RobotState;
use super::{MAX_COMMAND, MAX_MESSAGE};
use crate::time::{Duration, Instant};
use crate::wire::meca500::code::{Code, CodeKind};
use crate::wire::meca500::text::{AllowedState, Message, RobotNumber, TextCommandSpec};

/// Number of a request, in the order of submission.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RequestId(pub u64);

/// How a connection is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClientSettings {
    /// Time after which the robot shall stop when this end is gone; from 1 ms. `None`: the robot's own
    /// supervision only. Source: PM L3158.
    pub watchdog: Option<Duration>,
    /// Silence after which the robot counts as gone. `None`: never.
    ///
    /// Source: choice for 10 s, which is what the vendor's client takes.
    pub silence_limit: Option<Duration>,
}

impl Default for ClientSettings {
    fn default() -> Self {
        Self { watchdog: None, silence_limit: Some(Duration::from_secs(10)) }
    }
}

/// Why a command was not submitted. Nothing is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SubmitError {
    /// The robot has not said \[3000\] yet, or refused the connection.
    #[error("the robot has not granted the control yet")]
    NotConnected,
    /// Nothing but blanks.
    #[error("the command is empty")]
    Empty,
    /// It has a character that no command may have.
    #[error("the command has a character that is not printable ASCII, at byte {offset}")]
    NotAscii {
        /// Its place.
        offset: usize,
    },
    /// It is too long.
    #[error("the command has {len} characters, at most {MAX_COMMAND} can be sent")]
    TooLong {
        /// Its length.
        len: usize,
    },
    /// As many requests wait for their answers as there is room for.
    #[error("too many commands wait for their answers; wait for one of them first")]
    Busy,
    /// The network does not take what waits to be sent.
    #[error("the robot does not read: what waits to be sent has no room for another command")]
    OutboxFull,
}

/// How a request ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Outcome {
    /// The message is its answer.
    Answered,
    /// The checkpoint will never be reached.
    Discarded,
    /// The message is an error, and most likely its own.
    Refused(Code),
}

/// One message, and what it means to this end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Received<'a> {
    /// The message.
    pub message: Message<'a>,
    /// The request that it ends.
    pub ends: Option<(RequestId, Outcome)>,
    /// Requests without an answer that were submitted before this one are accepted, as far as they have
    /// not ended yet.
    pub accepts_before: Option<RequestId>,
}

/// What came in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Incoming<'a> {
    /// A message.
    Message(Received<'a>),
    /// A line that is no message; the connection goes on. Its text, as far as it is one.
    Unreadable(&'a str),
}

/// Where a connection stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Phase {
    /// No connection.
    #[default]
    Closed,
    /// Connected, \[3000\] has not come.
    Greeting,
    /// Commands may be sent.
    Ready,
    /// The robot refused: \[3001\] or \[3002\].
    Refused(Code),
}

/// What ends a request well.
#[derive(Clone, Copy, Debug)]
enum Expects {
    /// Nothing of its own.
    Nothing,
    /// A message with one of these codes.
    Codes(&'static [Code]),
    /// The answer to SyncCmdQueue with this number.
    Sync(u32),
    /// The end of the checkpoint with this number.
    Checkpoint(u16),
}

#[derive(Clone, Copy, Debug)]
struct Request {
    id: RequestId,
    name: Option<&'static str>,
    expects: Expects,
}

/// Errors that may be about a queued command, when it is read or when it is executed. Source: PM Table 1.
const fn is_of_motion(code: Code) -> bool {
    matches!(code.0, 1000 | 1005..=1012 | 1016 | 1023 | 1031 | 1033 | 1038 | 1040..=1041 | 3051)
}

impl Request {
    fn of(id: RequestId, line: &str, answers: &'static [Code]) -> Self {
        let (name, argument) = command_of(line);
        let name = TextCommandSpec::by_name(name).map(|spec| spec.name);
        let number = || argument.parse::<u32>().ok();
        let checkpoint = || number().and_then(|number| u16::try_from(number).ok());
        let expects = match name {
            Some("SyncCmdQueue") => number().map(Expects::Sync),
            Some("SetCheckpoint") => checkpoint().map(Expects::Checkpoint),
            _ => None,
        };
        let by_code = if answers.is_empty() { Expects::Nothing } else { Expects::Codes(answers) };
        Self { id, name, expects: expects.unwrap_or(by_code) }
    }

    fn is_silent(&self) -> bool {
        matches!(self.expects, Expects::Nothing)
    }

    fn may_fail_with(&self, code: Code) -> bool {
        if code == Code::IN_ERROR || code == Code::COMMAND_FAILED {
            return true;
        }
        if matches!(self.expects, Expects::Nothing | Expects::Checkpoint(_)) {
            return is_of_motion(code);
        }
        let Some(spec) = self.name.and_then(TextCommandSpec::by_name) else { return false };
        let is_of_the_state = matches!(
            code,
            Code::NOT_ACTIVATED
                | Code::NOT_HOMED
                | Code::DEACTIVATION_NEEDED
                | Code::SIM_NEEDS_DEACTIVATION
        );
        let minds_the_state = spec.allowed_state() != AllowedState::Any;
        (is_of_the_state && minds_the_state) || spec.errors().any(|error| error == code)
    }

    /// How a message ends it, if it does.
    fn outcome(&self, message: &Message<'_>, news: &News<'_>) -> Option<Outcome> {
        let code = message.code;
        let has_number = |number: i64| news.number == Some(number);
        let is_answer = match self.expects {
            Expects::Nothing => false,
            Expects::Codes(codes) => codes.contains(&code),
            Expects::Sync(number) => code == Code(2097) && has_number(number.into()),
            Expects::Checkpoint(number) => match code {
                Code::CHECKPOINT_DISCARDED if has_number(number.into()) => {
                    return Some(Outcome::Discarded);
                }
                code => code == Code::CHECKPOINT_REACHED && has_number(number.into()),
            },
        };
        if is_answer {
            return Some(Outcome::Answered);
        }
        let is_its_own = news.is_error
            && match news.quoted {
                Some(name) => match self.name {
                    Some(own) => own == name,
                    None => TextCommandSpec::by_name(name).is_none(),
                },
                None => self.may_fail_with(code),
            };
        is_its_own.then_some(Outcome::Refused(code))
    }
}

/// What of a message is looked at again for each request.
struct News<'a> {
    is_error: bool,
    /// The command that it quotes.
    quoted: Option<&'a str>,
    /// Its first value.
    number: Option<i64>,
}

/// The PC's end of a control connection: at most `PENDING` requests wait, `OUT` bytes wait to be sent.
#[derive(Debug)]
pub struct ClientSession<const PENDING: usize, const OUT: usize> {
    settings: ClientSettings,
    phase: Phase,
    splitter: LineSplitter<MAX_MESSAGE>,
    outbox: Outbox<OUT>,
    /// Those that wait, oldest first, without gaps.
    pending: [Option<Request>; PENDING],
    last_id: u64,
    last_sync: u32,
    state: RobotState,
    heard_at: Instant,
    fed_at: Instant,
    asked_at: Instant,
}

/// The command of a line and what stands in its parentheses.
fn command_of(line: &str) -> (&str, &str) {
    let line = line.trim();
    let line = line.strip_prefix('-').unwrap_or(line).trim_start();
    let (name, rest) = line.split_once('(').unwrap_or((line, ""));
    (name.trim_end(), rest.strip_suffix(')').unwrap_or(rest).trim())
}

impl<const PENDING: usize, const OUT: usize> ClientSession<PENDING, OUT> {
    /// A session without a connection.
    #[must_use]
    pub fn new(settings: ClientSettings) -> Self {
        Self {
            settings,
            phase: Phase::Closed,
            splitter: LineSplitter::new(),
            outbox: Outbox::new(),
            pending: [None; PENDING],
            last_id: 0,
            last_sync: 0,
            state: RobotState::default(),
            heard_at: Instant::ZERO,
            fed_at: Instant::ZERO,
            asked_at: Instant::ZERO,
        }
    }

    /// A connection is up. Everything of an earlier one is forgotten but the numbers of requests, which
    /// go on.
    pub fn connected(&mut self, now: Instant) {
        self.phase = Phase::Greeting;
        self.splitter.restart();
        self.outbox.clear();
        self.pending = [None; PENDING];
        self.state = RobotState::default();
        (self.heard_at, self.fed_at, self.asked_at) = (now, now, now);
    }

    /// The connection is gone. Who waited waits in vain. A refusal stays known until the next connection.
    pub fn disconnected(&mut self) {
        if !matches!(self.phase, Phase::Refused(_)) {
            self.phase = Phase::Closed;
        }
        self.outbox.clear();
        self.pending = [None; PENDING];
    }

    /// How the connection is kept now.
    #[must_use]
    pub const fn settings(&self) -> ClientSettings {
        self.settings
    }

    /// Feeds the connection watchdog now and with this period from now on, or not any more; the robot's own
    /// is not cancelled by that.
    pub fn set_watchdog(&mut self, now: Instant, period: Option<Duration>) {
        self.settings.watchdog = period;
        self.fed_at = now;
        if self.phase == Phase::Ready {
            Self::feed(&mut self.outbox, period);
        }
    }

    /// Where the connection stands.
    #[must_use]
    pub const fn phase(&self) -> Phase {
        self.phase
    }

    /// The newest of what the robot told.
    #[must_use]
    pub const fn state(&self) -> &RobotState {
        &self.state
    }

    /// Sends a command of the table, or any other line: what the table does not know has no answer.
    ///
    /// The arguments are not looked at; the robot answers a mistake with 1001 to 1003.
    /// [`parse_command`](crate::wire::meca500::text::parse_command) finds it before.
    ///
    /// # Errors
    ///
    /// [`SubmitError`]; nothing is sent.
    pub fn submit(&mut self, line: &str) -> Result<RequestId, SubmitError> {
        let (name, _) = command_of(line);
        let answers = TextCommandSpec::by_name(name).map_or(&[] as &[Code], |spec| spec.answers());
        self.submit_expecting(line, answers)
    }

    /// Sends a line whose answer has one of these codes, whatever the table says of it: for commands that
    /// the manual does not have, as GetFwVersionFull.
    ///
    /// # Errors
    ///
    /// [`SubmitError`]; nothing is sent.
    pub fn submit_expecting(
        &mut self,
        line: &str,
        answers: &'static [Code],
    ) -> Result<RequestId, SubmitError> {
        self.check(line)?;
        self.make_place()?;
        self.send(line)?;
        self.last_id += 1;
        let id = RequestId(self.last_id);
        if let Some(slot) = self.pending.iter_mut().find(|slot| slot.is_none()) {
            *slot = Some(Request::of(id, line, answers));
        }
        Ok(id)
    }

    /// Sends SyncCmdQueue with a number of its own: its answer says that the robot has read everything
    /// before it.
    ///
    /// # Errors
    ///
    /// [`SubmitError`]; nothing is sent.
    pub fn submit_sync(&mut self) -> Result<RequestId, SubmitError> {
        self.last_sync = self.last_sync.wrapping_add(1);
        let mut line = Outbox::<32>::new();
        let _ = write!(line, "SyncCmdQueue({})", self.last_sync);
        let _ = line.finish();
        let line = core::str::from_utf8(line.waiting()).unwrap_or("");
        self.submit(line.trim_end_matches('\0'))
    }

    fn check(&self, line: &str) -> Result<(), SubmitError> {
        if self.phase != Phase::Ready {
            return Err(SubmitError::NotConnected);
        }
        if line.trim().is_empty() {
            return Err(SubmitError::Empty);
        }
        if line.len() > MAX_COMMAND {
            return Err(SubmitError::TooLong { len: line.len() });
        }
        let is_foreign = |byte: u8| !matches!(byte, b' '..=b'~' | b'\t');
        match line.bytes().position(is_foreign) {
            Some(offset) => Err(SubmitError::NotAscii { offset }),
            None => Ok(()),
        }
    }

    /// Makes room for one more request: the oldest that has no answer is given up, since nobody can
    /// wait for what does not come.
    fn make_place(&mut self) -> Result<(), SubmitError> {
        if self.pending.iter().any(Option::is_none) {
            return Ok(());
        }
        let silent = |request: &Option<Request>| request.is_some_and(|r| r.is_silent());
        let oldest = self.pending.iter().position(silent).ok_or(SubmitError::Busy)?;
        Self::take(&mut self.pending, oldest);
        Ok(())
    }

    fn send(&mut self, line: &str) -> Result<(), SubmitError> {
        let _ = self.outbox.write_str(line);
        self.outbox.finish().map_err(|_| SubmitError::OutboxFull)
    }

    /// Removes a request; those behind it move up.
    fn take(pending: &mut [Option<Request>; PENDING], place: usize) -> Option<Request> {
        let taken = pending.get_mut(place)?.take();
        pending.get_mut(place..)?.rotate_left(1);
        taken
    }

    /// What waits to be sent.
    #[must_use]
    pub fn waiting(&self) -> &[u8] {
        self.outbox.waiting()
    }

    /// The first `count` bytes of [`waiting`](Self::waiting) are sent.
    pub fn sent(&mut self, count: usize) {
        self.outbox.sent(count);
    }

    /// Takes bytes that arrived from the front of `bytes` up to the end of a message; `None` when all are
    /// taken and no message has ended. To be called until then.
    pub fn receive<'a>(&'a mut self, now: Instant, bytes: &mut &[u8]) -> Option<Incoming<'a>> {
        if bytes.is_empty() {
            return None;
        }
        self.heard_at = now;
        let text = match self.splitter.next_line(bytes)? {
            Line::Text(text) => text,
            Line::NotAscii => return Some(Incoming::Unreadable("(not ASCII)")),
            Line::TooLong => return Some(Incoming::Unreadable("(too long)")),
        };
        let Ok(message) = Message::parse(text) else {
            return Some(Incoming::Unreadable(text));
        };
        self.state.take_in(&message);
        match (self.phase, message.code) {
            (Phase::Greeting, Code::CONNECTED) => {
                self.phase = Phase::Ready;
                (self.fed_at, self.asked_at) = (now, now);
                let period = self.settings.watchdog;
                Self::feed(&mut self.outbox, period);
            }
            (Phase::Greeting, code @ (Code::ANOTHER_USER | Code::FIRMWARE_UPGRADE)) => {
                self.phase = Phase::Refused(code);
            }
            _ => {}
        }
        let (ends, accepts_before) = Self::settle(&mut self.pending, &message);
        Some(Incoming::Message(Received { message, ends, accepts_before }))
    }

    /// Finds the request that a message ends and removes it, with those that it accepts.
    fn settle(
        pending: &mut [Option<Request>; PENDING],
        message: &Message<'_>,
    ) -> (Option<(RequestId, Outcome)>, Option<RequestId>) {
        let news = News {
            is_error: message.code.describe().is_some_and(|info| info.kind == CodeKind::Error),
            quoted: message.quoted_command().map(|command| command_of(command).0),
            number: message.values().next().and_then(|value| value.integer()),
        };
        let outcome_of = |(place, request): (usize, &Option<Request>)| {
            Some((place, request.as_ref()?.outcome(message, &news)?))
        };
        let found = pending.iter().enumerate().find_map(outcome_of);
        let ended = found.and_then(|(place, outcome)| Some((Self::take(pending, place)?, outcome)));
        let Some((request, outcome)) = ended else { return (None, None) };
        let proves = matches!(request.expects, Expects::Sync(_) | Expects::Checkpoint(_))
            && !matches!(outcome, Outcome::Refused(_));
        let accepts = proves.then_some(request.id);
        if proves {
            Self::forget_silent_before(pending, request.id);
        }
        (Some((request.id, outcome)), accepts)
    }

    fn forget_silent_before(pending: &mut [Option<Request>; PENDING], id: RequestId) {
        let mut kept = [None; PENDING];
        let stays = |request: &&Request| !(request.is_silent() && request.id < id);
        let requests = pending.iter().flatten().filter(stays);
        for (slot, request) in kept.iter_mut().zip(requests) {
            *slot = Some(*request);
        }
        *pending = kept;
    }

    fn feed(outbox: &mut Outbox<OUT>, watchdog: Option<Duration>) {
        if let Some(period) = watchdog {
            let seconds = RobotNumber(period.as_secs_f64());
            let _ = write!(outbox, "-ConnectionWatchdog({seconds})");
            // Without room the network does not take anything, and the watchdog is right to bark.
            let _ = outbox.finish();
        }
    }

    /// Feeds the watchdog and asks a silent robot for its state when it is time to; both leave as bytes to
    /// be sent. Returns when it wants to be called next at the latest, `None` while there is no
    /// connection.
    pub fn advance(&mut self, now: Instant) -> Option<Instant> {
        if self.phase != Phase::Ready {
            return None;
        }
        let mut next = now + Duration::from_secs(1);
        if let Some(period) = self.settings.watchdog {
            if now.saturating_duration_since(self.fed_at) >= period / 3 {
                Self::feed(&mut self.outbox, Some(period));
                self.fed_at = now;
            }
            next = next.min(self.fed_at + period / 3);
        }
        if let Some(limit) = self.settings.silence_limit {
            let quiet_since = self.heard_at.max(self.asked_at);
            if now.saturating_duration_since(quiet_since) >= limit / 4 {
                let _ = self.send("-GetStatusRobot");
                self.asked_at = now;
            }
            next = next.min(self.heard_at.max(self.asked_at) + limit / 4);
        }
        Some(next)
    }

    /// Whether the robot has been silent for longer than the limit.
    #[must_use]
    pub fn is_silent(&self, now: Instant) -> bool {
        let is_connected = matches!(self.phase, Phase::Greeting | Phase::Ready);
        let silence = now.saturating_duration_since(self.heard_at);
        is_connected && self.settings.silence_limit.is_some_and(|limit| silence > limit)
    }

    /// Requests that wait for their answers, oldest first; those without an answer too.
    pub fn pending(&self) -> impl Iterator<Item = RequestId> {
        self.pending.iter().flatten().map(|request| request.id)
    }
}
