//! Dynamic data: many wanted types, four slots.
//!
//! Each slot asks for one wanted type. While no more than four are wanted they stay where they are;
//! with more, a slot hands its turn on as soon as its type has arrived, or after the patience of the
//! configuration (a type the robot does not know never arrives).
//!
//! Invariants: a value is taken only from a slot whose DynamicType names a wanted type, whichever
//! slot that is, so the delay of one or two cycles and the numbering of slots do not matter; slots
//! nobody needs ask for 0.
//!
//! Left out: what the values mean ([`crate::wire::meca500::dynamic`]).

use super::Engine;
use super::config::Config;
use super::outputs::Outputs;
use super::ticket::SubscribeError;
use crate::time::{Duration, Instant};
use crate::wire::meca500::dynamic::{DynamicType, DynamicValue};
use crate::wire::meca500::image::InputImage;
use crate::wire::order::ImageOrder;

/// Types that can be wanted at the same time.
pub(super) const SUBSCRIPTIONS: usize = 16;

/// A value of a subscribed type.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DynamicReading {
    /// The type and its six values.
    pub value: DynamicValue,
    /// Time since it arrived.
    pub age: Duration,
}

#[derive(Clone, Copy, Debug)]
struct Wanted {
    ty: DynamicType,
    taken: Option<(DynamicValue, Instant)>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Slot {
    /// Position in the list of wanted types.
    asks: Option<usize>,
    waited: u16,
}

/// `repr(C)`: the count, all that is looked at while nothing is wanted, lies beside the engine's
/// other hot fields.
#[derive(Clone, Debug)]
#[repr(C)]
pub(super) struct Dynamic {
    wanted: [Option<Wanted>; SUBSCRIPTIONS],
    slots: [Slot; 4],
    /// Position the next free slot starts looking from.
    turn: usize,
    count: usize,
}

impl Dynamic {
    pub(super) const fn new() -> Self {
        Self {
            wanted: [None; SUBSCRIPTIONS],
            slots: [Slot { asks: None, waited: 0 }; 4],
            turn: 0,
            count: 0,
        }
    }

    fn subscribe(&mut self, ty: DynamicType) -> Result<(), SubscribeError> {
        if ty == DynamicType::AUTOMATIC {
            return Err(SubscribeError::Automatic);
        }
        if self.find(ty).is_some() {
            return Ok(());
        }
        let free = self.wanted.iter_mut().find(|place| place.is_none());
        let Some(free) = free else { return Err(SubscribeError::Full { max: SUBSCRIPTIONS }) };
        *free = Some(Wanted { ty, taken: None });
        self.count += 1;
        Ok(())
    }

    fn unsubscribe(&mut self, ty: DynamicType) {
        let Some(position) = self.find(ty) else { return };
        if let Some(place) = self.wanted.get_mut(position) {
            *place = None;
            self.count -= 1;
        }
        for slot in self.slots.iter_mut().filter(|slot| slot.asks == Some(position)) {
            *slot = Slot::default();
        }
    }

    fn find(&self, ty: DynamicType) -> Option<usize> {
        self.wanted.iter().position(|place| place.is_some_and(|wanted| wanted.ty == ty))
    }

    fn at(&self, position: usize) -> Option<Wanted> {
        self.wanted.get(position).copied().flatten()
    }

    /// Takes what arrived in a fresh image.
    #[inline]
    pub(super) fn take<O: ImageOrder>(&mut self, image: &InputImage<O>, now: Instant) {
        if self.count == 0 {
            return;
        }
        for (data, index) in image.dynamic_data.iter().zip(0_usize..) {
            let ty = DynamicType(data.dynamic_type.get());
            let asked = self.slots.get(index).and_then(|slot| slot.asks);
            let position = match asked {
                Some(asked) if self.at(asked).is_some_and(|wanted| wanted.ty == ty) => asked,
                _ => match self.find(ty) {
                    Some(position) => position,
                    None => continue,
                },
            };
            let values = data.value_idx.each_ref().map(|value| value.get());
            if let Some(Some(wanted)) = self.wanted.get_mut(position) {
                wanted.taken = Some((DynamicValue::from_values(ty, values), now));
            }
        }
    }

    /// Gives each slot its type for the coming cycle.
    #[inline]
    pub(super) fn schedule(&mut self, now: Instant, config: &Config, outputs: &mut Outputs) {
        if self.count == 0 {
            outputs.dynamic = [0; 4];
        } else {
            self.take_turns(now, config.dynamic_patience_cycles, outputs);
        }
    }

    fn take_turns(&mut self, now: Instant, patience: u16, outputs: &mut Outputs) {
        let crowded = self.count > self.slots.len();
        for index in 0..self.slots.len() {
            let Some(mut slot) = self.slots.get(index).copied() else { continue };
            let asked = slot.asks.and_then(|asks| self.at(asks));
            let served = asked.and_then(|wanted| wanted.taken).is_some_and(|(_, at)| at == now);
            slot.waited = slot.waited.saturating_add(1);
            let turn_over =
                crowded && slot.waited > 1 && (served || slot.waited >= patience.max(1));
            if (asked.is_none() || turn_over)
                && let Some(position) = self.next_wanted()
            {
                slot = Slot { asks: Some(position), waited: 0 };
            }
            let asks = slot.asks.and_then(|asks| self.at(asks));
            if let Some(request) = outputs.dynamic.get_mut(index) {
                *request = asks.map_or(0, |wanted| wanted.ty.0);
            }
            if let Some(place) = self.slots.get_mut(index) {
                *place = slot;
            }
        }
    }

    /// The next wanted type that no slot asks for.
    fn next_wanted(&mut self) -> Option<usize> {
        let start = self.turn;
        let position = (start..start + SUBSCRIPTIONS).map(|at| at % SUBSCRIPTIONS).find(|at| {
            self.at(*at).is_some() && !self.slots.iter().any(|slot| slot.asks == Some(*at))
        })?;
        self.turn = (position + 1) % SUBSCRIPTIONS;
        Some(position)
    }
}

impl<const QUEUE: usize> Engine<QUEUE> {
    /// Wants this type from now on; unknown types are asked for like any other.
    ///
    /// # Errors
    ///
    /// Too many types, or type 0.
    pub fn subscribe(&mut self, ty: DynamicType) -> Result<(), SubscribeError> {
        self.dynamic.subscribe(ty)
    }

    /// Does not want this type any more; its last value is forgotten.
    pub fn unsubscribe(&mut self, ty: DynamicType) {
        self.dynamic.unsubscribe(ty);
    }

    /// The newest value of a subscribed type; `None` until one has arrived.
    #[must_use]
    pub fn dynamic(&self, ty: DynamicType) -> Option<DynamicReading> {
        let (value, at) = self.dynamic.at(self.dynamic.find(ty)?)?.taken?;
        Some(DynamicReading { value, age: self.now.saturating_duration_since(at) })
    }
}
