//! The robot as an EtherNet/IP adapter: who it is, and its assemblies.
//!
//! Source: PM Section 7 for the images; identity and assemblies from the vendor's published PLC projects,
//! the revision differs with the firmware.

use super::image::{INPUT_LEN, OUTPUT_LEN, RobotStatusFlags};
use crate::wire::enip::identity::{Identity, ProductName};

/// Assembly that O->T data go to: the output image.
pub const OUTPUT_ASSEMBLY: u32 = 150;
/// Assembly that T->O data come from: the input image.
pub const INPUT_ASSEMBLY: u32 = 100;
/// Configuration assembly that some scanners name; it holds nothing. `Unverified:` another source has none.
pub const CONFIG_ASSEMBLY: u32 = 151;
/// Bytes of the output assembly.
pub const OUTPUT_ASSEMBLY_LEN: u16 = OUTPUT_LEN as u16;
/// Bytes of the input assembly.
pub const INPUT_ASSEMBLY_LEN: u16 = INPUT_LEN as u16;
/// Bit of the input image that is 1 while a connection only watches (MonitoringMode), counted from bit 0 of its
/// first byte.
pub const MONITORING_BIT: u16 = RobotStatusFlags::MONITORING_MODE.bits().trailing_zeros() as u16;
/// Shortest interval that the robot accepts, in us.
pub const MIN_RPI_US: u32 = 10_000;

/// Who a Meca500 with firmware 11.3 says it is; each robot has a serial number of its own.
pub const IDENTITY: Identity = Identity {
    vendor: 1565,
    device_type: 43,
    product_code: 500,
    major: 11,
    minor: 3,
    status: 0,
    serial: 0,
    name: ProductName::new(b"Meca500"),
};
