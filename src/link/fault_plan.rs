//! Which faults come and how often, for the wires and networks that misbehave on purpose.
//!
//! Invariant: the same plan and the same number of looks give the same faults.

use std::vec::Vec;

/// Which faults come, and how often.
#[derive(Clone, Debug)]
pub struct FaultPlan<F> {
    /// A fault and the chance that a frame meets it, in 1/1000; looked at in this order.
    pub chances: Vec<(F, u16)>,
    /// Where the random numbers begin.
    pub seed: u64,
    /// Number of faults after which nothing misbehaves any more; `None` is no end.
    pub limit: Option<u32>,
}

impl<F> FaultPlan<F> {
    /// No faults.
    pub const NONE: Self = Self { chances: Vec::new(), seed: 0, limit: None };
}

/// Draws faults by a [`FaultPlan`] and keeps count.
pub(super) struct Draws<F> {
    plan: FaultPlan<F>,
    /// For what a fault is like, too.
    pub(super) random: fastrand::Rng,
    made: u32,
    last: Option<F>,
}

impl<F: Copy> Draws<F> {
    pub(super) fn new(plan: FaultPlan<F>) -> Self {
        Self { random: fastrand::Rng::with_seed(plan.seed), plan, made: 0, last: None }
    }

    /// The fault that a frame meets: `injected`, or one by the plan.
    pub(super) fn draw(&mut self, injected: Option<F>) -> Option<F> {
        let drawn = injected.or_else(|| self.draw_by_plan());
        if drawn.is_some() {
            self.made = self.made.saturating_add(1);
            self.last = drawn;
        }
        drawn
    }

    fn draw_by_plan(&mut self) -> Option<F> {
        if self.plan.limit.is_some_and(|limit| self.made >= limit) {
            return None;
        }
        let random = &mut self.random;
        let mut met =
            self.plan.chances.iter().filter(|(_, per_mille)| random.u16(0..1000) < *per_mille);
        met.next().map(|(fault, _)| *fault)
    }

    /// Number of faults made so far.
    pub(super) const fn made(&self) -> u32 {
        self.made
    }

    /// The newest fault.
    pub(super) const fn last(&self) -> Option<F> {
        self.last
    }

    /// Whether the plan has no faults.
    #[cfg(feature = "ethercat")]
    pub(super) const fn plans_none(&self) -> bool {
        self.plan.chances.is_empty()
    }
}
