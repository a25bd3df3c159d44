//! Forward Open, Forward Close, and their answers.
//!
//! Source: CIP volume 1, chapter 3.

use super::bytes::{Reader, Writer};
use super::error::{DecodeError, NoRoom};
use super::parameters::{MAX_SMALL_SIZE, NetworkParameters, TimeoutMultiplier};

/// What tells one originator's connection from all others: 8 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Triad {
    /// Serial number of the connection, chosen by the originator.
    pub connection_serial: u16,
    /// The originator's vendor number.
    pub vendor: u16,
    /// The originator's serial number.
    pub originator_serial: u32,
}

impl Triad {
    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        Ok(Self {
            connection_serial: reader.u16("connection serial number")?,
            vendor: reader.u16("originator vendor")?,
            originator_serial: reader.u32("originator serial number")?,
        })
    }

    fn put(self, writer: &mut Writer<'_>) {
        writer.u16(self.connection_serial);
        writer.u16(self.vendor);
        writer.u32(self.originator_serial);
    }
}

/// Transport class and trigger of a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Transport(pub u8);

impl Transport {
    /// Class 1, produced cyclically; the direction bit is that of a client, as for all I/O.
    pub const CLASS_1_CYCLIC: Self = Self(0x01);

    /// Its class, 0 to 15.
    #[must_use]
    pub const fn class(self) -> u8 {
        self.0 & 0x0F
    }

    /// When data are produced: 0 cyclically, 1 on change, 2 when the application says so; 3 to 7 are
    /// reserved.
    #[must_use]
    pub const fn trigger(self) -> u8 {
        self.0 >> 4 & 7
    }

    /// Whether the target is the server of the connection (bit 7): explicit messages set it, I/O does not.
    #[must_use]
    pub const fn is_server(self) -> bool {
        self.0 & 0x80 != 0
    }
}

/// A request to open a connection: 36 bytes, 40 in a Large Forward Open, and the path.
///
/// Source: CIP volume 1, chapter 3.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ForwardOpen<'a> {
    /// Priority (bit 4) and tick time (bits 0 to 3: 2 to the power of it, in ms) of the request itself.
    pub priority_tick: u8,
    /// Ticks that the request may take.
    pub timeout_ticks: u8,
    /// Id of O->T; the target chooses it, and what stands here means nothing.
    pub o2t_id: u32,
    /// Id of T->O, chosen by the originator; of a multicast connection the target chooses it.
    pub t2o_id: u32,
    /// Which connection.
    pub triad: Triad,
    /// How many intervals without a frame end it.
    pub multiplier: TimeoutMultiplier,
    /// Requested interval O->T in us.
    pub o2t_rpi_us: u32,
    /// Parameters O->T.
    pub o2t: NetworkParameters,
    /// Requested interval T->O in us.
    pub t2o_rpi_us: u32,
    /// Parameters T->O.
    pub t2o: NetworkParameters,
    /// Class and trigger.
    pub transport: Transport,
    /// The connection path: see [`ConnectionPath`](super::path::ConnectionPath).
    pub path: &'a [u8],
}

impl<'a> ForwardOpen<'a> {
    /// Reads the data of a Forward Open, or of a Large one.
    ///
    /// # Errors
    ///
    /// It is cut off, longer than its path, or its multiplier is above 7.
    pub fn read(data: &'a [u8], is_large: bool) -> Result<Self, DecodeError> {
        let mut reader = Reader::new("Forward Open", data);
        let priority_tick = reader.u8("priority and tick time")?;
        let timeout_ticks = reader.u8("timeout ticks")?;
        let o2t_id = reader.u32("O->T connection id")?;
        let t2o_id = reader.u32("T->O connection id")?;
        let triad = Triad::read(&mut reader)?;
        let multiplier = reader.u8("timeout multiplier")?;
        let Some(multiplier) = TimeoutMultiplier::from_wire(multiplier) else {
            return Err(reader.wrong("timeout multiplier", multiplier, "0 to 7"));
        };
        reader.take("reserved bytes", 3)?;
        let parameters = |reader: &mut Reader<'a>, field| match is_large {
            true => reader.u32(field).map(NetworkParameters::from_double_word),
            false => reader.u16(field).map(NetworkParameters::from_word),
        };
        let o2t_rpi_us = reader.u32("O->T RPI")?;
        let o2t = parameters(&mut reader, "O->T parameters")?;
        let t2o_rpi_us = reader.u32("T->O RPI")?;
        let t2o = parameters(&mut reader, "T->O parameters")?;
        let transport = Transport(reader.u8("transport class and trigger")?);
        let words = reader.u8("path size")?;
        let path = reader.take("connection path", 2 * usize::from(words))?;
        reader.end()?;
        Ok(Self {
            priority_tick,
            timeout_ticks,
            o2t_id,
            t2o_id,
            triad,
            multiplier,
            o2t_rpi_us,
            o2t,
            t2o_rpi_us,
            t2o,
            transport,
            path,
        })
    }

    /// Writes the data of a Forward Open, or of a Large one, and returns their length: 36 or 40 bytes and
    /// the path.
    ///
    /// # Errors
    ///
    /// [`NoRoom`] if they do not fit, the path is longer than 255 words, or a size is above 511 bytes and
    /// the Forward Open is not a Large one.
    pub fn write(&self, room: &mut [u8], is_large: bool) -> Result<usize, NoRoom> {
        let mut writer = Writer::new(room);
        writer.put(&[self.priority_tick, self.timeout_ticks]);
        writer.u32(self.o2t_id);
        writer.u32(self.t2o_id);
        self.triad.put(&mut writer);
        writer.put(&[self.multiplier.to_wire(), 0, 0, 0]);
        for (rpi_us, parameters) in [(self.o2t_rpi_us, self.o2t), (self.t2o_rpi_us, self.t2o)] {
            writer.u32(rpi_us);
            if is_large {
                writer.u32(parameters.to_double_word());
            } else {
                if parameters.size > MAX_SMALL_SIZE {
                    writer.fail();
                }
                writer.u16(parameters.to_word());
            }
        }
        writer.u8(self.transport.0);
        writer.put_words(self.path, &[]);
        writer.finish()
    }
}

/// The answer of a target that opened the connection: 26 bytes and words of the application.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ForwardOpenReply<'a> {
    /// Id of O->T, chosen by the target.
    pub o2t_id: u32,
    /// Id of T->O.
    pub t2o_id: u32,
    /// Which connection.
    pub triad: Triad,
    /// Interval O->T in us that holds, whatever was requested.
    pub o2t_api_us: u32,
    /// Interval T->O in us that holds.
    pub t2o_api_us: u32,
    /// What the application adds: whole words, at most 255; usually none.
    pub application: &'a [u8],
}

impl<'a> ForwardOpenReply<'a> {
    /// Reads the data of a successful response.
    ///
    /// # Errors
    ///
    /// They are cut off, or longer than they say.
    pub fn read(data: &'a [u8]) -> Result<Self, DecodeError> {
        let (reply, mut reader) = Self::read_head(data)?;
        Ok(Self { application: read_application(&mut reader)?, ..reply })
    }

    /// Reads a successful response of a device that may be careless about its end: what it adds behind the
    /// intervals is passed over, be it more or less than it says.
    ///
    /// # Errors
    ///
    /// The response ends before its intervals do.
    pub fn read_answer(data: &'a [u8]) -> Result<Self, DecodeError> {
        Self::read_head(data).map(|(reply, _)| reply)
    }

    /// All but what the application adds, and where that begins.
    fn read_head(data: &'a [u8]) -> Result<(Self, Reader<'a>), DecodeError> {
        let mut reader = Reader::new("Forward Open reply", data);
        let reply = Self {
            o2t_id: reader.u32("O->T connection id")?,
            t2o_id: reader.u32("T->O connection id")?,
            triad: Triad::read(&mut reader)?,
            o2t_api_us: reader.u32("O->T API")?,
            t2o_api_us: reader.u32("T->O API")?,
            application: &[],
        };
        Ok((reply, reader))
    }

    /// Writes the data of a successful response and returns their length.
    ///
    /// # Errors
    ///
    /// [`NoRoom`] if they do not fit.
    pub fn write(&self, room: &mut [u8]) -> Result<usize, NoRoom> {
        let mut writer = Writer::new(room);
        writer.u32(self.o2t_id);
        writer.u32(self.t2o_id);
        self.triad.put(&mut writer);
        writer.u32(self.o2t_api_us);
        writer.u32(self.t2o_api_us);
        put_application(&mut writer, self.application);
        writer.finish()
    }
}

fn read_application<'a>(reader: &mut Reader<'a>) -> Result<&'a [u8], DecodeError> {
    let words = reader.u8("size of application reply")?;
    reader.u8("reserved byte")?;
    let application = reader.take("application reply", 2 * usize::from(words))?;
    reader.end()?;
    Ok(application)
}

fn put_application(writer: &mut Writer<'_>, application: &[u8]) {
    writer.put_words(application, &[0]);
}

/// What a refused Forward Open or Forward Close carries behind its status: 10 bytes, or 8.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ConnectionRefusal {
    /// Which connection.
    pub triad: Triad,
    /// Words of the path that were left when the refusal happened.
    pub remaining_path_words: u8,
}

impl ConnectionRefusal {
    /// Length in bytes.
    pub const LEN: usize = 10;

    /// Reads the data of a refusal. The size of the remaining path belongs to errors of routing only, so a
    /// device may leave it out, together with the reserved byte behind it: it then reads as 0.
    ///
    /// # Errors
    ///
    /// They are cut off, or longer than 10 bytes.
    pub fn read(data: &[u8]) -> Result<Self, DecodeError> {
        let mut reader = Reader::new("refusal of a connection", data);
        let triad = Triad::read(&mut reader)?;
        if reader.rest().is_empty() {
            return Ok(Self { triad, remaining_path_words: 0 });
        }
        let remaining_path_words = reader.u8("remaining path size")?;
        reader.u8("reserved byte")?;
        reader.end()?;
        Ok(Self { triad, remaining_path_words })
    }

    /// The data of a refusal.
    #[must_use]
    pub fn to_bytes(self) -> [u8; Self::LEN] {
        let mut bytes = [0; Self::LEN];
        let mut writer = Writer::new(&mut bytes);
        self.triad.put(&mut writer);
        writer.put(&[self.remaining_path_words, 0]);
        bytes
    }
}

/// A request to close a connection: 12 bytes and the path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ForwardClose<'a> {
    /// Priority and tick time of the request itself.
    pub priority_tick: u8,
    /// Ticks that the request may take.
    pub timeout_ticks: u8,
    /// Which connection.
    pub triad: Triad,
    /// The path it was opened with.
    pub path: &'a [u8],
}

impl<'a> ForwardClose<'a> {
    /// Reads the data of a Forward Close.
    ///
    /// # Errors
    ///
    /// They are cut off, or longer than the path.
    pub fn read(data: &'a [u8]) -> Result<Self, DecodeError> {
        let mut reader = Reader::new("Forward Close", data);
        let priority_tick = reader.u8("priority and tick time")?;
        let timeout_ticks = reader.u8("timeout ticks")?;
        let triad = Triad::read(&mut reader)?;
        let words = reader.u8("path size")?;
        reader.u8("reserved byte")?;
        let path = reader.take("connection path", 2 * usize::from(words))?;
        reader.end()?;
        Ok(Self { priority_tick, timeout_ticks, triad, path })
    }

    /// Writes the data of a Forward Close and returns their length.
    ///
    /// # Errors
    ///
    /// [`NoRoom`] if they do not fit.
    pub fn write(&self, room: &mut [u8]) -> Result<usize, NoRoom> {
        let mut writer = Writer::new(room);
        writer.put(&[self.priority_tick, self.timeout_ticks]);
        self.triad.put(&mut writer);
        writer.put_words(self.path, &[0]);
        writer.finish()
    }
}

/// The answer of a target that closed the connection: 10 bytes and words of the application.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ForwardCloseReply<'a> {
    /// Which connection.
    pub triad: Triad,
    /// What the application adds.
    pub application: &'a [u8],
}

impl<'a> ForwardCloseReply<'a> {
    /// Reads the data of a successful response.
    ///
    /// # Errors
    ///
    /// They are cut off, or longer than they say.
    pub fn read(data: &'a [u8]) -> Result<Self, DecodeError> {
        let mut reader = Reader::new("Forward Close reply", data);
        let triad = Triad::read(&mut reader)?;
        let application = read_application(&mut reader)?;
        Ok(Self { triad, application })
    }

    /// Writes the data of a successful response and returns their length.
    ///
    /// # Errors
    ///
    /// [`NoRoom`] if they do not fit.
    pub fn write(&self, room: &mut [u8]) -> Result<usize, NoRoom> {
        let mut writer = Writer::new(room);
        self.triad.put(&mut writer);
        put_application(&mut writer, self.application);
        writer.finish()
    }
}
