//! Which PDOs travel in a sync manager, and in what order: objects 1C12h and 1C13h.

use crate::wire::ethercat::coe::AbortCode;
use crate::wire::meca500::image::pdo::{Pdo, PdoLayout, Pdos, input_pdos, output_pdos};
use crate::wire::meca500::image::{INPUT_LEN, OUTPUT_LEN};

/// More PDOs than either image has.
const MAX_PDOS: usize = 16;

/// Outputs or inputs, as the main device sees them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Direction {
    Outputs,
    Inputs,
}

impl Direction {
    /// The PDOs of this direction, in the order of the image.
    pub(super) fn pdos(self, layout: PdoLayout) -> Pdos {
        match self {
            Self::Outputs => output_pdos(layout),
            Self::Inputs => input_pdos(layout),
        }
    }

    const fn image_len(self) -> usize {
        match self {
            Self::Outputs => OUTPUT_LEN,
            Self::Inputs => INPUT_LEN,
        }
    }
}

/// Bytes of the image that lie together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Span {
    at: usize,
    len: usize,
}

/// The PDOs assigned to a sync manager.
///
/// Invariant: `spans` and `len` belong to the first `count` of `indices`, which are PDOs of this
/// direction, each once; together they are not longer than the image.
#[derive(Clone, Copy, Debug)]
pub(super) struct Assignment {
    direction: Direction,
    layout: PdoLayout,
    indices: [u16; MAX_PDOS],
    count: u8,
    spans: [Span; MAX_PDOS],
    len: usize,
    /// Every PDO in the order of the image: the bytes are the image.
    is_whole: bool,
}

impl Assignment {
    /// Every PDO but `left_out`, in the order of the image.
    pub(super) fn new(direction: Direction, layout: PdoLayout, left_out: &[u16]) -> Self {
        let mut assignment = Self {
            direction,
            layout,
            indices: [0; MAX_PDOS],
            count: 0,
            spans: [Span::default(); MAX_PDOS],
            len: 0,
            is_whole: false,
        };
        let chosen = direction.pdos(layout).filter(|pdo| !left_out.contains(&pdo.index));
        let mut count = 0;
        for (slot, pdo) in assignment.indices.iter_mut().zip(chosen) {
            *slot = pdo.index;
            count += 1;
        }
        assignment.set_count(count).map_or(assignment, |()| assignment)
    }

    /// How many PDOs can be assigned.
    pub(super) fn capacity(&self) -> u8 {
        u8::try_from(self.direction.pdos(self.layout).count()).unwrap_or(u8::MAX)
    }

    /// How many are assigned; 0 also while the entries are being written.
    pub(super) const fn count(&self) -> u8 {
        self.count
    }

    /// The PDO at `sub_index`, 1 or more; 0 where none was ever written.
    pub(super) fn index_at(&self, sub_index: u8) -> Option<u16> {
        let slot = usize::from(sub_index).checked_sub(1)?;
        self.indices.get(slot).copied().filter(|_| sub_index <= self.capacity())
    }

    /// Length of the assigned PDOs together, in bytes.
    pub(super) const fn byte_len(&self) -> usize {
        self.len
    }

    fn pdo(&self, index: u16) -> Option<Pdo> {
        self.direction.pdos(self.layout).find(|pdo| pdo.index == index)
    }

    /// Sub-index 0: the first `count` entries count.
    pub(super) fn set_count(&mut self, count: u8) -> Result<(), AbortCode> {
        if count > self.capacity() {
            return Err(AbortCode::VALUE_RANGE);
        }
        let mut spans = [Span::default(); MAX_PDOS];
        let mut len = 0;
        let used = self.indices.get(..usize::from(count)).ok_or(AbortCode::VALUE_RANGE)?;
        for (slot, index) in spans.iter_mut().zip(used) {
            let pdo = self.pdo(*index).ok_or(AbortCode::CANNOT_MAP)?;
            *slot = Span { at: pdo.byte_offset.into(), len: pdo.byte_len.into() };
            len += slot.len;
        }
        if len > self.direction.image_len() {
            return Err(AbortCode::PDO_LENGTH);
        }
        let once =
            used.iter().enumerate().all(|(at, index)| !used.iter().take(at).any(|i| i == index));
        if !once {
            return Err(AbortCode::CANNOT_MAP);
        }
        let mut next = 0;
        let in_order = spans.iter().take(used.len()).all(|span| {
            let follows = span.at == next;
            next = span.at + span.len;
            follows
        });
        self.is_whole = in_order && len == self.direction.image_len();
        (self.count, self.spans, self.len) = (count, spans, len);
        Ok(())
    }

    /// Sub-index 1 and up: a PDO, while none counts.
    pub(super) fn set_index(&mut self, sub_index: u8, index: u16) -> Result<(), AbortCode> {
        if self.count != 0 {
            return Err(AbortCode::COUNT_NOT_ZERO);
        }
        self.pdo(index).ok_or(AbortCode::CANNOT_MAP)?;
        let slot = usize::from(sub_index).checked_sub(1).and_then(|at| self.indices.get_mut(at));
        *slot.ok_or(AbortCode::NO_SUB_INDEX)? = index;
        Ok(())
    }

    /// All at once, from sub-index `first` on: the count with its padding (if 0), then the PDOs.
    pub(super) fn set_all(&mut self, first: u8, values: &[u8]) -> Result<(), AbortCode> {
        let (count, words) = if first == 0 {
            let (&[count, _], words) =
                values.split_first_chunk().ok_or(AbortCode::LENGTH_MISMATCH)?;
            (Some(count), words)
        } else {
            (None, values)
        };
        let (words, odd) = words.as_chunks::<2>();
        if !odd.is_empty() {
            return Err(AbortCode::LENGTH_MISMATCH);
        }
        if words.len() > usize::from(self.capacity()) {
            return Err(AbortCode::TOO_LONG);
        }
        let mut next = *self;
        if let Some(count) = count {
            if count > self.capacity() {
                return Err(AbortCode::VALUE_RANGE);
            }
            if words.len() < usize::from(count) {
                return Err(AbortCode::TOO_SHORT);
            }
            next.set_count(0)?;
        }
        // Behind the count, an object may be filled up with zeros.
        let used = count.map_or(words.len(), usize::from);
        for (sub_index, word) in (1..).zip(words.iter().take(used)) {
            next.set_index(sub_index, u16::from_le_bytes(*word))?;
        }
        if let Some(count) = count {
            next.set_count(count)?;
        }
        *self = next;
        Ok(())
    }

    /// Lays the assigned PDOs out in the image; what is not assigned becomes 0.
    pub(super) fn scatter(&self, assigned: &[u8], image: &mut [u8]) {
        if self.is_whole {
            image.iter_mut().zip(assigned).for_each(|(to, from)| *to = *from);
            return;
        }
        image.fill(0);
        let mut rest = assigned;
        for span in self.spans.iter().take(usize::from(self.count)) {
            let Some((own, behind)) = rest.split_at_checked(span.len) else { return };
            let place = image.get_mut(span.at..span.at + span.len).unwrap_or_default();
            place.iter_mut().zip(own).for_each(|(to, from)| *to = *from);
            rest = behind;
        }
    }

    /// Collects the assigned PDOs from the image.
    pub(super) fn gather(&self, image: &[u8], assigned: &mut [u8]) {
        if self.is_whole {
            assigned.iter_mut().zip(image).for_each(|(to, from)| *to = *from);
            return;
        }
        let mut rest = assigned;
        for span in self.spans.iter().take(usize::from(self.count)) {
            let Some((own, behind)) = rest.split_at_mut_checked(span.len) else { return };
            let place = image.get(span.at..span.at + span.len).unwrap_or_default();
            own.iter_mut().zip(place).for_each(|(to, from)| *to = *from);
            rest = behind;
        }
    }
}
