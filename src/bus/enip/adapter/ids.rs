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
