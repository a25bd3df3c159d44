//! The closest known name to one that is not known.

use super::spec::TextCommandSpec;

/// No command's name is longer.
const LONGEST: usize = 48;
/// Names that differ in more letters are other words, not mistyped ones: UseVariables is no
/// ListVariables.
const MOST_MISTAKES: usize = 2;

/// The name that somebody most likely meant; `None` when none is near.
pub(super) fn closest(name: &str) -> Option<&'static str> {
    if name.len() > LONGEST {
        return None;
    }
    let near = |known: &'static str| {
        let distance = edit_distance(name, known);
        let is_near = distance <= MOST_MISTAKES && distance * 4 <= known.len();
        is_near.then_some((distance, known))
    };
    TextCommandSpec::all()
        .filter_map(|spec| near(spec.name))
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, known)| known)
}

/// Insertions, deletions and replacements that lead from one name to the other, ignoring case.
fn edit_distance(typed: &str, known: &str) -> usize {
    let mut costs = [0_usize; LONGEST];
    for (cost, distance) in costs.iter_mut().zip(1..) {
        *cost = distance;
    }
    let mut last = known.len();
    for (row, letter) in typed.bytes().enumerate() {
        let mut diagonal = row;
        let mut left = row + 1;
        for (cost, other) in costs.iter_mut().zip(known.bytes()) {
            let replaced = diagonal + usize::from(!letter.eq_ignore_ascii_case(&other));
            diagonal = *cost;
            left = replaced.min(diagonal + 1).min(left + 1);
            *cost = left;
        }
        last = left;
    }
    last
}
