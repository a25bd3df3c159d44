//! Encoded paths (padded EPATH): which object, attribute or connection point is meant.
//!
//! Source: CIP volume 1, appendix C.

use super::bytes::{Reader, Writer};
use super::error::DecodeError;

const MESSAGE: &str = "path";

/// One segment of a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Segment<'a> {
    /// Number of a class. Numbers take 2 bytes up to 255, 4 up to 65535, 6 beyond.
    Class(u32),
    /// Number of an instance; 0 is the class itself.
    Instance(u32),
    /// Number of a member.
    Member(u32),
    /// Number of a connection point: an assembly.
    ConnectionPoint(u32),
    /// Number of an attribute.
    Attribute(u32),
    /// Which device is expected.
    Key(ElectronicKey),
    /// Least time between two frames, in ms.
    ProductionInhibit(u8),
    /// Data for the configuration assembly: whole words, at most 255.
    Data(&'a [u8]),
}

impl Segment<'_> {
    /// Its first byte, with the shortest format: names it in errors.
    const fn kind(&self) -> u8 {
        match self {
            Self::Class(_) => LOGICAL,
            Self::Instance(_) => LOGICAL | 1 << 2,
            Self::Member(_) => LOGICAL | 2 << 2,
            Self::ConnectionPoint(_) => LOGICAL | 3 << 2,
            Self::Attribute(_) => LOGICAL | 4 << 2,
            Self::Key(_) => KEY,
            Self::ProductionInhibit(_) => PRODUCTION_INHIBIT,
            Self::Data(_) => SIMPLE_DATA,
        }
    }
}

/// Which device a connection is meant for: 10 bytes, format 4. Zeros fit everything.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct ElectronicKey {
    /// Vendor number.
    pub vendor: u16,
    /// Device type.
    pub device_type: u16,
    /// Product code.
    pub product_code: u16,
    /// Major revision, 7 bits.
    pub major: u8,
    /// Minor revision.
    pub minor: u8,
    /// Whether a device that can stand in for the one described is good enough.
    pub is_compatible: bool,
}

/// Segment types and formats. A logical segment is `001TTTFF`: its type and the size of its value.
const LOGICAL: u8 = 0x20;
const LOGICAL_MASK: u8 = 0xE0;
const KEY: u8 = 0x34;
const KEY_FORMAT: u8 = 4;
const PRODUCTION_INHIBIT: u8 = 0x43;
const SIMPLE_DATA: u8 = 0x80;

/// The segments of a path.
#[derive(Clone, Copy, Debug)]
pub struct Segments<'a> {
    reader: Reader<'a>,
    has_failed: bool,
}

impl<'a> Segments<'a> {
    /// The bytes that have not been read yet; behind an error, up to where it was noticed.
    #[must_use]
    pub const fn rest(&self) -> &'a [u8] {
        self.reader.rest()
    }
}

/// Reads the segments of a padded path one by one; behind an error nothing follows.
#[must_use]
pub const fn segments(path: &[u8]) -> Segments<'_> {
    Segments { reader: Reader::new(MESSAGE, path), has_failed: false }
}

impl<'a> Iterator for Segments<'a> {
    type Item = Result<Segment<'a>, DecodeError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.has_failed || self.reader.rest().is_empty() {
            return None;
        }
        let segment = next_segment(&mut self.reader);
        self.has_failed = segment.is_err();
        Some(segment)
    }
}

fn next_segment<'a>(reader: &mut Reader<'a>) -> Result<Segment<'a>, DecodeError> {
    let kind = reader.u8("segment type")?;
    match kind {
        KEY => return read_key(reader).map(Segment::Key),
        PRODUCTION_INHIBIT => {
            return Ok(Segment::ProductionInhibit(reader.u8("production inhibit time")?));
        }
        SIMPLE_DATA => {
            let words = reader.u8("data segment size")?;
            let data = reader.take("data segment", 2 * usize::from(words))?;
            return Ok(Segment::Data(data));
        }
        _ => {}
    }
    let make = match (kind & LOGICAL_MASK, kind >> 2 & 7) {
        (LOGICAL, 0) => Segment::Class,
        (LOGICAL, 1) => Segment::Instance,
        (LOGICAL, 2) => Segment::Member,
        (LOGICAL, 3) => Segment::ConnectionPoint,
        (LOGICAL, 4) => Segment::Attribute,
        _ => return Err(reader.wrong("segment type", kind, "a logical, key or data segment")),
    };
    let value = match kind & 3 {
        0 => u32::from(reader.u8("8-bit segment value")?),
        1 => {
            reader.u8("segment padding")?;
            u32::from(reader.u16("16-bit segment value")?)
        }
        2 => {
            reader.u8("segment padding")?;
            reader.u32("32-bit segment value")?
        }
        _ => return Err(reader.wrong("segment type", kind, "a value of 8, 16 or 32 bits")),
    };
    Ok(make(value))
}

fn read_key(reader: &mut Reader<'_>) -> Result<ElectronicKey, DecodeError> {
    let format = reader.u8("key format")?;
    if format != KEY_FORMAT {
        return Err(reader.wrong("key format", format, "4"));
    }
    let (vendor, device_type) = (reader.u16("key vendor")?, reader.u16("key device type")?);
    let product_code = reader.u16("key product code")?;
    let major = reader.u8("key major revision")?;
    Ok(ElectronicKey {
        vendor,
        device_type,
        product_code,
        major: major & 0x7F,
        minor: reader.u8("key minor revision")?,
        is_compatible: major & 0x80 != 0,
    })
}

fn put_logical(writer: &mut Writer<'_>, kind: u8, value: u32) {
    if let Ok(value) = u8::try_from(value) {
        writer.u8(kind);
        writer.u8(value);
    } else if let Ok(value) = u16::try_from(value) {
        writer.u8(kind | 1);
        writer.u8(0);
        writer.u16(value);
    } else {
        writer.u8(kind | 2);
        writer.u8(0);
        writer.u32(value);
    }
}

pub(crate) fn put_segment(writer: &mut Writer<'_>, segment: Segment<'_>) {
    match segment {
        Segment::Class(value)
        | Segment::Instance(value)
        | Segment::Member(value)
        | Segment::ConnectionPoint(value)
        | Segment::Attribute(value) => put_logical(writer, segment.kind(), value),
        Segment::Key(key) => {
            writer.put(&[KEY, KEY_FORMAT]);
            writer.u16(key.vendor);
            writer.u16(key.device_type);
            writer.u16(key.product_code);
            writer.u8(key.major & 0x7F | u8::from(key.is_compatible) << 7);
            writer.u8(key.minor);
        }
        Segment::ProductionInhibit(ms) => writer.put(&[PRODUCTION_INHIBIT, ms]),
        Segment::Data(data) => {
            writer.u8(SIMPLE_DATA);
            writer.put_words(data, &[]);
        }
    }
}

/// Which attribute of which object a request means.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ObjectPath {
    /// Number of the class.
    pub class: u32,
    /// Number of the instance; 0, or none given, is the class itself.
    pub instance: u32,
    /// Number of the attribute, if one is given.
    pub attribute: Option<u32>,
}

impl ObjectPath {
    /// The connection manager.
    pub const CONNECTION_MANAGER: Self = Self { class: 6, instance: 1, attribute: None };

    /// Reads the path of a request: class, instance, attribute, in this order.
    ///
    /// # Errors
    ///
    /// Other segments, or another order.
    pub fn read(path: &[u8]) -> Result<Self, DecodeError> {
        const ORDER: &str = "class, instance and attribute in this order";
        let reader = Reader::new(MESSAGE, path);
        let wrong = |other: Segment<'_>| reader.wrong("order of segments", other.kind(), ORDER);
        let mut segments = segments(path);
        let class = match segments.next().transpose()? {
            Some(Segment::Class(class)) => class,
            Some(other) => return Err(wrong(other)),
            None => return Err(DecodeError::Truncated { message: MESSAGE, field: "class" }),
        };
        let mut found = Self { class, instance: 0, attribute: None };
        let mut has_instance = false;
        for segment in segments {
            match segment? {
                Segment::Instance(instance) if !has_instance && found.attribute.is_none() => {
                    (found.instance, has_instance) = (instance, true);
                }
                // A connection point names an assembly as an instance does.
                Segment::ConnectionPoint(instance)
                    if !has_instance && found.attribute.is_none() =>
                {
                    (found.instance, has_instance) = (instance, true);
                }
                Segment::Attribute(attribute) if found.attribute.is_none() => {
                    found.attribute = Some(attribute);
                }
                other => return Err(wrong(other)),
            }
        }
        Ok(found)
    }

    /// Writes the path into `room` and returns its length, which is even.
    ///
    /// # Errors
    ///
    /// [`NoRoom`](super::NoRoom) if it does not fit; 18 bytes always suffice.
    pub fn write(&self, room: &mut [u8]) -> Result<usize, super::NoRoom> {
        let mut writer = Writer::new(room);
        put_segment(&mut writer, Segment::Class(self.class));
        put_segment(&mut writer, Segment::Instance(self.instance));
        if let Some(attribute) = self.attribute {
            put_segment(&mut writer, Segment::Attribute(attribute));
        }
        writer.finish()
    }
}

/// What the path of a Forward Open names: assemblies, and perhaps a key and configuration data.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ConnectionPath<'a> {
    /// Which device is expected.
    pub key: Option<ElectronicKey>,
    /// Configuration assembly.
    pub config: Option<u32>,
    /// Assembly that O->T data go to.
    pub o2t: Option<u32>,
    /// Assembly that T->O data come from.
    pub t2o: Option<u32>,
    /// Data for the configuration assembly.
    pub data: &'a [u8],
}

/// Class of the assembly object.
pub const ASSEMBLY: u32 = 4;

impl<'a> ConnectionPath<'a> {
    /// Reads a connection path: perhaps a key, the assembly class, perhaps an instance for the
    /// configuration, the O->T point, the T->O point, perhaps data. Points may be given as instances; one
    /// point alone is that of O->T. A production inhibit time is passed over.
    ///
    /// # Errors
    ///
    /// Segments that cannot be read, in another order or twice, another class than assembly, or more than
    /// two points.
    pub fn read(path: &'a [u8]) -> Result<Self, DecodeError> {
        const CONNECTION: &str = "connection path";
        const ORDER: &str = "key, class, instance, points, data, each once";
        let reader = Reader::new(CONNECTION, path);
        let mut found = Self::default();
        let mut class = None;
        let mut instances = [None; 3];
        let mut points = [None; 2];
        for segment in segments(path) {
            match segment? {
                Segment::Key(key) if class.is_none() && found.key.is_none() => {
                    found.key = Some(key);
                }
                Segment::Class(number) if class.is_none() => class = Some(number),
                Segment::Instance(number) => push(&reader, &mut instances, number)?,
                Segment::ConnectionPoint(number) => push(&reader, &mut points, number)?,
                Segment::ProductionInhibit(_) => {}
                Segment::Data(data) if class.is_some() && found.data.is_empty() => {
                    found.data = data;
                }
                other => return Err(reader.wrong("order of segments", other.kind(), ORDER)),
            }
        }
        match class {
            Some(ASSEMBLY) => {}
            Some(other) => return Err(reader.wrong("class", other, "4 (assembly)")),
            None => return Err(DecodeError::Truncated { message: CONNECTION, field: "class" }),
        }
        (found.config, found.o2t, found.t2o) = match (instances, points) {
            ([config, None, None], [o2t, t2o]) => (config, o2t, t2o),
            ([o2t, t2o, None], [None, None]) => (None, o2t, t2o),
            ([config, o2t, t2o], [None, None]) => (config, o2t, t2o),
            ([config, o2t, None], [t2o, None]) => (config, o2t, t2o),
            _ => return Err(reader.wrong("number of points", 3_u8, "two at most")),
        };
        Ok(found)
    }

    /// Writes the path into `room` and returns its length, which is even.
    ///
    /// # Errors
    ///
    /// [`NoRoom`](super::NoRoom) if it does not fit; without data 34 bytes always suffice.
    pub fn write(&self, room: &mut [u8]) -> Result<usize, super::NoRoom> {
        let mut writer = Writer::new(room);
        if let Some(key) = self.key {
            put_segment(&mut writer, Segment::Key(key));
        }
        put_segment(&mut writer, Segment::Class(ASSEMBLY));
        if let Some(config) = self.config {
            put_segment(&mut writer, Segment::Instance(config));
        }
        for point in [self.o2t, self.t2o].into_iter().flatten() {
            put_segment(&mut writer, Segment::ConnectionPoint(point));
        }
        if !self.data.is_empty() {
            put_segment(&mut writer, Segment::Data(self.data));
        }
        writer.finish()
    }
}

/// Puts `number` into the first free place.
fn push(reader: &Reader<'_>, places: &mut [Option<u32>], number: u32) -> Result<(), DecodeError> {
    match places.iter_mut().find(|place| place.is_none()) {
        Some(place) => {
            *place = Some(number);
            Ok(())
        }
        None => Err(reader.wrong("instance or point", number, "the last, with none behind it")),
    }
}
