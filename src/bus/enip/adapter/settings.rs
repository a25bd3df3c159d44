//! How an adapter is set up.

use core::net::Ipv4Addr;

use super::{INPUT_ONLY_POINT, LISTEN_ONLY_POINT};
use crate::time::Duration;
use crate::wire::enip::identity::Identity;
use crate::wire::meca500::adapter::{
    CONFIG_ASSEMBLY, IDENTITY, INPUT_ASSEMBLY, INPUT_ASSEMBLY_LEN, MIN_RPI_US, OUTPUT_ASSEMBLY,
    OUTPUT_ASSEMBLY_LEN,
};

/// What may be opened.
///
/// Source: PM L3237 (`EnableEtherNetIp`), whose 0, 1 and 2 these are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Access {
    /// Nothing; nobody is answered.
    Disabled,
    /// Everything.
    #[default]
    Full,
    /// Only connections that monitor: an owner is refused.
    MonitoringOnly,
}

/// Who the adapter is, what it offers, and within which limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AdapterSettings {
    /// Who it says it is. Of the status word, "owned" (bit 0) and the state of its connections (bits 4 to 7)
    /// are filled in by the adapter.
    pub identity: Identity,
    /// Number of the assembly that O->T data go to.
    pub output_assembly: u32,
    /// Its length in bytes, at most [`MAX_IMAGE_LEN`](super::MAX_IMAGE_LEN); a greater one counts as that.
    pub output_len: u16,
    /// Number of the assembly that T->O data come from.
    pub input_assembly: u32,
    /// Its length in bytes, at most [`MAX_IMAGE_LEN`](super::MAX_IMAGE_LEN); a greater one counts as that.
    pub input_len: u16,
    /// A configuration instance is accepted if it is this one, or any with `None`; it is never needed.
    pub config_assembly: Option<u32>,
    /// O->T point of input-only connections.
    pub input_only_point: u32,
    /// O->T point of listen-only connections.
    pub listen_only_point: u32,
    /// Shortest interval that is accepted in either direction; a shorter one is refused with 01/0111.
    pub min_rpi: Duration,
    /// Longest interval that is accepted.
    pub max_rpi: Duration,
    /// APIs are whole multiples of this, rounded up; with zero they are what was requested.
    pub rpi_step: Duration,
    /// What may be opened at first; [`Adapter::set_access`](super::Adapter::set_access) changes it.
    pub access: Access,
    /// How long the first O->T frame may take, unless the connection's own timeout is longer.
    pub initial_watchdog: Duration,
    /// How long a TCP connection may be silent before it is closed, in whole seconds up to 3600, as the TCP/IP
    /// interface object tells it; zero keeps it for ever. A TCP connection over which a class 1 connection was
    /// opened counts as heard from as long as that is open.
    ///
    /// Source: CIP volume 2, chapter 5, attribute 13; what counts as heard from is a choice.
    pub inactivity: Duration,
    /// Mask of the network that the adapter's address is in; what is left of the address chooses its groups.
    pub netmask: Ipv4Addr,
    /// Hardware address, as the Ethernet link object tells it.
    pub mac: [u8; 6],
    /// Name of the host, as the TCP/IP interface object tells it.
    pub host_name: &'static str,
}

impl AdapterSettings {
    /// A Meca500: assemblies 150 with 60 bytes and 100 with 252 bytes, configuration 151, RPI 10 ms to 3.2 s
    /// in steps of 1 ms, everything may be opened, 10 s for the first frame, 120 s of silence over TCP.
    ///
    /// Source: PM L1770 for 10 ms, identity and assemblies from [`crate::wire::meca500::adapter`]; longest
    /// interval, step, network mask, hardware address and host name are a choice.
    #[must_use]
    pub const fn meca500() -> Self {
        Self {
            identity: IDENTITY,
            output_assembly: OUTPUT_ASSEMBLY,
            output_len: OUTPUT_ASSEMBLY_LEN,
            input_assembly: INPUT_ASSEMBLY,
            input_len: INPUT_ASSEMBLY_LEN,
            config_assembly: Some(CONFIG_ASSEMBLY),
            input_only_point: INPUT_ONLY_POINT,
            listen_only_point: LISTEN_ONLY_POINT,
            min_rpi: Duration::from_micros(MIN_RPI_US as u64),
            max_rpi: Duration::from_millis(3_200),
            rpi_step: Duration::from_millis(1),
            access: Access::Full,
            initial_watchdog: Duration::from_secs(10),
            inactivity: Duration::from_secs(120),
            netmask: Ipv4Addr::new(255, 255, 255, 0),
            // Locally administered: no robot has it.
            mac: [0x02, 0, 0, 0, 0, 0x01],
            host_name: "meca500",
        }
    }
}
