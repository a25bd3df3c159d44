//! The address space of an ESC: registers below 1000h, process data memory above.

/// Length of the address space in bytes.
pub(super) const MEMORY_LEN: usize = 0x2000;

/// The bytes of registers and process data memory; values are little-endian.
#[derive(Clone, Debug)]
pub(super) struct Memory {
    bytes: [u8; MEMORY_LEN],
}

impl Memory {
    pub(super) const fn new() -> Self {
        Self { bytes: [0; MEMORY_LEN] }
    }

    /// The bytes from `address` on; `None` if they are not all there.
    pub(super) fn get(&self, address: u16, length: usize) -> Option<&[u8]> {
        self.bytes.get(usize::from(address)..)?.get(..length)
    }

    /// The bytes from `address` on; `None` if they are not all there.
    pub(super) fn get_mut(&mut self, address: u16, length: usize) -> Option<&mut [u8]> {
        self.bytes.get_mut(usize::from(address)..)?.get_mut(..length)
    }

    /// A value; zero where there is no memory.
    pub(super) fn read<const N: usize>(&self, address: u16) -> [u8; N] {
        let rest = self.bytes.get(usize::from(address)..);
        rest.and_then(|rest| rest.first_chunk()).copied().unwrap_or([0; N])
    }

    /// Sets a value; nothing happens where there is no memory.
    pub(super) fn write<const N: usize>(&mut self, address: u16, value: [u8; N]) {
        let rest = self.bytes.get_mut(usize::from(address)..);
        if let Some(place) = rest.and_then(|rest| rest.first_chunk_mut()) {
            *place = value;
        }
    }

    pub(super) fn u8(&self, address: u16) -> u8 {
        u8::from_le_bytes(self.read(address))
    }

    pub(super) fn u16(&self, address: u16) -> u16 {
        u16::from_le_bytes(self.read(address))
    }

    pub(super) fn u32(&self, address: u16) -> u32 {
        u32::from_le_bytes(self.read(address))
    }

    pub(super) fn u64(&self, address: u16) -> u64 {
        u64::from_le_bytes(self.read(address))
    }

    pub(super) fn set_u8(&mut self, address: u16, value: u8) {
        self.write(address, [value]);
    }

    pub(super) fn set_u16(&mut self, address: u16, value: u16) {
        self.write(address, value.to_le_bytes());
    }

    pub(super) fn set_u32(&mut self, address: u16, value: u32) {
        self.write(address, value.to_le_bytes());
    }

    pub(super) fn set_u64(&mut self, address: u16, value: u64) {
        self.write(address, value.to_le_bytes());
    }

    /// Counts one more in a counter of one byte, which stops at 255.
    pub(super) fn count(&mut self, address: u16) {
        self.set_u8(address, self.u8(address).saturating_add(1));
    }
}
