//! A scenario file: what people do to the robots, and when, one event a line.
//!
//! ```text
//! 2.5 s estop press          # this long after the beginning
//! +1.5s estop release        # this long after the line before
//! reset                      # directly after the line before
//! 5 s   robot 2 pstop2 press # one of several robots; without `robot` all of them
//! wait homed                 # until it is so
//! +0.2s cable pull tcp
//! repeat 3                   # all of it again, three times in all
//! ```
//!
//! Comments begin with `#` or `//`. Upper and lower case are the same, and so are `estop`, `E-Stop` and
//! `e_stop`. The whole file is checked before anything is served: [`parse`] finds every mistake with
//! line and column.

use core::fmt;
use std::prelude::v1::*;

use super::cell::Mains;
use super::deed::Deed;
use super::stage::Cable;
use crate::sim::meca500::Part;
use crate::time::Duration;

/// Longest time in a scenario, in seconds: a week. Whoever asks for more has mistyped it.
const LONGEST_S: f64 = 604_800.0;
/// Most repetitions.
const MOST_TIMES: u32 = 1_000_000;

/// The events, for an error message.
const EVENTS: &str = "estop, pstop1, pstop2, swstop, reset, start, mismatch, block, unblock, push, cable, \
                      power, part, gripper, drives, wait, quit or repeat";

/// When an event is due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum When {
    /// After the beginning.
    At(Duration),
    /// After the event before.
    After(Duration),
}

/// What can be waited for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Condition {
    Activated,
    Deactivated,
    Homed,
    /// Activated and homed, and nothing keeps it from moving.
    Ready,
    Moving,
    /// At rest with nothing left to do.
    Idle,
    Paused,
    /// In error mode.
    Error,
    /// Somebody controls it.
    Connected,
    /// Nobody does.
    Disconnected,
}

impl Condition {
    const ALL: [(&'static str, Self); 10] = [
        ("activated", Self::Activated),
        ("deactivated", Self::Deactivated),
        ("homed", Self::Homed),
        ("ready", Self::Ready),
        ("moving", Self::Moving),
        ("idle", Self::Idle),
        ("paused", Self::Paused),
        ("error", Self::Error),
        ("connected", Self::Connected),
        ("disconnected", Self::Disconnected),
    ];
}

impl fmt::Display for Condition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (name, _) = Self::ALL[*self as usize];
        f.write_str(match self {
            Self::Error => "in error",
            _ => name,
        })
    }
}

/// What is done at a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Act {
    Do(Deed),
    Wait(Condition),
    /// The simulation ends.
    Quit,
}

/// One event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Event {
    pub(super) line: usize,
    pub(super) when: When,
    /// The robot, counted from 0; `None` is every one.
    pub(super) robot: Option<usize>,
    pub(super) act: Act,
}

/// A scenario without mistakes.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Scenario {
    pub(super) events: Vec<Event>,
    /// How often all of it happens; `None` is without end.
    pub(super) times: Option<u32>,
}

/// A mistake, shown as `line:column: message`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Mistake {
    line: usize,
    column: usize,
    message: String,
}

impl fmt::Display for Mistake {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { line, column, message } = self;
        write!(f, "{line}:{column}: {message}")
    }
}

/// What is wrong, and in which column.
type Found<T> = Result<T, (usize, String)>;

/// Reads a scenario for so many robots.
///
/// # Errors
///
/// Everything that is wrong with it, line by line.
pub(super) fn parse(text: &str, robots: usize) -> Result<Scenario, Vec<Mistake>> {
    let mut reader = Reader { robots, earliest: Duration::ZERO, at_line: 0, times: None };
    let (mut scenario, mut mistakes) =
        (Scenario { times: Some(1), ..Default::default() }, Vec::new());
    for (line, content) in (1..).zip(text.lines()) {
        match reader.line(line, content) {
            Ok(None) => {}
            Ok(Some(event)) => scenario.events.push(event),
            Err((column, message)) => mistakes.push(Mistake { line, column, message }),
        }
    }
    if let Some((line, column, times)) = reader.times {
        scenario.times = times;
        let takes_time = |event: &Event| matches!(event.when, When::At(time) | When::After(time) if !time.is_zero());
        if mistakes.is_empty() && !scenario.events.iter().any(takes_time) {
            let message = "what is repeated takes no time; give an event one, as +1s".into();
            mistakes.push(Mistake { line, column, message });
        }
    }
    if mistakes.is_empty() { Ok(scenario) } else { Err(mistakes) }
}

/// A word and the column it begins in, counted from 1 in characters.
#[derive(Clone, Copy)]
struct Word<'t> {
    text: &'t str,
    column: usize,
}

impl Word<'_> {
    /// In the one spelling that is compared.
    fn plain(&self) -> String {
        self.text.to_lowercase().replace(['-', '_'], "")
    }

    fn fault<T>(&self, message: impl Into<String>) -> Found<T> {
        Err((self.column, message.into()))
    }
}

/// The words of a line, and the column behind the last one.
struct Words<'t> {
    words: std::vec::IntoIter<Word<'t>>,
    end: usize,
}

impl<'t> Words<'t> {
    fn of(line: &'t str) -> Self {
        let code = line.find("//").map_or(line, |at| &line[..at]);
        let code = code.find('#').map_or(code, |at| &code[..at]).trim_end();
        let column = |at: usize| code[..at].chars().count() + 1;
        let mut words = Vec::new();
        let mut rest = code;
        while let Some(text) = rest.split_whitespace().next() {
            let at = code.len() - rest.len() + rest.find(text).unwrap_or(0);
            words.push(Word { text, column: column(at) });
            rest = &code[at + text.len()..];
        }
        Self { words: words.into_iter(), end: column(code.len()) }
    }

    fn peek(&self) -> Option<Word<'t>> {
        self.words.as_slice().first().copied()
    }

    /// The next word; `wanted` says what is missing without one.
    fn next(&mut self, wanted: &str) -> Found<Word<'t>> {
        self.words.next().ok_or_else(|| (self.end, format!("{wanted} is missing")))
    }

    /// The next word must be one of these.
    fn choice<T: Copy>(&mut self, what: &str, choices: &[(&str, T)]) -> Found<T> {
        let names: Vec<_> = choices.iter().map(|(name, _)| *name).collect();
        let names = listed(&names);
        let word = self.next(&names)?;
        match choices.iter().find(|(name, _)| *name == word.plain()) {
            Some((_, choice)) => Ok(*choice),
            None => word.fault(format!("no {what}: `{}`; there are {names}", word.text)),
        }
    }

    fn number(&mut self, what: &str, range: core::ops::RangeInclusive<f64>) -> Found<f64> {
        let (min, max) = (*range.start(), *range.end());
        let word = self.next(&format!("{what}, {min} to {max},"))?;
        match word.text.parse::<f64>() {
            Ok(number) if range.contains(&number) => Ok(number),
            _ => word.fault(format!("{what} is {min} to {max}, not `{}`", word.text)),
        }
    }

    fn integer(&mut self, what: &str, max: u32) -> Found<u32> {
        let word = self.next(&format!("{what}, 1 to {max},"))?;
        match word.text.parse::<u32>() {
            Ok(number) if (1..=max).contains(&number) => Ok(number),
            _ => word.fault(format!("{what} is 1 to {max}, not `{}`", word.text)),
        }
    }
}

/// `a, b or c`.
fn listed(names: &[&str]) -> String {
    match names.split_last() {
        Some((last, [])) => (*last).to_string(),
        Some((last, before)) => format!("{} or {last}", before.join(", ")),
        None => String::new(),
    }
}

struct Reader {
    robots: usize,
    /// No later event can be due before this.
    earliest: Duration,
    /// Where that was said.
    at_line: usize,
    /// `repeat`: its line and column, and how often.
    times: Option<(usize, usize, Option<u32>)>,
}

const PRESS: [(&str, bool); 4] =
    [("press", true), ("release", false), ("on", true), ("off", false)];
const SWITCH: [(&str, bool); 2] = [("on", true), ("off", false)];

impl Reader {
    /// The event of a line; `None` for one that holds none.
    fn line(&mut self, line: usize, content: &str) -> Found<Option<Event>> {
        let mut words = Words::of(content);
        let Some(first) = words.peek() else { return Ok(None) };
        if let Some((at, ..)) = self.times {
            return first.fault(format!("nothing can follow `repeat` of line {at}"));
        }
        let when = self.when(line, &mut words)?;
        let robot = self.robot(&mut words)?;
        let name = words.next("an event")?;
        if name.plain() == "repeat" {
            if robot.is_some() || first.column != name.column {
                return first.fault("`repeat` stands alone, without time and robot");
            }
            let times = match words.peek() {
                None => None,
                Some(_) => Some(words.integer("the number of times", MOST_TIMES)?),
            };
            self.times = Some((line, name.column, times));
            return ended(words, None);
        }
        let act = act(name, &mut words)?;
        if act == Act::Quit && robot.is_some() {
            return name.fault("`quit` ends all of it, without robot");
        }
        ended(words, Some(Event { line, when, robot, act }))
    }

    fn when(&mut self, line: usize, words: &mut Words<'_>) -> Found<When> {
        let Some(word) = words.peek() else { return Ok(When::After(Duration::ZERO)) };
        let is_relative = word.text.starts_with('+');
        let digits = word.text.trim_start_matches('+');
        if !is_relative
            && !digits.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '.' | '-'))
        {
            return Ok(When::After(Duration::ZERO));
        }
        words.next("a time")?;
        let split = digits.find(|c: char| c.is_alphabetic()).unwrap_or(digits.len());
        let (number, unit) = digits.split_at(split);
        let unit = match unit {
            "" => words.next("the unit of the time, s, ms or min,")?,
            text => Word { text, column: word.column + usize::from(is_relative) + split },
        };
        let seconds = match unit.text {
            "s" => 1.0,
            "ms" => 1e-3,
            "min" => 60.0,
            text => {
                return unit.fault(format!("no unit of time: `{text}`; there are s, ms and min"));
            }
        };
        let time = match number.parse::<f64>() {
            Ok(number) if (0.0..=LONGEST_S).contains(&(number * seconds)) => {
                Duration::from_nanos((number * seconds * 1e9).round() as u64)
            }
            _ => {
                return word.fault(format!(
                    "a time is a number as 2.5 with its unit, at most a week, not `{}`",
                    word.text
                ));
            }
        };
        if is_relative {
            self.earliest += time;
            self.at_line = line;
            return Ok(When::After(time));
        }
        if time < self.earliest {
            return word.fault(format!(
                "too early: line {} is due at {} s; events stand in their order",
                self.at_line,
                self.earliest.as_secs_f64()
            ));
        }
        (self.earliest, self.at_line) = (time, line);
        Ok(When::At(time))
    }

    fn robot(&self, words: &mut Words<'_>) -> Found<Option<usize>> {
        if words.peek().is_none_or(|word| word.plain() != "robot") {
            return Ok(None);
        }
        words.next("robot")?;
        let most = u32::try_from(self.robots).unwrap_or(u32::MAX);
        let number = words.integer("the number of the robot", most)?;
        Ok(Some(number as usize - 1))
    }
}

/// The event, if the line ends here.
fn ended(words: Words<'_>, event: Option<Event>) -> Found<Option<Event>> {
    match words.peek() {
        None => Ok(event),
        Some(word) => word.fault(format!("one event a line: `{}` is too much", word.text)),
    }
}

fn act(name: Word<'_>, words: &mut Words<'_>) -> Found<Act> {
    let joint = |words: &mut Words<'_>| {
        words.choice("part of the arm", &[("joint", ())])?;
        words.integer("the number of the joint", 6).map(|joint| joint as u8)
    };
    let deed = match name.plain().as_str() {
        "estop" | "pstop1" => Deed::EStop { pressed: words.choice("way to use it", &PRESS)? },
        "pstop2" | "swstop" => Deed::PStop2 { pressed: words.choice("way to use it", &PRESS)? },
        "reset" => Deed::Reset,
        "start" => Deed::Start,
        "mismatch" => Deed::Mismatch { there: words.choice("choice", &SWITCH)? },
        "block" => Deed::Hold { joint: joint(words)?, held: true },
        "unblock" => Deed::Hold { joint: joint(words)?, held: false },
        "push" => {
            let joint = joint(words)?;
            Deed::Push { joint, percent: words.number("the torque in percent", -100.0..=100.0)? }
        }
        "cable" => {
            let plugged = words.choice("way to use it", &[("pull", false), ("plug", true)])?;
            let kinds =
                [("ethercat", Cable::EtherCat), ("enip", Cable::EtherNetIp), ("tcp", Cable::Tcp)];
            let cable = match words.peek() {
                None => Cable::All,
                Some(_) => words.choice("cable", &kinds)?,
            };
            Deed::Cable { cable, plugged }
        }
        "power" => {
            let ways = [("off", Mains::Off), ("on", Mains::On), ("cycle", Mains::Cycle)];
            Deed::Mains(words.choice("way to switch it", &ways)?)
        }
        "part" => {
            let ways = [("outer", Some(true)), ("inner", Some(false)), ("none", None)];
            match words.choice("part", &ways)? {
                None => Deed::Part(None),
                Some(is_outer) => {
                    let mm = words.number("the width of the part in mm", 0.0..=100.0)?;
                    Deed::Part(Some(if is_outer { Part::Outer(mm) } else { Part::Inner(mm) }))
                }
            }
        }
        "gripper" => {
            let ways = [("overheats", true), ("cools", false)];
            Deed::Overheat { hot: words.choice("state of the gripper", &ways)? }
        }
        "drives" => {
            words.choice("state of the drives", &[("break", ())])?;
            Deed::BreakDrives
        }
        "wait" => return words.choice("condition", &Condition::ALL).map(Act::Wait),
        "quit" => return Ok(Act::Quit),
        "enable" | "enablingdevice" => return name.fault("the Meca500 has no enabling device"),
        _ => return name.fault(format!("no event: `{}`; there are {EVENTS}", name.text)),
    };
    Ok(Act::Do(deed))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn events(text: &str) -> Vec<Event> {
        parse(text, 2).expect(text).events
    }

    fn only(text: &str) -> Event {
        let events = events(text);
        assert_eq!(events.len(), 1, "{text}");
        events[0]
    }

    fn complaint(text: &str) -> String {
        let mistakes = parse(text, 2).expect_err(text);
        assert_eq!(mistakes.len(), 1, "{mistakes:?}");
        mistakes[0].to_string()
    }

    #[test]
    fn times_have_units() {
        let pressed = Act::Do(Deed::EStop { pressed: true });
        for (text, when) in [
            ("2.5 s estop press", When::At(Duration::from_millis(2_500))),
            ("2.5s estop press", When::At(Duration::from_millis(2_500))),
            ("+250 ms E-Stop on", When::After(Duration::from_millis(250))),
            ("+.5min PSTOP1 press", When::After(Duration::from_secs(30))),
            ("  e_stop press", When::After(Duration::ZERO)),
            ("0s estop press // now", When::At(Duration::ZERO)),
        ] {
            assert_eq!(only(text), Event { line: 1, when, robot: None, act: pressed }, "{text}");
        }
    }

    #[test]
    fn every_event_is_understood() {
        for (text, deed) in [
            ("pstop2 press", Deed::PStop2 { pressed: true }),
            ("swstop off", Deed::PStop2 { pressed: false }),
            ("reset", Deed::Reset),
            ("start", Deed::Start),
            ("mismatch on", Deed::Mismatch { there: true }),
            ("block joint 3", Deed::Hold { joint: 3, held: true }),
            ("unblock joint 6", Deed::Hold { joint: 6, held: false }),
            ("push joint 2 -40", Deed::Push { joint: 2, percent: -40.0 }),
            ("cable pull", Deed::Cable { cable: Cable::All, plugged: false }),
            ("cable plug enip", Deed::Cable { cable: Cable::EtherNetIp, plugged: true }),
            ("power cycle", Deed::Mains(Mains::Cycle)),
            ("part outer 3.5", Deed::Part(Some(Part::Outer(3.5)))),
            ("part none", Deed::Part(None)),
            ("gripper overheats", Deed::Overheat { hot: true }),
            ("drives break", Deed::BreakDrives),
        ] {
            assert_eq!(only(text).act, Act::Do(deed), "{text}");
        }
        assert_eq!(only("wait homed").act, Act::Wait(Condition::Homed));
        assert_eq!(only("quit").act, Act::Quit);
    }

    #[test]
    fn conditions_are_shown_by_their_names() {
        for (name, condition) in Condition::ALL {
            assert!(condition.to_string().ends_with(name), "{name}");
        }
    }

    #[test]
    fn robots_are_counted_from_one() {
        assert_eq!(only("1s robot 2 reset").robot, Some(1));
        assert_eq!(complaint("robot 3 reset"), "1:7: the number of the robot is 1 to 2, not `3`");
    }

    #[test]
    fn comments_and_empty_lines_are_nothing() {
        let events = events("# all\n\n  // of it\n1s reset # now\r\n");
        assert_eq!(events.iter().map(|event| event.line).collect::<Vec<_>>(), [4]);
    }

    #[test]
    fn what_repeats_must_take_time() {
        assert_eq!(parse("+1s reset\nrepeat", 1).unwrap().times, None);
        assert_eq!(parse("+1s reset\nrepeat 3 # times", 1).unwrap().times, Some(3));
        assert_eq!(parse("+1s reset", 1).unwrap().times, Some(1));
        assert!(complaint("reset\nrepeat").contains("takes no time"));
        assert!(complaint("+1s reset\nrepeat\nreset").contains("nothing can follow"));
        assert!(complaint("+1s reset\n+1s repeat").starts_with("2:1: `repeat` stands alone"));
    }

    #[test]
    fn mistakes_name_their_place() {
        for (text, said) in [
            ("2 estop press", "1:3: no unit of time: `estop`; there are s, ms and min"),
            ("2", "1:2: the unit of the time, s, ms or min, is missing"),
            ("2h reset", "1:2: no unit of time: `h`"),
            ("+2h reset", "1:3: no unit of time: `h`"),
            ("-1s reset", "1:1: a time is"),
            ("1e9s reset", "1:2: no unit of time: `e9s`"),
            ("99999999s reset", "1:1: a time is"),
            ("1.2.3s reset", "1:1: a time is"),
            ("1s", "1:3: an event is missing"),
            ("1s jump", "1:4: no event: `jump`; there are estop,"),
            ("1s estop", "1:9: press, release, on or off is missing"),
            (
                "1s estop push",
                "1:10: no way to use it: `push`; there are press, release, on or off",
            ),
            ("1s block joint 7", "1:16: the number of the joint is 1 to 6, not `7`"),
            ("1s block arm 1", "1:10: no part of the arm: `arm`; there are joint"),
            ("push joint 1 200", "1:14: the torque in percent is -100 to 100, not `200`"),
            ("push joint 1 nan", "1:14: the torque in percent"),
            ("cable cut", "1:7: no way to use it: `cut`; there are pull or plug"),
            ("cable pull usb", "1:12: no cable: `usb`; there are ethercat, enip or tcp"),
            ("reset now", "1:7: one event a line: `now` is too much"),
            ("enabling-device press", "1:1: the Meca500 has no enabling device"),
            ("wait finished", "1:6: no condition: `finished`"),
            ("robot 1 quit", "1:9: `quit` ends all of it"),
            ("5s reset\n4s reset", "2:1: too early: line 1 is due at 5 s"),
            ("5s reset\n+2s reset\n6s reset", "3:1: too early: line 2 is due at 7 s"),
            ("ä ö", "1:1: no event: `ä`"),
            ("1s ö", "1:4: no event: `ö`"),
        ] {
            let complaint = complaint(text);
            assert!(complaint.starts_with(said), "{text}: {complaint}");
        }
    }

    #[test]
    fn every_mistake_is_found_at_once() {
        let mistakes = parse("1s jump\nreset\n2s estop\n", 1).unwrap_err();
        assert_eq!(mistakes.iter().map(|mistake| mistake.line).collect::<Vec<_>>(), [1, 3]);
    }
}
