//! What makes one emulated robot differ from another on the bus.

use crate::wire::meca500::image::pdo::PdoLayout;

/// How an emulated Meca500 presents itself on EtherCAT.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Meca500Settings {
    /// Serial number (1018h:04).
    pub serial: u32,
    /// Which firmware's objects the dictionary has. The device behind it must lay out its images
    /// accordingly; bits that this layout calls gaps are sent as the device wrote them.
    pub layout: PdoLayout,
    /// Hardware version (1009h). Source: choice.
    pub hardware_version: &'static str,
    /// Software version (100Ah). Source: choice.
    pub software_version: &'static str,
    /// PDOs that are not assigned after power-up, e.g. `&[0x1A08]`: a real robot was seen like
    /// that, with 248 input bytes. The main device may assign them. Source: capture.
    pub unassigned_at_power_up: &'static [u16],
    /// Refuses SAFE-OP with AL status code 0025h until the main device has written both
    /// assignments (1C12h and 1C13h) since power-up, as users report of real robots.
    pub assignment_must_be_written: bool,
}

impl Default for Meca500Settings {
    fn default() -> Self {
        Self {
            serial: 0,
            layout: PdoLayout::V11_3,
            hardware_version: "R3",
            software_version: "11.3.84",
            unassigned_at_power_up: &[],
            assignment_must_be_written: false,
        }
    }
}
