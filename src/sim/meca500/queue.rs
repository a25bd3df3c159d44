//! The motion queue: commands in the order of their arrival, and those compiled ahead.
//!
//! ```text
//! receive --> queue (first in, first out) --compile--> compiled, about 25 --execute--> the arm
//!             '----------------- at most 13,000 commands -----------------'
//! ```
//!
//! Invariants: order is kept; markers of offline programs take no space. Source: PM L1423, L5231.

use alloc::collections::VecDeque;

use super::kinematics::Joints;
use super::motion::{Plan, Space};
use super::readings::CompiledCommands;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::command::{MotionCommand, VelocityCommand};

/// Most commands in the queue.
pub(super) const CAPACITY: usize = 13_000;
/// Commands whose turn has come, kept for whoever logs them.
const MOST_BEGUN: usize = 4_096;
/// Commands compiled ahead.
pub(super) const COMPILED_AHEAD: usize = 25;

/// An entry of the queue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Item {
    /// A command.
    Command(MotionCommand),
    /// The commands of an offline program follow.
    ProgramBegin(u16),
    /// The commands of an offline program end.
    ProgramEnd(u16),
    /// Program 1 starts again.
    ProgramAgain,
}

impl Item {
    const fn takes_space(&self) -> bool {
        matches!(self, Self::Command(_))
    }

    /// The checkpoint it stands for.
    pub(super) const fn checkpoint(&self) -> Option<u16> {
        match self {
            Self::Command(MotionCommand::SetCheckpoint(n)) => Some(*n),
            _ => None,
        }
    }
}

/// What a compiled entry does when its turn comes.
#[derive(Clone, Debug)]
pub(super) enum Step {
    /// A planned move; `None` once the follower has taken the plan.
    Move {
        plan: Option<alloc::boxed::Box<Plan>>,
        space: Space,
        /// SetBlending in force for this move, as a fraction.
        blending: f64,
    },
    /// A move that cannot be made.
    Fail(Code),
    /// A queued setting, and the joints at its place in the queue.
    Setting(MotionCommand, Joints),
    /// A checkpoint.
    Checkpoint(u16),
    /// Seconds to wait.
    Delay(f64),
    /// A gripper or valve command.
    Tool(MotionCommand),
    /// A velocity command.
    Velocity(VelocityCommand),
    /// A command that acts at once when reached: from an offline program, or a queued variable.
    Immediate(MotionCommand),
    /// A marker.
    ProgramBegin(u16),
    /// A marker.
    ProgramEnd(u16),
    /// A marker.
    ProgramAgain,
}

/// A compiled entry and what it was compiled from.
#[derive(Clone, Debug)]
pub(super) struct Compiled {
    pub(super) item: Item,
    pub(super) step: Step,
}

/// The queue.
#[derive(Clone, Debug, Default)]
pub(super) struct Queue {
    waiting: VecDeque<Item>,
    compiled: VecDeque<Compiled>,
    waiting_commands: usize,
    compiled_commands: usize,
    /// Commands whose turn has come, while somebody wants to know.
    begun: VecDeque<MotionCommand>,
    records_begun: bool,
}

impl Queue {
    /// Commands the queue can still take.
    pub(super) const fn space(&self, reading: CompiledCommands) -> usize {
        let compiled = match reading {
            CompiledCommands::Counted => self.compiled_commands,
            CompiledCommands::NotCounted => 0,
        };
        CAPACITY.saturating_sub(self.waiting_commands + compiled)
    }

    /// Commands waiting without those compiled.
    pub(super) const fn pending(&self) -> usize {
        self.waiting_commands
    }

    pub(super) fn is_empty(&self) -> bool {
        self.waiting.is_empty() && self.compiled.is_empty()
    }

    /// Adds an entry at the end. The caller has looked at [`space`](Self::space).
    pub(super) fn push(&mut self, item: Item) {
        self.waiting_commands += usize::from(item.takes_space());
        self.waiting.push_back(item);
    }

    /// Puts entries in front of all that wait, in their order.
    pub(super) fn insert_front(&mut self, items: impl DoubleEndedIterator<Item = Item>) {
        for item in items.rev() {
            self.waiting_commands += usize::from(item.takes_space());
            self.waiting.push_front(item);
        }
    }

    /// The next entry to compile, if there is room for its result.
    pub(super) fn next_to_compile(&self) -> Option<Item> {
        if self.compiled.len() >= COMPILED_AHEAD { None } else { self.waiting.front().copied() }
    }

    /// Drops the next entry to compile.
    pub(super) fn take_next(&mut self) -> Option<Item> {
        let item = self.waiting.pop_front()?;
        self.waiting_commands -= usize::from(item.takes_space());
        Some(item)
    }

    /// Replaces the next entry to compile by its result.
    pub(super) fn compile_next(&mut self, step: Step) {
        if let Some(item) = self.take_next() {
            self.compiled_commands += usize::from(item.takes_space());
            self.compiled.push_back(Compiled { item, step });
        }
    }

    /// The compiled entry whose turn is next.
    pub(super) fn front(&self) -> Option<&Step> {
        self.compiled.front().map(|compiled| &compiled.step)
    }

    /// Takes the compiled entry whose turn it is.
    pub(super) fn pop(&mut self) -> Option<Step> {
        let compiled = self.compiled.pop_front()?;
        self.compiled_commands -= usize::from(compiled.item.takes_space());
        if let (true, Item::Command(command)) = (self.records_begun, compiled.item) {
            if self.begun.len() >= MOST_BEGUN {
                self.begun.pop_front();
            }
            self.begun.push_back(command);
        }
        Some(compiled.step)
    }

    /// The gripper force of the last command that sets it, in percent.
    pub(super) fn last_gripper_force(&self) -> Option<f32> {
        let compiled = self.compiled.iter().map(|compiled| &compiled.item);
        compiled.chain(&self.waiting).rev().find_map(|item| match item {
            Item::Command(MotionCommand::SetGripperForce(percent)) => Some(*percent),
            _ => None,
        })
    }

    /// Whether commands whose turn comes are kept for [`next_begun`](Self::next_begun).
    pub(super) fn record_begun(&mut self, records: bool) {
        self.records_begun = records;
    }

    /// The next command whose turn has come.
    pub(super) fn next_begun(&mut self) -> Option<MotionCommand> {
        self.begun.pop_front()
    }

    /// What the compiled entries do, in their order.
    pub(super) fn compiled(&self) -> impl Iterator<Item = &Step> {
        self.compiled.iter().map(|compiled| &compiled.step)
    }

    /// The compiled entries in their order, to be changed.
    pub(super) fn compiled_mut(&mut self) -> impl Iterator<Item = &mut Compiled> {
        self.compiled.iter_mut()
    }

    /// Whether what is compiled leaves the joints after it unknown.
    pub(super) fn end_is_unknown(&self) -> bool {
        self.compiled.iter().any(|entry| matches!(entry.step, Step::Velocity(_) | Step::Fail(_)))
    }

    /// Undoes the compilation, so that it is done anew.
    pub(super) fn decompile(&mut self) {
        while let Some(compiled) = self.compiled.pop_back() {
            let space = usize::from(compiled.item.takes_space());
            self.compiled_commands -= space;
            self.waiting_commands += space;
            self.waiting.push_front(compiled.item);
        }
    }

    /// Empties the queue and gives its checkpoints in their order.
    pub(super) fn clear(&mut self, mut discard: impl FnMut(u16)) {
        self.decompile();
        for item in self.waiting.drain(..) {
            if let Some(checkpoint) = item.checkpoint() {
                discard(checkpoint);
            }
        }
        self.waiting_commands = 0;
    }
}
