//! What a person at the cell does: buttons, plugs, power, and hands on the arm.

use super::event::RobotEvent;
use super::motion::Follower;
use super::robot::VirtualRobot;
use super::settings::FittedTool;
use super::tool::Part;
use crate::wire::meca500::code::Code;

/// The buttons, plugs and parts of the cell. Get one with [`VirtualRobot::panel`].
#[derive(Debug)]
pub struct Panel<'a> {
    robot: &'a mut VirtualRobot,
}

impl VirtualRobot {
    /// Lets a person act.
    pub const fn panel(&mut self) -> Panel<'_> {
        Panel { robot: self }
    }
}

impl Panel<'_> {
    /// Presses the E-Stop (or opens P-Stop 1, which the Meca500 cannot tell apart).
    pub fn press_e_stop(&mut self) {
        self.robot.safety.e_stop.set_present(true);
        self.robot.cut_power_when_stopped();
    }

    /// Pulls the E-Stop out again.
    pub fn release_e_stop(&mut self) {
        self.robot.safety.e_stop.set_present(false);
    }

    /// Opens the P-Stop 2 circuit (SWStop).
    pub fn press_p_stop2(&mut self) {
        self.robot.set_p_stop2(true);
    }

    /// Closes the P-Stop 2 circuit.
    pub fn release_p_stop2(&mut self) {
        self.robot.set_p_stop2(false);
    }

    /// Presses the Reset button.
    pub fn press_reset(&mut self) {
        if self.robot.is_online() {
            self.robot.safety.press_reset();
        }
    }

    /// Lets the redundant safety inputs disagree, or agree again.
    pub const fn set_safety_mismatch(&mut self, mismatch: bool) {
        self.robot.safety.set_mismatch(mismatch);
    }

    /// Pulls the power plug.
    pub fn switch_off(&mut self) {
        self.robot.switch_off();
    }

    /// Puts the power plug in: the robot boots.
    pub fn switch_on(&mut self) {
        self.robot.switch_on();
    }

    /// Presses the Start/Stop button on the base: starts offline program 1 (PM L4002), which begins
    /// anew at its end while
    /// [`offline_program_loop`](super::PersistentSettings::offline_program_loop) is set. What empties
    /// the queue ends it.
    ///
    /// # Errors
    ///
    /// Those of [`VirtualRobot::start_program`].
    pub fn press_start(&mut self) -> Result<(), Code> {
        self.robot.start_by_button()
    }

    /// Unscrews the tool and screws on another one. Only on a deactivated robot; returns whether it
    /// was done.
    pub fn fit_tool(&mut self, tool: FittedTool) -> bool {
        let may = !self.robot.has_motors_on() && !self.robot.simulating;
        if may {
            self.robot.tool.fit(tool);
        }
        may
    }

    /// Gives the tool a firmware older than the robot's, or the right one.
    pub const fn set_tool_firmware_outdated(&mut self, outdated: bool) {
        self.robot.tool.old_firmware = outdated;
    }

    /// Puts a part between the fingers, or takes it away.
    pub const fn place_part(&mut self, part: Option<Part>) {
        self.robot.tool.place_part(part);
    }

    /// Overheats the gripper (error 3025), or lets it cool.
    pub const fn set_gripper_overheated(&mut self, overheated: bool) {
        self.robot.tool.overheated = overheated;
    }

    /// Holds a joint (1 to 6) where it is now, or lets it go.
    pub fn block_joint(&mut self, joint: usize, blocked: bool) {
        let position = self.robot.target_joints();
        let slot = joint.wrapping_sub(1);
        if let Some(at) = self.robot.disturbance.blocked_at.get_mut(slot) {
            *at = blocked.then_some(position.get(slot).copied().unwrap_or(0.0));
        }
    }

    /// Pushes on a joint (1 to 6) with a torque in percent of its motor's largest; 0 lets go.
    pub fn push_joint(&mut self, joint: usize, percent: f64) {
        let slot = joint.wrapping_sub(1);
        if let Some(push) = self.robot.disturbance.push_percent.get_mut(slot)
            && percent.is_finite()
        {
            *push = percent.clamp(-100.0, 100.0);
        }
    }

    /// Breaks the communication with the drives: error 3006, which only a reboot ends.
    pub fn break_drives(&mut self) {
        self.robot.raise(Code::DRIVE_COMMUNICATION);
    }

    /// Moves the arm by hand, with its brakes released: a deactivated robot only. Joints outside
    /// the model's limits are kept at them. Returns whether it was done.
    pub fn move_by_hand(&mut self, joints: [f64; 6]) -> bool {
        let may = !self.robot.has_motors_on() && !self.robot.is_busy();
        if may && joints.iter().all(|joint| joint.is_finite()) {
            let limits = super::motion::JointLimits::MODEL;
            let mut kept = joints;
            for (joint, (min, max)) in kept.iter_mut().zip(limits.min.into_iter().zip(limits.max)) {
                *joint = joint.clamp(min, max);
            }
            self.robot.follower = Follower::at_rest(kept);
            self.robot.look_ahead_anew();
        }
        may
    }

    /// Events so far, oldest first, forgotten afterwards.
    pub fn drain_events(&mut self) -> impl Iterator<Item = RobotEvent> + '_ {
        core::iter::from_fn(|| self.robot.poll_event())
    }
}
