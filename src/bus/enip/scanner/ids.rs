//! Numbers that must not repeat: serial numbers, connection ids, sender contexts.

/// Where they come from. Each counts through its whole range before a number comes again; the seed says where
/// the counting begins, so that a new process does not begin where the last one did.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ids {
    serial: u16,
    connection: u32,
    context: u64,
}

/// An odd step: counting by it visits all numbers of 32 bits, and neighbours do not look alike.
const CONNECTION_STEP: u32 = 0x9E37_79B1;

/// The next number of a splitmix64 generator.
const fn splitmix(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let mut mixed = *state;
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    mixed ^ (mixed >> 31)
}

impl Ids {
    pub(super) const fn new(seed: u64) -> Self {
        let mut state = seed;
        let (serial, connection) = (splitmix(&mut state), splitmix(&mut state));
        Self { serial: serial as u16, connection: connection as u32, context: splitmix(&mut state) }
    }

    /// The serial number of another connection.
    pub(super) const fn serial(&mut self) -> u16 {
        self.serial = self.serial.wrapping_add(1);
        self.serial
    }

    /// Another connection id, never 0.
    pub(super) const fn connection(&mut self) -> u32 {
        self.connection = self.connection.wrapping_add(CONNECTION_STEP);
        if self.connection == 0 {
            self.connection = CONNECTION_STEP;
        }
        self.connection
    }

    /// Another sender context.
    pub(super) const fn context(&mut self) -> [u8; 8] {
        splitmix(&mut self.context).to_le_bytes()
    }
}
