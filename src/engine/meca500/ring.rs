//! A queue of fixed capacity: the only container of the engine.
//!
//! Invariants: `len <= N`; nothing is ever overwritten, a full ring hands the value back; an empty
//! ring starts over at its first slot, so that a queue that is read as it fills stays in the same
//! cache lines.

/// First in, first out, at most `N` values, no allocation. `repr(C)`: the counts lie in the cache
/// line of the first slots.
#[derive(Clone, Debug)]
#[repr(C)]
pub(super) struct Ring<T: Copy, const N: usize> {
    head: u32,
    len: u32,
    /// Slots that hold no value hold any: an `Option` for each would cost memory and a branch.
    slots: [T; N],
}

impl<T: Copy, const N: usize> Ring<T, N> {
    /// An empty ring; nobody ever sees `filler`.
    pub(super) const fn new(filler: T) -> Self {
        const { assert!(N <= u32::MAX as usize) };
        Self { head: 0, len: 0, slots: [filler; N] }
    }

    pub(super) const fn len(&self) -> u32 {
        self.len
    }

    pub(super) const fn is_empty(&self) -> bool {
        self.len == 0
    }

    pub(super) const fn free(&self) -> usize {
        N - self.len as usize
    }

    /// Slot of the value at `position`; `position` is below `N`, so one subtraction wraps it.
    const fn slot(&self, position: u32) -> usize {
        let slot = self.head as usize + position as usize;
        if slot >= N { slot - N } else { slot }
    }

    /// Adds `value` at the back; `false` and nothing changed when the ring is full.
    pub(super) fn push(&mut self, value: T) -> bool {
        if self.free() == 0 {
            return false;
        }
        let slot = self.slot(self.len);
        if let Some(place) = self.slots.get_mut(slot) {
            *place = value;
            self.len += 1;
        }
        true
    }

    /// The value at `position`, counted from the front.
    pub(super) fn get(&self, position: u32) -> Option<&T> {
        if position < self.len { self.slots.get(self.slot(position)) } else { None }
    }

    pub(super) fn get_mut(&mut self, position: u32) -> Option<&mut T> {
        let slot = self.slot(position);
        if position < self.len { self.slots.get_mut(slot) } else { None }
    }

    pub(super) fn front(&self) -> Option<&T> {
        self.get(0)
    }

    pub(super) fn back_mut(&mut self) -> Option<&mut T> {
        self.len.checked_sub(1).and_then(|last| self.get_mut(last))
    }

    pub(super) fn pop(&mut self) -> Option<T> {
        let value = *self.front()?;
        self.len -= 1;
        self.head = if self.len == 0 { 0 } else { self.slot(1) as u32 };
        Some(value)
    }

    pub(super) fn clear(&mut self) {
        self.head = 0;
        self.len = 0;
    }
}
