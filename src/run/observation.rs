//! What a run looks at in the images, beside the engine: for people and plots only.

use crate::wire::meca500::image::{InputImage, OutputImage};
use crate::wire::order::{Big, BigIntLittleReal, ByteOrder, ImageOrder, Little, LittleIntBigReal};

/// A few fields of one cycle's images as plain values.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Observation {
    /// Calculated joint positions, in degrees.
    pub joints_deg: [f32; 6],
    /// Calculated pose of the TRF in the WRF: mm, and degrees.
    pub pose: [f32; 6],
    /// The frames the pose is given in: the WRF in the BRF, then the TRF in the FRF.
    pub frames: [[f32; 6]; 2],
    /// Commands the robot's queue can still take; `None` over the text interface, which does not tell.
    pub fifo_space: Option<u16>,
    /// MoveID of the outputs and of the inputs; `None` over the text interface, which has none.
    pub move_ids: Option<MoveIds>,
    /// Robot's monotonic time, in microseconds.
    pub robot_time_us: u64,
}

/// The two ends of the handshake in one cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MoveIds {
    /// That of the outputs.
    pub sent: u16,
    /// That of the inputs.
    pub echoed: u16,
}

impl Observation {
    /// Reads the images in the given order; `None` if one has the wrong length.
    #[must_use]
    pub fn read(inputs: &[u8], outputs: &[u8], order: ByteOrder) -> Option<Self> {
        if order == Big::VALUE {
            Self::read_in::<Big>(inputs, outputs)
        } else if order == Little::VALUE {
            Self::read_in::<Little>(inputs, outputs)
        } else if order == BigIntLittleReal::VALUE {
            Self::read_in::<BigIntLittleReal>(inputs, outputs)
        } else {
            Self::read_in::<LittleIntBigReal>(inputs, outputs)
        }
    }

    fn read_in<O: ImageOrder>(inputs: &[u8], outputs: &[u8]) -> Option<Self> {
        let inputs = InputImage::<O>::from_bytes(inputs).ok()?;
        let outputs = OutputImage::<O>::from_bytes(outputs).ok()?;
        let pose = inputs.target_end_effector_pose.values();
        let [wrf, trf] = [inputs.target_wrf.values(), inputs.target_trf.values()]
            .map(|frame| [frame.x, frame.y, frame.z, frame.alpha, frame.beta, frame.gamma]);
        let timestamp = inputs.robot_timestamp.values();
        Some(Self {
            joints_deg: inputs.target_joint_set.values().joint,
            pose: [pose.x, pose.y, pose.z, pose.alpha, pose.beta, pose.gamma],
            frames: [wrf, trf],
            fifo_space: Some(inputs.motion_status.fifo_space.get()),
            move_ids: Some(MoveIds {
                sent: outputs.motion_control.move_id.get(),
                echoed: inputs.motion_status.move_id.get(),
            }),
            robot_time_us: u64::from(timestamp.seconds) * 1_000_000
                + u64::from(timestamp.microseconds),
        })
    }

    /// Whether a Meca500 could have sent this: in the wrong byte order it nearly never could.
    ///
    /// FifoSpace is at most 13,000; joints and coordinates are zero, or neither tiny nor huge.
    #[must_use]
    pub fn is_plausible(&self) -> bool {
        const LARGEST_FIFO_SPACE: u16 = 13_000;
        let is_sane = |value: &f32| *value == 0.0 || (1e-20..1e6).contains(&value.abs());
        let [wrf, trf] = &self.frames;
        let mut reals = self.joints_deg.iter().chain(&self.pose).chain(wrf).chain(trf);
        self.fifo_space.is_none_or(|space| space <= LARGEST_FIFO_SPACE) && reals.all(is_sane)
    }

    /// How far the tool moved since `earlier`, in mm; 0 when a frame changed in between, because the
    /// pose then jumps without a motion.
    #[must_use]
    pub fn distance_mm(&self, earlier: &Self) -> f64 {
        if self.frames != earlier.frames {
            return 0.0;
        }
        let [x, y, z, ..] = self.pose;
        let [before_x, before_y, before_z, ..] = earlier.pose;
        let square = |now: f32, before: f32| (f64::from(now) - f64::from(before)).powi(2);
        let distance = (square(x, before_x) + square(y, before_y) + square(z, before_z)).sqrt();
        if distance.is_finite() { distance } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::meca500::image::{INPUT_LEN, OUTPUT_LEN};

    #[test]
    fn fields_are_read_in_every_order() {
        for order in ByteOrder::ALL {
            let real = |value: f32| match order.reals {
                crate::wire::order::Endian::BigEndian => value.to_be_bytes(),
                crate::wire::order::Endian::LittleEndian => value.to_le_bytes(),
            };
            let mut inputs = [0; INPUT_LEN];
            inputs[16..20].copy_from_slice(&real(12.5));
            inputs[40..44].copy_from_slice(&real(190.0));
            inputs[8] = 1;
            inputs[9] = 1;
            let mut outputs = [0; OUTPUT_LEN];
            outputs[0..6].copy_from_slice(&[0, 0, 0, 0, 2, 2]);
            let seen = Observation::read(&inputs, &outputs, order).unwrap();
            assert_eq!(seen.joints_deg[0], 12.5, "{order}");
            assert_eq!(seen.pose[0], 190.0, "{order}");
            let move_ids = Some(MoveIds { sent: 0x0202, echoed: 0x0101 });
            assert_eq!(seen.move_ids, move_ids, "{order}");
            assert_eq!(Observation::read(&inputs[1..], &outputs, order), None);
        }
    }

    #[test]
    fn values_in_the_wrong_order_are_not_plausible() {
        let sane =
            Observation { fifo_space: Some(13_000), pose: [190.0; 6], ..Observation::default() };
        assert!(sane.is_plausible());
        let swapped = Some(13_000_u16.swap_bytes());
        assert!(!Observation { fifo_space: swapped, ..sane }.is_plausible());
        let swapped = f32::from_bits(190.0_f32.to_bits().swap_bytes());
        assert!(!Observation { pose: [swapped; 6], ..sane }.is_plausible());
    }

    #[test]
    fn a_change_of_frames_is_no_distance() {
        let still = Observation::default();
        let moved = Observation { pose: [3.0, 4.0, 12.0, 0.0, 0.0, 0.0], ..still };
        assert_eq!(moved.distance_mm(&still), 13.0);
        let mut other_tool = moved;
        other_tool.frames[1][2] = 50.0;
        assert_eq!(other_tool.distance_mm(&still), 0.0);
        let lost = Observation { pose: [f32::NAN; 6], ..still };
        assert_eq!(lost.distance_mm(&still), 0.0);
    }
}
