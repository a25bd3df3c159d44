//! An EtherCAT frame: Ethernet header, EtherCAT header, datagrams one behind the other.
//!
//! ```text
//!  destination 6 | source 6 | 88 A4 | length:11 0 type:4 | datagram | datagram | ... | padding
//!  datagram: command 1 | index 1 | address 4 | length:11 000 C M | irq 2 | data | working counter 2
//! ```
//!
//! C is set on a frame that circulates behind a broken line, M when another datagram follows.
//! Both roles use this: the main device builds frames with [`FrameBuilder`] and reads what came
//! back with [`datagrams`]; a subdevice walks the same bytes with [`DatagramsMut`] and changes them
//! where they stand. The length in the EtherCAT header is written but, as in an ESC, not read: the
//! chain of datagrams says where it ends. Frames with a VLAN tag or in UDP are not EtherCAT here.
//!
//! Source: ETG.1000 part 4.

use super::command::Command;

/// Length of the Ethernet header in bytes: destination, source, type.
pub const ETHERNET_HEADER: usize = 14;
/// Length of the EtherCAT header in bytes.
pub const ETHERCAT_HEADER: usize = 2;
/// Length of a datagram's header in bytes; its working counter is not in it.
pub const DATAGRAM_HEADER: usize = 10;
/// Length of a datagram's working counter in bytes.
pub const WORKING_COUNTER: usize = 2;
/// The Ethernet type of EtherCAT; big-endian on the wire, as every Ethernet type.
pub const ETHER_TYPE: u16 = 0x88A4;
/// Longest data of one datagram in bytes: what its 11-bit length can say.
pub const MAX_DATA: usize = 0x07FF;
/// Shortest Ethernet frame without its checksum, in bytes; shorter ones are padded on a real wire.
pub const MIN_FRAME: usize = 60;
/// The bit that an ESC sets in the first byte of the source address: locally administered.
pub const PASSED_BIT: u8 = 0x02;

const TYPE_DATAGRAMS: u8 = 1;
const LENGTH_MASK: u16 = 0x07FF;
const CIRCULATING: u16 = 0x4000;
const MORE: u16 = 0x8000;
const MORE_IN_HIGH_BYTE: u8 = 0x80;

/// Why bytes are not a frame of EtherCAT datagrams.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FrameError {
    /// Not even an Ethernet header.
    #[error("an Ethernet frame has at least 14 bytes, found {found}")]
    TooShort {
        /// Bytes found.
        found: usize,
    },
    /// Some other protocol.
    #[error("Ethernet type {ether_type:04X}h is not EtherCAT (88A4h)")]
    NotEtherCat {
        /// The Ethernet type found.
        ether_type: u16,
    },
    /// EtherCAT, but not datagrams: network variables, a mailbox gateway.
    #[error("EtherCAT frame of type {kind}, only type 1 carries datagrams")]
    NotDatagrams {
        /// The type found, 0 to 15.
        kind: u8,
    },
    /// The frame ends inside a datagram, or before one that the previous one announced.
    #[error("datagram {number} at byte {offset} needs {needed} bytes, the frame has {found} left")]
    Truncated {
        /// Which datagram, counted from 0.
        number: usize,
        /// Where it starts, in bytes from the start of the frame.
        offset: usize,
        /// Bytes it needs, as far as can be told.
        needed: usize,
        /// Bytes there are.
        found: usize,
    },
}

/// One datagram of a frame, borrowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Datagram<'a> {
    /// The command's number; above 14 none is defined and subdevices ignore it.
    pub code: u8,
    /// The main device's own mark; comes back unchanged.
    pub index: u8,
    /// The four address bytes as they stand.
    pub address: [u8; 4],
    /// Whether the frame was marked as circulating.
    pub circulating: bool,
    /// Whether another datagram follows.
    pub more: bool,
    /// The OR of the subdevices' event requests, as far as their masks let them through.
    pub event: u16,
    /// The data.
    pub data: &'a [u8],
    /// The working counter.
    pub working_counter: u16,
}

impl Datagram<'_> {
    /// The command with its address, if the number is one of the fifteen.
    #[must_use]
    pub const fn command(&self) -> Option<Command> {
        Command::from_wire(self.code, self.address)
    }
}

/// The datagrams of a frame whose chain has been found whole.
#[derive(Clone, Debug)]
pub struct Datagrams<'a> {
    rest: &'a [u8],
    ended: bool,
}

/// Reads the datagrams of `frame`, which starts at the Ethernet header. All of them are checked
/// before the first is given out.
///
/// # Errors
///
/// What makes it no frame of datagrams, with the place.
pub fn datagrams(frame: &[u8]) -> Result<Datagrams<'_>, FrameError> {
    let (header, rest) = frame
        .split_first_chunk::<ETHERNET_HEADER>()
        .ok_or(FrameError::TooShort { found: frame.len() })?;
    let [.., high, low] = *header;
    let ether_type = u16::from_be_bytes([high, low]);
    if ether_type != ETHER_TYPE {
        return Err(FrameError::NotEtherCat { ether_type });
    }
    let truncated = |number, offset, needed, found| {
        Err(FrameError::Truncated { number, offset, needed, found })
    };
    let Some((&[_, kind], rest)) = rest.split_first_chunk::<ETHERCAT_HEADER>() else {
        return truncated(0, ETHERNET_HEADER, ETHERCAT_HEADER, rest.len());
    };
    if kind >> 4 != TYPE_DATAGRAMS {
        return Err(FrameError::NotDatagrams { kind: kind >> 4 });
    }
    let all = Datagrams { rest, ended: false };
    let mut walk = all.clone();
    let mut number = 0;
    while !walk.ended {
        let found = walk.rest.len();
        if walk.next().is_none() {
            let needed = walk.rest.first_chunk::<DATAGRAM_HEADER>().map_or(
                DATAGRAM_HEADER,
                |&[.., low, high, _, _]| {
                    let length = usize::from(u16::from_le_bytes([low, high]) & LENGTH_MASK);
                    DATAGRAM_HEADER + length + WORKING_COUNTER
                },
            );
            return truncated(number, frame.len() - found, needed, found);
        }
        number += 1;
    }
    Ok(all)
}

impl<'a> Iterator for Datagrams<'a> {
    type Item = Datagram<'a>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.ended {
            return None;
        }
        let (&[code, index, a, b, c, d, low, high, event_low, event_high], rest) =
            self.rest.split_first_chunk::<DATAGRAM_HEADER>()?;
        let length = u16::from_le_bytes([low, high]);
        let (data, rest) = rest.split_at_checked(usize::from(length & LENGTH_MASK))?;
        let (&counter, rest) = rest.split_first_chunk::<WORKING_COUNTER>()?;
        let more = length & MORE != 0;
        self.rest = rest;
        self.ended = !more;
        Some(Datagram {
            code,
            index,
            address: [a, b, c, d],
            circulating: length & CIRCULATING != 0,
            more,
            event: u16::from_le_bytes([event_low, event_high]),
            data,
            working_counter: u16::from_le_bytes(counter),
        })
    }
}

/// One datagram of a frame, to be changed where it stands.
#[derive(Debug)]
pub struct DatagramMut<'a> {
    header: &'a mut [u8; DATAGRAM_HEADER],
    /// The data.
    pub data: &'a mut [u8],
    counter: &'a mut [u8; WORKING_COUNTER],
}

impl DatagramMut<'_> {
    /// The command with its address; `None` for a number above 14.
    #[must_use]
    pub const fn command(&self) -> Option<Command> {
        let [code, _, a, b, c, d, ..] = *self.header;
        Command::from_wire(code, [a, b, c, d])
    }

    /// Adds one to the position or the broadcast counter, wrapping.
    pub fn count_device(&mut self) {
        let [_, _, low, high, ..] = self.header;
        [*low, *high] = u16::from_le_bytes([*low, *high]).wrapping_add(1).to_le_bytes();
    }

    /// Sets bits of the event field.
    pub fn raise_event(&mut self, bits: u16) {
        let [.., low, high] = self.header;
        [*low, *high] = (u16::from_le_bytes([*low, *high]) | bits).to_le_bytes();
    }

    /// Adds to the working counter, wrapping.
    pub fn add_to_working_counter(&mut self, increment: u16) {
        *self.counter = u16::from_le_bytes(*self.counter).wrapping_add(increment).to_le_bytes();
    }
}

/// The datagrams of a frame, to be changed where they stand. Gives out what is whole and stops
/// there; a subdevice asks [`datagrams`] first whether all of them are.
#[derive(Debug)]
pub struct DatagramsMut<'a> {
    rest: &'a mut [u8],
}

impl<'a> DatagramsMut<'a> {
    /// The datagrams of `frame`, which starts at the Ethernet header.
    #[must_use]
    pub fn new(frame: &'a mut [u8]) -> Self {
        let headers = ETHERNET_HEADER + ETHERCAT_HEADER;
        Self { rest: frame.split_at_mut_checked(headers).map_or(&mut [], |(_, rest)| rest) }
    }
}

impl<'a> Iterator for DatagramsMut<'a> {
    type Item = DatagramMut<'a>;

    fn next(&mut self) -> Option<Self::Item> {
        let rest = core::mem::take(&mut self.rest);
        let (header, rest) = rest.split_first_chunk_mut::<DATAGRAM_HEADER>()?;
        let [.., low, high, _, _] = *header;
        let length = u16::from_le_bytes([low, high]);
        let (data, rest) = rest.split_at_mut_checked(usize::from(length & LENGTH_MASK))?;
        let (counter, rest) = rest.split_first_chunk_mut::<WORKING_COUNTER>()?;
        if length & MORE != 0 {
            self.rest = rest;
        }
        Some(DatagramMut { header, data, counter })
    }
}

/// Marks a frame as passed by a subdevice: the locally administered bit of the source address.
pub fn mark_as_passed(frame: &mut [u8]) {
    if let Some([_, _, _, _, _, _, first, ..]) = frame.first_chunk_mut::<7>() {
        *first |= PASSED_BIT;
    }
}

/// The frame has no room for what shall go in; it is unchanged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no room in the frame: {needed} more bytes needed, {room} left")]
pub struct FrameFull {
    /// Bytes needed.
    pub needed: usize,
    /// Bytes left; a datagram's data also end at [`MAX_DATA`].
    pub room: usize,
}

/// Builds a frame in a buffer of the caller, one datagram after the other.
#[derive(Debug)]
pub struct FrameBuilder<'a> {
    buffer: &'a mut [u8],
    used: usize,
    last: Option<usize>,
}

impl<'a> FrameBuilder<'a> {
    /// Starts a broadcast frame from `source` in `buffer`, whose length is the limit.
    ///
    /// # Errors
    ///
    /// `buffer` cannot hold the headers.
    pub fn new(buffer: &'a mut [u8], source: [u8; 6]) -> Result<Self, FrameFull> {
        let used = ETHERNET_HEADER + ETHERCAT_HEADER;
        let room = buffer.len();
        let Some(head) = buffer.first_chunk_mut::<{ ETHERNET_HEADER + ETHERCAT_HEADER }>() else {
            return Err(FrameFull { needed: used, room });
        };
        let [a, b, c, d, e, f] = source;
        let [high, low] = ETHER_TYPE.to_be_bytes();
        *head = [
            0xFF,
            0xFF,
            0xFF,
            0xFF,
            0xFF,
            0xFF,
            a,
            b,
            c,
            d,
            e,
            f,
            high,
            low,
            0,
            TYPE_DATAGRAMS << 4,
        ];
        Ok(Self { buffer, used, last: None })
    }

    /// Appends a datagram with these data.
    ///
    /// # Errors
    ///
    /// It does not fit.
    pub fn push(&mut self, command: Command, index: u8, data: &[u8]) -> Result<(), FrameFull> {
        self.append(command, index, data.len())?.copy_from_slice(data);
        Ok(())
    }

    /// Appends a datagram with `length` bytes of zeros, to be filled by those it reads from.
    ///
    /// # Errors
    ///
    /// It does not fit.
    pub fn push_zeros(
        &mut self,
        command: Command,
        index: u8,
        length: usize,
    ) -> Result<(), FrameFull> {
        self.append(command, index, length)?.fill(0);
        Ok(())
    }

    /// Writes header and counter of a datagram and returns the room for its data.
    fn append(
        &mut self,
        command: Command,
        index: u8,
        length: usize,
    ) -> Result<&mut [u8], FrameFull> {
        let needed = DATAGRAM_HEADER + length + WORKING_COUNTER;
        let room = self.buffer.len().saturating_sub(self.used);
        let full = FrameFull { needed, room };
        // The EtherCAT header counts all datagrams with 11 bits, like a datagram its data.
        let total = self.used + needed - ETHERNET_HEADER - ETHERCAT_HEADER;
        let wire_length = u16::try_from(length).map_err(|_| full)?;
        if room < needed || total > MAX_DATA {
            return Err(full);
        }
        let start = self.used;
        if let Some(flags) = self.last.and_then(|last| self.buffer.get_mut(last + 7)) {
            *flags |= MORE_IN_HIGH_BYTE;
        }
        let [low, high] = (u16::try_from(total).unwrap_or(0)).to_le_bytes();
        if let Some([first, second]) = self
            .buffer
            .get_mut(ETHERNET_HEADER..)
            .and_then(|rest| rest.first_chunk_mut::<ETHERCAT_HEADER>())
        {
            (*first, *second) = (low, TYPE_DATAGRAMS << 4 | high);
        }
        self.used += needed;
        self.last = Some(start);
        let rest = self.buffer.get_mut(start..start + needed).ok_or(full)?;
        let (header, rest) = rest.split_first_chunk_mut::<DATAGRAM_HEADER>().ok_or(full)?;
        let (data, counter) = rest.split_last_chunk_mut::<WORKING_COUNTER>().ok_or(full)?;
        let [a, b, c, d] = command.address();
        let [low, high] = wire_length.to_le_bytes();
        *header = [command.code(), index, a, b, c, d, low, high, 0, 0];
        *counter = [0; WORKING_COUNTER];
        Ok(data)
    }

    /// Ends the frame and returns its length in the buffer. It is not padded: a wire pads to
    /// [`MIN_FRAME`] by itself where it needs that.
    #[must_use]
    pub const fn finish(self) -> usize {
        self.used
    }
}
