//! Where the arm is, from what the robot tells of it.
//!
//! ```text
//! [2026][joints] [2027][pose] ... [2230][time]      one observation, every monitoring interval
//! ```

use crate::run::observation::Observation;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::text::Message;

const JOINTS: Code = Code(2026);
const POSE: Code = Code(2027);
const TARGET_JOINTS: Code = Code(2200);
const TARGET_POSE: Code = Code(2201);
const CYCLE_END: Code = Code(2230);

/// A frame that is just changing: unlike every frame, itself too.
const CHANGING: [f32; 6] = [f32::NAN; 6];

/// The observation in progress.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trace {
    joints: Option<[f32; 6]>,
    pose: Option<[f32; 6]>,
    frames: [[f32; 6]; 2],
    time_us: u64,
    /// Whether a pose has come and the mark that ends the cycle has not.
    is_open: bool,
}

/// Which of the two frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Frame {
    Wrf,
    Trf,
}

fn narrow(values: [f64; 6]) -> [f32; 6] {
    values.map(|value| value as f32)
}

/// Six numbers behind a time stamp.
fn stamped(message: &Message<'_>) -> Option<(u64, [f32; 6])> {
    let [_, a, b, c, d, e, f] = message.numbers()?;
    let time = message.values().next()?.integer()?;
    Some((u64::try_from(time).ok()?, narrow([a, b, c, d, e, f])))
}

impl Trace {
    pub(super) const fn new() -> Self {
        Self { joints: None, pose: None, frames: [[0.0; 6]; 2], time_us: 0, is_open: false }
    }

    /// Takes in a message; an observation when it is whole.
    pub(super) fn take_in(&mut self, message: &Message<'_>) -> Option<Observation> {
        match message.code {
            JOINTS => {
                // A robot that does not mark the end of its cycles.
                let open = if self.is_open { self.observation() } else { None };
                self.is_open = false;
                self.joints = message.numbers().map(narrow).or(self.joints);
                open
            }
            POSE => {
                self.pose = message.numbers().map(narrow).or(self.pose);
                self.is_open = true;
                None
            }
            CYCLE_END => {
                let time = message.values().next()?.integer()?;
                self.time_us = u64::try_from(time).ok()?;
                self.is_open = false;
                self.observation()
            }
            TARGET_JOINTS => {
                let (time_us, joints) = stamped(message)?;
                (self.time_us, self.joints) = (time_us, Some(joints));
                None
            }
            TARGET_POSE => {
                let (time_us, pose) = stamped(message)?;
                (self.time_us, self.pose) = (time_us, Some(pose));
                self.is_open = false;
                self.observation()
            }
            _ => None,
        }
    }

    /// A frame is about to change: the pose will jump without a motion.
    pub(super) const fn begin_change(&mut self, frame: Frame) {
        self.set(frame, CHANGING);
    }

    /// A frame is this now.
    pub(super) const fn set(&mut self, frame: Frame, value: [f32; 6]) {
        let [wrf, trf] = &mut self.frames;
        match frame {
            Frame::Wrf => *wrf = value,
            Frame::Trf => *trf = value,
        }
    }

    /// Deactivation sets both back.
    pub(super) const fn reset_frames(&mut self) {
        self.frames = [[0.0; 6]; 2];
    }

    fn observation(&self) -> Option<Observation> {
        Some(Observation {
            joints_deg: self.joints?,
            pose: self.pose?,
            frames: self.frames,
            robot_time_us: self.time_us,
            ..Observation::default()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(trace: &mut Trace, line: &str) -> Option<Observation> {
        trace.take_in(&Message::parse(line).unwrap())
    }

    #[test]
    fn the_messages_of_one_interval_are_one_observation() {
        let mut trace = Trace::new();
        // The example of the manual, PM L860-864.
        assert_eq!(
            told(&mut trace, "[2026][-102.6011,-0.0000,-78.9239,-0.0000,15.7848,110.3150]"),
            None
        );
        assert_eq!(
            told(&mut trace, "[2027][-3.7936,-16.9703,457.5125,26.3019,-5.6569,9.0367]"),
            None
        );
        let seen = told(&mut trace, "[2230][58675156984]").unwrap();
        assert_eq!((seen.joints_deg[0], seen.pose[2]), (-102.6011, 457.5125));
        assert_eq!((seen.robot_time_us, seen.fifo_space), (58_675_156_984, None));
    }

    #[test]
    fn a_robot_that_marks_no_cycles_is_followed_too() {
        let mut trace = Trace::new();
        told(&mut trace, "[2026][1,0,0,0,0,0]");
        assert_eq!(told(&mut trace, "[2027][1,0,0,0,0,0]"), None);
        let seen = told(&mut trace, "[2026][2,0,0,0,0,0]").unwrap();
        assert_eq!(seen.joints_deg[0], 1.0);
    }

    #[test]
    fn a_pose_that_jumps_with_its_frame_is_no_distance() {
        let mut trace = Trace::new();
        let at = |trace: &mut Trace, x: u32| {
            told(trace, "[2026][0,0,0,0,0,0]");
            told(trace, &std::format!("[2027][{x},0,0,0,0,0]"));
            told(trace, "[2230][1]").unwrap()
        };
        let before = at(&mut trace, 0);
        trace.begin_change(Frame::Trf);
        let [early, late] = [at(&mut trace, 0), at(&mut trace, 70)];
        trace.set(Frame::Trf, [70.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let [after, moved] = [at(&mut trace, 70), at(&mut trace, 72)];
        for (now, earlier) in [(early, before), (late, early), (after, late), (after, before)] {
            assert_eq!(now.distance_mm(&earlier), 0.0);
        }
        assert_eq!(moved.distance_mm(&after), 2.0);
    }

    #[test]
    fn what_is_no_six_numbers_changes_nothing() {
        let mut trace = Trace::new();
        for line in
            ["[2026][1,2]", "[2027][a]", "[2230][x]", "[2230][-1]", "[2201][1,2,3]", "[2200][]"]
        {
            assert_eq!(told(&mut trace, line), None, "{line}");
        }
    }
}
