//! A queue of fixed capacity: the only container of the engine.
//!
//! Invariant: `len <= N`; nothing is ever overwritten, a full ring hands the value back.

/// First in, first out, at most `N` values, no allocation.
#[derive(Clone, Debug)]
pub(super) struct Ring<T: Copy, const N: usize> {
    slots: [Option<T>; N],
    head: usize,
    len: usize,
}

impl<T: Copy, const N: usize> Ring<T, N> {
    pub(super) const fn new() -> Self {
        Self { slots: [None; N], head: 0, len: 0 }
    }

    pub(super) const fn len(&self) -> usize {
        self.len
    }

    pub(super) const fn is_empty(&self) -> bool {
        self.len == 0
    }

    pub(super) const fn free(&self) -> usize {
        N - self.len
    }

    /// Slot of the value at `position`; `position` is below `N`, so one subtraction wraps it.
    const fn slot(&self, position: usize) -> usize {
        let slot = self.head + position;
        if slot >= N { slot - N } else { slot }
    }

    /// Adds `value` at the back; `false` and nothing changed when the ring is full.
    pub(super) fn push(&mut self, value: T) -> bool {
        if self.len >= N {
            return false;
        }
        let slot = self.slot(self.len);
        if let Some(place) = self.slots.get_mut(slot) {
            *place = Some(value);
            self.len += 1;
        }
        true
    }

    /// The value at `position`, counted from the front.
    pub(super) fn get(&self, position: usize) -> Option<T> {
        if position >= self.len {
            return None;
        }
        self.slots.get(self.slot(position)).copied().flatten()
    }

    pub(super) fn get_mut(&mut self, position: usize) -> Option<&mut T> {
        if position >= self.len {
            return None;
        }
        let slot = self.slot(position);
        self.slots.get_mut(slot).and_then(Option::as_mut)
    }

    pub(super) fn front(&self) -> Option<T> {
        self.get(0)
    }

    pub(super) fn back_mut(&mut self) -> Option<&mut T> {
        self.len.checked_sub(1).and_then(|last| self.get_mut(last))
    }

    pub(super) fn pop(&mut self) -> Option<T> {
        let value = self.front()?;
        self.head = self.slot(1 % N.max(1));
        self.len -= 1;
        Some(value)
    }

    pub(super) fn clear(&mut self) {
        self.head = 0;
        self.len = 0;
    }
}
