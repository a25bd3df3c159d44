//! The words the floors share about one bus cycle.
//!
//! A [`CyclicLink`] is the PLC's end of a bus: it sends an output image and brings back an input
//! image. A [`CyclicDevice`] is the robot's end. Directions are always the PLC's: *outputs* go to
//! the robot, *inputs* come from it.

use crate::time::Instant;

/// What one exchange of a [`CyclicLink`] says about the inputs it brought.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InputQuality {
    /// The inputs were produced by the robot since the previous exchange.
    Fresh,
    /// The inputs are those of an earlier exchange (a late or lost frame, a wrong working counter).
    /// `age_cycles` counts exchanges since they were fresh and saturates; 1 is one bad cycle.
    Stale {
        /// Exchanges since the inputs were fresh.
        age_cycles: u32,
    },
    /// No inputs can be trusted: the link is down, was never up, or the robot left the bus.
    Lost,
}

impl InputQuality {
    /// Whether the inputs may advance a handshake.
    #[must_use]
    pub const fn is_fresh(self) -> bool {
        matches!(self, Self::Fresh)
    }
}

/// The PLC's end of a cyclic bus, for one robot.
pub trait CyclicLink {
    /// Why an exchange cannot be made at all, now or ever again. A lost frame is not an error but
    /// a quality.
    type Error;

    /// Sends `outputs` and fills `inputs` with the newest image of the robot: one bus cycle.
    ///
    /// `now` is the time of this cycle; links that pace themselves by a clock may ignore it.
    /// When the answer is not [`InputQuality::Fresh`], `inputs` keeps the last good image.
    ///
    /// # Errors
    ///
    /// A transport failure the link cannot recover from by itself.
    fn exchange(
        &mut self,
        now: Instant,
        outputs: &[u8],
        inputs: &mut [u8],
    ) -> Result<InputQuality, Self::Error>;
}

/// The PLC's end of a cyclic bus that carries several robots in one exchange.
///
/// One cycle is: [`write_outputs`](Self::write_outputs) for each robot, one
/// [`exchange`](Self::exchange), [`read_inputs`](Self::read_inputs) for each robot.
pub trait CyclicSegment {
    /// Why an exchange cannot be made at all, now or ever again.
    type Error;

    /// Number of robots on the segment; they are numbered from 0.
    fn robot_count(&self) -> usize;

    /// Sets the outputs that the next exchange sends to `robot`; they stay until set again. Without
    /// such a robot, or with a slice of the wrong length, nothing happens.
    fn write_outputs(&mut self, robot: usize, outputs: &[u8]);

    /// One bus cycle for all robots; `now` as in [`CyclicLink::exchange`].
    ///
    /// # Errors
    ///
    /// A transport failure the link cannot recover from by itself.
    fn exchange(&mut self, now: Instant) -> Result<(), Self::Error>;

    /// Copies the newest good inputs of `robot` and says how good they are. Without such a robot,
    /// or with a slice of the wrong length, nothing is copied and the answer is
    /// [`InputQuality::Lost`].
    fn read_inputs(&self, robot: usize, inputs: &mut [u8]) -> InputQuality;

    /// By how much the next cycle should begin later than planned, in ns; negative is earlier. Asked
    /// after each exchange. A bus whose devices share a clock uses it to draw the caller's cycles to
    /// that clock; others leave it at 0.
    fn nudge_ns(&self) -> i64 {
        0
    }

    /// How many cycles that could not begin in their time the caller makes up for, at least half a period apart:
    /// on a bus where each frame is sent at the caller's beat and the devices expect a fixed number of them. On
    /// others, 0, what has passed is left out.
    fn makes_up(&self) -> u32 {
        0
    }
}

/// The robot's end of a cyclic bus: what a virtual robot offers to any bus.
pub trait CyclicDevice {
    /// Length of the output image in bytes (60 for a Meca500).
    const OUTPUT_LEN: usize;
    /// Length of the input image in bytes (252 for a Meca500).
    const INPUT_LEN: usize;

    /// One bus cycle: takes the newest `outputs` (`None` while no controller feeds the robot, or
    /// the bus watchdog expired), lets the robot live until `now`, and writes its `inputs`.
    ///
    /// A slice of the wrong length is treated as no outputs, and as no room for inputs.
    fn cycle(&mut self, now: Instant, outputs: Option<&[u8]>, inputs: &mut [u8]);

    /// Whether the device answered its bus in the last cycle. While it does not (switched off,
    /// booting, left for another protocol) it writes no inputs, and a link reports them as lost.
    fn is_on_bus(&self) -> bool;
}
