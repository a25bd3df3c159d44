//! How the robot answers each text command, in which state it takes it, and whether it remembers.
//!
//! Queued commands need no row: they are answered with nothing and need a robot that is ready for
//! motion without error and stop signal. Where the manual contradicts itself the row says which
//! reading is taken.

use super::spec::{TextCommandSpec, Timing};
use crate::wire::meca500::code::Code;

/// The state in which the robot takes a command. Source: PM, "Usage restrictions" of each chapter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum AllowedState {
    /// Any.
    Any,
    /// Deactivated; otherwise 1026, or 1027 for simulation.
    Deactivated,
    /// Activated.
    Activated,
    /// Activated and homed, or activated in recovery mode; otherwise 1005 or 1006. Source: PM L7122.
    Ready,
    /// [`Ready`](Self::Ready), and neither in error (1011) nor under a stop signal. Source: PM L2003.
    ReadyAndFree,
    /// [`ReadyAndFree`](Self::ReadyAndFree) and homed: recovery mode is not enough.
    HomedAndFree,
    /// While a program is being saved; otherwise 1022.
    Saving,
    /// The manual does not tell.
    NotStated,
}

impl AllowedState {
    /// The errors for a robot in another state, as far as the chapters name them in one breath with it.
    const fn errors(self) -> &'static [Code] {
        match self {
            Self::Ready => &[Code::NOT_ACTIVATED, Code::NOT_HOMED],
            Self::ReadyAndFree | Self::HomedAndFree => {
                &[Code::NOT_ACTIVATED, Code::NOT_HOMED, Code::IN_ERROR]
            }
            Self::Any | Self::Deactivated | Self::Activated | Self::Saving | Self::NotStated => &[],
        }
    }
}

/// What is known of the answers to one command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Answers {
    name: &'static str,
    state: AllowedState,
    is_persistent: bool,
    answers: &'static [Code],
    later: &'static [Code],
    errors: &'static [Code],
}

/// Codes without the word.
macro_rules! codes {
    ($($code:literal),*) => { &[$(Code($code)),*] };
}

impl Answers {
    const fn persistent(self) -> Self {
        Self { is_persistent: true, ..self }
    }

    const fn then(self, later: &'static [Code]) -> Self {
        Self { later, ..self }
    }

    const fn or(self, errors: &'static [Code]) -> Self {
        Self { errors, ..self }
    }
}

const fn row(name: &'static str, state: AllowedState, answers: &'static [Code]) -> Answers {
    Answers { name, state, is_persistent: false, answers, later: &[], errors: &[] }
}

/// Whatever the state.
const fn any(name: &'static str, answers: &'static [Code]) -> Answers {
    row(name, AllowedState::Any, answers)
}

/// Ready for motion, in error or under a stop signal nevertheless.
const fn ready(name: &'static str, answers: &'static [Code]) -> Answers {
    row(name, AllowedState::Ready, answers)
}

/// While deactivated only.
const fn deactivated(name: &'static str, answers: &'static [Code]) -> Answers {
    row(name, AllowedState::Deactivated, answers)
}

/// A queued command that is unlike the others.
const fn queued(name: &'static str) -> Answers {
    row(name, AllowedState::ReadyAndFree, &[])
}

/// Source: PM Table 2 and the chapters. Where the two differ Table 2 is taken: GetWrf answers 2013 (its
/// chapter prints 2014), GetPStop2Cfg 2179 (its chapter prints 2178). GetExtToolFwVersion may answer
/// with either of the two codes that Table 2 gives it.
const ANSWERS: &[Answers] = &[
    // Motion.
    queued("SetCheckpoint").then(codes![3030, 3040]),
    // Control.
    any("ActivateRobot", codes![2000]),
    deactivated("ActivateSim", codes![2045, 2046]).or(codes![1027]),
    ready("ClearMotion", codes![2044]),
    any("ConnectionWatchdog", codes![2177]),
    row("DeactivateRobot", AllowedState::Activated, codes![2004]),
    deactivated("DeactivateSim", codes![2046]),
    any("EnableEtherNetIp", codes![2085]).persistent(),
    any("EnableProfinet", codes![2085]).persistent(),
    row("Home", AllowedState::Activated, codes![2002]).or(codes![1014, 1032]),
    any("LogTrace", codes![2085]),
    any("LogUserCommands", codes![2085]),
    ready("PauseMotion", codes![2042]).then(codes![3004]),
    deactivated("RebootRobot", &[]),
    ready("ResetError", codes![2005, 2006]),
    ready("ResumeMotion", codes![2043]),
    deactivated("SetCalibrationCfg", codes![2170]).persistent(),
    any("SetCtrlPortMonitoring", codes![2096]),
    any("SetEob", codes![2054, 2055]),
    any("SetEom", codes![2052, 2053]),
    deactivated("SetJointLimits", codes![2092]).persistent(),
    deactivated("SetJointLimitsCfg", codes![2093]).persistent(),
    any("SetMonitoringInterval", codes![2085]),
    deactivated("SetNetworkOptions", codes![2085]).persistent(),
    row("SetOfflineProgramLoop", AllowedState::Saving, &[]).or(codes![1022]),
    deactivated("SetPStop2Cfg", codes![2178]).persistent(),
    any("SetRealTimeMonitoring", codes![2117]),
    any("SetRecoveryMode", codes![2049, 2050]),
    deactivated("SetRobotName", codes![2085]).persistent(),
    any("SetRtc", codes![2085]),
    deactivated("SetSimModeCfg", codes![2188]).persistent(),
    any("SetTimeScaling", codes![2015]),
    ready("StartProgram", codes![2063]).or(codes![3017]),
    any("StartSaving", codes![2060]).persistent(),
    any("StopSaving", codes![2061]).then(codes![2064, 2065]).or(codes![1022]),
    any("SwitchToEtherCat", codes![2085]).persistent(),
    any("SyncCmdQueue", codes![2097]),
    any("TcpDump", codes![3035]).then(codes![3036]),
    any("TcpDumpStop", codes![3036]),
    // Settings.
    ready("GetAutoConf", codes![2028]),
    ready("GetAutoConfTurn", codes![2031]),
    ready("GetBlending", codes![2150]),
    any("GetCalibrationCfg", codes![2171]),
    ready("GetCartAcc", codes![2156]),
    ready("GetCartAngVel", codes![2155]),
    ready("GetCartLinVel", codes![2154]),
    any("GetCheckpoint", codes![2157]),
    any("GetCheckpointDiscarded", codes![2149]),
    ready("GetConf", codes![2029]),
    ready("GetConfTurn", codes![2036]),
    any("GetEthernetIpEnabled", codes![2073]),
    any("GetFwVersion", codes![2081]),
    ready("GetJointAcc", codes![2153]),
    any("GetJointLimits", codes![2090]),
    any("GetJointLimitsCfg", codes![2094]),
    ready("GetJointVel", codes![2152]),
    ready("GetJointVelLimit", codes![2169]),
    ready("GetModelJointLimits", codes![2113]),
    any("GetMonitoringInterval", codes![2116]),
    ready("GetMoveDuration", codes![2191]),
    ready("GetMoveDurationCfg", codes![2190]),
    ready("GetMoveMode", codes![2189]),
    any("GetNetworkOptions", codes![2119]),
    any("GetPStop2Cfg", codes![2179]),
    ready("GetPayload", codes![2192]),
    any("GetProductType", codes![2084]),
    any("GetProfinetEnabled", codes![2077]),
    any("GetRealTimeMonitoring", codes![2117]),
    any("GetRobotCalibrated", codes![2122]),
    any("GetRobotName", codes![2095]),
    any("GetRobotSerial", codes![2083]),
    any("GetSimModeCfg", codes![2187]),
    any("GetTimeScaling", codes![2015]),
    ready("GetTorqueLimits", codes![2161]),
    ready("GetTorqueLimitsCfg", codes![2160]),
    ready("GetTrf", codes![2014]),
    ready("GetVelTimeout", codes![2151]),
    ready("GetWrf", codes![2013]),
    // Real-time data.
    ready("GetCmdPendingCount", codes![2080]),
    any("GetRtAccelerometer", codes![2220]),
    any("GetRtCartPos", codes![2211]),
    any("GetRtCartVel", codes![2214]),
    any("GetRtConf", codes![2218]),
    any("GetRtConfTurn", codes![2219]),
    any("GetRtJointPos", codes![2210]),
    any("GetRtJointTorq", codes![2213]),
    any("GetRtJointVel", codes![2212]),
    any("GetRtTargetCartPos", codes![2201]),
    any("GetRtTargetCartVel", codes![2204]),
    any("GetRtTargetConf", codes![2208]),
    any("GetRtTargetConfTurn", codes![2209]),
    any("GetRtTargetJointPos", codes![2200]),
    any("GetRtTargetJointTorq", codes![2203]),
    any("GetRtTargetJointVel", codes![2202]),
    any("GetRtTrf", codes![2229]),
    any("GetRtWrf", codes![2228]),
    any("GetRtc", codes![2140]),
    any("GetSafetyStopStatus", codes![3032, 3070, 3083, 3086]),
    any("GetStatusRobot", codes![2007]),
    any("GetTorqueLimitsStatus", codes![3028]),
    row("GetJoints", AllowedState::NotStated, codes![2026]),
    row("GetPose", AllowedState::NotStated, codes![2027]),
    // Work zone and collisions.
    any("GetCollisionCfg", codes![2181]),
    any("GetCollisionStatus", codes![2182]),
    any("GetToolSphere", codes![2167]),
    any("GetWorkZoneCfg", codes![2163]),
    any("GetWorkZoneLimits", codes![2165]),
    any("GetWorkZoneStatus", codes![2183]),
    deactivated("SetCollisionCfg", codes![2180]).persistent(),
    deactivated("SetToolSphere", codes![2168]).persistent(),
    deactivated("SetWorkZoneCfg", codes![2164]).persistent(),
    deactivated("SetWorkZoneLimits", codes![2166]).persistent(),
    // Accessories.
    any("GetExtToolFwVersion", codes![2086, 2088]).or(codes![3039]),
    any("GetExtToolSim", codes![2047]),
    ready("GetGripperForce", codes![2158]),
    ready("GetGripperRange", codes![2162]),
    ready("GetGripperVel", codes![2159]),
    any("GetRtExtToolStatus", codes![2300]),
    any("GetRtGripperForce", codes![2321]),
    any("GetRtGripperPos", codes![2322]),
    any("GetRtGripperState", codes![2320]).or(codes![1038]),
    any("GetRtValveState", codes![2310]).or(codes![1041]),
    row("GetStatusGripper", AllowedState::NotStated, codes![2079]),
    queued("GripperClose").or(codes![1038]),
    queued("GripperOpen").or(codes![1038]),
    row("MoveGripper", AllowedState::HomedAndFree, &[]).or(codes![1038]),
    any("SetExtToolSim", codes![2047]),
    // Variables.
    any("CreateVariable", codes![2552]).or(codes![1552]).persistent(),
    any("DeleteVariable", codes![2553]).or(codes![1553]).persistent(),
    any("GetVariable", codes![2551]).or(codes![1551]),
    any("ListVariables", codes![2550]).or(codes![1550]),
    any("SetVariable", codes![2554]).or(codes![1554]).persistent(),
];

impl TextCommandSpec {
    fn row(&self) -> Answers {
        let listed = ANSWERS.iter().find(|row| row.name == self.name).copied();
        listed.unwrap_or(match (self.available, self.timing) {
            (Some(true), Timing::Queued) => queued(self.name),
            _ => row(self.name, AllowedState::NotStated, &[]),
        })
    }

    /// Codes of the answer to it: the first of them that comes is the answer, and says that the
    /// command has been done. Nothing for queued commands, for those that the robot just does, and for
    /// those of other robots. Source: PM Table 2 and the chapters.
    #[must_use]
    pub fn answers(&self) -> &'static [Code] {
        self.row().answers
    }

    /// Codes of what the command makes the robot say later, apart from its answer: the checkpoint was
    /// reached, the capture ended. Source: PM, the chapters.
    #[must_use]
    pub fn later_messages(&self) -> &'static [Code] {
        self.row().later
    }

    /// Errors that its chapter names, beside 1001 to 1003; any command may fail with others (1040, 1026
    /// in the wrong state). Source: PM, the chapters.
    pub fn errors(&self) -> impl Iterator<Item = Code> + use<> {
        let row = self.row();
        row.state.errors().iter().chain(row.errors).copied()
    }

    /// The state in which the robot takes it.
    #[must_use]
    pub fn allowed_state(&self) -> AllowedState {
        self.row().state
    }

    /// Whether what it sets survives a restart of the robot. Source: PM L7106 and the chapters.
    #[must_use]
    pub fn is_persistent(&self) -> bool {
        self.row().is_persistent
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_is_of_a_command_and_comes_once() {
        let names = || ANSWERS.iter().map(|row| row.name);
        for (position, name) in names().enumerate() {
            assert!(TextCommandSpec::by_name(name).is_some(), "{name}");
            assert!(names().skip(position + 1).all(|other| other != name), "{name} twice");
        }
    }
}
