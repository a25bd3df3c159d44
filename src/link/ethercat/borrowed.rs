//! A robot in a group that somebody else drives.
//!
//! For a PLC that has its own `ethercrab` main device with drives and terminals on it: it brings its
//! group to OP and cycles it; a [`GroupRobot`] moves a robot's images in and out of the group and judges
//! what came back. This is the only place where types of `ethercrab` are part of the interface.

use ethercrab::subdevice_group::Op;
use ethercrab::{DefaultLock, MainDevice, SubDeviceGroup, SubDeviceState, TxRxResponse};

use super::error::EthercatError;
use super::layout::{Direction, LayoutMismatch};
use crate::cycle::InputQuality;
use crate::wire::ethercat::identity::{MECA500_PRODUCT_CODE, MECA500_VENDOR_ID};

/// One robot of a foreign group.
#[derive(Clone, Copy, Debug)]
pub struct GroupRobot {
    index: usize,
    quality: InputQuality,
}

impl GroupRobot {
    /// The robot with this index in `group`, which must hold our images as they are.
    ///
    /// # Errors
    ///
    /// There is no such subdevice, it is no Meca500, or its process data are not 60 and 252 bytes long:
    /// then assign all its PDOs (1C12h, 1C13h) before the group is configured.
    pub fn new<const ROBOTS: usize, const BYTES: usize, DC>(
        group: &SubDeviceGroup<ROBOTS, BYTES, DefaultLock, Op, DC>,
        main_device: &MainDevice<'_>,
        index: usize,
    ) -> Result<Self, EthercatError> {
        let position = u16::try_from(index).unwrap_or(u16::MAX);
        let found = u16::try_from(group.len()).unwrap_or(u16::MAX);
        let robot = group
            .subdevice(main_device, index)
            .map_err(|_| EthercatError::NoSuchPosition { position, found })?;
        let identity = robot.identity();
        let (vendor, product) = (identity.vendor_id, identity.product_id);
        if (vendor, product) != (MECA500_VENDOR_ID, MECA500_PRODUCT_CODE) {
            return Err(EthercatError::NotMeca500 { position, vendor, product });
        }
        let io = robot.io_raw();
        let lengths =
            [(Direction::Outputs, io.outputs().len()), (Direction::Inputs, io.inputs().len())];
        for (direction, found) in lengths {
            let mapped = direction.image_len();
            if mapped != found {
                let mismatch = LayoutMismatch::ProcessData { direction, mapped, found };
                return Err(EthercatError::Layout { position, mismatch });
            }
        }
        Ok(Self { index, quality: InputQuality::Lost })
    }

    /// Puts outputs into the group, for its next exchange. Not while one is under way. A slice of the
    /// wrong length changes nothing.
    pub fn write<const ROBOTS: usize, const BYTES: usize, DC>(
        &self,
        group: &SubDeviceGroup<ROBOTS, BYTES, DefaultLock, Op, DC>,
        main_device: &MainDevice<'_>,
        outputs: &[u8],
    ) {
        if let Ok(robot) = group.subdevice(main_device, self.index) {
            let mut io = robot.io_raw_mut();
            if io.outputs().len() == outputs.len() {
                io.outputs().copy_from_slice(outputs);
            }
        }
    }

    /// Takes the inputs out of the group after an exchange that brought `response`; `None` if it failed.
    /// `working_counter` is what the whole group should count: 3 for each robot.
    ///
    /// When the answer is not [`InputQuality::Fresh`], `inputs` keeps what it has.
    pub fn read<const ROBOTS: usize, const BYTES: usize, DC, T>(
        &mut self,
        group: &SubDeviceGroup<ROBOTS, BYTES, DefaultLock, Op, DC>,
        main_device: &MainDevice<'_>,
        response: Option<&TxRxResponse<ROBOTS, T>>,
        working_counter: u16,
        inputs: &mut [u8],
    ) -> InputQuality {
        let state = response.and_then(|response| response.subdevice_states.get(self.index));
        let adds_up = response.is_some_and(|response| response.working_counter == working_counter);
        self.quality = match (state, self.quality) {
            (Some(SubDeviceState::Op), _) if adds_up => InputQuality::Fresh,
            (Some(SubDeviceState::Op) | None, InputQuality::Fresh) => {
                InputQuality::Stale { age_cycles: 1 }
            }
            (Some(SubDeviceState::Op) | None, InputQuality::Stale { age_cycles }) => {
                InputQuality::Stale { age_cycles: age_cycles.saturating_add(1) }
            }
            _ => InputQuality::Lost,
        };
        if self.quality == InputQuality::Fresh
            && let Ok(robot) = group.subdevice(main_device, self.index)
        {
            let io = robot.inputs_raw();
            match inputs.len() == io.len() {
                true => inputs.copy_from_slice(&io),
                false => self.quality = InputQuality::Lost,
            }
        }
        self.quality
    }
}
