//! Looking on without taking part.

use crate::wire::meca500::image::{OUTPUT_FIELDS, OUTPUT_LEN};

/// The block that only chooses what the robot reports.
const DYNAMIC_DATA: u16 = 0x7420;
const DYNAMIC_DATA_LAST: u16 = 0x7423;

/// `outputs` without anything that acts on the robot: only the choice of dynamic data stays.
pub(super) fn only_dynamic_data(outputs: &[u8; OUTPUT_LEN]) -> [u8; OUTPUT_LEN] {
    let mut harmless = [0; OUTPUT_LEN];
    let choices = OUTPUT_FIELDS
        .iter()
        .filter(|field| (DYNAMIC_DATA..=DYNAMIC_DATA_LAST).contains(&field.object));
    for field in choices {
        let at = usize::from(field.byte_offset);
        let bytes = at..at + usize::from(field.size_bits / 8);
        if let (Some(to), Some(from)) = (harmless.get_mut(bytes.clone()), outputs.get(bytes)) {
            to.copy_from_slice(from);
        }
    }
    harmless
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_that_acts_passes() {
        let passed = only_dynamic_data(&[0xFF; OUTPUT_LEN]);
        assert_eq!(passed[..44], [0; 44]);
        assert_eq!(passed[44..], [0xFF; 16]);
    }
}
