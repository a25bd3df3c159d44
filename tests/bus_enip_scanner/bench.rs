//! A scanner on the bench, and the words of a scripted target.

use std::net::{Ipv4Addr, SocketAddrV4};

use fieldarm::bus::enip::scanner::{
    ConnectionSettings, Originator, Scanner, ScannerEvent, TRANSMIT_LEN, Target, TargetStatus,
    Transmit,
};
use fieldarm::time::{Duration, Instant};

/// What the scanner did.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Deed {
    Connect(usize),
    Stream(usize, Vec<u8>),
    Disconnect(usize),
    Datagram(SocketAddrV4, Vec<u8>),
    Join(Ipv4Addr),
    Leave(Ipv4Addr),
}

/// Bytes typed as hexadecimal digits with spaces.
pub(crate) fn hex(text: &str) -> Vec<u8> {
    text.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).expect("two digits")).collect()
}

pub(crate) fn ms(ms: u64) -> Duration {
    Duration::from_millis(ms)
}

/// Handle that the scripted target gives out.
pub(crate) const SESSION: [u8; 4] = [0x44, 0x33, 0x22, 0x11];
/// Id of O->T that it chooses.
pub(crate) const O2T_ID: [u8; 4] = [0x01, 0xA0, 0xB0, 0xC0];
/// Success of the message router.
pub(crate) const OK: [u8; 3] = [0, 0, 0];

/// Where the `index`th target is.
pub(crate) fn address(index: usize) -> SocketAddrV4 {
    SocketAddrV4::new(Ipv4Addr::new(192, 168, 0, 100 + index as u8), 44_818)
}

/// Where its frames come from.
pub(crate) fn io_address(index: usize) -> SocketAddrV4 {
    SocketAddrV4::new(*address(index).ip(), 2222)
}

/// An encapsulated packet.
pub(crate) fn packet(
    command: u16,
    session: [u8; 4],
    status: u32,
    context: [u8; 8],
    data: &[u8],
) -> Vec<u8> {
    let mut bytes = command.to_le_bytes().to_vec();
    bytes.extend((data.len() as u16).to_le_bytes());
    bytes.extend(session);
    bytes.extend(status.to_le_bytes());
    bytes.extend(context);
    bytes.extend([0; 4]);
    bytes.extend(data);
    bytes
}

/// The data of SendRRData around a CIP message, with further items behind it.
pub(crate) fn unconnected(message: &[u8], items: &[(u16, [u8; 16])]) -> Vec<u8> {
    let mut bytes = vec![0; 6];
    bytes.extend((2 + items.len() as u16).to_le_bytes());
    bytes.extend([0, 0, 0, 0, 0xB2, 0]);
    bytes.extend((message.len() as u16).to_le_bytes());
    bytes.extend(message);
    for (kind, data) in items {
        bytes.extend(kind.to_le_bytes());
        bytes.extend([16, 0]);
        bytes.extend(data);
    }
    bytes
}

/// A socket address item's data.
pub(crate) fn socket(address: [u8; 4], port: u16) -> [u8; 16] {
    let mut bytes = [0; 16];
    bytes[1] = 2;
    bytes[2..4].copy_from_slice(&port.to_be_bytes());
    bytes[4..8].copy_from_slice(&address);
    bytes
}

/// A T->O frame.
pub(crate) fn frame(id: [u8; 4], sequence: u32, count: u16, data: &[u8]) -> Vec<u8> {
    let mut bytes = hex("02 00 02 80 08 00");
    bytes.extend(id);
    bytes.extend(sequence.to_le_bytes());
    bytes.extend([0xB1, 0]);
    bytes.extend((data.len() as u16 + 2).to_le_bytes());
    bytes.extend(count.to_le_bytes());
    bytes.extend(data);
    bytes
}

pub(crate) fn context(packet: &[u8]) -> [u8; 8] {
    packet[12..20].try_into().expect("a header")
}

/// Serial, vendor and originator serial of a Forward Open in a packet.
pub(crate) fn triad(open: &[u8]) -> [u8; 8] {
    open[56..64].try_into().expect("a Forward Open")
}

/// The T->O id of a Forward Open in a packet.
pub(crate) fn t2o_id(open: &[u8]) -> [u8; 4] {
    open[52..56].try_into().expect("a Forward Open")
}

/// A scanner, the time, and what it did and said.
pub(crate) struct Bench {
    pub(crate) scanner: Scanner<Vec<Target>>,
    pub(crate) now: Instant,
    pub(crate) events: Vec<ScannerEvent>,
}

impl Bench {
    pub(crate) fn new(settings: &[ConnectionSettings]) -> Self {
        Self::with_seed(settings, 7)
    }

    pub(crate) fn with_seed(settings: &[ConnectionSettings], seed: u64) -> Self {
        let target = |(index, settings): (usize, &ConnectionSettings)| {
            Target::new(address(index), *settings).expect("settings that can be")
        };
        let targets: Vec<_> = settings.iter().enumerate().map(target).collect();
        let originator = Originator { vendor: 0x1234, serial: 0xAABB_CCDD };
        let mut scanner = Scanner::new(targets, originator, seed);
        let now = Instant::from_millis(1_000);
        scanner.handle_timeout(now);
        Self { scanner, now, events: Vec::new() }
    }

    pub(crate) fn meca500() -> Self {
        Self::new(&[ConnectionSettings::meca500()])
    }

    /// Everything the scanner wants done now.
    pub(crate) fn deeds(&mut self) -> Vec<Deed> {
        let mut deeds = Vec::new();
        let mut room = [0; TRANSMIT_LEN];
        while let Some(transmit) = self.scanner.poll_transmit(self.now, &mut room) {
            deeds.push(match transmit {
                Transmit::Connect { target } => Deed::Connect(target),
                Transmit::Stream { target, len } => Deed::Stream(target, room[..len].to_vec()),
                Transmit::Disconnect { target } => Deed::Disconnect(target),
                Transmit::Datagram { to, len } => Deed::Datagram(to, room[..len].to_vec()),
                Transmit::JoinGroup { group } => Deed::Join(group),
                Transmit::LeaveGroup { group } => Deed::Leave(group),
            });
            assert!(deeds.len() < 1000, "it never stops: {:?}", deeds.last());
        }
        deeds
    }

    /// The one packet that it sends on a stream now.
    pub(crate) fn sent(&mut self) -> Vec<u8> {
        let deeds = self.deeds();
        let mut packets = deeds.iter().filter_map(|deed| match deed {
            Deed::Stream(_, bytes) => Some(bytes.clone()),
            _ => None,
        });
        let sent = packets.next().unwrap_or_else(|| panic!("nothing is sent: {deeds:?}"));
        assert_eq!(packets.next(), None, "more than one request at once");
        sent
    }

    /// The frames that it sends now.
    pub(crate) fn frames(&mut self) -> Vec<Vec<u8>> {
        let frame = |deed| match deed {
            Deed::Datagram(_, bytes) => Some(bytes),
            _ => None,
        };
        self.deeds().into_iter().filter_map(frame).collect()
    }

    pub(crate) fn events(&mut self) -> Vec<ScannerEvent> {
        self.events.extend(std::iter::from_fn(|| self.scanner.poll_event()));
        std::mem::take(&mut self.events)
    }

    pub(crate) fn status(&self) -> TargetStatus {
        self.scanner.status(0).expect("there is one")
    }

    /// Lets time pass as a driver would, and returns what was done when.
    pub(crate) fn pass(&mut self, time: Duration) -> Vec<(Instant, Deed)> {
        let end = self.now + time;
        let mut done = Vec::new();
        let mut at_once = 0;
        for _ in 0..1_000_000 {
            let now = self.now;
            done.extend(self.deeds().into_iter().map(|deed| (now, deed)));
            self.events.extend(std::iter::from_fn(|| self.scanner.poll_event()));
            let Some(next) = self.scanner.poll_timeout().filter(|next| *next <= end) else {
                self.now = end;
                return done;
            };
            at_once = if next <= now { at_once + 1 } else { 0 };
            assert!(at_once < 3, "the deadline {next:?} is not served at {now:?}");
            self.now = next.max(now);
            self.scanner.handle_timeout(self.now);
        }
        panic!("time does not pass");
    }

    /// What was sent on streams in `deeds`, by the service of the message.
    pub(crate) fn requests(deeds: &[(Instant, Deed)], service: u8) -> Vec<Vec<u8>> {
        let request = |(_, deed): &(Instant, Deed)| match deed {
            Deed::Stream(_, bytes) if bytes.get(40) == Some(&service) => Some(bytes.clone()),
            _ => None,
        };
        deeds.iter().filter_map(request).collect()
    }

    /// Confirms a Forward Close.
    pub(crate) fn confirm_close(&mut self, target: usize, close: &[u8]) {
        let mut message = vec![0xCE, 0, 0, 0];
        message.extend(&close[48..56]);
        message.extend([0, 0]);
        self.answer(target, close, &message);
    }

    /// Connects and registers again, as asked for.
    pub(crate) fn reconnect(&mut self, target: usize) {
        self.scanner.handle_connected(self.now, target);
        let register = self.sent();
        self.stream(target, &packet(0x65, SESSION, 0, context(&register), &[1, 0, 0, 0]));
    }

    pub(crate) fn stream(&mut self, target: usize, bytes: &[u8]) {
        self.scanner.handle_stream(self.now, target, bytes);
    }

    /// Answers a SendRRData request with a CIP message.
    pub(crate) fn answer(&mut self, target: usize, request: &[u8], message: &[u8]) {
        self.answer_with(target, request, message, &[]);
    }

    pub(crate) fn answer_with(
        &mut self,
        target: usize,
        request: &[u8],
        message: &[u8],
        items: &[(u16, [u8; 16])],
    ) {
        let data = unconnected(message, items);
        self.stream(target, &packet(0x6F, SESSION, 0, context(request), &data));
    }

    /// Refuses a Forward Open or Close with general status 1 and additional words.
    pub(crate) fn refuse(&mut self, target: usize, request: &[u8], words: &[u16]) {
        let service = request[40] | 0x80;
        let mut message = vec![service, 0, 1, words.len() as u8];
        message.extend(words.iter().flat_map(|word| word.to_le_bytes()));
        let triad =
            if service == 0xCE { request[48..56].to_vec() } else { triad(request).to_vec() };
        message.extend(triad);
        message.extend([0, 0]);
        self.answer(target, request, &message);
    }

    /// Connects, registers, refuses to tell an identity; returns the Forward Open.
    pub(crate) fn up_to_open(&mut self, target: usize) -> Vec<u8> {
        assert!(self.deeds().contains(&Deed::Connect(target)));
        self.scanner.handle_connected(self.now, target);
        let register = self.sent();
        assert_eq!(register[..2], [0x65, 0]);
        self.stream(target, &packet(0x65, SESSION, 0, context(&register), &[1, 0, 0, 0]));
        let request = self.sent();
        assert_eq!(request[40], 1, "GetAttributesAll");
        self.answer(target, &request, &[0x81, 0, 0x08, 0]);
        let open = self.sent();
        assert!(open[40] == 0x54 || open[40] == 0x5B, "a Forward Open");
        open
    }

    /// The message that accepts a Forward Open.
    pub(crate) fn acceptance(
        open: &[u8],
        t2o_id: [u8; 4],
        o2t_api_us: u32,
        t2o_api_us: u32,
    ) -> Vec<u8> {
        let mut message = vec![open[40] | 0x80];
        message.extend(OK);
        message.extend(O2T_ID);
        message.extend(t2o_id);
        message.extend(triad(open));
        message.extend(o2t_api_us.to_le_bytes());
        message.extend(t2o_api_us.to_le_bytes());
        message.extend([0, 0]);
        message
    }

    /// Brings a target up with these intervals; returns the id of its frames.
    pub(crate) fn open_with(&mut self, target: usize, o2t_api_us: u32, t2o_api_us: u32) -> [u8; 4] {
        let open = self.up_to_open(target);
        let id = t2o_id(&open);
        let message = Self::acceptance(&open, id, o2t_api_us, t2o_api_us);
        self.answer(target, &open, &message);
        id
    }

    /// Brings a target up at 10 ms.
    pub(crate) fn open(&mut self, target: usize) -> [u8; 4] {
        self.open_with(target, 10_000, 10_000)
    }

    /// A frame of target 0 arrives.
    pub(crate) fn receive(&mut self, frame: &[u8]) {
        self.scanner.handle_datagram(self.now, io_address(0), frame);
    }
}
