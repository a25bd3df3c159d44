//! A scanner among targets that do what a string of bytes says: right, nearly right, or nonsense.

use std::collections::HashSet;
use std::net::{Ipv4Addr, SocketAddrV4};
use std::time::Duration;

use fieldarm::bus::enip::scanner::*;
use fieldarm::bus::enip::{ConnectionKind, INPUT_ONLY_POINT};
use fieldarm::time::Instant;
use fieldarm::wire::enip::connection::ForwardOpen;
use fieldarm::wire::enip::cpf::Unconnected;
use fieldarm::wire::enip::encapsulation::{Command, Packet};
use fieldarm::wire::enip::io::IoFrame;
use fieldarm::wire::enip::message::{Request, Service};
use fieldarm::wire::enip::parameters::{Priority, TimeoutMultiplier};
use fieldarm::wire::enip::path::{ElectronicKey, ObjectPath};

use crate::choices::{Choices, spoil};
use crate::messages;

/// More than any single thing that arrives may set off.
const MOST_AT_ONCE: usize = 400;
const TARGETS: usize = 3;

fn settings(index: usize) -> ConnectionSettings {
    let owner = ConnectionSettings {
        kind: ConnectionKind::ExclusiveOwner,
        o2t_assembly: 150,
        t2o_assembly: 100,
        o2t_len: 60,
        t2o_len: 252,
        config: ConfigPath::Named(151),
        tries_other_config: true,
        key: None,
        o2t_rpi: Duration::from_millis(10),
        t2o_rpi: Duration::from_millis(10),
        multiplier: TimeoutMultiplier::from_factor(16).expect("16 is one"),
        t2o_type: T2oType::Unicast,
        monitoring_bit: Some(9),
        priority: Priority::Scheduled,
        io_port: 2_222,
        step_limit: Duration::from_secs(2),
        first_retry: Duration::from_millis(100),
        longest_retry: Duration::from_secs(5),
        retries_permanent: true,
    };
    match index {
        0 => owner,
        1 => ConnectionSettings {
            kind: ConnectionKind::InputOnly,
            o2t_assembly: INPUT_ONLY_POINT,
            o2t_len: 0,
            t2o_type: T2oType::Multicast,
            io_port: 2_223,
            ..owner
        },
        _ => ConnectionSettings {
            t2o_type: T2oType::Multicast,
            config: ConfigPath::None,
            tries_other_config: false,
            key: Some(ElectronicKey::default()),
            retries_permanent: false,
            ..owner
        },
    }
}

fn address(index: usize) -> SocketAddrV4 {
    SocketAddrV4::new(Ipv4Addr::new(10, 0, 0, 1 + index as u8), 44_818)
}

/// What the network knows of a target.
#[derive(Clone, Debug, Default)]
struct Line {
    is_asked_for: bool,
    is_connected: bool,
    /// The last packet of the scanner that was not answered yet.
    asked: Option<Vec<u8>>,
    frame_count: u32,
}

/// The scanner, and what the network around it knows.
pub(crate) struct Surrounded {
    scanner: Scanner<Vec<Target>>,
    now: Instant,
    lines: [Line; TARGETS],
    groups: HashSet<Ipv4Addr>,
    triads: HashSet<(u16, u16, u32)>,
    /// Requests sent, frames sent, connections opened, connections that ran.
    pub(crate) counts: [usize; 4],
}

impl Surrounded {
    pub(crate) fn new() -> Self {
        let targets = (0..TARGETS)
            .map(|index| Target::new(address(index), settings(index)).expect("good settings"))
            .collect();
        let originator = Originator { vendor: 0x0539, serial: 77 };
        let mut new = Self {
            scanner: Scanner::new(targets, originator, 1),
            now: Instant::from_millis(5),
            lines: Default::default(),
            groups: HashSet::new(),
            triads: HashSet::new(),
            counts: [0; 4],
        };
        new.pass(Duration::ZERO);
        new
    }

    /// Obeys all of `bytes`.
    pub(crate) fn obey(&mut self, bytes: &[u8]) {
        let mut choices = Choices::new(bytes);
        while let Some(what) = choices.next() {
            self.step(what, &mut choices);
            self.drain();
        }
    }

    /// Connects a target and answers everything it is asked, well, until its connection is open.
    pub(crate) fn open(&mut self, index: usize) {
        for _ in 0..20 {
            if self.lines[index].is_asked_for {
                self.connect(index);
            }
            // Nothing but zeros: everything is granted.
            if let Some(answer) = self.answer(index, &mut Choices::new(&[])) {
                self.stream_bytes(index, &answer);
            }
        }
    }

    pub(crate) fn is_open(&self, index: usize) -> bool {
        self.scanner.status(index).is_some_and(|status| status.is_open)
    }

    /// A good answer to what the scanner last asked.
    pub(crate) fn answer(&mut self, index: usize, choices: &mut Choices<'_>) -> Option<Vec<u8>> {
        messages::answer(&self.lines[index].asked.take()?, choices)
    }

    pub(crate) fn connect(&mut self, index: usize) {
        self.lines[index] = Line {
            is_connected: true,
            frame_count: self.lines[index].frame_count,
            ..Line::default()
        };
        self.scanner.handle_connected(self.now, index);
        self.drain();
    }

    pub(crate) fn is_asked_for(&self, index: usize) -> bool {
        self.lines[index].is_asked_for
    }

    pub(crate) fn is_connected(&self, index: usize) -> bool {
        self.lines[index].is_connected
    }

    pub(crate) fn stream_bytes(&mut self, index: usize, bytes: &[u8]) {
        if self.lines[index].is_connected {
            self.scanner.handle_stream(self.now, index, bytes);
            self.drain();
        }
    }

    pub(crate) fn datagram(&mut self, from: SocketAddrV4, bytes: &[u8]) {
        self.scanner.handle_datagram(self.now, from, bytes);
        self.drain();
    }

    fn step(&mut self, what: u8, choices: &mut Choices<'_>) {
        let index = choices.below(TARGETS);
        match what % 20 {
            0..=2 => {
                if self.lines[index].is_asked_for {
                    self.connect(index);
                }
            }
            3 => {
                let line = &mut self.lines[index];
                if line.is_asked_for || line.is_connected {
                    *line = Line { frame_count: line.frame_count, ..Line::default() };
                    self.scanner.handle_disconnected(self.now, index);
                }
            }
            4..=10 => {
                let Some(mut answer) = self.answer(index, choices) else { return };
                if what % 20 == 10 {
                    spoil(&mut answer, choices);
                }
                let split =
                    if what % 20 < 9 { answer.len() } else { choices.below(answer.len() + 1) };
                self.stream_bytes(index, &answer[..split]);
                self.stream_bytes(index, &answer[split..]);
            }
            11 => {
                let garbage = choices.some(100).to_vec();
                self.stream_bytes(index, &garbage);
            }
            12..=15 => self.frame(index, choices),
            16 => {
                let time = self.scanner.poll_timeout();
                let time =
                    time.map_or(Duration::ZERO, |due| due.saturating_duration_since(self.now));
                self.pass(time);
            }
            17 => self.pass(Duration::from_millis(choices.byte().into())),
            18 => self.pass(Duration::from_micros(choices.double_word().into()) / 1_000),
            _ => self.call(index, choices),
        }
    }

    fn frame(&mut self, index: usize, choices: &mut Choices<'_>) {
        let id = self.scanner.status(index).map_or(0, |status| status.t2o_id);
        let line = &mut self.lines[index];
        line.frame_count =
            line.frame_count.wrapping_add(choices.pick(&[1, 1, 1, 1, 0, 3, u32::MAX]));
        let count = line.frame_count;
        let mut datagram = match choices.below(4) {
            0 => messages::frame(id, count, None, choices.some(252)),
            _ => messages::frame(id, count, None, &[3; 252]),
        };
        if choices.one_in(4) {
            spoil(&mut datagram, choices);
        }
        let from = if choices.one_in(8) { choices.below(TARGETS) } else { index };
        self.datagram(SocketAddrV4::new(*address(from).ip(), 2_222), &datagram);
    }

    /// What the user of a scanner does, with targets that do not exist too.
    fn call(&mut self, index: usize, choices: &mut Choices<'_>) {
        let target = choices.pick(&[index, index, index, TARGETS, usize::MAX]);
        match choices.below(8) {
            0 => self.scanner.close(self.now, target),
            1 | 2 => self.scanner.open(self.now, target),
            3 => {
                let path =
                    ObjectPath { class: choices.double_word(), instance: 1, attribute: Some(1) };
                let service = Service(choices.byte());
                let _ = self.scanner.request(self.now, target, service, path, choices.some(700));
            }
            4 => self.scanner.write_outputs(target, &[9; 60]),
            5 => self.scanner.set_run(target, choices.one_in(2)),
            6 => self.scanner.set_early(Duration::from_millis(choices.byte().into())),
            _ => {
                self.scanner.begin_cycle();
                let _ = self.scanner.read_inputs(target, &mut [0; 252]);
                let _ = self.scanner.read_inputs(target, &mut [0; 7]);
                let _ = self.scanner.answer(target).len();
            }
        }
    }

    /// Lets time pass; behind its deadline the scanner wants none before now.
    pub(crate) fn pass(&mut self, time: Duration) {
        self.now += time.min(Duration::from_secs(100_000));
        self.scanner.handle_timeout(self.now);
        self.drain();
        if let Some(due) = self.scanner.poll_timeout() {
            assert!(
                due > self.now,
                "due at {due:?}, already {:?}: a loop that waits for it spins",
                self.now
            );
        }
    }

    fn drain(&mut self) {
        let mut room = [0; 2_048];
        for count in 0.. {
            let Some(transmit) = self.scanner.poll_transmit(self.now, &mut room) else { break };
            assert!(count < MOST_AT_ONCE, "it never stops transmitting: {transmit:?}");
            self.take(transmit, &room);
        }
        for count in 0.. {
            let Some(event) = self.scanner.poll_event() else { break };
            assert!(count < MOST_AT_ONCE, "events never end: {event:?}");
            match event {
                ScannerEvent::Opened { o2t_api, t2o_api, .. } => {
                    assert!(!o2t_api.is_zero() && !t2o_api.is_zero(), "{event:?}");
                    self.counts[2] += 1;
                }
                ScannerEvent::Running { .. } => self.counts[3] += 1,
                ScannerEvent::Failed { trouble, .. } => assert!(!trouble.to_string().is_empty()),
                _ => {}
            }
        }
    }

    fn take(&mut self, transmit: Transmit, room: &[u8]) {
        match transmit {
            Transmit::Connect { target } => {
                let line = &mut self.lines[target];
                assert!(!line.is_asked_for && !line.is_connected, "connects twice: {line:?}");
                line.is_asked_for = true;
            }
            Transmit::Disconnect { target } => {
                let line = &mut self.lines[target];
                assert!(line.is_asked_for || line.is_connected, "nothing to disconnect");
                *line = Line { frame_count: line.frame_count, ..Line::default() };
            }
            Transmit::Stream { target, len } => {
                assert!(self.lines[target].is_connected, "sends to nobody");
                let packet = Packet::from_datagram(&room[..len]).expect("a whole packet");
                self.note_triad(&packet);
                if packet.header.command != Command::UNREGISTER_SESSION {
                    self.lines[target].asked = Some(room[..len].to_vec());
                }
                self.counts[0] += 1;
            }
            Transmit::Datagram { to, len } => {
                let frame = IoFrame::read(&room[..len]).expect("a whole frame");
                let open = (0..TARGETS).filter_map(|index| self.scanner.status(index));
                let mut open = open.filter(|status| status.is_open);
                assert!(
                    open.any(|status| status.o2t_id == frame.connection_id),
                    "frame of nothing"
                );
                assert_ne!(to.port(), 0);
                self.counts[1] += 1;
            }
            Transmit::JoinGroup { group } => {
                assert!(group.is_multicast(), "{group}");
                assert!(self.groups.insert(group), "joined twice: {group}");
            }
            Transmit::LeaveGroup { group } => {
                assert!(self.groups.remove(&group), "left, but not joined: {group}");
            }
        }
    }

    /// No connection is opened with a triad that was used before.
    fn note_triad(&mut self, packet: &Packet<'_>) {
        if packet.header.command != Command::SEND_RR_DATA {
            return;
        }
        let unconnected = Unconnected::read(packet.data).expect("good items");
        let request = Request::read(unconnected.message).expect("a good request");
        let is_large = request.service == Service::LARGE_FORWARD_OPEN;
        let manager = ObjectPath::read(request.path) == Ok(ObjectPath::CONNECTION_MANAGER);
        if manager && (is_large || request.service == Service::FORWARD_OPEN) {
            let open = ForwardOpen::read(request.data, is_large).expect("a good Forward Open");
            let triad = open.triad;
            let triad = (triad.connection_serial, triad.vendor, triad.originator_serial);
            assert!(self.triads.insert(triad), "used again: {triad:?}");
        }
    }
}
