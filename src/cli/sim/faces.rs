//! All that the robots are served on, and the one wait for it.
//!
//! Read [`Faces::pass`] first. A robot has up to three faces: a place in the EtherCAT line, an
//! EtherNet/IP adapter, and the two ports of the text interface. Each face is served when something
//! arrived for it or its time has come, and only then: a frame waits neither for the millisecond of
//! the others nor for their system calls.
//!
//! Invariants: one thread and one clock; a pass ends within [`STEP`] and what there was to do; who
//! controls a robot is settled before its next face is served.

use std::io;
use std::prelude::v1::*;

use super::args::{ModeName, SimArgs};
use super::labels::Labels;
use super::line::EtherCatFace;
use super::shared_robot::SharedRobot;
use super::stage::{Cable, Cables};
use super::teller::Teller;
use crate::cli::enip::serve::{EnipFace, EnipOptions};
use crate::cli::exit::Failure;
use crate::cli::text::serve::{self as text, TextFace, TextOptions};
use crate::link::clock::MonotonicClock;
use crate::link::watch_list::WatchList;
use crate::time::{Duration, Instant};
use crate::wire::meca500::adapter::MIN_RPI_US;

/// Longest wait of a pass.
pub(super) const STEP: Duration = Duration::from_millis(1);

/// How much before its time a face is served along with another, so that an idle robot wakes up once a
/// millisecond and not once for each face.
pub(super) const EARLY: Duration = Duration::from_micros(250);

/// Numbers on the list of sockets; those of the text faces follow.
const ETHERCAT: usize = 0;
const ENIP: usize = 1;
const FIRST_TEXT: usize = 2;

/// Everything that the robots are served on.
pub(super) struct Faces {
    pub(super) robots: Vec<SharedRobot>,
    pub(super) ethercat: Option<EtherCatFace>,
    pub(super) enip: Option<EnipFace>,
    /// One for each robot, or none.
    pub(super) text: Vec<TextFace>,
    pub(super) cables: Vec<Cables>,
    clock: MonotonicClock,
}

impl Faces {
    /// Opens what the command line asks for.
    pub(super) fn open(
        args: &SimArgs,
        robots: Vec<SharedRobot>,
        teller: Teller,
    ) -> Result<Self, Failure> {
        let faces = [args.ethercat.is_some(), args.enip.is_some(), args.tcp.is_some()];
        let labels = Labels {
            are_several: robots.len() > 1,
            is_mixed: faces.iter().filter(|is_there| **is_there).count() > 1,
        };
        let ethercat = match &args.ethercat {
            Some(interface) => Some(EtherCatFace::open(args, interface, &robots, teller)?),
            None => None,
        };
        let clock = ethercat.as_ref().map_or_else(MonotonicClock::new, EtherCatFace::clock);
        let enip = match args.enip {
            Some(first) => {
                let usual = Duration::from_micros(MIN_RPI_US.into());
                let options = EnipOptions {
                    first,
                    min_rpi: args.min_rpi_ms.unwrap_or(usual),
                    monitoring_only: args.monitoring_only,
                };
                Some(EnipFace::open(options, &robots, clock, labels, teller)?)
            }
            None => None,
        };
        let text = match args.tcp {
            Some(control) => {
                let options = TextOptions {
                    control,
                    monitoring: args.monitor,
                    is_on_ethercat: ethercat.is_some(),
                    teller,
                };
                let open = |(number, robot): (u16, &SharedRobot)| {
                    TextFace::open(options, number, robot.clone(), labels.of(number.into()))
                };
                (0..).zip(&robots).map(open).collect::<Result<_, _>>()?
            }
            None => Vec::new(),
        };
        let cables = vec![Cables::default(); robots.len()];
        Ok(Self { robots, ethercat, enip, text, cables, clock })
    }

    /// The time that all of them live by.
    pub(super) fn now(&self) -> Instant {
        self.clock.now()
    }

    /// What is served, for a person.
    pub(super) fn announcement(&self, args: &SimArgs) -> String {
        let ethercat = self.ethercat.iter().map(|face| face.whereabouts().to_owned());
        let enip = self.enip.iter().map(|face| face.whereabouts().to_owned());
        let text = (!self.text.is_empty()).then(|| text::whereabouts(&self.text));
        let all: Vec<String> = ethercat.chain(enip).chain(text).collect();
        let is_only_text = self.ethercat.is_none() && self.enip.is_none();
        let count = match self.robots.len() {
            1 if is_only_text => "a".into(),
            count => count.to_string(),
        };
        let mode = match (args.mode(), &self.ethercat) {
            (_, None) => "",
            (ModeName::Ethercat, _) if all.len() == 1 => "",
            (ModeName::Ethercat, _) => "; in EtherCAT mode at first",
            (ModeName::Tcp, _) => "; in TCP/IP mode at first",
        };
        let all = all.join("; and on ");
        format!("serving {count} virtual Meca500 on {all}{mode}; Ctrl-C ends it")
    }

    /// Says what keeps a face from being reached.
    pub(super) fn warn(&self) {
        self.ethercat.iter().for_each(EtherCatFace::warn);
    }

    /// Waits until something is to be done at a face, at most until `deadline` or for [`STEP`], and does
    /// it.
    pub(super) fn pass(&mut self, deadline: Instant) -> Result<(), Failure> {
        match (&mut self.ethercat, &mut self.enip, &*self.text) {
            // Who has no other face to look after waits for its own sockets in its own way.
            (Some(ethercat), None, []) => ethercat.step(),
            (None, Some(enip), []) => enip.step(),
            _ => self.pass_over_all(deadline),
        }
    }

    fn pass_over_all(&mut self, deadline: Instant) -> Result<(), Failure> {
        let ready = {
            let mut list = WatchList::new();
            let now = self.clock.now();
            let mut until = deadline.min(now + STEP);
            if let Some(face) = &self.ethercat {
                face.watch(&mut list, ETHERCAT);
                until = until.min(face.next_due());
            }
            if let Some(face) = &self.enip {
                face.watch(&mut list, ENIP);
                until = until.min(face.next_due());
            }
            for (number, face) in (FIRST_TEXT..).zip(&self.text) {
                face.watch(&mut list, number);
                until = until.min(face.next_due());
            }
            let waited = list.wait(until.saturating_duration_since(now));
            waited.map_err(|error| Failure::link(format!("cannot wait for sockets: {error}")))?
        };
        if let Some(face) = &mut self.ethercat
            && (ready.contains(ETHERCAT) || face.next_due() <= self.clock.now() + EARLY)
        {
            face.serve()?;
        }
        if let Some(face) = &mut self.enip
            && (ready.contains(ENIP) || face.next_due() <= self.clock.now())
        {
            face.serve()?;
        }
        for (robot, face) in self.text.iter_mut().enumerate() {
            let now = self.clock.now();
            if ready.contains(FIRST_TEXT + robot) || face.next_due() <= now + EARLY {
                face.serve(now);
                if let Some(enip) = &mut self.enip {
                    enip.settle(robot);
                }
            }
        }
        Ok(())
    }

    /// Pulls a cable of a robot, or plugs it in again; says why not if it cannot.
    pub(super) fn set_plugged(
        &mut self,
        robot: usize,
        cable: Cable,
        plugged: bool,
    ) -> Result<(), String> {
        let is_there = match cable {
            Cable::EtherCat => self.ethercat.is_some(),
            Cable::EtherNetIp => self.enip.is_some(),
            Cable::Tcp => !self.text.is_empty(),
            Cable::All => true,
        };
        let Some(cables) = self.cables.get_mut(robot).filter(|_| is_there) else {
            return Err("nothing is served there".into());
        };
        cables.set(cable, plugged);
        let cables = *cables;
        if let Some(face) = &mut self.ethercat {
            let pulled = self.cables.iter().position(|cables| !cables.ethercat);
            face.set_reach(pulled.unwrap_or(usize::MAX));
        }
        let enip = self.enip.as_mut().map(|face| face.set_plugged(robot, cables.ethernet_ip));
        let text = self.text.get_mut(robot).map(|face| face.set_plugged(cables.tcp));
        [enip, text].into_iter().flatten().collect::<io::Result<()>>().map_err(|error| {
            format!("this system cannot hold up what arrives at a socket: {error}")
        })
    }

    /// Whether a fault of the wire cut the power since this was asked last.
    pub(super) fn take_power_cycle(&mut self) -> bool {
        self.ethercat.as_mut().is_some_and(EtherCatFace::take_power_cycle)
    }

    /// What passed, for a person.
    pub(super) fn totals(&self) -> Vec<String> {
        let ethercat = self.ethercat.iter().map(EtherCatFace::totals);
        let enip = self.enip.iter().map(EnipFace::totals);
        let text = (!self.text.is_empty()).then(|| text::totals(&self.text));
        ethercat.chain(enip).chain(text).collect()
    }
}
