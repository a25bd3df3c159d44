//! What keys mean: one key, or two in a row, to what is done.
//!
//! Read [`Keyboard::press`] first. Where the keys come from is the business of [`keys`](super::keys).

use std::prelude::v1::*;

use super::cell::{Cell, Mains};
use super::deed::Deed;
use super::stage::Cable;
use crate::sim::meca500::{Lifecycle, Signal};

/// What is shown for the key `h`.
pub(super) const HELP: &str = "\
keys:  e E-Stop, press and release    p P-Stop 2, press and release    r Reset    s Start/Stop
       c cable, pull and plug         o power, off and on              b 1 to 6: block a joint, free it
       1 to 9 one of several robots   0 all robots                     h these keys    q quit";

/// What a key stands for.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Stroke {
    /// Something is done at these robots, counted from 0.
    Do(Vec<usize>, Deed),
    /// Something is told to the person.
    Tell(String),
    /// The end.
    Quit,
}

/// Whom the keys are for, and what was begun.
#[derive(Debug, Default)]
pub(super) struct Keyboard {
    /// `None` is all of them.
    chosen: Option<usize>,
    /// `b` was pressed, and the joint is next.
    wants_joint: bool,
}

impl Keyboard {
    /// What this key does; `None` for one without a meaning. Keys that switch look at the robots first:
    /// what is so everywhere is undone, otherwise it is done where it is not so yet.
    pub(super) fn press<C: Cell>(&mut self, key: u8, cell: &mut C) -> Option<Stroke> {
        if core::mem::take(&mut self.wants_joint) {
            return Some(match key {
                b'1'..=b'6' => {
                    let joint = key - b'0';
                    let slot = usize::from(joint - 1);
                    self.switch(
                        cell,
                        |cell, number| {
                            cell.robot(number).standing().blocked.get(slot) == Some(&true)
                        },
                        |held| Deed::Hold { joint, held },
                    )
                }
                _ => Stroke::Tell("no joint: after b comes 1 to 6".into()),
            });
        }
        Some(match key.to_ascii_lowercase() {
            b'e' => self.switch(
                cell,
                |cell, number| cell.robot(number).standing().e_stop == Signal::Present,
                |pressed| Deed::EStop { pressed },
            ),
            b'p' => self.switch(
                cell,
                |cell, number| cell.robot(number).standing().p_stop2 == Signal::Present,
                |pressed| Deed::PStop2 { pressed },
            ),
            b'c' => self.switch(
                cell,
                |cell, number| !cell.is_plugged(number),
                |pulled| Deed::Cable { cable: Cable::All, plugged: !pulled },
            ),
            b'o' => self.switch(
                cell,
                |cell, number| cell.robot(number).lifecycle() == Lifecycle::Off,
                |off| Deed::Mains(if off { Mains::Off } else { Mains::On }),
            ),
            b'r' => Stroke::Do(self.robots(cell), Deed::Reset),
            b's' => Stroke::Do(self.robots(cell), Deed::Start),
            b'b' => {
                self.wants_joint = true;
                Stroke::Tell("block or free a joint: 1 to 6".into())
            }
            b'0' => {
                self.chosen = None;
                Stroke::Tell("keys are for all robots".into())
            }
            key @ b'1'..=b'9' => {
                let number = usize::from(key - b'1');
                if number < cell.count() {
                    self.chosen = Some(number);
                    Stroke::Tell(format!("keys are for robot {}", number + 1))
                } else {
                    Stroke::Tell(format!("there is no robot {}", number + 1))
                }
            }
            b'h' | b'?' => Stroke::Tell(HELP.into()),
            b'q' => Stroke::Quit,
            _ => return None,
        })
    }

    fn robots<C: Cell>(&self, cell: &C) -> Vec<usize> {
        self.chosen.map_or_else(|| (0..cell.count()).collect(), |number| vec![number])
    }

    fn switch<C: Cell>(
        &self,
        cell: &mut C,
        is_so: impl Fn(&mut C, usize) -> bool,
        deed: impl Fn(bool) -> Deed,
    ) -> Stroke {
        let robots = self.robots(cell);
        let not_yet: Vec<usize> =
            robots.iter().copied().filter(|number| !is_so(cell, *number)).collect();
        if not_yet.is_empty() {
            Stroke::Do(robots, deed(false))
        } else {
            Stroke::Do(not_yet, deed(true))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::cell::Bench;
    use super::super::deed::perform;
    use super::*;
    use crate::wire::meca500::revision::Revision;

    /// Presses the keys and does what they ask for.
    fn typed(keys: &str, bench: &mut Bench) -> Vec<Stroke> {
        let mut keyboard = Keyboard::default();
        keys.bytes()
            .filter_map(|key| {
                let stroke = keyboard.press(key, bench)?;
                if let Stroke::Do(robots, deed) = &stroke {
                    robots.iter().for_each(|number| drop(perform(*deed, bench, *number)));
                }
                Some(stroke)
            })
            .collect()
    }

    #[test]
    fn a_key_undoes_what_it_did() {
        let mut bench = Bench::of(Revision::R4, 1);
        let one = |deed| Stroke::Do(vec![0], deed);
        let cable = |plugged| one(Deed::Cable { cable: Cable::All, plugged });
        for (keys, strokes) in [
            ("eE", [one(Deed::EStop { pressed: true }), one(Deed::EStop { pressed: false })]),
            ("pp", [one(Deed::PStop2 { pressed: true }), one(Deed::PStop2 { pressed: false })]),
            ("cc", [cable(false), cable(true)]),
            ("oo", [one(Deed::Mains(Mains::Off)), one(Deed::Mains(Mains::On))]),
        ] {
            assert_eq!(typed(keys, &mut bench), strokes, "{keys}");
        }
    }

    #[test]
    fn a_joint_takes_two_keys() {
        let mut bench = Bench::of(Revision::R4, 1);
        let strokes = typed("b3b3", &mut bench);
        assert_eq!(strokes[1], Stroke::Do(vec![0], Deed::Hold { joint: 3, held: true }));
        assert_eq!(strokes[3], Stroke::Do(vec![0], Deed::Hold { joint: 3, held: false }));
        let strokes = typed("b7e", &mut bench);
        assert!(matches!(&strokes[1], Stroke::Tell(words) if words.contains("1 to 6")));
        assert_eq!(strokes[2], Stroke::Do(vec![0], Deed::EStop { pressed: true }));
    }

    #[test]
    fn keys_are_for_all_robots_or_for_one() {
        let mut bench = Bench::of(Revision::R4, 3);
        let strokes = typed("2e0eez5r", &mut bench);
        let tells = |words: &str| Stroke::Tell(words.into());
        assert_eq!(
            strokes,
            [
                tells("keys are for robot 2"),
                Stroke::Do(vec![1], Deed::EStop { pressed: true }),
                tells("keys are for all robots"),
                // Where it is not pressed yet.
                Stroke::Do(vec![0, 2], Deed::EStop { pressed: true }),
                Stroke::Do(vec![0, 1, 2], Deed::EStop { pressed: false }),
                tells("there is no robot 5"),
                Stroke::Do(vec![0, 1, 2], Deed::Reset),
            ]
        );
    }

    #[test]
    fn the_help_names_every_key() {
        let mut bench = Bench::of(Revision::R4, 1);
        for key in "epsrcobhq".chars() {
            assert!(HELP.contains(&format!(" {key} ")), "{key}");
            assert_eq!(typed(&key.to_string(), &mut bench).len(), 1, "{key}");
        }
        assert_eq!(typed("q?xyz\n\u{1b}", &mut bench), [Stroke::Quit, Stroke::Tell(HELP.into())]);
    }
}
