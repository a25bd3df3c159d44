//! What the benches share: timing, instruction counts, the allocation counter and the table.
//!
//! A bench is a list of [`Group`]s. The subjects of a group are timed in turns, so that a slow
//! spell of the machine falls on all of them, and are counted in one run under callgrind.
//! [`measure`] does both; [`table`] prints. Every counted operation is a function that is never
//! inlined and whose name starts with `measured_`: only instructions inside such functions count.

pub(crate) mod alloc;
pub(crate) mod callgrind;
pub(crate) mod table;
pub(crate) mod timing;

/// An operation to measure.
pub(crate) struct Subject {
    /// What the table calls it.
    pub(crate) name: &'static str,
    run: Box<dyn FnMut(u64)>,
}

impl Subject {
    /// `operation` calls one function named `measured_*` once. Its inputs and its result go
    /// through `black_box`, or nothing is left to measure.
    pub(crate) fn new(name: &'static str, mut operation: impl FnMut() + 'static) -> Self {
        Self { name, run: Box::new(move |times| (0..times).for_each(|_| operation())) }
    }

    /// Performs the operation `times` times.
    pub(crate) fn run(&mut self, times: u64) {
        (self.run)(times);
    }
}

/// Subjects that do the same work, printed below each other.
pub(crate) struct Group {
    /// What they do.
    pub(crate) title: &'static str,
    /// The subjects, references first.
    pub(crate) subjects: Vec<Subject>,
    /// Names of the subjects that the others are compared with, one column each.
    pub(crate) references: &'static [&'static str],
}

/// Figures of one subject.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Figures {
    /// Time of one operation.
    pub(crate) nanoseconds: timing::Nanoseconds,
    /// Instructions of one operation; `None` where they cannot be counted.
    pub(crate) instructions: Option<f64>,
}

/// Measures all subjects, in their order.
///
/// In the process that callgrind runs, only counts and ends the process.
pub(crate) fn measure(groups: &mut [Group], effort: timing::Effort) -> Vec<Figures> {
    let mut subjects: Vec<&mut Subject> =
        groups.iter_mut().flat_map(|group| &mut group.subjects).collect();
    if callgrind::is_counting() {
        callgrind::count_here(&mut subjects);
        std::process::exit(0);
    }
    let times = timing::time(&mut subjects, effort);
    let counts = callgrind::count_in_child(subjects.len());
    if let Err(reason) = &counts {
        println!("No instruction counts: {reason}.");
    }
    let counts = counts.map_or_else(
        |_| vec![None; times.len()],
        |counts| counts.into_iter().map(Some).collect::<Vec<_>>(),
    );
    times
        .into_iter()
        .zip(counts)
        .map(|(nanoseconds, instructions)| Figures { nanoseconds, instructions })
        .collect()
}
