//! An adapter among scanners that do what a string of bytes says: right, nearly right, or nonsense.

use std::net::{Ipv4Addr, SocketAddrV4};
use std::time::Duration;

use fieldarm::bus::enip::ConnectionKind;
use fieldarm::bus::enip::adapter::*;
use fieldarm::time::Instant;
use fieldarm::wire::enip::encapsulation::{Command, Packet};
use fieldarm::wire::enip::io::IoFrame;
use fieldarm::wire::meca500::adapter::IDENTITY;

use crate::choices::{Choices, spoil};
use crate::messages;

/// More than any single thing that arrives may set off.
const MOST_AT_ONCE: usize = 200;
const INPUTS: [u8; 252] = [0x5A; 252];

const SETTINGS: AdapterSettings = AdapterSettings {
    identity: IDENTITY,
    output_assembly: 150,
    output_len: 60,
    input_assembly: 100,
    input_len: 252,
    config_assembly: Some(151),
    input_only_point: 238,
    listen_only_point: 237,
    min_rpi: Duration::from_millis(10),
    max_rpi: Duration::from_millis(3_200),
    rpi_step: Duration::from_millis(1),
    access: Access::Full,
    initial_watchdog: Duration::from_secs(10),
    inactivity: Duration::from_secs(120),
    netmask: Ipv4Addr::new(255, 255, 255, 0),
    mac: [2, 0, 0, 0, 0, 1],
    host_name: "hostile",
};

/// The adapter, and what the network around it knows.
pub(crate) struct Surrounded {
    pub(crate) adapter: Adapter,
    now: Instant,
    /// Open streams, with the session that was registered on each.
    streams: Vec<(StreamId, u32)>,
    /// What has opened and not ended.
    live: Vec<ConnectionStatus>,
    /// Answers on streams and in datagrams, frames, connections opened: whether anything is reached at all.
    pub(crate) counts: [usize; 4],
    frame_count: u32,
    /// Nobody is to be answered.
    is_disabled: bool,
}

impl Surrounded {
    pub(crate) fn new() -> Self {
        let mut adapter = Adapter::new(SETTINGS, Ipv4Addr::new(192, 168, 0, 100), 1);
        adapter.set_inputs(&INPUTS, &INPUTS);
        let now = Instant::from_millis(5);
        Self {
            adapter,
            now,
            streams: Vec::new(),
            live: Vec::new(),
            counts: [0; 4],
            frame_count: 0,
            is_disabled: false,
        }
    }

    /// Obeys all of `bytes`.
    pub(crate) fn obey(&mut self, bytes: &[u8]) {
        let mut choices = Choices::new(bytes);
        while let Some(what) = choices.next() {
            self.step(what, &mut choices);
            self.drain();
        }
    }

    /// A stream's number, if there is one.
    fn stream(&self, choices: &mut Choices<'_>) -> Option<(StreamId, u32)> {
        (!self.streams.is_empty()).then(|| choices.pick(&self.streams))
    }

    pub(crate) fn accept(&mut self, choices: &mut Choices<'_>) {
        let peer = peer(choices);
        match self.adapter.handle_accepted(self.now, peer) {
            Some(stream) => {
                assert!(
                    self.streams.iter().all(|(other, _)| *other != stream),
                    "number given twice"
                );
                assert!(stream.index() < STREAMS);
                self.streams.push((stream, 0));
            }
            None => assert!(self.is_disabled || self.streams.len() == STREAMS, "turned away"),
        }
    }

    /// Gives a stream bytes, and takes what comes of them.
    pub(crate) fn stream_bytes(&mut self, index: usize, bytes: &[u8]) {
        if let Some((stream, _)) = self.streams.get(index) {
            self.adapter.handle_stream(self.now, *stream, bytes);
            self.drain();
        }
    }

    pub(crate) fn session(&self, index: usize) -> u32 {
        self.streams.get(index).map_or(0, |(_, session)| *session)
    }

    pub(crate) fn stream_count(&self) -> usize {
        self.streams.len()
    }

    pub(crate) fn connection_count(&self) -> usize {
        self.live.len()
    }

    fn step(&mut self, what: u8, choices: &mut Choices<'_>) {
        match what % 24 {
            0 | 1 => {
                self.accept(choices);
                if what % 24 == 1 {
                    let register = messages::request(0, &mut Choices::new(&[0, 0]));
                    self.stream_bytes(self.streams.len().wrapping_sub(1), &register);
                }
            }
            2..=11 => {
                let Some((stream, session)) = self.stream(choices) else {
                    return self.accept(choices);
                };
                let mut message = if what % 24 == 11 {
                    choices.some(80).to_vec()
                } else {
                    messages::request(session, choices)
                };
                if what % 24 >= 8 {
                    spoil(&mut message, choices);
                }
                let split =
                    if what % 24 < 6 { message.len() } else { choices.below(message.len() + 1) };
                self.adapter.handle_stream(self.now, stream, &message[..split]);
                self.drain();
                // What came first may have ended the stream.
                if split < message.len() && self.streams.iter().any(|(open, _)| *open == stream) {
                    self.adapter.handle_stream(self.now, stream, &message[split..]);
                }
            }
            12 => {
                if let Some((stream, _)) = self.stream(choices) {
                    self.streams.retain(|(open, _)| *open != stream);
                    self.adapter.handle_stream_closed(self.now, stream);
                }
            }
            13 => {
                let mut message = messages::request(0, choices);
                if choices.below(2) == 0 {
                    spoil(&mut message, choices);
                }
                self.adapter.handle_message_datagram(self.now, peer(choices), &message);
            }
            14..=17 => self.io_datagram(choices),
            18 => self.pass(Duration::from_micros(choices.double_word().into()) / 1_000),
            19 | 20 => self.pass(Duration::from_millis(choices.byte().into())),
            21 => {
                if let Some(due) = self.adapter.poll_timeout() {
                    self.pass(due.saturating_duration_since(self.now));
                }
            }
            22 => {
                let what = choices.below(8);
                match what {
                    0 => self.adapter.set_access(self.now, Access::Disabled),
                    1 => self.adapter.set_access(self.now, Access::MonitoringOnly),
                    2 => self.adapter.set_controlled_elsewhere(true),
                    3 => self.adapter.set_controlled_elsewhere(false),
                    _ => self.adapter.set_access(self.now, Access::Full),
                }
                self.is_disabled = what == 0 || (self.is_disabled && matches!(what, 2 | 3));
            }
            _ => {
                if choices.one_in(8) {
                    self.adapter.restart(choices.byte().into());
                    self.streams.clear();
                    self.live.clear();
                    assert_eq!(self.adapter.connections().count(), 0);
                    self.adapter.set_inputs(&INPUTS, &INPUTS);
                } else {
                    self.adapter.set_inputs(choices.some(252), choices.some(300));
                }
            }
        }
    }

    fn io_datagram(&mut self, choices: &mut Choices<'_>) {
        let (id, from) = match self.live.len() {
            0 => (choices.double_word(), peer(choices)),
            len => {
                let live = &self.live[choices.below(len)];
                (live.o2t_id, SocketAddrV4::new(*live.originator.ip(), 2_222))
            }
        };
        self.frame_count = self.frame_count.wrapping_add(choices.pick(&[1, 1, 1, 0, 2, u32::MAX]));
        let count = self.frame_count;
        let mut datagram = match choices.below(4) {
            0 => messages::frame(id, count, None, &[]),
            1 => messages::frame(id, count, Some(false), &[1; 60]),
            2 => messages::frame(id, count, Some(true), choices.some(80)),
            _ => messages::frame(id, count, Some(true), &[2; 60]),
        };
        if choices.one_in(4) {
            spoil(&mut datagram, choices);
        }
        let from = if choices.one_in(8) { peer(choices) } else { from };
        self.adapter.handle_io_datagram(self.now, from, &datagram);
    }

    /// Lets time pass; behind its deadline the adapter wants none before now.
    pub(crate) fn pass(&mut self, time: Duration) {
        self.now += time.min(Duration::from_secs(100_000));
        self.adapter.handle_timeout(self.now);
        self.drain();
        if let Some(due) = self.adapter.poll_timeout() {
            assert!(
                due > self.now,
                "due at {due:?}, already {:?}: a loop that waits for it spins",
                self.now
            );
        }
    }

    pub(crate) fn drain(&mut self) {
        let mut room = [0; 2_048];
        for count in 0.. {
            let Some(transmit) = self.adapter.poll_transmit(self.now, &mut room) else { break };
            assert!(count < MOST_AT_ONCE, "it never stops transmitting: {transmit:?}");
            self.take(transmit, &room);
        }
        for count in 0.. {
            let Some(event) = self.adapter.poll_event() else { break };
            assert!(count < MOST_AT_ONCE, "events never end: {event:?}");
            self.note(event);
        }
        self.check();
    }

    fn take(&mut self, transmit: Transmit, room: &[u8]) {
        let is_close = matches!(transmit, Transmit::CloseStream { .. });
        assert!(is_close || !self.is_disabled, "answered although disabled: {transmit:?}");
        match transmit {
            Transmit::Stream { stream, len } => {
                let mut bytes = &room[..len];
                assert!(!bytes.is_empty());
                while !bytes.is_empty() {
                    let (packet, len) = Packet::from_stream(bytes).expect("a whole packet");
                    assert_eq!(packet.header.options, 0);
                    let open = self.streams.iter_mut().find(|(open, _)| *open == stream);
                    let (_, session) = open.expect("sent to a stream that is not open");
                    if packet.header.command == Command::REGISTER_SESSION
                        && packet.header.status.0 == 0
                    {
                        *session = packet.header.session;
                    }
                    bytes = &bytes[len..];
                    self.counts[0] += 1;
                }
            }
            Transmit::CloseStream { stream } => {
                let open = self.streams.iter().position(|(open, _)| *open == stream);
                self.streams.remove(open.expect("closed a stream that is not open"));
            }
            Transmit::MessageDatagram { len, .. } => {
                Packet::from_datagram(&room[..len]).expect("a whole packet");
                self.counts[1] += 1;
            }
            Transmit::IoDatagram { to, len } => {
                let frame = IoFrame::read(&room[..len]).expect("a whole frame");
                assert_eq!(frame.data.len(), INPUTS.len());
                assert_ne!(to.port(), 0);
                self.counts[2] += 1;
            }
        }
    }

    fn note(&mut self, event: AdapterEvent) {
        let same = |a: &ConnectionStatus, b: &ConnectionStatus| a.triad == b.triad;
        match event {
            AdapterEvent::Opened(status) => {
                assert!(
                    !self.live.iter().any(|live| same(live, &status)),
                    "opened twice: {status:?}"
                );
                self.live.push(status);
                self.counts[3] += 1;
            }
            AdapterEvent::Closed(status) | AdapterEvent::TimedOut(status) => {
                let at = self.live.iter().position(|live| same(live, &status));
                self.live
                    .remove(at.unwrap_or_else(|| panic!("ended, but was not open: {status:?}")));
            }
            _ => {}
        }
    }

    fn check(&self) {
        let open: Vec<_> = self.adapter.connections().collect();
        assert!(open.len() <= CONNECTIONS && self.streams.len() <= STREAMS);
        let mut expected: Vec<_> =
            self.live.iter().map(|live| format!("{:?}", live.triad)).collect();
        let mut found: Vec<_> = open.iter().map(|open| format!("{:?}", open.triad)).collect();
        expected.sort_unstable();
        found.sort_unstable();
        assert_eq!(found, expected, "events and connections differ");
        let mut ids: Vec<_> = open.iter().map(|open| open.o2t_id).collect();
        ids.sort_unstable();
        ids.dedup();
        assert_eq!(ids.len(), open.len(), "an id given twice: {open:?}");
        let owners = open.iter().filter(|open| open.kind == ConnectionKind::ExclusiveOwner).count();
        assert!(owners <= 1, "{owners} owners");
        assert_eq!(self.adapter.owner().is_some(), owners == 1);
        if let Some(outputs) = self.adapter.outputs() {
            assert_eq!((owners, outputs.len()), (1, 60));
        }
        for open in &open {
            let limits = SETTINGS.min_rpi..=SETTINGS.max_rpi + SETTINGS.rpi_step;
            assert!(limits.contains(&open.t2o_api), "{open:?}");
            // Without O->T frames the interval is what was requested.
            let is_owner = open.kind == ConnectionKind::ExclusiveOwner;
            assert!(!is_owner || limits.contains(&open.o2t_api), "{open:?}");
        }
    }
}

fn peer(choices: &mut Choices<'_>) -> SocketAddrV4 {
    SocketAddrV4::new(Ipv4Addr::new(192, 168, 0, 1 + choices.byte() % 3), 40_000)
}
