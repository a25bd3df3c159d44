//! One target: its connection from the first attempt to the Forward Close, and back again.
//!
//! [`Io`] says how far the I/O connection is, [`Session`] how far the TCP connection below it is. The two are
//! apart on purpose: frames go on while a stream is lost, and a stream is kept while the I/O is refused, for
//! explicit requests. What is to be sent next on the stream is decided in [`Target::next_step`] alone.

use core::net::{Ipv4Addr, SocketAddrV4};

use super::answers::{self, Agreed};
use super::consuming::{Arrival, Consumer, Silence};
use super::events::EventQueue;
use super::explicit::{Explicit, Stage};
use super::groups::Membership;
use super::ids::Ids;
use super::producing::Producer;
use super::requests::{self, Envelope};
use super::session::{Inbox, PACKET_LEN, Pending, Session, Stream};
use super::{
    ConfigPath, ConnectionKind, ConnectionSettings, Mistake, Originator, RequestError,
    ScannerEvent, Step, TargetCounters, TargetStatus, Transmit, Trouble,
};
use crate::cycle::InputQuality;
use crate::time::{Duration, Instant};
use crate::wire::enip::NoRoom;
use crate::wire::enip::connection::Triad;
use crate::wire::enip::encapsulation::Packet;
use crate::wire::enip::identity::Identity;
use crate::wire::enip::io::IoFrame;
use crate::wire::enip::message::{Response, Service};
use crate::wire::enip::path::ObjectPath;
use crate::wire::enip::status::{ExtendedStatus, GeneralStatus};

/// How far the I/O connection is.
#[derive(Clone, Copy, Debug)]
enum Io {
    /// Not open, and not to be opened by itself.
    Idle,
    /// To be opened then.
    Waiting { until: Instant },
    /// Being opened.
    Opening,
    /// Open.
    Open(Open),
}

/// An open connection.
#[derive(Clone, Copy, Debug)]
struct Open {
    triad: Triad,
    config: ConfigPath,
    agreed: Agreed,
}

/// A connection that the target may still have and that is to be closed.
#[derive(Clone, Copy, Debug)]
struct Farewell {
    triad: Triad,
    config: ConfigPath,
    /// How often it is tried before the target's own watchdog must do.
    tries_left: u8,
}

/// Once on the stream that there is, once on a new one.
const FAREWELL_TRIES: u8 = 2;

/// Pauses that double.
#[derive(Clone, Copy, Debug, Default)]
struct Backoff {
    failures: u32,
}

impl Backoff {
    fn next(&mut self, settings: &ConnectionSettings) -> Duration {
        let factor = 1_u32.checked_shl(self.failures).unwrap_or(u32::MAX);
        self.failures = self.failures.saturating_add(1);
        settings.first_retry.saturating_mul(factor).min(settings.longest_retry)
    }
}

/// One target of a scanner. Holds its images and buffers; about 4 kB.
#[derive(Debug)]
pub struct Target {
    index: usize,
    address: SocketAddrV4,
    settings: ConnectionSettings,
    io: Io,
    session: Session,
    producer: Producer,
    consumer: Consumer,
    counters: TargetCounters,
    membership: Membership,
    /// What the caller wants: open, or closed.
    is_wanted: bool,
    /// The caller waits for the end.
    is_closing: bool,
    farewell: Option<Farewell>,
    /// The configuration path of the next attempt: of two, the one that was accepted last.
    config: ConfigPath,
    has_tried_other_config: bool,
    backoff: Backoff,
    stream_backoff: Backoff,
    identity: Option<Identity>,
    explicit: Explicit,
    events: EventQueue,
    inbox: Inbox,
}

impl Target {
    /// A target at `address` (usually port 44818) with which a connection like `settings` is to be held.
    ///
    /// # Errors
    ///
    /// [`Mistake`] if no connection can have these settings.
    pub fn new(address: SocketAddrV4, settings: ConnectionSettings) -> Result<Self, Mistake> {
        settings.check()?;
        let has_header = settings.kind == ConnectionKind::ExclusiveOwner;
        Ok(Self {
            index: 0,
            address,
            settings,
            io: Io::Idle,
            session: Session::new(),
            producer: Producer::new(settings.o2t_len, has_header),
            consumer: Consumer::new(settings.t2o_len),
            counters: TargetCounters::default(),
            membership: Membership::default(),
            is_wanted: true,
            is_closing: false,
            farewell: None,
            config: settings.config,
            has_tried_other_config: false,
            backoff: Backoff::default(),
            stream_backoff: Backoff::default(),
            identity: None,
            explicit: Explicit::new(),
            events: EventQueue::default(),
            inbox: Inbox::new(),
        })
    }

    pub(super) const fn set_index(&mut self, index: usize) {
        self.index = index;
    }

    pub(super) const fn membership(&self) -> Membership {
        self.membership
    }

    pub(super) const fn set_joined(&mut self, joined: Option<Ipv4Addr>) {
        self.membership.joined = joined;
    }

    pub(super) fn status(&self) -> TargetStatus {
        let agreed = match self.io {
            Io::Open(open) => Some(open.agreed),
            _ => None,
        };
        TargetStatus {
            address: self.address,
            is_open: agreed.is_some(),
            has_session: self.has_session(),
            o2t_api: agreed.map_or(Duration::ZERO, |agreed| agreed.o2t_api),
            t2o_api: agreed.map_or(Duration::ZERO, |agreed| agreed.t2o_api),
            o2t_id: agreed.map_or(0, |agreed| agreed.o2t_id),
            t2o_id: agreed.map_or(0, |agreed| agreed.t2o_id),
            identity: self.identity,
            counters: self.counters,
        }
    }

    const fn has_session(&self) -> bool {
        self.session.is_up() && self.session.handle.is_some() && !self.session.must_unregister
    }

    // What the caller wants.

    /// Time begins.
    pub(super) fn begin(&mut self, now: Instant) {
        if self.is_wanted {
            self.start_attempt(now);
        }
    }

    pub(super) fn open(&mut self, now: Instant) {
        self.is_wanted = true;
        self.is_closing = false;
        if matches!(self.io, Io::Idle | Io::Waiting { .. }) {
            self.backoff = Backoff::default();
            self.start_attempt(now);
        }
    }

    pub(super) fn close(&mut self, now: Instant) {
        self.is_wanted = false;
        self.is_closing = true;
        if let Io::Open(open) = self.io {
            self.end_io(open);
        }
        self.io = Io::Idle;
        if self.farewell.is_some() {
            self.session.hurry(now);
        }
        self.settle(now);
    }

    pub(super) fn request(
        &mut self,
        service: Service,
        path: ObjectPath,
        data: &[u8],
    ) -> Result<(), RequestError> {
        if !self.has_session() || self.is_closing {
            return Err(RequestError::NoSession);
        }
        self.explicit.queue(service, path, data)
    }

    pub(super) fn answer(&self) -> &[u8] {
        self.explicit.answer()
    }

    pub(super) fn write_outputs(&mut self, outputs: &[u8]) {
        self.producer.write(outputs);
    }

    pub(super) const fn set_run(&mut self, run: bool) {
        self.producer.set_run(run);
    }

    pub(super) fn begin_cycle(&mut self) {
        self.producer.begin_cycle();
        self.consumer.begin_cycle();
    }

    pub(super) fn read_inputs(&self, inputs: &mut [u8]) -> InputQuality {
        self.consumer.read(inputs)
    }

    pub(super) fn poll_event(&mut self) -> Option<ScannerEvent> {
        self.events.pop()
    }

    // How the I/O connection comes and goes.

    fn start_attempt(&mut self, now: Instant) {
        self.io = Io::Opening;
        self.has_tried_other_config = false;
        self.session.hurry(now);
    }

    /// The attempt or the connection failed.
    fn fail(&mut self, now: Instant, trouble: Trouble) {
        let again = trouble.is_transient() || self.settings.retries_permanent;
        let retry_in = (self.is_wanted && again).then(|| self.backoff.next(&self.settings));
        self.io = retry_in.map_or(Io::Idle, |pause| Io::Waiting { until: now + pause });
        self.events.push(ScannerEvent::Failed { target: self.index, trouble, retry_in });
    }

    /// Frames end; the target is to be told.
    fn end_io(&mut self, open: Open) {
        self.producer.stop();
        self.consumer.stop();
        self.membership.wanted = None;
        self.say_farewell(open.triad, open.config);
    }

    const fn say_farewell(&mut self, triad: Triad, config: ConfigPath) {
        self.farewell = Some(Farewell { triad, config, tries_left: FAREWELL_TRIES });
    }

    /// A Forward Close was not answered, or could not be sent.
    fn count_farewell(&mut self) {
        self.farewell = self.farewell.and_then(|farewell| {
            let tries_left = farewell.tries_left.checked_sub(1).filter(|left| *left > 0)?;
            Some(Farewell { tries_left, ..farewell })
        });
    }

    fn opened(&mut self, now: Instant, open: Open) {
        let Agreed { o2t_id, o2t_api, t2o_api, group, .. } = open.agreed;
        self.io = Io::Open(open);
        self.config = open.config;
        self.membership.wanted = group;
        self.producer.start(now, o2t_id, o2t_api);
        let is_owner = self.settings.kind == ConnectionKind::ExclusiveOwner;
        // Frames to us alone end with the connection.
        let monitoring_bit = self.settings.monitoring_bit.filter(|_| is_owner && group.is_some());
        self.consumer.start(now, t2o_api, self.settings.multiplier, monitoring_bit);
        self.counters.opened = self.counters.opened.saturating_add(1);
        let (target, config, multicast) = (self.index, open.config, group);
        self.events.push(ScannerEvent::Opened { target, o2t_api, t2o_api, config, multicast });
    }

    /// Looks whether what the caller wanted to end has ended.
    fn settle(&mut self, now: Instant) {
        let is_over = self.farewell.is_none() && self.session.pending.is_none();
        if !self.is_closing || !is_over {
            return;
        }
        self.is_closing = false;
        self.give_up_request();
        if self.session.is_up() && self.session.handle.is_some() {
            self.session.must_unregister = true;
        } else {
            let hang_up =
                self.session.must_disconnect || !matches!(self.session.stream, Stream::Down { .. });
            self.session.drop_stream(now, hang_up);
        }
        self.events.push(ScannerEvent::Closed { target: self.index });
    }

    // How the stream comes and goes.

    pub(super) fn handle_connected(&mut self, now: Instant) {
        if matches!(self.session.stream, Stream::Connecting { .. }) {
            self.session.stream = Stream::Up;
            self.inbox.clear();
        }
        self.settle(now);
    }

    pub(super) fn handle_disconnected(&mut self, now: Instant) {
        match self.session.stream {
            Stream::Down { .. } => return,
            Stream::Connecting { .. } => self.lose_stream(now, Trouble::Unreachable, false),
            Stream::Up => {
                let step = self.session.pending.map_or(Step::RegisterSession, |one| one.step);
                self.lose_stream(now, Trouble::NoAnswer { step }, false);
            }
        }
        self.settle(now);
    }

    /// The stream is gone, or of no use any more and to be hung up.
    fn lose_stream(&mut self, now: Instant, trouble: Trouble, hang_up: bool) {
        let was_up = self.session.is_up();
        let was_told = self.session.must_unregister;
        let pending = self.session.pending;
        let has_farewell = self.farewell.is_some();
        self.session.drop_stream(now + self.stream_backoff.next(&self.settings), hang_up);
        self.inbox.clear();
        self.give_up_request();
        if has_farewell {
            self.count_farewell();
        } else if let Some(pending) = pending.filter(|one| one.step == Step::ForwardOpen) {
            // It may have been opened all the same.
            self.say_farewell(pending.triad, self.config);
        }
        match self.io {
            Io::Opening if !was_told => self.fail(now, trouble),
            Io::Open(_) if was_up => {
                self.events.push(ScannerEvent::StreamLost { target: self.index });
            }
            _ => {}
        }
    }

    fn give_up_request(&mut self) {
        if self.explicit.stage != Stage::None {
            self.explicit.finish(&[]);
            self.events.push(ScannerEvent::Answered {
                target: self.index,
                status: GeneralStatus::CONNECTION_FAILURE,
                extended: Some(ExtendedStatus::REQUEST_TIMED_OUT),
            });
        }
    }

    pub(super) fn handle_stream(&mut self, now: Instant, bytes: &[u8]) {
        let mut rest = bytes;
        let mut packet = [0; PACKET_LEN];
        while self.session.is_up() {
            let before = rest.len();
            rest = self.inbox.fill(rest);
            match self.inbox.pop(&mut packet) {
                Ok(Some(_)) => {
                    if let Some((packet, _)) = Packet::from_stream(&packet) {
                        self.handle_packet(now, &packet);
                    }
                }
                Ok(None) if rest.is_empty() || rest.len() == before => break,
                Ok(None) => {}
                Err(error) => {
                    let step = self.session.pending.map_or(Step::Request, |one| one.step);
                    self.lose_stream(now, Trouble::Malformed { step, error }, true);
                }
            }
        }
        self.settle(now);
    }

    fn handle_packet(&mut self, now: Instant, packet: &Packet<'_>) {
        let Some(pending) = self.session.pending else { return };
        if !answers::belongs_to(&packet.header, &pending, self.session.handle) {
            return;
        }
        let step = pending.step;
        if let Some(trouble) = answers::encapsulation_trouble(&packet.header, step) {
            return self.fail_step(now, pending, trouble);
        }
        if step == Step::RegisterSession {
            match answers::session_handle(packet) {
                Ok(handle) => {
                    self.session.handle = Some(handle);
                    self.session.pending = None;
                    self.stream_backoff = Backoff::default();
                }
                Err(error) => self.fail_step(now, pending, Trouble::Malformed { step, error }),
            }
            return;
        }
        match answers::answer(packet, pending.service) {
            Ok(Some(answer)) => self.handle_answer(now, pending, &answer),
            Ok(None) => {}
            Err(error) => self.fail_step(now, pending, Trouble::Malformed { step, error }),
        }
    }

    fn handle_answer(&mut self, now: Instant, pending: Pending, answer: &answers::Answer<'_>) {
        let response = &answer.response;
        let is_success = response.status == GeneralStatus::SUCCESS;
        match pending.step {
            Step::Identity => {
                self.identity = is_success.then(|| Identity::read(response.data).ok()).flatten();
                self.session.pending = None;
            }
            Step::ForwardOpen if is_success => self.handle_agreement(now, pending, answer),
            Step::ForwardOpen if answers::is_about_another(response, &pending) => {}
            Step::ForwardOpen => {
                self.session.pending = None;
                self.handle_refusal(now, response);
            }
            // Whatever it answers: the connection is gone, or the target's watchdog will end it.
            Step::ForwardClose if answers::is_about_another_close(response, &pending) => {}
            Step::ForwardClose => {
                self.session.pending = None;
                self.farewell = None;
            }
            Step::Request => {
                self.session.pending = None;
                self.explicit.finish(response.data);
                let (target, status) = (self.index, response.status);
                let extended = response.extended();
                self.events.push(ScannerEvent::Answered { target, status, extended });
            }
            Step::Connect | Step::RegisterSession => {}
        }
    }

    fn handle_agreement(&mut self, now: Instant, pending: Pending, answer: &answers::Answer<'_>) {
        let (triad, config) = (pending.triad, self.config);
        match answers::agreed(answer, &pending, *self.address.ip(), self.settings.t2o_type) {
            Ok(None) => {}
            Ok(Some(agreed)) => {
                self.session.pending = None;
                if matches!(self.io, Io::Opening) {
                    self.opened(now, Open { triad, config, agreed });
                } else {
                    self.say_farewell(triad, config);
                }
            }
            Err(error) => {
                let step = Step::ForwardOpen;
                self.fail_step(now, pending, Trouble::Malformed { step, error });
            }
        }
    }

    fn handle_refusal(&mut self, now: Instant, response: &Response<'_>) {
        let (o2t, t2o) = (self.settings.o2t_size(), self.settings.t2o_size());
        let trouble = Trouble::refusal(response, o2t, t2o);
        if !matches!(self.io, Io::Opening) {
            return;
        }
        let tries_other = self.settings.tries_other_config && trouble.is_about_the_path();
        if tries_other && !self.has_tried_other_config {
            self.has_tried_other_config = true;
            self.config = self.other_config();
        } else {
            // A path that was refused for another reason than itself is good enough for the next attempt.
            if trouble.is_about_the_path() {
                self.config = self.settings.config;
            }
            self.fail(now, trouble);
        }
    }

    /// Of the path that is set and the other one, the one not tried last.
    fn other_config(&self) -> ConfigPath {
        if self.config == self.settings.config {
            self.settings.config.other()
        } else {
            self.settings.config
        }
    }

    /// A request brought something unusable, or nothing in time.
    fn fail_step(&mut self, now: Instant, pending: Pending, trouble: Trouble) {
        if pending.step == Step::Request {
            // The context tells a late answer from others, so the stream can be kept.
            self.session.pending = None;
            self.give_up_request();
        } else {
            self.lose_stream(now, trouble, true);
        }
    }

    // Frames.

    pub(super) fn handle_frame(&mut self, now: Instant, from: Ipv4Addr, frame: &IoFrame<'_>) {
        let Io::Open(open) = self.io else { return };
        if frame.connection_id != open.agreed.t2o_id || from != *self.address.ip() {
            return;
        }
        if self.consumer.take(now, frame, &mut self.counters) == Arrival::First {
            self.backoff = Backoff::default();
            self.events.push(ScannerEvent::Running { target: self.index });
        }
    }

    pub(super) fn poll_frame(
        &mut self,
        now: Instant,
        early: Duration,
        room: &mut [u8],
    ) -> Option<Transmit> {
        let Io::Open(open) = self.io else { return None };
        let len = self.producer.produce(now, early, room, &mut self.counters)?;
        Some(Transmit::Datagram { to: open.agreed.o2t_to, len })
    }

    // Time.

    pub(super) fn handle_timeout(&mut self, now: Instant) {
        if let Some(pending) = self.session.pending.filter(|pending| now >= pending.deadline) {
            self.fail_step(now, pending, Trouble::NoAnswer { step: pending.step });
        }
        if let Stream::Connecting { deadline } = self.session.stream
            && now >= deadline
        {
            self.lose_stream(now, Trouble::Unreachable, true);
        }
        match self.io {
            Io::Waiting { until } if now >= until => self.start_attempt(now),
            Io::Open(open) => {
                if let Some(silence) = self.consumer.silence(now) {
                    self.end_io(open);
                    self.counters.timed_out = self.counters.timed_out.saturating_add(1);
                    self.fail(now, self.trouble_of(silence));
                }
            }
            _ => {}
        }
        self.settle(now);
    }

    const fn trouble_of(&self, silence: Silence) -> Trouble {
        match silence {
            Silence::Nothing(after) => Trouble::TimedOut { after },
            Silence::WrongLength(found) => {
                Trouble::FrameSize { expected: self.settings.t2o_len, found }
            }
            Silence::ControlLost(after) => Trouble::ControlLost { after },
        }
    }

    /// Whether something is to be done on the stream, so that it has to be there.
    const fn needs_stream(&self) -> bool {
        matches!(self.io, Io::Opening | Io::Open(_)) || self.farewell.is_some()
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        let stream = match self.session.stream {
            Stream::Down { retry_at } => self.needs_stream().then_some(retry_at),
            Stream::Connecting { deadline } => Some(deadline),
            Stream::Up => self.session.pending.map(|pending| pending.deadline),
        };
        let io = match self.io {
            Io::Waiting { until } => Some(until),
            Io::Open(_) => self.consumer.deadline().into_iter().chain(self.producer.wake()).min(),
            Io::Idle | Io::Opening => None,
        };
        stream.into_iter().chain(io).min()
    }

    // What is sent on the stream.

    pub(super) fn poll_stream(
        &mut self,
        now: Instant,
        originator: Originator,
        ids: &mut Ids,
        room: &mut [u8],
    ) -> Option<Transmit> {
        let target = self.index;
        if core::mem::take(&mut self.session.must_disconnect) {
            return Some(Transmit::Disconnect { target });
        }
        match self.session.stream {
            Stream::Down { retry_at } if self.needs_stream() && now >= retry_at => {
                let deadline = now + self.settings.step_limit;
                self.session.stream = Stream::Connecting { deadline };
                Some(Transmit::Connect { target })
            }
            Stream::Up if self.session.must_unregister => {
                let handle = self.session.handle.unwrap_or_default();
                self.session.drop_stream(now, true);
                let len = requests::unregister_session(handle, room).ok()?;
                Some(Transmit::Stream { target, len })
            }
            Stream::Up if self.session.pending.is_none() => {
                let step = self.next_step()?;
                let len = self.send(now, step, originator, ids, room).ok()?;
                Some(Transmit::Stream { target, len })
            }
            _ => None,
        }
    }

    /// What to ask next.
    const fn next_step(&self) -> Option<Step> {
        if self.session.handle.is_none() {
            return Some(Step::RegisterSession);
        }
        if self.farewell.is_some() {
            return Some(Step::ForwardClose);
        }
        if matches!(self.io, Io::Opening) {
            if !self.session.has_asked_identity {
                return Some(Step::Identity);
            }
            return Some(Step::ForwardOpen);
        }
        if matches!(self.explicit.stage, Stage::Queued) {
            return Some(Step::Request);
        }
        None
    }

    fn send(
        &mut self,
        now: Instant,
        step: Step,
        originator: Originator,
        ids: &mut Ids,
        room: &mut [u8],
    ) -> Result<usize, NoRoom> {
        let context = ids.context();
        let envelope = Envelope { session: self.session.handle.unwrap_or_default(), context };
        let settings = &self.settings;
        let mut triad = Triad::default();
        let (service, len) = match step {
            Step::Connect | Step::RegisterSession => {
                (Service(0), requests::register_session(context, room)?)
            }
            Step::Identity => {
                let service = Service::GET_ATTRIBUTES_ALL;
                let target = (service, requests::IDENTITY);
                (service, requests::unconnected(envelope, target, &[], None, room)?)
            }
            Step::ForwardOpen => {
                triad = Triad {
                    connection_serial: ids.serial(),
                    vendor: originator.vendor,
                    originator_serial: originator.serial,
                };
                let (id, config) = (ids.connection(), self.config);
                let len = requests::forward_open(settings, envelope, triad, id, config, room)?;
                (requests::open_service(settings), len)
            }
            Step::ForwardClose => {
                let Some(farewell) = self.farewell else { return Err(NoRoom { room: 0 }) };
                triad = farewell.triad;
                let config = farewell.config;
                let len = requests::forward_close(settings, envelope, triad, config, room)?;
                (Service::FORWARD_CLOSE, len)
            }
            Step::Request => {
                let (service, path) = (self.explicit.service, self.explicit.path);
                let data = self.explicit.data();
                (service, requests::unconnected(envelope, (service, path), data, None, room)?)
            }
        };
        match step {
            Step::Identity => self.session.has_asked_identity = true,
            Step::Request => self.explicit.stage = Stage::Sent,
            _ => {}
        }
        let deadline = now + settings.step_limit;
        self.session.pending = Some(Pending { step, service, context, deadline, triad });
        Ok(len)
    }
}
