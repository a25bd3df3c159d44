//! Addresses of an ESC's registers, and the bits in them that somebody here reads or writes.
//!
//! All values are little-endian. Read the groups in order of address: what the chip is, how it is
//! addressed, its ports, the application layer, events, errors, watchdogs, the SII, FMMUs, sync
//! managers, distributed clocks.
//!
//! Source: ETG.1000 part 4.

/// First address of the process data memory; registers are below.
pub const RAM_START: u16 = 0x1000;

/// Type of the ESC, 1 byte; revision and build follow.
pub const TYPE: u16 = 0x0000;
/// Number of FMMUs, 1 byte.
pub const FMMU_COUNT: u16 = 0x0004;
/// Number of sync managers, 1 byte.
pub const SYNC_MANAGER_COUNT: u16 = 0x0005;
/// Process data memory in units of 1,024 bytes, 1 byte.
pub const RAM_SIZE: u16 = 0x0006;
/// Two bits a port: 0 none, 1 not configured, 2 E-bus, 3 MII; 1 byte.
pub const PORT_DESCRIPTOR: u16 = 0x0007;
/// What the ESC can do, 2 bytes.
pub const FEATURES: u16 = 0x0008;
/// [`FEATURES`]: distributed clocks, their 64-bit width, and SYNC signals that can be activated.
pub const FEATURES_DC: u16 = 0x010C;

/// Station address, 2 bytes; 0 after power-up.
pub const STATION_ADDRESS: u16 = 0x0010;
/// Second station address, 2 bytes, loaded from the SII at power-up.
pub const STATION_ALIAS: u16 = 0x0012;
/// Data link control, 4 bytes.
pub const DL_CONTROL: u16 = 0x0100;
/// [`DL_CONTROL`]: frames of other protocols are destroyed, and passed frames are marked in their
/// source address.
pub const DL_CONTROL_ETHERCAT_ONLY: u32 = 0x0000_0001;
/// [`DL_CONTROL`]: the alias is a station address too.
pub const DL_CONTROL_ALIAS: u32 = 0x0100_0000;
/// [`DL_CONTROL`]: shift of the two bits of port 1: 0 automatic, 1 automatic but opened only by a
/// write, 2 always open, 3 always closed.
pub const DL_CONTROL_PORT_1_SHIFT: u32 = 10;
/// [`DL_CONTROL`] after power-up.
pub const DL_CONTROL_POWER_UP: u32 = 0x0007_0001;
/// Data link status, 2 bytes.
pub const DL_STATUS: u16 = 0x0110;
/// [`DL_STATUS`]: the SII was loaded and the firmware's side works.
pub const DL_STATUS_OPERATIONAL: u16 = 0x0001;
/// [`DL_STATUS`]: the firmware's watchdog is not expired.
pub const DL_STATUS_PDI_WATCHDOG: u16 = 0x0002;
/// [`DL_STATUS`]: a link at port 0 and frames on it; its loop is open.
pub const DL_STATUS_PORT_0_OPEN: u16 = 0x0210;
/// [`DL_STATUS`]: a link at port 1.
pub const DL_STATUS_PORT_1_LINK: u16 = 0x0020;
/// [`DL_STATUS`]: frames come in at port 1.
pub const DL_STATUS_PORT_1_FRAMES: u16 = 0x0800;
/// [`DL_STATUS`]: the loop of port 1 is closed.
pub const DL_STATUS_PORT_1_CLOSED: u16 = 0x0400;
/// [`DL_STATUS`]: the loops of ports 2 and 3, which do not exist here, are closed.
pub const DL_STATUS_PORTS_2_3_CLOSED: u16 = 0x5000;

/// Application layer control, 2 bytes: the requested state.
pub const AL_CONTROL: u16 = 0x0120;
/// [`AL_CONTROL`]: acknowledges the error of AL status.
pub const AL_CONTROL_ACKNOWLEDGE: u8 = 0x10;
/// Application layer status, 2 bytes.
pub const AL_STATUS: u16 = 0x0130;
/// [`AL_STATUS`]: a request was refused or a state was left; the code says why.
pub const AL_STATUS_ERROR: u8 = 0x10;
/// AL status code, 2 bytes.
pub const AL_STATUS_CODE: u16 = 0x0134;
/// What the firmware is attached by, 1 byte, from the SII; its configuration follows.
pub const PDI_CONTROL: u16 = 0x0140;

/// Which events go into the event field of passing datagrams, 2 bytes.
pub const ECAT_EVENT_MASK: u16 = 0x0200;
/// Which events interrupt the firmware, 4 bytes.
pub const AL_EVENT_MASK: u16 = 0x0204;
/// Events for the main device, 2 bytes.
pub const ECAT_EVENT_REQUEST: u16 = 0x0210;
/// [`ECAT_EVENT_REQUEST`]: DL status changed; cleared by reading it.
pub const ECAT_EVENT_DL_STATUS: u16 = 0x0004;
/// [`ECAT_EVENT_REQUEST`]: AL status changed; cleared by reading it.
pub const ECAT_EVENT_AL_STATUS: u16 = 0x0008;
/// [`ECAT_EVENT_REQUEST`]: shift of the eight bits of the sync managers with something to read.
pub const ECAT_EVENT_SYNC_MANAGER_SHIFT: u32 = 4;
/// Events for the firmware, 4 bytes.
pub const AL_EVENT_REQUEST: u16 = 0x0220;
/// [`AL_EVENT_REQUEST`]: AL control was written.
pub const AL_EVENT_AL_CONTROL: u32 = 0x0000_0001;
/// [`AL_EVENT_REQUEST`]: a sync manager was switched or its configuration written.
pub const AL_EVENT_SYNC_MANAGER_CHANGE: u32 = 0x0000_0010;
/// [`AL_EVENT_REQUEST`]: the process data watchdog expired.
pub const AL_EVENT_WATCHDOG: u32 = 0x0000_0040;
/// [`AL_EVENT_REQUEST`]: shift of the bits of the sync managers with something for the firmware.
pub const AL_EVENT_SYNC_MANAGER_SHIFT: u32 = 8;

/// Errors of received frames, two bytes a port: invalid frames, then physical errors. A write to
/// any of 0300h to 030Bh clears all of them.
pub const RX_ERRORS: u16 = 0x0300;
/// Errors that a subdevice before found already, one byte a port.
pub const FORWARDED_ERRORS: u16 = 0x0308;
/// Frames with a broken chain of datagrams, 1 byte; cleared by a write.
pub const PROCESSING_ERRORS: u16 = 0x030C;
/// Lost links, one byte a port; a write to any clears all of them.
pub const LOST_LINKS: u16 = 0x0310;

/// Unit of both watchdogs, 2 bytes: (value + 2) * 40 ns.
pub const WATCHDOG_DIVIDER: u16 = 0x0400;
/// Time limit of the firmware's watchdog in units, 2 bytes; 0 switches it off.
pub const PDI_WATCHDOG: u16 = 0x0410;
/// Time limit of the process data watchdog in units, 2 bytes; 0 switches it off.
pub const PROCESS_WATCHDOG: u16 = 0x0420;
/// Process data watchdog, 2 bytes: 1 while it is fed or off, 0 when expired.
pub const PROCESS_WATCHDOG_STATUS: u16 = 0x0440;
/// How often the process data watchdog expired, 1 byte; a write to it or the next clears both.
pub const PROCESS_WATCHDOG_COUNTER: u16 = 0x0442;
/// How often the firmware's watchdog expired, 1 byte.
pub const PDI_WATCHDOG_COUNTER: u16 = 0x0443;
/// [`WATCHDOG_DIVIDER`] after power-up: 100 us.
pub const WATCHDOG_DIVIDER_POWER_UP: u16 = 0x09C2;
/// [`PDI_WATCHDOG`] and [`PROCESS_WATCHDOG`] after power-up: 100 ms with the divider of power-up.
pub const WATCHDOG_POWER_UP: u16 = 0x03E8;

/// Who may use the SII, 1 byte: bit 0 offers it to the firmware, bit 1 takes it back by force.
pub const SII_ACCESS: u16 = 0x0500;
/// SII control and status, 2 bytes.
pub const SII_CONTROL: u16 = 0x0502;
/// [`SII_CONTROL`]: a write is allowed in this very access.
pub const SII_WRITE_ENABLE: u16 = 0x0001;
/// [`SII_CONTROL`]: a read fetches 8 bytes instead of 4.
pub const SII_READS_8_BYTES: u16 = 0x0040;
/// [`SII_CONTROL`]: words are addressed with two bytes on the memory's own bus.
pub const SII_TWO_ADDRESS_BYTES: u16 = 0x0080;
/// [`SII_CONTROL`]: mask of the command.
pub const SII_COMMAND: u16 = 0x0700;
/// [`SII_CONTROL`]: read.
pub const SII_COMMAND_READ: u16 = 0x0100;
/// [`SII_CONTROL`]: write.
pub const SII_COMMAND_WRITE: u16 = 0x0200;
/// [`SII_CONTROL`]: load the configuration area again.
pub const SII_COMMAND_RELOAD: u16 = 0x0400;
/// [`SII_CONTROL`]: the configuration area has a wrong checksum and was not loaded.
pub const SII_CHECKSUM_ERROR: u16 = 0x0800;
/// [`SII_CONTROL`]: the last command was none, or there is no such address.
pub const SII_COMMAND_ERROR: u16 = 0x2000;
/// [`SII_CONTROL`]: a write without [`SII_WRITE_ENABLE`].
pub const SII_WRITE_ERROR: u16 = 0x4000;
/// [`SII_CONTROL`]: still at work.
pub const SII_BUSY: u16 = 0x8000;
/// Word address in the SII, 4 bytes.
pub const SII_ADDRESS: u16 = 0x0504;
/// Data read, 4 or 8 bytes, or to write, 2 bytes.
pub const SII_DATA: u16 = 0x0508;

/// First FMMU; each has [`FMMU_LEN`] bytes.
pub const FMMU: u16 = 0x0600;
/// Length of an FMMU in bytes.
pub const FMMU_LEN: u16 = 16;
/// First sync manager; each has [`SYNC_MANAGER_LEN`] bytes.
pub const SYNC_MANAGER: u16 = 0x0800;
/// Length of a sync manager in bytes: start 2, length 2, control, status, activation, firmware's.
pub const SYNC_MANAGER_LEN: u16 = 8;

/// Receive times of ports 0 to 3, 4 bytes each, in ns; a write to port 0's latches all.
pub const DC_RECEIVE_TIMES: u16 = 0x0900;
/// System time, 8 bytes, in ns; a write is what the control loop compares with.
pub const DC_SYSTEM_TIME: u16 = 0x0910;
/// Receive time of the processing unit, 8 bytes, in ns, latched with the ports'.
pub const DC_RECEIVE_TIME: u16 = 0x0918;
/// What the local clock lacks to system time, 8 bytes, in ns.
pub const DC_OFFSET: u16 = 0x0920;
/// Time a frame needs from the reference clock to here, 4 bytes, in ns.
pub const DC_DELAY: u16 = 0x0928;
/// Mean difference to the reference clock, 4 bytes, in ns: sign and magnitude.
pub const DC_DIFFERENCE: u16 = 0x092C;
/// [`DC_DIFFERENCE`]: the local copy of system time is behind.
pub const DC_DIFFERENCE_BEHIND: u32 = 0x8000_0000;
/// Speed counter start, 2 bytes; a write restarts the control loop.
pub const DC_SPEED_START: u16 = 0x0930;
/// Speed counter difference, 2 bytes.
pub const DC_SPEED_DIFFERENCE: u16 = 0x0932;
/// Filter depth of the difference, 1 byte: the mean is taken over 2 to this power.
pub const DC_DIFFERENCE_FILTER: u16 = 0x0934;
/// Filter depth of the speed counter, 1 byte.
pub const DC_SPEED_FILTER: u16 = 0x0935;
/// Who controls the SYNC unit, 1 byte; 0 is the main device.
pub const DC_CYCLIC_CONTROL: u16 = 0x0980;
/// SYNC activation, 1 byte.
pub const DC_ACTIVATION: u16 = 0x0981;
/// [`DC_ACTIVATION`]: the unit and SYNC0 are on.
pub const DC_ACTIVATION_SYNC0: u8 = 0x03;
/// [`DC_ACTIVATION`]: the unit and SYNC1 are on.
pub const DC_ACTIVATION_SYNC1: u8 = 0x05;
/// Time of the next SYNC0, 8 bytes, in ns of system time; a write sets the first.
pub const DC_SYNC0_TIME: u16 = 0x0990;
/// Time of the next SYNC1, 8 bytes, in ns of system time.
pub const DC_SYNC1_TIME: u16 = 0x0998;
/// Time between two SYNC0, 4 bytes, in ns.
pub const DC_SYNC0_CYCLE: u16 = 0x09A0;
/// Time from SYNC0 to SYNC1, 4 bytes, in ns.
pub const DC_SYNC1_CYCLE: u16 = 0x09A4;

bitflags::bitflags! {
    /// The control byte of a sync manager.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub struct SyncManagerControl: u8 {
        /// One buffer, written and read in turn, instead of three with the newest data.
        const MAILBOX = 0x02;
        /// The main device writes and the firmware reads; else the other way round.
        const OUTPUT = 0x04;
        /// Accesses are events for the main device.
        const ECAT_EVENT = 0x10;
        /// Accesses are events for the firmware.
        const PDI_EVENT = 0x20;
        /// A write feeds the process data watchdog.
        const WATCHDOG = 0x40;
        /// The low two bits say mailbox or buffered; the other two patterns are reserved.
        const RESERVED_MODE = 0x01;
        /// The second two bits say the direction; the other two patterns are reserved.
        const RESERVED_DIRECTION = 0x08;
    }
}

bitflags::bitflags! {
    /// The status byte of a sync manager.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub struct SyncManagerStatus: u8 {
        /// The buffer was written to its end; cleared when its first byte is read.
        const WRITTEN = 0x01;
        /// The buffer was read to its end; cleared when its first byte is written.
        const READ = 0x02;
        /// The mailbox holds something unread.
        const FULL = 0x08;
        /// Buffered: which buffer was written last, 3 for none.
        const BUFFER = 0x30;
    }
}

bitflags::bitflags! {
    /// The activation byte of a sync manager.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub struct SyncManagerActivation: u8 {
        /// On: its buffer is guarded.
        const ENABLED = 0x01;
        /// Toggled by the main device to have the last mailbox datagram again.
        const REPEAT = 0x02;
    }
}
