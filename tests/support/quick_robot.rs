//! A robot for tests that wait for it often.

use fieldarm::sim::meca500::{LifecycleTimes, RobotSettings};
use fieldarm::time::Duration;

/// A robot that loses little time with what the manual gives no time for.
pub(crate) fn quick_robot() -> RobotSettings {
    let times = LifecycleTimes {
        activation: Duration::from_millis(20),
        deactivation: Duration::from_millis(10),
        homing: Duration::from_millis(50),
        boot: Duration::from_millis(100),
    };
    RobotSettings { times, ..RobotSettings::default() }
}
