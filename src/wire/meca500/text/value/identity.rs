//! Who the robot is.

use core::fmt;

use super::ValueError;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::revision::Revision;
use crate::wire::meca500::text::message::Message;

/// A firmware version: `v11.3.84`, with a build behind it in some messages. Source: PM L4548.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FirmwareVersion {
    /// First number.
    pub major: u16,
    /// Second number.
    pub minor: u16,
    /// Third number.
    pub patch: u16,
}

impl FirmwareVersion {
    /// Reads answers 2081 (robot), 2082 (with the build, which is passed over), 2086 and 2088 (tool).
    ///
    /// # Errors
    ///
    /// [`ValueError`].
    pub fn read(message: &Message<'_>) -> Result<Self, ValueError> {
        let text = super::text(message)?;
        let unfit = ValueError::Unfit {
            code: message.code,
            position: 1,
            expected: "a version as v11.3.84",
        };
        Self::of(text).ok_or(unfit)
    }

    fn of(text: &str) -> Option<Self> {
        let text = text.strip_prefix('v').unwrap_or(text);
        let mut numbers = text.split('.').map(|part| {
            let is_number = !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit());
            is_number.then(|| part.parse().ok()).flatten()
        });
        let [major, minor, patch] = [numbers.next()??, numbers.next()??, numbers.next()??];
        Some(Self { major, minor, patch })
    }
}

impl fmt::Display for FirmwareVersion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "v{}.{}.{}", self.major, self.minor, self.patch)
    }
}

/// What message 3000 says of the robot: `Connected to Meca500 R3 v11.3.84`. What cannot be read is
/// `None`, because a text of the robot may change with its firmware (PM L480).
///
/// Source: client for the form.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Greeting {
    /// Hardware revision.
    pub revision: Option<Revision>,
    /// Firmware.
    pub firmware: Option<FirmwareVersion>,
}

impl Greeting {
    /// Reads message 3000; nothing from another.
    #[must_use]
    pub fn read(message: &Message<'_>) -> Self {
        let mut greeting = Self::default();
        if message.code != Code::CONNECTED {
            return greeting;
        }
        for word in message.body.split([' ', '_']) {
            match word {
                "R3" => greeting.revision = Some(Revision::R3),
                "R4" => greeting.revision = Some(Revision::R4),
                _ if word.starts_with('v') => greeting.firmware = FirmwareVersion::of(word),
                _ => {}
            }
        }
        greeting
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString as _;

    #[test]
    fn versions_are_three_numbers() {
        let read = |line: &str| FirmwareVersion::read(&Message::parse(line).unwrap());
        let version = FirmwareVersion { major: 11, minor: 3, patch: 84 };
        assert_eq!(read("[2081][v11.3.84]"), Ok(version));
        assert_eq!(read("[2082][11.3.84.1234-official]"), Ok(version));
        assert_eq!(version.to_string(), "v11.3.84");
        for line in ["[2081][v11.3]", "[2081][v11.3.x]", "[2081][]", "[2081][v1.+2.3]"] {
            assert!(read(line).is_err(), "{line}");
        }
    }

    #[test]
    fn a_greeting_tells_revision_and_firmware() {
        let read = |line: &str| Greeting::read(&Message::parse(line).unwrap());
        let greeting = read("[3000][Connected to Meca500 R4 v11.3.84]");
        assert_eq!(greeting.revision, Some(Revision::R4));
        assert_eq!(greeting.firmware.map(|version| version.patch), Some(84));
        assert_eq!(read("[3000][Connected to Meca500 x_x_x.x.x.]"), Greeting::default());
        assert_eq!(read("[3001][Meca500 R4 v11.3.84]"), Greeting::default());
    }
}
