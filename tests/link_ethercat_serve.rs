//! The serving of emulated robots: what a frame costs.
#![cfg(all(feature = "ethercat", feature = "sim"))]

use std::io;
use std::time::Duration;

use fieldarm::bus::ethercat::meca500::{Meca500Application, Meca500Settings};
use fieldarm::bus::ethercat::{Settings, SubDevice};
use fieldarm::link::ethercat::faulty_wire::{FaultPlan, FaultyWire, WireEnd, WireFault};
use fieldarm::link::ethercat::serve::Server;
use fieldarm::link::ethercat::wire::Wire;
use fieldarm::sim::meca500::{CyclicBus, RobotSettings, VirtualRobot};
use fieldarm::time::Instant;
use fieldarm::wire::ethercat::sii::SiiImage;
use fieldarm::wire::meca500::subdevice::DESCRIPTION;

/// A main device that asks the same, once in a millisecond, and counts the answers.
struct Asking {
    now: Instant,
    frame: Vec<u8>,
    answers: u32,
}

impl Wire for Asking {
    fn send(&mut self, _: &[u8]) -> io::Result<()> {
        self.answers += 1;
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], deadline: Instant) -> io::Result<Option<usize>> {
        let next = self.now + Duration::from_millis(1);
        self.now = next.min(deadline);
        if self.now < next {
            return Ok(None);
        }
        buffer[..self.frame.len()].copy_from_slice(&self.frame);
        Ok(Some(self.frame.len()))
    }

    fn now(&self) -> Instant {
        self.now
    }

    fn pause_until(&mut self, deadline: Instant) {
        self.now = deadline;
    }
}

fn robot() -> SubDevice<Meca500Application<VirtualRobot>> {
    let robot =
        VirtualRobot::new(RobotSettings { bus: CyclicBus::EtherCat, ..RobotSettings::default() });
    let application = Meca500Application::new(robot, Meca500Settings::default());
    let sii = SiiImage::new(&DESCRIPTION).expect("it fits");
    SubDevice::new(application, &DESCRIPTION, sii, Settings::default())
}

fn serve(plan: FaultPlan, steps: u32) -> (u32, u32, u64) {
    // BRD of AL status, and LRW of the images of four robots.
    let mut frame = vec![0x10; 12];
    frame.extend([0x88, 0xA4, 0xFA, 0x14, 7, 1, 0, 0, 0x30, 0x01, 2, 0x80, 0, 0, 0, 0, 0, 0]);
    frame.extend([12, 1, 0, 0, 0, 0, 0xE0, 0x04, 0, 0]);
    frame.resize(frame.len() + 1_248 + 2, 0);
    let asking = Asking { now: Instant::ZERO, frame, answers: 0 };
    let wire = FaultyWire::new(asking, WireEnd::Subdevices, plan);
    let mut server = Server::new(wire, (0..4).map(|_| robot()).collect());
    // What is made at the beginning is made now.
    for _ in 0..100 {
        let _ = server.step();
    }
    let used = allocation_counter::measure(|| {
        for _ in 0..steps {
            let _ = server.step();
        }
    });
    (server.wire().inner().answers, server.wire().faults_made(), used.count_total)
}

#[test]
fn a_frame_is_served_without_allocation() {
    assert_eq!(serve(FaultPlan::NONE, 2_000), (2_100, 0, 0));
}

#[test]
fn a_fault_is_made_without_allocation() {
    let chances = WireFault::ALL.iter().map(|fault| (*fault, 10)).collect();
    let (answers, faults, allocations) = serve(FaultPlan { chances, seed: 5, limit: None }, 2_000);
    assert!((100..2_100).contains(&answers), "{answers} answers");
    assert!(faults > 50, "{faults} faults");
    assert_eq!(allocations, 0);
}
