//! The four dynamic slots: what they are asked for, what they show, and the rotation.
//!
//! ```text
//! requested now --> (one or two cycles) --> shown; 0 shows the next type of the rotation
//! ```
//!
//! A slot always says which type it shows. Source: PM L1268-1291, L1534, L1598.

use super::dynamic_values::is_reported;
use super::readings::{
    AutomaticSlots, DynamicDelay, Readings, UnavailableInRotation, UnknownDynamicType,
    VariablesInRotation,
};
use super::variables::Variables;
use crate::wire::meca500::dynamic::{DYNAMIC_TYPES, DynamicType};

/// The slots of one connection.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct DynamicSlots {
    /// Requests of this cycle and the two before.
    requested: [[u32; 4]; 3],
    shown: [DynamicType; 4],
    /// The type that the rotation showed last.
    rotated: DynamicType,
    /// Completed rotations.
    cycles: u32,
}

impl DynamicSlots {
    /// What the slots show in this cycle, in which `requested` was asked for.
    pub(super) fn next(
        &mut self,
        requested: [u32; 4],
        readings: &Readings,
        variables: &Variables,
    ) -> [DynamicType; 4] {
        let [now, before, _] = self.requested;
        self.requested = [requested, now, before];
        let due = match readings.dynamic_delay {
            DynamicDelay::OneCycle => now,
            DynamicDelay::TwoCycles => before,
        };
        let mut together = None;
        for (shown, wanted) in self.shown.iter_mut().zip(due.map(DynamicType)) {
            let exists = is_known(wanted) || variables.get(variable_id(wanted)).is_some();
            let is_automatic = wanted == DynamicType::AUTOMATIC
                || (!exists && readings.unknown_dynamic_type == UnknownDynamicType::Automatic);
            if is_automatic {
                let turn = |rotated: &mut DynamicType, cycles: &mut u32| {
                    let (next, wrapped) = after(*rotated, readings, variables);
                    *rotated = next;
                    *cycles = cycles.wrapping_add(u32::from(wrapped));
                    next
                };
                *shown = match readings.automatic_slots {
                    AutomaticSlots::Share => turn(&mut self.rotated, &mut self.cycles),
                    AutomaticSlots::Together => {
                        *together.get_or_insert_with(|| turn(&mut self.rotated, &mut self.cycles))
                    }
                };
            } else if exists || readings.unknown_dynamic_type == UnknownDynamicType::EchoedWithZeros
            {
                *shown = wanted;
            }
        }
        self.shown
    }

    /// DynamicDataCycles.
    pub(super) const fn cycles(&self) -> u32 {
        self.cycles
    }
}

/// Whether Table 12 has the type for this robot.
fn is_known(ty: DynamicType) -> bool {
    !ty.is_variable() && ty.spec().is_some()
}

/// The cyclic ID that a variable's type is; 0 for other types.
pub(super) fn variable_id(ty: DynamicType) -> u16 {
    if ty.is_variable() { u16::try_from(ty.0).unwrap_or(0) } else { 0 }
}

/// The type after `ty` in the rotation, and whether the rotation began anew.
fn after(ty: DynamicType, readings: &Readings, variables: &Variables) -> (DynamicType, bool) {
    let unavailable = readings.unavailable_in_rotation == UnavailableInRotation::Present;
    let table = |above: DynamicType| {
        DYNAMIC_TYPES
            .iter()
            .filter(move |spec| spec.last_id > above && !spec.id.is_variable())
            .find(|spec| unavailable || is_reported(spec))
            .map(|spec| DynamicType(spec.id.0.max(above.0 + 1)))
    };
    let variables = || {
        let present = readings.variables_in_rotation == VariablesInRotation::Present;
        let mut ids = variables.ids().filter(|_| present).map(|id| DynamicType(id.into()));
        ids.find(|id| *id > ty)
    };
    let next = table(ty).or_else(variables);
    let wrapped = next.is_none() && ty != DynamicType::AUTOMATIC;
    (next.or_else(|| table(DynamicType::AUTOMATIC)).unwrap_or(ty), wrapped)
}
