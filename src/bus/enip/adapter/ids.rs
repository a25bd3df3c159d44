//! Numbers for connections and sessions that do not repeat soon.
//!
//! The upper half of a number tells one life of the adapter from the next, so that frames for a connection
//! from before a restart do not reach one from after it; the lower half counts.

/// Where numbers come from.
#[derive(Debug)]
pub(super) struct Ids {
    life: u16,
    count: u16,
}

impl Ids {
    pub(super) const fn new(seed: u64) -> Self {
        Self { life: life_from(seed), count: 0 }
    }

    /// Begins another life; counting goes on.
    pub(super) const fn restart(&mut self, seed: u64) {
        let life = life_from(seed);
        // Life 0 is left out: it would allow the number 0.
        let next = if self.life == u16::MAX { 1 } else { self.life + 1 };
        self.life = if life == self.life { next } else { life };
    }

    /// The next number, never 0; the same only after 65 536 others.
    pub(super) const fn next(&mut self) -> u32 {
        self.count = self.count.wrapping_add(1);
        (self.life as u32) << 16 | self.count as u32
    }
}

/// 16 bits that depend on all of `seed`; not 0.
const fn life_from(seed: u64) -> u16 {
    // The finaliser of SplitMix64: neighbouring seeds give unrelated lives.
    let mut mixed = seed.wrapping_add(0x9E37_79B9_7F4A_7C15);
    mixed = (mixed ^ mixed >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    let life = (mixed ^ mixed >> 31) as u16;
    if life == 0 { 1 } else { life }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_life_has_numbers_of_its_own() {
        let mut ids = Ids::new(5);
        for seed in [5, 5, 6, 5] {
            let before = ids.next();
            ids.restart(seed);
            let after = ids.next();
            assert_ne!(before >> 16, after >> 16, "seed {seed}");
            assert_eq!(after as u16, before as u16 + 1, "counting goes on");
        }
    }

    #[test]
    fn no_number_is_0() {
        assert!((0..100_000).all(|seed| life_from(seed) != 0));
        let mut ids = Ids { life: u16::MAX, count: u16::MAX };
        assert_eq!(ids.next(), 0xFFFF_0000);
        // Back to a seed whose life is the one before.
        let seed = (0..1_000_000).find(|seed| life_from(*seed) == u16::MAX).unwrap();
        ids.restart(seed);
        assert_eq!(ids.life, 1);
    }
}
