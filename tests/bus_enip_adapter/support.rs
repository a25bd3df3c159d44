//! A robot to talk to: what it sends is collected, time moves from deadline to deadline.
//!
//! Messages are put together here from bytes, not with the crate's own writers.

use std::net::{Ipv4Addr, SocketAddrV4};

use fieldarm::bus::enip::adapter::{
    Adapter, AdapterEvent, AdapterSettings, MAX_TRANSMIT_LEN, StreamId, Transmit,
};
use fieldarm::time::{Duration, Instant};

/// Where the robot is.
pub(crate) const ADDRESS: Ipv4Addr = Ipv4Addr::new(192, 168, 0, 100);
/// Its first group: host 100.
pub(crate) const GROUP: Ipv4Addr = Ipv4Addr::new(239, 192, 13, 96);
/// Deadlines in one call of `advance`, at most.
const MAX_STEPS: u32 = 2_000_000;

pub(crate) fn peer(host: u8) -> SocketAddrV4 {
    SocketAddrV4::new(Ipv4Addr::new(192, 168, 0, host), 50_000)
}

pub(crate) const fn ms(millis: u64) -> Duration {
    Duration::from_millis(millis)
}

/// Bytes from hexadecimal text; `|` and spaces are for the reader.
pub(crate) fn hex(text: &str) -> Vec<u8> {
    let digits: Vec<u8> = text.bytes().filter(|byte| !b" |\n".contains(byte)).collect();
    assert!(digits.len().is_multiple_of(2), "half a byte in {text:?}");
    let byte = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap();
    digits.chunks(2).map(byte).collect()
}

pub(crate) fn shown(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" ")
}

/// A frame that the robot produced.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Frame {
    pub(crate) at: Instant,
    pub(crate) to: SocketAddrV4,
    pub(crate) bytes: Vec<u8>,
}

impl Frame {
    fn word(&self, at: usize) -> u32 {
        u32::from_le_bytes(self.bytes[at..at + 4].try_into().unwrap())
    }
    pub(crate) fn id(&self) -> u32 {
        self.word(6)
    }
    pub(crate) fn sequence(&self) -> u32 {
        self.word(10)
    }
    pub(crate) fn count(&self) -> u16 {
        u16::from_le_bytes([self.bytes[18], self.bytes[19]])
    }
    pub(crate) fn image(&self) -> &[u8] {
        &self.bytes[20..]
    }
}

/// A registered session.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Session {
    pub(crate) stream: StreamId,
    pub(crate) handle: u32,
}

/// What a Forward Open brought.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Opened {
    pub(crate) o2t_id: u32,
    pub(crate) t2o_id: u32,
    pub(crate) o2t_api_us: u32,
    pub(crate) t2o_api_us: u32,
    pub(crate) group: Option<SocketAddrV4>,
}

pub(crate) struct Robot {
    pub(crate) adapter: Adapter,
    pub(crate) now: Instant,
    pub(crate) frames: Vec<Frame>,
    pub(crate) messages: Vec<(SocketAddrV4, Vec<u8>)>,
    pub(crate) closed: Vec<usize>,
    pub(crate) answers: Vec<(usize, Vec<u8>)>,
}

impl Robot {
    pub(crate) fn new() -> Self {
        Self::with(AdapterSettings::meca500())
    }

    pub(crate) fn with(settings: AdapterSettings) -> Self {
        Self {
            adapter: Adapter::new(settings, ADDRESS, 1),
            now: Instant::from_millis(1_000),
            frames: Vec::new(),
            messages: Vec::new(),
            closed: Vec::new(),
            answers: Vec::new(),
        }
    }

    /// Collects what the robot sends now.
    pub(crate) fn flush(&mut self) {
        let mut room = [0; MAX_TRANSMIT_LEN];
        for _ in 0..10_000 {
            let Some(transmit) = self.adapter.poll_transmit(self.now, &mut room) else { return };
            match transmit {
                Transmit::Stream { stream, len } => {
                    self.answers.push((stream.index(), room[..len].to_vec()));
                }
                Transmit::CloseStream { stream } => self.closed.push(stream.index()),
                Transmit::MessageDatagram { to, len } => {
                    self.messages.push((to, room[..len].to_vec()));
                }
                Transmit::IoDatagram { to, len } => {
                    self.frames.push(Frame { at: self.now, to, bytes: room[..len].to_vec() });
                }
            }
        }
        panic!("the robot never stops sending");
    }

    /// Lets time pass, from deadline to deadline.
    pub(crate) fn advance(&mut self, by: Duration) {
        let end = self.now + by;
        for _ in 0..MAX_STEPS {
            match self.adapter.poll_timeout() {
                Some(next) if next <= end => self.now = self.now.max(next),
                _ => {
                    self.now = end;
                    return;
                }
            }
            self.adapter.handle_timeout(self.now);
            self.flush();
        }
        panic!("too many deadlines: does time stand still?");
    }

    pub(crate) fn events(&mut self) -> Vec<AdapterEvent> {
        std::iter::from_fn(|| self.adapter.poll_event()).collect()
    }

    pub(crate) fn accept(&mut self, peer: SocketAddrV4) -> StreamId {
        self.adapter.handle_accepted(self.now, peer).expect("a stream is free")
    }

    /// Sends bytes on a stream; what comes back on it at once.
    pub(crate) fn feed(&mut self, stream: StreamId, bytes: &[u8]) -> Vec<u8> {
        self.adapter.handle_stream(self.now, stream, bytes);
        self.answers.clear();
        self.flush();
        let own = self.answers.iter().filter(|(index, _)| *index == stream.index());
        own.flat_map(|(_, bytes)| bytes.clone()).collect()
    }

    pub(crate) fn session(&mut self, peer: SocketAddrV4) -> Session {
        let stream = self.accept(peer);
        let answer = self.feed(stream, &packet(0x65, 0, &hex("01 00 00 00")));
        assert_eq!(answer.len(), 28, "{}", shown(&answer));
        assert_eq!(&answer[8..12], [0; 4]);
        let handle = u32::from_le_bytes(answer[4..8].try_into().unwrap());
        assert_ne!(handle, 0);
        Session { stream, handle }
    }

    /// Sends a CIP message; the whole encapsulated answer.
    pub(crate) fn rr(&mut self, session: Session, message: &[u8], items: &[&[u8]]) -> Vec<u8> {
        self.feed(session.stream, &packet(0x6F, session.handle, &rr_data(message, items)))
    }

    /// Sends a CIP message; the CIP message that comes back.
    pub(crate) fn cip(&mut self, session: Session, message: &[u8]) -> Vec<u8> {
        unwrapped(&self.rr(session, message, &[])).0
    }

    /// Opens a connection, which must succeed.
    pub(crate) fn open(&mut self, session: Session, request: &[u8]) -> Opened {
        self.open_with(session, request, &[])
    }

    pub(crate) fn open_with(
        &mut self,
        session: Session,
        request: &[u8],
        items: &[&[u8]],
    ) -> Opened {
        let answer = self.rr(session, request, items);
        let (reply, group) = unwrapped(&answer);
        assert_eq!(&reply[..4], [0xD4, 0, 0, 0], "{}", shown(&reply));
        assert_eq!(reply.len(), 30);
        let word = |at: usize| u32::from_le_bytes(reply[at..at + 4].try_into().unwrap());
        Opened {
            o2t_id: word(4),
            t2o_id: word(8),
            o2t_api_us: word(20),
            t2o_api_us: word(24),
            group,
        }
    }

    /// An O->T frame with run/idle header.
    pub(crate) fn output(
        &mut self,
        from: SocketAddrV4,
        id: u32,
        seq: (u32, u16),
        run: bool,
        fill: u8,
    ) {
        let mut data = u32::from(run).to_le_bytes().to_vec();
        data.extend([fill; 60]);
        self.frame(from, id, seq, &data);
    }

    /// A frame with `data` behind its sequence count.
    pub(crate) fn frame(&mut self, from: SocketAddrV4, id: u32, seq: (u32, u16), data: &[u8]) {
        let from = SocketAddrV4::new(*from.ip(), 2_222);
        self.adapter.handle_io_datagram(self.now, from, &io_frame(id, seq, data));
    }
}

pub(crate) fn io_frame(id: u32, (sequence, count): (u32, u16), data: &[u8]) -> Vec<u8> {
    let mut bytes = hex("02 00 | 02 80 08 00");
    bytes.extend(id.to_le_bytes());
    bytes.extend(sequence.to_le_bytes());
    bytes.extend(hex("B1 00"));
    bytes.extend((data.len() as u16 + 2).to_le_bytes());
    bytes.extend(count.to_le_bytes());
    bytes.extend(data);
    bytes
}

/// An encapsulated message with sender context 1 to 8.
pub(crate) fn packet(command: u16, session: u32, data: &[u8]) -> Vec<u8> {
    let mut bytes = command.to_le_bytes().to_vec();
    bytes.extend((data.len() as u16).to_le_bytes());
    bytes.extend(session.to_le_bytes());
    bytes.extend(hex("00 00 00 00 | 01 02 03 04 05 06 07 08 | 00 00 00 00"));
    bytes.extend(data);
    bytes
}

/// The data of SendRRData; `items` stand behind the message, with type and length.
pub(crate) fn rr_data(message: &[u8], items: &[&[u8]]) -> Vec<u8> {
    let mut bytes = hex("00 00 00 00 | 05 00");
    bytes.extend((2 + items.len() as u16).to_le_bytes());
    bytes.extend(hex("00 00 00 00 | B2 00"));
    bytes.extend((message.len() as u16).to_le_bytes());
    bytes.extend(message);
    items.iter().for_each(|item| bytes.extend(*item));
    bytes
}

/// The CIP message in an answer to SendRRData, and the address that a T->O socket item tells.
pub(crate) fn unwrapped(answer: &[u8]) -> (Vec<u8>, Option<SocketAddrV4>) {
    assert!(answer.len() >= 40, "no CIP answer: {}", shown(answer));
    assert_eq!(answer[..2], [0x6F, 0]);
    let len = u16::from_le_bytes([answer[2], answer[3]]);
    assert_eq!(answer.len(), 24 + usize::from(len));
    assert_eq!(&answer[8..24], hex("00 00 00 00 01 02 03 04 05 06 07 08 00 00 00 00"));
    assert_eq!(&answer[24..30], [0; 6]);
    let count = answer[30];
    assert_eq!(&answer[31..38], hex("00 00 00 00 00 B2 00"));
    let end = 40 + usize::from(u16::from_le_bytes([answer[38], answer[39]]));
    let message = answer[40..end].to_vec();
    let group = match count {
        2 => {
            assert_eq!(answer.len(), end);
            None
        }
        3 => {
            let item = &answer[end..];
            assert_eq!(item.len(), 20);
            assert_eq!(&item[..6], hex("01 80 10 00 00 02"));
            assert_eq!(&item[12..], [0; 8]);
            let port = u16::from_be_bytes([item[6], item[7]]);
            Some(SocketAddrV4::new(Ipv4Addr::new(item[8], item[9], item[10], item[11]), port))
        }
        _ => panic!("{count} items in {}", shown(answer)),
    };
    (message, group)
}

/// Fields of a Forward Open that tests change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Field {
    Service,
    T2oId,
    Serial,
    Vendor,
    OriginatorSerial,
    Multiplier,
    O2tRpi,
    O2tParameters,
    T2oRpi,
    T2oParameters,
    Transport,
    /// With its size in words.
    Path,
}

/// A Forward Open of an owner at 10 ms, x16, point-to-point both ways, with the `changes`.
pub(crate) fn open_request(changes: &[(Field, &str)]) -> Vec<u8> {
    let fields = [
        (Field::Service, "54 02 20 06 24 01 | 0A 0E | 00 00 00 00"),
        (Field::T2oId, "44 33 22 11"),
        (Field::Serial, "07 00"),
        (Field::Vendor, "4D 00"),
        (Field::OriginatorSerial, "78 56 34 12"),
        (Field::Multiplier, "02 00 00 00"),
        (Field::O2tRpi, "10 27 00 00"),
        (Field::O2tParameters, "42 48"),
        (Field::T2oRpi, "10 27 00 00"),
        (Field::T2oParameters, "FE 48"),
        (Field::Transport, "01"),
        (Field::Path, "04 | 20 04 24 97 2C 96 2C 64"),
    ];
    let changed = |field: Field| changes.iter().find(|(other, _)| *other == field);
    fields
        .iter()
        .flat_map(|(field, usual)| hex(changed(*field).map_or(*usual, |(_, bytes)| *bytes)))
        .collect()
}

/// An owner with this serial number.
pub(crate) fn owner(serial: &str) -> Vec<u8> {
    open_request(&[(Field::Serial, serial)])
}

/// Input-only at 10 ms with heartbeats, point-to-point.
pub(crate) fn input_only(serial: &str) -> Vec<u8> {
    open_request(&[
        (Field::Serial, serial),
        (Field::O2tParameters, "02 48"),
        (Field::Path, "03 | 20 04 2C EE 2C 64"),
    ])
}

/// Forward Close of the connection with this serial number.
pub(crate) fn close_request(serial: &str) -> Vec<u8> {
    let mut bytes = hex("4E 02 20 06 24 01 | 0A 0E");
    bytes.extend(hex(serial));
    bytes.extend(hex("4D 00 78 56 34 12 | 04 00 | 20 04 24 97 2C 96 2C 64"));
    bytes
}
