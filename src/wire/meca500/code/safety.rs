//! Safety codes: state of each stop signal.

use super::Resettable::{No, NotStated, Yes};
use super::{CodeInfo, safety};

/// Every safety code, in ascending order. The value that follows is 1 active, 2 gone but to be reset, 0 clear. Source: PM Tables 2 and 3.
pub(super) const SAFETY: &[CodeInfo] = &[
    safety(
        3032,
        "Protective stop 2 (SWStop): motion is stopped, the motors stay on.",
        "2/1/0",
        "Release the stop, then resume motion.",
        Yes,
    ),
    safety(3069, "Voltage fluctuation; not on a Meca500.", "0/1/2", "", NotStated),
    safety(
        3070,
        "Emergency stop: the robot is deactivated and the motors have no power.",
        "0/1/2",
        "Release the stop, press Reset, then activate.",
        Yes,
    ),
    safety(3080, "Operation mode changed; not on a Meca500.", "0/1/2", "", NotStated),
    safety(
        3081,
        "The TCP connection broke, as one chapter numbers it; the tables say 3086.",
        "0/1/2",
        "Connect again, then resume motion.",
        Yes,
    ),
    safety(3082, "Safety stop 3082; the manual does not name it.", "0/1/2", "", NotStated),
    safety(
        3083,
        "The robot was rebooted and its motors have no power.",
        "0/2",
        "Press Reset.",
        NotStated,
    ),
    safety(
        3084,
        "The two channels of a stop signal disagreed for over a second.",
        "0/1",
        "Check the wiring of the stops, then reboot.",
        No,
    ),
    safety(3085, "Safety stop 3085; the manual does not name it.", "0/2", "", NotStated),
    safety(
        3086,
        "The TCP connection broke, or its watchdog ran out.",
        "0/1/2",
        "Connect again, then resume motion.",
        Yes,
    ),
    safety(3087, "Safety stop 3087; the manual does not name it.", "0/1/2", "", NotStated),
];
