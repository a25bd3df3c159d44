//! Real-time values and messages that come unasked.

use super::{CodeInfo, monitored, monitoring, response};

/// Codes from 2200 on that are neither errors nor safety codes, in ascending order. Source: PM Tables 2 and 3.
pub(super) const REALTIME: &[CodeInfo] = &[
    monitored(
        2200,
        "Answer to GetRtTargetJointPos.",
        "t, theta1, theta2, theta3, theta4, theta5, theta6",
    ),
    monitored(2201, "Answer to GetRtTargetCartPos.", "t, x, y, z, alpha, beta, gamma"),
    monitored(
        2202,
        "Answer to GetRtTargetJointVel.",
        "t, omega1, omega2, omega3, omega4, omega5, omega6",
    ),
    monitored(2203, "Answer to GetRtTargetJointTorq.", "t, tau1, tau2, tau3, tau4, tau5, tau6"),
    monitored(
        2204,
        "Answer to GetRtTargetCartVel.",
        "t, x_dot, y_dot, z_dot, omega_x, omega_y, omega_z",
    ),
    monitored(2208, "Answer to GetRtTargetConf.", "t, c_s, c_e, c_w"),
    monitored(2209, "Answer to GetRtTargetConfTurn.", "t, c_t"),
    monitored(
        2210,
        "Answer to GetRtJointPos.",
        "t, theta1, theta2, theta3, theta4, theta5, theta6",
    ),
    monitored(2211, "Answer to GetRtCartPos.", "t, x, y, z, alpha, beta, gamma"),
    monitored(
        2212,
        "Answer to GetRtJointVel.",
        "t, omega1, omega2, omega3, omega4, omega5, omega6",
    ),
    monitored(2213, "Answer to GetRtJointTorq.", "t, tau1, tau2, tau3, tau4, tau5, tau6"),
    monitored(2214, "Answer to GetRtCartVel.", "t, x_dot, y_dot, z_dot, omega_x, omega_y, omega_z"),
    monitored(2218, "Answer to GetRtConf.", "t, c_s, c_e, c_w"),
    monitored(2219, "Answer to GetRtConfTurn.", "t, c_t"),
    monitored(2220, "Answer to GetRtAccelerometer.", "t, n, a_x, a_y, a_z"),
    monitoring(2226, "A hard deceleration begins or ends.", "t,hardDecel,linDistance"),
    monitoring(2227, "Checkpoint reached last.", "t,n"),
    monitored(2228, "Answer to GetRtWrf.", "t, x, y, z, alpha, beta, gamma"),
    monitored(2229, "Answer to GetRtTrf.", "t, x, y, z, alpha, beta, gamma"),
    monitoring(2230, "Time stamp that ends a cycle of monitoring messages.", "t"),
    monitored(2300, "Answer to GetRtExtToolStatus.", "t, simType, phyType, hs, es, oh"),
    monitored(2310, "Answer to GetRtValveState.", "t, v1, v2"),
    monitored(2320, "Answer to GetRtGripperState.", "t, hp, dr, gc, go"),
    monitored(2321, "Answer to GetRtGripperForce.", "t, p"),
    monitored(2322, "Answer to GetRtGripperPos.", "t, d"),
    monitored(2330, "Answer to GetRtIoStatus.", "t, b_{id}, present, simMode, errorCode"),
    monitored(2340, "Answer to GetRtOutputState.", "t, b_{id}, p1, p2, p3, p4, p5, p6, p7, p8"),
    monitored(2341, "Answer to GetRtInputState.", "t, b_{id}, p1, p2, p3, p4, p5, p6, p7, p8"),
    monitored(2342, "Answer to GetRtVacuumState.", "t, v, h, p"),
    monitored(2343, "Answer to GetRtVacuumPressure.", "t, p"),
    monitored(3000, "Connected.", "Connected to ... x_x_x.x.x."),
    response(3004, "The robot stopped moving.", "End of movement."),
    response(3012, "The robot stopped moving and its queue is empty.", "End of block."),
    response(3013, "The stored program ended.", "End of offline program."),
    monitored(3028, "Whether a torque limit is exceeded.", "s"),
    response(3030, "A checkpoint was reached.", "n"),
    response(3035, "A network capture began.", "TCP dump capture started for x seconds"),
    response(3036, "A network capture ended.", "TCP dump capture stopped"),
    response(3040, "A checkpoint was discarded.", "n"),
    monitoring(3048, "Drives near overload, one flag for each.", "0/1, 0/1, ..."),
    CodeInfo {
        remedy: "Give the move more time, or raise the velocity limits.",
        ..response(
            3051,
            "A time-based move cannot keep its duration.",
            "Move duration too short: ... is too short. Fastest possible ... Command: ...",
        )
    },
];
