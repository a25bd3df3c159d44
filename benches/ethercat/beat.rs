//! The beat of a contender: deadlines on a fixed grid, and the figures of each cycle.

use std::thread;
use std::time::{Duration, Instant};

/// What a contender is to do.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Beat {
    /// Time between two exchanges.
    pub(crate) period: Duration,
    /// Cycles that are not counted.
    pub(crate) warm_up: usize,
    /// Cycles that are.
    pub(crate) cycles: usize,
}

/// What its cycles were like.
#[derive(Clone, Debug, Default)]
pub(crate) struct Figures {
    /// Time of each exchange, from outputs in hand to inputs in hand.
    pub(crate) exchange_ns: Vec<u64>,
    /// Time of all engines in each cycle; empty for those without.
    pub(crate) engine_ns: Vec<u64>,
    /// Deadlines that passed without a cycle.
    pub(crate) overruns: u64,
    /// Exchanges that did not bring every robot's inputs.
    pub(crate) lost: u64,
    /// Allocations in all counted cycles, of every thread; `None` where nobody counts.
    pub(crate) allocations: Option<u64>,
}

/// One exchange.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Exchanged {
    /// From outputs in hand to inputs in hand.
    pub(crate) took: Duration,
    /// What the engines took.
    pub(crate) engine: Option<Duration>,
    /// Whether it brought every robot's inputs.
    pub(crate) is_whole: bool,
}

impl Beat {
    /// Makes the cycles, each begun at its deadline. A late one does not push the next ones back;
    /// deadlines that passed meanwhile are given up and counted.
    pub(crate) fn keep(self, mut exchange: impl FnMut() -> Exchanged) -> Figures {
        let mut figures = Figures {
            exchange_ns: Vec::with_capacity(self.cycles),
            engine_ns: Vec::with_capacity(self.cycles),
            ..Figures::default()
        };
        let mut deadline = Instant::now();
        for _ in 0..self.warm_up {
            wait(&mut deadline, self.period);
            exchange();
        }
        let allocations = crate::support::alloc::allocations_during(|| {
            for _ in 0..self.cycles {
                figures.overruns += wait(&mut deadline, self.period);
                let exchanged = exchange();
                figures.exchange_ns.push(nanoseconds(exchanged.took));
                figures.engine_ns.extend(exchanged.engine.map(nanoseconds));
                figures.lost += u64::from(!exchanged.is_whole);
            }
        });
        figures.allocations = Some(allocations);
        figures
    }
}

fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

/// Waits for `deadline` and moves it to the next one that can be met; how many were missed.
fn wait(deadline: &mut Instant, period: Duration) -> u64 {
    let mut now = Instant::now();
    while now < *deadline {
        thread::sleep(*deadline - now);
        now = Instant::now();
    }
    let missed = (now - *deadline).as_nanos() / period.as_nanos();
    let missed = u32::try_from(missed).unwrap_or(u32::MAX - 1);
    *deadline += period * (missed + 1);
    u64::from(missed)
}

impl Figures {
    /// As lines of text, for the process that asked.
    pub(crate) fn print(&self, contender: &str) {
        let line = |name: &str, values: &[u64]| {
            print!("{contender} {name}");
            values.iter().for_each(|value| print!(" {value}"));
            println!();
        };
        line("exchange_ns", &self.exchange_ns);
        line("engine_ns", &self.engine_ns);
        line("overruns", &[self.overruns]);
        line("lost", &[self.lost]);
        line("allocations", self.allocations.as_slice());
    }

    /// Adds the line `text`, without the contender's name; other lines are left alone.
    pub(crate) fn read(&mut self, text: &str) {
        let mut words = text.split_whitespace();
        let name = words.next();
        let mut values = words.map_while(|word| word.parse::<u64>().ok());
        match name {
            Some("exchange_ns") => self.exchange_ns.extend(values),
            Some("engine_ns") => self.engine_ns.extend(values),
            Some("overruns") => self.overruns += values.sum::<u64>(),
            Some("lost") => self.lost += values.sum::<u64>(),
            Some("allocations") => {
                if let Some(more) = values.next() {
                    self.allocations = Some(self.allocations.unwrap_or(0) + more);
                }
            }
            _ => {}
        }
    }
}
