//! What a sample-and-hold bus can do to a cell: seeded, replayable faults between a PLC and any
//! [`CyclicDevice`].
//!
//! A [`FaultyLink`] is a link without sockets that joins one device and misbehaves on purpose. At
//! most one fault is active at a time and lasts a bounded number of cycles, so that a run can be
//! told as a list: [`FaultyLink::active`] says what happens in the cycle just made.
//!
//! Every fault but the corrupting ones is something a correct bus does: an image arrives whole,
//! but late, twice, not at all, or composed of 32-bit words of two neighbouring cycles. A PLC must
//! survive those without losing, doubling or tearing a command. The corrupting faults
//! ([`Fault::BitFlip`], [`Fault::TornOutputs`]) are kept from a PLC by every bus's checksum and
//! consistency rules; against them it can only stay sane, so they are not part of
//! [`Fault::SURVIVABLE`].
//!
//! Left out: reboots of the robot and restarts of the PLC, which are done to the device and the
//! engine directly.

use alloc::vec;
use alloc::vec::Vec;
use core::convert::Infallible;

use crate::cycle::{CyclicDevice, CyclicLink, InputQuality};
use crate::time::Instant;

/// One way a bus misbehaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Fault {
    /// The inputs are old, and the link says so. The robot gets its outputs.
    Stale,
    /// The inputs are old and called fresh: the robot's cycle is slower than the bus.
    Frozen,
    /// The outputs do not reach the robot, which goes on with those it has.
    Skipped,
    /// Outputs and inputs arrive one cycle late.
    Late,
    /// The inputs are 32-bit words of the newest image and the one before it.
    TornInputs,
    /// The inputs are zeros, called fresh: a stack that is up before its application.
    Zeroed,
    /// Nothing passes in either direction, and the link says so.
    LinkLoss,
    /// One bit of the inputs is wrong.
    BitFlip,
    /// The robot gets 32-bit words of these outputs and those before them.
    TornOutputs,
}

impl Fault {
    /// What a correct bus does: a PLC must come through without a lost or doubled command.
    pub const SURVIVABLE: &[Self] = &[
        Self::Stale,
        Self::Frozen,
        Self::Skipped,
        Self::Late,
        Self::TornInputs,
        Self::Zeroed,
        Self::LinkLoss,
    ];

    /// What checksums and consistency rules keep from a PLC: it must stay sane.
    pub const CORRUPTING: &[Self] = &[Self::BitFlip, Self::TornOutputs];
}

/// Which faults come, how often, and for how long.
#[derive(Clone, Copy, Debug)]
pub struct FaultPlan {
    /// The faults to draw from, each as likely as the others; none means a perfect bus.
    pub faults: &'static [Fault],
    /// Chance that a fault starts in a cycle without one, in 1/1000.
    pub per_mille: u16,
    /// Longest duration of a fault in cycles; the shortest is 1.
    pub longest_cycles: u32,
}

impl FaultPlan {
    /// A perfect bus.
    pub const NONE: Self = Self { faults: &[], per_mille: 0, longest_cycles: 1 };
}

/// A link in memory to `device` that misbehaves as planned; the same seed gives the same run.
#[derive(Clone, Debug)]
pub struct FaultyLink<D> {
    device: D,
    plan: FaultPlan,
    random: fastrand::Rng,
    active: Option<Fault>,
    cycles_left: u32,
    age_cycles: u32,
    /// What the robot got in this cycle and in the one before.
    held: Vec<u8>,
    previous_outputs: Vec<u8>,
    /// What the robot produced in this cycle and in the one before.
    produced: Vec<u8>,
    previous_inputs: Vec<u8>,
}

impl<D: CyclicDevice> FaultyLink<D> {
    /// Joins `device` by a bus that misbehaves by `plan`, seeded with `seed`.
    #[must_use]
    pub fn new(device: D, plan: FaultPlan, seed: u64) -> Self {
        Self {
            device,
            plan,
            random: fastrand::Rng::with_seed(seed),
            active: None,
            cycles_left: 0,
            age_cycles: 0,
            held: vec![0; D::OUTPUT_LEN],
            previous_outputs: vec![0; D::OUTPUT_LEN],
            produced: vec![0; D::INPUT_LEN],
            previous_inputs: vec![0; D::INPUT_LEN],
        }
    }

    /// The robot at the far end.
    pub fn device(&self) -> &D {
        &self.device
    }

    /// The robot at the far end, to press its buttons or reboot it.
    pub fn device_mut(&mut self) -> &mut D {
        &mut self.device
    }

    /// Changes the plan from the next cycle on; an active fault ends.
    pub fn set_plan(&mut self, plan: FaultPlan) {
        self.plan = plan;
        self.active = None;
        self.cycles_left = 0;
    }

    /// Starts `fault` with the next cycle, for `cycles` cycles.
    pub fn inject(&mut self, fault: Fault, cycles: u32) {
        self.active = Some(fault);
        // The next cycle counts one down before it looks.
        self.cycles_left = cycles.saturating_add(1);
    }

    /// The fault of the cycle just made.
    #[must_use]
    pub fn active(&self) -> Option<Fault> {
        self.active
    }

    /// The outputs the robot has, whether they reached it in this cycle or before.
    #[must_use]
    pub fn held_outputs(&self) -> &[u8] {
        &self.held
    }

    /// The inputs the robot produced in this cycle, whether they reached the PLC or not.
    #[must_use]
    pub fn produced_inputs(&self) -> &[u8] {
        &self.produced
    }

    fn choose_fault(&mut self) {
        self.cycles_left = self.cycles_left.saturating_sub(1);
        if self.cycles_left > 0 {
            return;
        }
        self.active = None;
        if self.random.u16(0..1000) < self.plan.per_mille {
            self.active = self.random.choice(self.plan.faults).copied();
            self.cycles_left = self.random.u32(1..=self.plan.longest_cycles.max(1));
        }
    }

    /// What the robot has of `outputs` in this cycle.
    fn deliver_outputs(&mut self, outputs: &[u8]) {
        match self.active {
            Some(Fault::Skipped | Fault::LinkLoss) => {}
            Some(Fault::Late) => self.held.copy_from_slice(&self.previous_outputs),
            Some(Fault::TornOutputs) => {
                tear(&mut self.random, &mut self.held, &self.previous_outputs, outputs);
            }
            _ => self.held.copy_from_slice(outputs),
        }
        self.previous_outputs.copy_from_slice(outputs);
    }

    /// What the PLC gets of what the robot produced in this cycle.
    fn deliver_inputs(&mut self, inputs: &mut [u8]) -> InputQuality {
        match self.active {
            None | Some(Fault::Skipped | Fault::TornOutputs) => {
                inputs.copy_from_slice(&self.produced);
            }
            Some(Fault::Frozen) => {}
            Some(Fault::Late) => inputs.copy_from_slice(&self.previous_inputs),
            Some(Fault::TornInputs) => {
                tear(&mut self.random, inputs, &self.previous_inputs, &self.produced);
            }
            Some(Fault::Zeroed) => inputs.fill(0),
            Some(Fault::BitFlip) => {
                inputs.copy_from_slice(&self.produced);
                let bit = self.random.usize(0..inputs.len() * 8);
                if let Some(byte) = inputs.get_mut(bit / 8) {
                    *byte ^= 1 << (bit % 8);
                }
            }
            Some(Fault::Stale) => {
                self.age_cycles = self.age_cycles.saturating_add(1);
                return InputQuality::Stale { age_cycles: self.age_cycles };
            }
            Some(Fault::LinkLoss) => {
                self.age_cycles = self.age_cycles.saturating_add(1);
                return InputQuality::Lost;
            }
        }
        self.age_cycles = 0;
        InputQuality::Fresh
    }
}

/// Fills `into` with the words of `old` and `new`, cut at a random 32-bit boundary.
fn tear(random: &mut fastrand::Rng, into: &mut [u8], old: &[u8], new: &[u8]) {
    let cut = 4 * random.usize(0..=into.len() / 4);
    let (head, tail) = if random.bool() { (old, new) } else { (new, old) };
    let words = head.iter().take(cut).chain(tail.iter().skip(cut));
    for (to, from) in into.iter_mut().zip(words) {
        *to = *from;
    }
}

impl<D: CyclicDevice> CyclicLink for FaultyLink<D> {
    type Error = Infallible;

    /// One cycle of the misbehaving bus. Images of the wrong length count as a lost link.
    fn exchange(
        &mut self,
        now: Instant,
        outputs: &[u8],
        inputs: &mut [u8],
    ) -> Result<InputQuality, Infallible> {
        if outputs.len() != D::OUTPUT_LEN || inputs.len() != D::INPUT_LEN {
            return Ok(InputQuality::Lost);
        }
        self.choose_fault();
        self.deliver_outputs(outputs);
        self.previous_inputs.copy_from_slice(&self.produced);
        let seen = (self.active != Some(Fault::LinkLoss)).then_some(self.held.as_slice());
        self.device.cycle(now, seen, &mut self.produced);
        if !self.device.is_on_bus() {
            self.age_cycles = self.age_cycles.saturating_add(1);
            return Ok(InputQuality::Lost);
        }
        Ok(self.deliver_inputs(inputs))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Echoes its first output word and counts its cycles in the second.
    struct Echo {
        cycles: u32,
    }

    impl CyclicDevice for Echo {
        const OUTPUT_LEN: usize = 8;
        const INPUT_LEN: usize = 8;

        fn cycle(&mut self, _: Instant, outputs: Option<&[u8]>, inputs: &mut [u8]) {
            self.cycles += 1;
            if let Some(outputs) = outputs {
                inputs[..4].copy_from_slice(&outputs[..4]);
            }
            inputs[4..].copy_from_slice(&self.cycles.to_le_bytes());
        }

        fn is_on_bus(&self) -> bool {
            true
        }
    }

    fn link(plan: FaultPlan, seed: u64) -> FaultyLink<Echo> {
        FaultyLink::new(Echo { cycles: 0 }, plan, seed)
    }

    fn exchange(link: &mut FaultyLink<Echo>, word: u32, inputs: &mut [u8]) -> InputQuality {
        let outputs = u64::from(word).to_le_bytes();
        let Ok(quality) = link.exchange(Instant::ZERO, &outputs, inputs);
        quality
    }

    fn words(inputs: [u8; 8]) -> (u32, u32) {
        let both = u64::from_le_bytes(inputs);
        (both as u32, (both >> 32) as u32)
    }

    #[test]
    fn a_perfect_bus_answers_in_the_same_cycle() {
        let mut link = link(FaultPlan::NONE, 1);
        let mut inputs = [0; 8];
        for word in 1..100 {
            assert_eq!(exchange(&mut link, word, &mut inputs), InputQuality::Fresh);
            assert_eq!(words(inputs), (word, word));
        }
    }

    #[test]
    fn each_fault_does_what_it_says() {
        let expected = [
            (Fault::Stale, InputQuality::Stale { age_cycles: 1 }, (2, 2)),
            (Fault::Frozen, InputQuality::Fresh, (2, 2)),
            (Fault::Skipped, InputQuality::Fresh, (2, 3)),
            (Fault::Late, InputQuality::Fresh, (2, 2)),
            (Fault::Zeroed, InputQuality::Fresh, (0, 0)),
            (Fault::LinkLoss, InputQuality::Lost, (2, 2)),
        ];
        for (fault, quality, seen) in expected {
            let mut link = link(FaultPlan::NONE, 1);
            let mut inputs = [0; 8];
            exchange(&mut link, 1, &mut inputs);
            exchange(&mut link, 2, &mut inputs);
            link.inject(fault, 1);
            assert_eq!(exchange(&mut link, 3, &mut inputs), quality, "{fault:?}");
            assert_eq!(link.active(), Some(fault));
            assert_eq!(words(inputs), seen, "{fault:?}");
            assert_eq!(exchange(&mut link, 4, &mut inputs), InputQuality::Fresh, "{fault:?}");
            assert_eq!(words(inputs), (4, 4), "{fault:?} has ended");
        }
    }

    #[test]
    fn a_tear_mixes_whole_words_of_two_neighbouring_images() {
        let mut mixed = 0;
        for seed in 0..200 {
            let mut link = link(FaultPlan::NONE, seed);
            let mut inputs = [0; 8];
            exchange(&mut link, 1, &mut inputs);
            link.inject(Fault::TornInputs, 1);
            exchange(&mut link, 2, &mut inputs);
            let (word, count) = words(inputs);
            assert!((1..=2).contains(&word) && (1..=2).contains(&count));
            mixed += u32::from(word != count);
        }
        assert!(mixed > 20, "tears are drawn: {mixed}");
    }

    #[test]
    fn the_same_seed_gives_the_same_faults() {
        let plan = FaultPlan { faults: Fault::SURVIVABLE, per_mille: 200, longest_cycles: 5 };
        let run = |seed| {
            let mut link = link(plan, seed);
            let mut inputs = [0; 8];
            (0..1000)
                .map(|word| (exchange(&mut link, word, &mut inputs), link.active(), inputs))
                .collect::<Vec<_>>()
        };
        assert_eq!(run(7), run(7));
        assert_ne!(run(7), run(8));
        for fault in Fault::SURVIVABLE {
            assert!(run(7).iter().any(|(_, active, _)| active == &Some(*fault)), "{fault:?}");
        }
    }
}
