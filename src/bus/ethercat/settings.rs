//! What can be chosen about an emulated subdevice apart from its description.

use crate::time::Duration;

/// How a subdevice behaves where devices differ. [`Settings::default`] is a usual one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Whether the ESC has a distributed clock. Without it feature register 0008h says so, and
    /// registers 0900h to 09FFh do not exist.
    pub distributed_clock: bool,
    /// Whether an SII read fetches 8 bytes instead of 4.
    pub sii_reads_8_bytes: bool,
    /// One-way time of a frame from the device before, or from the main device, to this one. The
    /// way back takes the same. The default is 1 us.
    pub line_delay: Duration,
    /// What the local clock shows at power-up, in ns.
    pub clock_start_ns: u64,
    /// How much too fast the local clock runs, in parts per billion; 0 is exact.
    pub clock_drift_ppb: i32,
    /// How long a request for OP waits for the first outputs before AL status code 001Bh. The
    /// default is 9 s, the time that main devices grant this step.
    ///
    /// Source: choice
    pub outputs_timeout: Duration,
    /// How often the firmware lives when nothing else sets its pace: outside OP, or in OP without
    /// outputs. The default is 1 ms.
    ///
    /// Source: choice
    pub idle_period: Duration,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            distributed_clock: true,
            sii_reads_8_bytes: false,
            line_delay: Duration::from_micros(1),
            clock_start_ns: 0,
            clock_drift_ppb: 0,
            outputs_timeout: Duration::from_secs(9),
            idle_period: Duration::from_millis(1),
        }
    }
}
