//! How an adapter is set up.

use crate::time::Duration;
use crate::wire::enip::identity::Identity;

/// What may be opened.
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

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AdapterSettings {
    pub identity: Identity,
    pub output_assembly: u32,
    pub output_len: u16,
    pub input_assembly: u32,
    pub input_len: u16,
    /// A configuration instance is accepted if it is this one, or any with `None`; it is never needed.
    pub config_assembly: Option<u32>,
    pub input_only_point: u32,
    pub listen_only_point: u32,
    pub min_rpi: Duration,
    pub max_rpi: Duration,
    /// APIs are whole multiples of this, rounded up.
    pub rpi_step: Duration,
    pub access: Access,
    /// How long the first O->T frame may take.
    pub initial_watchdog: Duration,
    pub netmask: core::net::Ipv4Addr,
    pub mac: [u8; 6],
    pub host_name: &'static str,
}
