//! The objects that explicit messages reach, and their attributes.
//!
//! Each has its own file with what it is for. Of the class itself, attributes 1 (revision), 2 (greatest
//! instance) and 3 (number of instances) can be read. Nothing can be set.
//!
//! Source: CIP volume 1, chapter 5; CIP volume 2, chapter 5.

mod assembly;
mod connection_manager;
mod ethernet_link;
mod identity;
mod message_router;
mod qos;
mod tcp_ip;

use super::target::Target;
use crate::wire::enip::bytes::Writer;

/// A class of objects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Object {
    Identity,
    MessageRouter,
    Assembly,
    ConnectionManager,
    Qos,
    TcpIp,
    EthernetLink,
}

/// All classes with their numbers.
const CLASSES: [(u16, Object); 7] = [
    (0x01, Object::Identity),
    (0x02, Object::MessageRouter),
    (0x04, Object::Assembly),
    (0x06, Object::ConnectionManager),
    (0x48, Object::Qos),
    (0xF5, Object::TcpIp),
    (0xF6, Object::EthernetLink),
];

impl Object {
    /// The class with this number.
    pub(super) fn of_class(class: u32) -> Option<Self> {
        let mut classes = CLASSES.iter();
        classes.find(|(number, _)| u32::from(*number) == class).map(|(_, object)| *object)
    }

    /// Whether there is this instance, which is not 0.
    pub(super) fn has_instance(self, target: &Target, instance: u32) -> bool {
        match self {
            Self::Assembly => assembly::has_instance(&target.settings, instance),
            _ => instance == 1,
        }
    }

    /// What GetAttributesAll returns; empty where it is not offered.
    pub(super) const fn all_attributes(self) -> &'static [u32] {
        match self {
            Self::Identity => identity::ALL,
            Self::ConnectionManager => connection_manager::ALL,
            Self::TcpIp => tcp_ip::ALL,
            Self::EthernetLink => ethernet_link::ALL,
            Self::MessageRouter | Self::Assembly | Self::Qos => &[],
        }
    }

    /// Puts an attribute of an instance, or of the class if that is 0; whether there is such an attribute.
    pub(super) fn put_attribute(
        self,
        target: &Target,
        instance: u32,
        attribute: u32,
        writer: &mut Writer<'_>,
    ) -> bool {
        if instance == 0 {
            return self.put_class_attribute(target, attribute, writer);
        }
        match self {
            Self::Identity => identity::put(target, attribute, writer),
            Self::MessageRouter => message_router::put(target, attribute, writer),
            Self::Assembly => assembly::put(target, instance, attribute, writer),
            Self::ConnectionManager => connection_manager::put(target, attribute, writer),
            Self::Qos => qos::put(attribute, writer),
            Self::TcpIp => tcp_ip::put(target, attribute, writer),
            Self::EthernetLink => ethernet_link::put(target, attribute, writer),
        }
    }

    fn put_class_attribute(self, target: &Target, attribute: u32, writer: &mut Writer<'_>) -> bool {
        let (greatest, count) = match self {
            Self::Assembly => assembly::instances(&target.settings),
            _ => (1, 1),
        };
        let value = match attribute {
            1 => self.revision(),
            2 => greatest,
            3 => count,
            _ => return false,
        };
        writer.u16(value);
        true
    }

    const fn revision(self) -> u16 {
        match self {
            Self::Identity | Self::MessageRouter | Self::ConnectionManager | Self::Qos => 1,
            Self::Assembly => 2,
            Self::TcpIp => 4,
            Self::EthernetLink => 3,
        }
    }
}

/// Puts a counted string: a byte of length in front.
fn put_short_string(writer: &mut Writer<'_>, text: &[u8]) {
    let len = u8::try_from(text.len()).unwrap_or(u8::MAX);
    writer.u8(len);
    writer.put(text.get(..usize::from(len)).unwrap_or_default());
}
