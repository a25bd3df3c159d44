//! Why an SDO transfer was given up.

/// An SDO abort code, with a text of our own. Source: ETG.1000 part 6.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct AbortCode(pub u32);

macro_rules! codes {
    ($($name:ident = $code:literal $text:literal;)*) => {
        impl AbortCode {
            $(
                #[doc = concat!("`", stringify!($code), "`: ", $text, ".")]
                pub const $name: Self = Self($code);
            )*

            /// What the code means, for people.
            #[must_use]
            pub const fn text(self) -> &'static str {
                match self {
                    $(Self::$name => $text,)*
                    _ => "unknown abort code",
                }
            }
        }
    };
}

codes! {
    TOGGLE = 0x0503_0000 "the toggle bit of the segment did not alternate";
    TIMEOUT = 0x0504_0000 "the transfer took too long";
    COMMAND = 0x0504_0001 "the command is unknown, or does not belong to the transfer";
    OUT_OF_MEMORY = 0x0504_0005 "the device has no room for that much data";
    UNSUPPORTED_ACCESS = 0x0601_0000 "the object cannot be accessed in this way";
    WRITE_ONLY = 0x0601_0001 "the entry can only be written";
    READ_ONLY = 0x0601_0002 "the entry can only be read";
    COUNT_NOT_ZERO = 0x0601_0003 "the entry can be written only while sub-index 0 is 0";
    NO_COMPLETE_ACCESS = 0x0601_0004 "the object has no complete access: its length varies";
    LONGER_THAN_MAILBOX = 0x0601_0005 "the object is longer than the mailbox";
    MAPPED_OUTPUT = 0x0601_0006 "the entry is a cyclic output and not written by SDO";
    NO_OBJECT = 0x0602_0000 "the dictionary has no such object";
    CANNOT_MAP = 0x0604_0041 "this cannot be mapped or assigned here";
    PDO_LENGTH = 0x0604_0042 "the process data would become too long";
    PARAMETERS_CLASH = 0x0604_0043 "the parameters do not fit together";
    DEVICE_CLASH = 0x0604_0047 "the device does not fit the parameters";
    HARDWARE = 0x0606_0000 "the hardware failed";
    LENGTH_MISMATCH = 0x0607_0010 "the data are not as long as the entry";
    TOO_LONG = 0x0607_0012 "the data are longer than the entry";
    TOO_SHORT = 0x0607_0013 "the data are shorter than the entry";
    NO_SUB_INDEX = 0x0609_0011 "the object has no such sub-index";
    VALUE_RANGE = 0x0609_0030 "the value is not one of those allowed";
    VALUE_TOO_HIGH = 0x0609_0031 "the value is too high";
    VALUE_TOO_LOW = 0x0609_0032 "the value is too low";
    LIMITS_CROSSED = 0x0609_0036 "the maximum is below the minimum";
    GENERAL = 0x0800_0000 "the transfer failed";
    NOT_STORED = 0x0800_0020 "the data cannot be stored";
    NOT_STORED_LOCALLY = 0x0800_0021 "the device's own control does not let the data be stored";
    NOT_IN_THIS_STATE = 0x0800_0022 "this cannot be done in the state the device is in";
    NO_DICTIONARY = 0x0800_0023 "the device has no dictionary";
}

impl core::fmt::Display for AbortCode {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{} ({:#010x})", self.text(), self.0)
    }
}
