//! Positions, velocities and torques with the time they were taken at.

use super::{Reader, ValueError};
use crate::wire::meca500::text::message::Message;

/// A value of a message of the group 22xx, whose first value is the robot's time. Source: PM L3779.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stamped<T> {
    /// The robot's monotonic clock in microseconds, counted from no point in particular. Source: PM
    /// L5667.
    pub timestamp_us: u64,
    /// What was measured or aimed at then.
    pub value: T,
}

impl<const N: usize> Stamped<[f64; N]> {
    /// A time and `N` numbers: joints in degrees, poses in mm and degrees, velocities, torques in percent.
    ///
    /// # Errors
    ///
    /// [`ValueError`].
    pub fn numbers(message: &Message<'_>) -> Result<Self, ValueError> {
        let mut reader = Reader::any(message);
        let timestamp_us = reader.integer()?;
        let value = reader.numbers()?;
        reader.end()?;
        Ok(Self { timestamp_us, value })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_comes_first() {
        let message = Message::parse("[2210][58675156984,1,2,3,4,5,-6.5]").unwrap();
        let read = Stamped::<[f64; 6]>::numbers(&message).unwrap();
        assert_eq!(read.timestamp_us, 58_675_156_984);
        assert_eq!(read.value, [1.0, 2.0, 3.0, 4.0, 5.0, -6.5]);
        assert!(Stamped::<[f64; 7]>::numbers(&message).is_err());
        assert!(Stamped::<[f64; 5]>::numbers(&message).is_err());
        let early = Message::parse("[2210][-1,1,2,3,4,5,6]").unwrap();
        assert!(Stamped::<[f64; 6]>::numbers(&early).is_err());
    }
}
