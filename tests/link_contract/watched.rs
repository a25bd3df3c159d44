//! A virtual robot with a witness beside it who sees every image that reaches the robot and every
//! image that it makes of it, whatever the bus does to them on the way.

use fieldarm::cycle::CyclicDevice;
use fieldarm::sim::meca500::{RobotSettings, VirtualRobot};
use fieldarm::time::Instant;
use fieldarm::wire::meca500::image::{InputImage, OUTPUT_LEN, OutputImage};
use fieldarm::wire::order::{Big, BigIntLittleReal, Endian, ImageOrder, Little, LittleIntBigReal};

use crate::checkers::RobotWitness;

/// The robot and its witness.
#[derive(Clone, Debug)]
pub(crate) struct WatchedRobot {
    pub(crate) robot: VirtualRobot,
    pub(crate) witness: RobotWitness,
}

impl WatchedRobot {
    pub(crate) fn new(settings: RobotSettings) -> Self {
        Self { robot: VirtualRobot::new(settings), witness: RobotWitness::default() }
    }

    fn watch<O: ImageOrder>(&mut self, outputs: &[u8], inputs: &[u8]) {
        if let (Ok(outputs), Ok(inputs)) =
            (OutputImage::<O>::from_bytes(outputs), InputImage::<O>::from_bytes(inputs))
        {
            self.witness.watch(outputs, inputs);
        }
    }
}

impl CyclicDevice for WatchedRobot {
    const OUTPUT_LEN: usize = VirtualRobot::OUTPUT_LEN;
    const INPUT_LEN: usize = VirtualRobot::INPUT_LEN;

    fn cycle(&mut self, now: Instant, outputs: Option<&[u8]>, inputs: &mut [u8]) {
        self.robot.cycle(now, outputs, inputs);
        if !self.robot.is_on_bus() {
            return;
        }
        let outputs = outputs.unwrap_or(&[0; OUTPUT_LEN]);
        let order = self.robot.settings().byte_order;
        match (order.integers, order.reals) {
            (Endian::BigEndian, Endian::BigEndian) => self.watch::<Big>(outputs, inputs),
            (Endian::LittleEndian, Endian::LittleEndian) => self.watch::<Little>(outputs, inputs),
            (Endian::BigEndian, Endian::LittleEndian) => {
                self.watch::<BigIntLittleReal>(outputs, inputs);
            }
            (Endian::LittleEndian, Endian::BigEndian) => {
                self.watch::<LittleIntBigReal>(outputs, inputs);
            }
        }
    }

    fn is_on_bus(&self) -> bool {
        self.robot.is_on_bus()
    }
}
