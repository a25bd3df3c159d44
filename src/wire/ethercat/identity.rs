//! Who a subdevice says it is, in the SII (words 8 to 15) and in object 1018h.

/// The four numbers of an EtherCAT identity: 32 bits each, little-endian on the wire.
///
/// Source: ETG.1000 part 6.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Identity {
    /// Vendor ID (1018h:01).
    pub vendor: u32,
    /// Product code (1018h:02).
    pub product: u32,
    /// Revision number (1018h:03).
    pub revision: u32,
    /// Serial number (1018h:04); 0 is "none given".
    pub serial: u32,
}

/// Mecademic's vendor ID. Source: mapping.
pub const MECA500_VENDOR_ID: u32 = 0x00EC_ADE1;
/// Product code of the Meca500, revisions R3 and R4 alike. Source: mapping.
pub const MECA500_PRODUCT_CODE: u32 = 0x0004_D500;
/// Revision number of every firmware so far, although the image's layout changed: it cannot tell
/// the layout. Source: mapping.
pub const MECA500_REVISION: u32 = 1;

impl Identity {
    /// A Meca500 with this serial number.
    #[must_use]
    pub const fn meca500(serial: u32) -> Self {
        Self {
            vendor: MECA500_VENDOR_ID,
            product: MECA500_PRODUCT_CODE,
            revision: MECA500_REVISION,
            serial,
        }
    }

    /// Whether vendor and product are those of a Meca500, whatever revision and serial number.
    #[must_use]
    pub const fn is_meca500(&self) -> bool {
        self.vendor == MECA500_VENDOR_ID && self.product == MECA500_PRODUCT_CODE
    }
}
