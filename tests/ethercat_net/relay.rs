//! A relay in user space: two threads that pass frames on between the halves of a cable, one for each
//! way, and do to them what the test orders.
//!
//! Each way is a [`FaultyWire`] of its own, so a link can be down one way only. What a seed decides is
//! what happens to a frame; which frame meets it is a matter of real time.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::mpsc::{self, Receiver, Sender, TryRecvError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use fieldarm::link::ethercat::faulty_wire::{FaultPlan, FaultyWire, WireEnd, WireFault};
use fieldarm::link::ethercat::raw_socket::{RawSocket, is_transient};
use fieldarm::link::ethercat::wire::{MAX_FRAME, Wire};

use crate::namespaces::{Cable, End, TO_MAIN, TO_ROBOTS};

/// Far longer than opening an interface takes.
const LONG: Duration = Duration::from_secs(20);
/// Longest time between two looks at what is ordered.
const LOOK: Duration = Duration::from_millis(1);

/// One of the two ways.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Way {
    /// From the main device to the robots.
    Out,
    /// From the robots to the main device.
    Back,
}

/// What a lane tells of itself, as of its last frame or look.
#[derive(Debug, Default)]
struct Standing {
    made: AtomicU32,
    is_quiet: AtomicBool,
}

/// One way: from one interface to the other, until nobody can order anything more.
struct Lane {
    orders: Sender<WireFault>,
    standing: Arc<Standing>,
    /// Ends with the number of frames passed on.
    thread: JoinHandle<u64>,
}

/// What is between the halves of a cable.
pub(crate) struct Relay {
    out: Lane,
    back: Lane,
}

impl Relay {
    /// Passes frames on between the halves of `cable`, unharmed until a fault is ordered.
    pub(crate) fn start(cable: &Cable, seed: u64) -> Self {
        let lane = |from: &'static str, to: &'static str, end: WireEnd, seed: u64| {
            let open = move || (RawSocket::open(from), RawSocket::open(to));
            let (from, to) = cable.inside(End::Between, LONG, open);
            let (from, to) = (from.expect("root opens it"), to.expect("root opens it"));
            let from = FaultyWire::new(from, end, FaultPlan { seed, ..FaultPlan::NONE });
            let standing = Arc::new(Standing::default());
            let (orders, ordered) = mpsc::channel();
            let thread = thread::spawn({
                let standing = Arc::clone(&standing);
                move || pass_on(from, to, &ordered, &standing)
            });
            Lane { orders, standing, thread }
        };
        // What comes from the main device goes out to the subdevices, as if received at their end.
        let out = lane(TO_MAIN, TO_ROBOTS, WireEnd::Subdevices, seed);
        let back = lane(TO_ROBOTS, TO_MAIN, WireEnd::MainDevice, !seed);
        Self { out, back }
    }

    /// The next frame that goes this way meets `fault`.
    pub(crate) fn order(&self, way: Way, fault: WireFault) {
        let lane = match way {
            Way::Out => &self.out,
            Way::Back => &self.back,
        };
        lane.orders.send(fault).expect("the relay is there");
    }

    /// Number of faults made so far, both ways.
    pub(crate) fn faults_made(&self) -> u32 {
        [&self.out, &self.back].map(|lane| lane.standing.made.load(Ordering::Acquire)).iter().sum()
    }

    /// Whether no frame is held back and nothing is down. To be asked after
    /// [`faults_made`](Self::faults_made): what that counts is in here.
    pub(crate) fn is_quiet(&self) -> bool {
        [&self.out, &self.back].iter().all(|lane| lane.standing.is_quiet.load(Ordering::Acquire))
    }

    /// Ends it; the number of frames it passed on, out and back.
    pub(crate) fn end(self) -> [u64; 2] {
        [self.out, self.back].map(|Lane { orders, thread, .. }| {
            drop(orders);
            thread.join().expect("a relay never panics")
        })
    }
}

fn pass_on(
    mut from: FaultyWire<RawSocket>,
    mut to: RawSocket,
    ordered: &Receiver<WireFault>,
    standing: &Standing,
) -> u64 {
    let mut buffer = [0; MAX_FRAME];
    let mut passed = 0;
    loop {
        match ordered.try_recv() {
            Ok(fault) => from.inject_received(fault),
            Err(TryRecvError::Empty) => {}
            Err(TryRecvError::Disconnected) => return passed,
        }
        let deadline = from.now() + LOOK;
        match from.receive(&mut buffer, deadline) {
            // What cannot leave is lost as on a cable.
            Ok(Some(length)) => passed += u64::from(to.send(&buffer[..length]).is_ok()),
            Ok(None) => {}
            Err(error) => {
                assert!(is_transient(&error), "{error}");
                // It may come at once, and again.
                from.pause_until(deadline);
            }
        }
        standing.is_quiet.store(from.is_quiet(), Ordering::Release);
        standing.made.store(from.faults_made(), Ordering::Release);
    }
}
