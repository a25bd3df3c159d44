//! The robots of one frame: an `ethercrab` group, with or without distributed clocks.

use std::sync::Arc;
use std::vec::Vec;

use ethercrab::error::Error;
use ethercrab::subdevice_group::{HasDc, HasPdi, NoDc, Op};
use ethercrab::{DefaultLock, MainDevice, SubDeviceGroup, TxRxResponse};

use super::layout::Layout;
use crate::time::Duration;
use crate::wire::ethercat::frame::{
    DATAGRAM_HEADER, ETHERCAT_HEADER, ETHERNET_HEADER, WORKING_COUNTER,
};
use crate::wire::ethercat::identity::Identity;

/// Robots in one frame: four images of 312 bytes and their state checks fill it.
pub(super) const GROUP_ROBOTS: usize = 4;
/// Process data of a group in bytes, so that it never needs a second frame.
pub(super) const GROUP_BYTES: usize = 1_400;

/// What a datagram adds to its data, in bytes.
const DATAGRAM: usize = DATAGRAM_HEADER + WORKING_COUNTER;
/// Length of the system time, in bytes.
const CLOCK: usize = 8;
/// Length of an AL status, in bytes.
const STATE: usize = 2;

pub(super) type Group<S, DC = NoDc> = SubDeviceGroup<GROUP_ROBOTS, GROUP_BYTES, DefaultLock, S, DC>;

/// A group whose process data are exchanged.
pub(super) enum RobotGroup {
    Free(Group<Op, NoDc>),
    Clocked(Group<Op, HasDc>),
}

/// Where the DC reference stood when a frame passed it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ClockReading {
    /// System time of the reference, in ns.
    pub(super) system_time_ns: u64,
    /// Time since the last SYNC0 of the reference.
    pub(super) since_sync0: Duration,
}

/// What came back for a group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct GroupReply {
    pub(super) working_counter: u16,
    /// AL state of each member as its number on the wire; 0 if it did not answer.
    pub(super) states: [u8; GROUP_ROBOTS],
    pub(super) clock: Option<ClockReading>,
}

impl GroupReply {
    fn new<T>(
        response: &TxRxResponse<GROUP_ROBOTS, T>,
        clock: impl FnOnce(&T) -> Option<ClockReading>,
    ) -> Self {
        let mut states = [0; GROUP_ROBOTS];
        for (state, found) in states.iter_mut().zip(&response.subdevice_states) {
            *state = u8::from(*found);
        }
        Self { working_counter: response.working_counter, states, clock: clock(&response.extra) }
    }
}

impl RobotGroup {
    /// Number of robots.
    pub(super) fn len(&self) -> usize {
        match self {
            Self::Free(group) => group.len(),
            Self::Clocked(group) => group.len(),
        }
    }

    /// Length of the frame of a cycle, in bytes.
    pub(super) fn frame_len(&self, main_device: &MainDevice<'_>) -> usize {
        /// Process data of all members, in bytes.
        fn process_data<S: HasPdi, DC>(
            group: &Group<S, DC>,
            main_device: &MainDevice<'_>,
        ) -> usize {
            let of_member = |member| {
                let robot = group.subdevice(main_device, member).ok()?;
                let io = robot.io_raw();
                Some(io.inputs().len() + io.outputs().len())
            };
            (0..group.len()).filter_map(of_member).sum()
        }
        let (data, reference) = match self {
            Self::Free(group) => (process_data(group, main_device), 0),
            Self::Clocked(group) => (process_data(group, main_device), DATAGRAM + CLOCK),
        };
        let states = self.len() * (DATAGRAM + STATE);
        ETHERNET_HEADER + ETHERCAT_HEADER + reference + DATAGRAM + data + states
    }

    /// One frame: outputs, inputs and states of all members.
    pub(super) async fn cycle(&self, main_device: &MainDevice<'_>) -> Result<GroupReply, Error> {
        match self {
            Self::Free(group) => {
                let response = group.tx_rx(main_device).await?;
                Ok(GroupReply::new(&response, |()| None))
            }
            Self::Clocked(group) => {
                let response = group.tx_rx_dc(main_device).await?;
                Ok(GroupReply::new(&response, |cycle| {
                    Some(ClockReading {
                        system_time_ns: cycle.dc_system_time,
                        since_sync0: cycle.cycle_start_offset,
                    })
                }))
            }
        }
    }

    /// Puts outputs of a member into its process data. Not while a cycle of the group is under way.
    pub(super) fn write(
        &self,
        main_device: &MainDevice<'_>,
        member: usize,
        layout: &Layout,
        image: &[u8],
    ) {
        match self {
            Self::Free(group) => {
                if let Ok(robot) = group.subdevice(main_device, member) {
                    layout.scatter(image, robot.io_raw_mut().outputs());
                }
            }
            Self::Clocked(group) => {
                if let Ok(robot) = group.subdevice(main_device, member) {
                    layout.scatter(image, robot.io_raw_mut().outputs());
                }
            }
        }
    }

    /// Takes inputs of a member from its process data. Not while a cycle of the group is under way.
    pub(super) fn read(
        &self,
        main_device: &MainDevice<'_>,
        member: usize,
        layout: &Layout,
        image: &mut [u8],
    ) {
        match self {
            Self::Free(group) => {
                if let Ok(robot) = group.subdevice(main_device, member) {
                    layout.gather(&robot.inputs_raw(), image);
                }
            }
            Self::Clocked(group) => {
                if let Ok(robot) = group.subdevice(main_device, member) {
                    layout.gather(&robot.inputs_raw(), image);
                }
            }
        }
    }
}

/// What an ESC needs to be told again after a restart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct EscSetup {
    /// FMMU 0 to 3.
    pub(super) fmmus: [u8; 64],
    /// Sync manager 0 to 3.
    pub(super) sync_managers: [u8; 32],
    /// Propagation delay in ns.
    pub(super) delay_ns: u32,
}

impl Default for EscSetup {
    fn default() -> Self {
        Self { fmmus: [0; 64], sync_managers: [0; 32], delay_ns: 0 }
    }
}

/// One robot as the cycle and its care see it.
pub(super) struct Member {
    pub(super) group: usize,
    pub(super) index: usize,
    pub(super) station: u16,
    pub(super) position: u16,
    pub(super) identity: Identity,
    pub(super) outputs: Layout,
    pub(super) inputs: Layout,
    pub(super) setup: EscSetup,
}

/// What the cycle and a task that cares for a robot both use.
pub(super) struct Shared {
    pub(super) main_device: Arc<MainDevice<'static>>,
    pub(super) groups: Vec<RobotGroup>,
    pub(super) members: Vec<Member>,
}
