//! The tool on the flange: MEGP 25 grippers and the MPM500 with its two valves.
//!
//! A gripper moves in parallel with the arm. Its fingers go to a wanted opening at the set velocity
//! and stop where a part is in the way; then the gripper is forcing ("holding part").
//!
//! Chosen: fingers move at constant velocity, without acceleration; the force is the set one as
//! soon as the fingers meet the part; fingers that meet each other or their end stop do not count
//! as forcing. Source: PM L6299-6302, L6371-6620.

use super::settings::FittedTool;

/// Finger velocity at 100 %, in mm/s. Source: PM L6614.
const FULL_VELOCITY_MM_PER_S: f64 = 50.0;
/// Openings nearer than this are the same, in mm.
const SAME_MM: f64 = 1e-6;

/// A part between the fingers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Part {
    /// Gripped from outside: the fingers cannot close below this opening, in mm.
    Outer(f64),
    /// Gripped from inside: the fingers cannot open beyond this opening, in mm.
    Inner(f64),
}

/// State of a gripper as dynamic type 53 reports it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GripperState {
    /// The gripper is forcing.
    pub holding_part: bool,
    /// The wanted opening is reached.
    pub target_reached: bool,
    /// The opening is at or below the closed one.
    pub closed: bool,
    /// The opening is at or above the open one.
    pub open: bool,
    /// Grip force in percent, positive outwards.
    pub force_percent: f64,
    /// Fingers' opening, in mm.
    pub opening_mm: f64,
}

/// The tool and what it is doing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tool {
    fitted: FittedTool,
    emulated: Option<FittedTool>,
    homed: bool,
    opening_mm: f64,
    wanted_mm: f64,
    moved: bool,
    velocity_percent: f64,
    force_percent: f64,
    forcing: f64,
    part: Option<Part>,
    pub(super) overheated: bool,
    pub(super) old_firmware: bool,
    valves: [bool; 2],
}

impl Tool {
    pub(super) const fn new(fitted: FittedTool) -> Self {
        Self {
            fitted,
            emulated: None,
            homed: false,
            opening_mm: 0.0,
            wanted_mm: 0.0,
            moved: false,
            velocity_percent: 40.0,
            force_percent: 50.0,
            forcing: 0.0,
            part: None,
            overheated: false,
            old_firmware: false,
            valves: [false; 2],
        }
    }

    /// The tool the robot works with: the emulated one in simulation.
    pub(super) fn kind(&self) -> FittedTool {
        self.emulated.unwrap_or(self.fitted)
    }

    /// The tool on the flange.
    pub(super) const fn fitted(&self) -> FittedTool {
        self.fitted
    }

    /// Another tool is screwed on, or none.
    pub(super) const fn fit(&mut self, fitted: FittedTool) {
        *self = Self::new(fitted);
    }

    /// Simulation emulates the fitted tool, or an MEGP 25E where there is none. Source: PM L6526.
    pub(super) fn emulate(&mut self, on: bool) {
        self.emulated = on.then_some(match self.fitted {
            FittedTool::None => FittedTool::Megp25E,
            fitted => fitted,
        });
        self.homed = false;
    }

    /// The emulated tool, if one is.
    pub(super) const fn emulated(&self) -> Option<FittedTool> {
        self.emulated
    }

    /// SetExtToolSim: emulates this tool, or none. Another kind of tool was never homed.
    pub(super) fn emulate_as(&mut self, emulated: Option<FittedTool>) {
        let before = self.kind();
        self.emulated = emulated;
        if self.kind() != before {
            self.homed = false;
        }
    }

    /// Whether it is a gripper.
    pub(super) fn is_gripper(&self) -> bool {
        self.kind().opening_mm().is_some()
    }

    /// Whether a gripper still needs homing.
    pub(super) fn needs_homing(&self) -> bool {
        self.is_gripper() && !self.homed
    }

    /// Whether the gripper was homed since its activation.
    pub(super) const fn is_homed(&self) -> bool {
        self.homed
    }

    /// Homing ends: the range is known, the fingers are closed.
    pub(super) fn home(&mut self) {
        if self.is_gripper() {
            self.homed = true;
            self.opening_mm = self.clamped(0.0);
            self.wanted_mm = self.opening_mm;
        }
    }

    /// Motor power goes: valves close, the gripper forgets its homing. Source: PM L3203, L6677.
    pub(super) const fn deactivate(&mut self) {
        self.homed = false;
        self.valves = [false; 2];
        self.forcing = 0.0;
        self.wanted_mm = self.opening_mm;
    }

    /// Widest opening, in mm; 0 without a gripper.
    pub(super) fn range_mm(&self) -> f64 {
        self.kind().opening_mm().unwrap_or(0.0)
    }

    /// The fingers shall go to `opening_mm`.
    pub(super) fn move_fingers(&mut self, opening_mm: f64, velocity_percent: f64, force: f64) {
        self.wanted_mm = opening_mm.clamp(0.0, self.range_mm());
        self.velocity_percent = velocity_percent;
        self.force_percent = force;
        self.moved = true;
    }

    /// Opens or closes valves; `None` keeps one.
    pub(super) fn set_valves(&mut self, valves: [Option<bool>; 2]) {
        for (valve, wanted) in self.valves.iter_mut().zip(valves) {
            *valve = wanted.unwrap_or(*valve);
        }
    }

    pub(super) const fn valves(&self) -> [bool; 2] {
        self.valves
    }

    /// Puts a part between the fingers, or takes it away.
    pub(super) const fn place_part(&mut self, part: Option<Part>) {
        self.part = part;
        self.moved = true;
    }

    /// The gripper stops applying a force (error 3025). Source: PM L553.
    pub(super) const fn release(&mut self) {
        self.wanted_mm = self.opening_mm;
        self.forcing = 0.0;
    }

    fn clamped(&self, opening_mm: f64) -> f64 {
        match self.part {
            Some(Part::Outer(least)) => opening_mm.max(least.min(self.range_mm())),
            Some(Part::Inner(most)) => opening_mm.min(most.max(0.0)),
            None => opening_mm,
        }
    }

    /// Whether the fingers have nowhere to go.
    pub(super) const fn is_at_rest(&self) -> bool {
        !self.moved
    }

    /// Lets `seconds` pass.
    pub(super) fn advance(&mut self, seconds: f64) {
        if !self.moved || !self.is_gripper() {
            self.moved = false;
            return;
        }
        let reachable = self.clamped(self.wanted_mm);
        let step = (FULL_VELOCITY_MM_PER_S * self.velocity_percent / 100.0 * seconds).max(0.0);
        let way = reachable - self.opening_mm;
        self.opening_mm += way.clamp(-step, step);
        if (reachable - self.opening_mm).abs() < SAME_MM {
            self.opening_mm = reachable;
            self.moved = false;
            let blocked_by = self.wanted_mm - reachable;
            self.forcing = if blocked_by.abs() < SAME_MM { 0.0 } else { blocked_by.signum() };
        } else {
            self.forcing = 0.0;
        }
    }

    /// What a gripper reports; `range` is that of SetGripperRange.
    pub(super) fn gripper_state(&self, range: Option<[f32; 2]>) -> GripperState {
        let [closed_mm, open_mm] =
            range.map_or([0.0, self.range_mm()], |range| range.map(f64::from));
        GripperState {
            holding_part: self.forcing != 0.0,
            target_reached: (self.wanted_mm - self.opening_mm).abs() < SAME_MM,
            closed: self.opening_mm <= closed_mm + SAME_MM,
            open: self.opening_mm >= open_mm - SAME_MM,
            force_percent: self.forcing * self.force_percent,
            opening_mm: self.opening_mm,
        }
    }
}
