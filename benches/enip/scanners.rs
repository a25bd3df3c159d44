//! Those that send O->T: our link as `fieldarm run` cycles it, and the scanner `ethernetip`.

use std::net::{Ipv4Addr, SocketAddrV4};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use fieldarm::bus::enip::scanner::{ConnectionSettings, Originator};
use fieldarm::cycle::InputQuality;
use fieldarm::link::enip::sockets::{SocketNetwork, SocketSettings};
use fieldarm::link::enip::{EnipSegment, EnipSettings, TargetSettings};
use fieldarm::run::pace::RealTime;
use fieldarm::run::periodic::{Controller, Periodic};
use fieldarm::time::Instant;
use fieldarm::wire::WireError;
use fieldarm::wire::enip::MESSAGE_PORT;
use fieldarm::wire::meca500::image::{INPUT_LEN, OUTPUT_LEN};

use crate::gaps::Arrivals;
use crate::python::python;
use crate::target::Meter;
use crate::{MULTIPLIER, Round, address, seed};

/// Longest time to a running connection.
const PATIENCE: Duration = Duration::from_secs(15);

/// A PLC that wants nothing of its robot.
struct Idle;

impl Controller for Idle {
    const OUTPUT_LEN: usize = OUTPUT_LEN;
    const INPUT_LEN: usize = INPUT_LEN;

    fn cycle(
        &mut self,
        _: Instant,
        _: InputQuality,
        _: &[u8],
        _: &mut [u8],
    ) -> Result<(), WireError> {
        Ok(())
    }
}

/// Our link with one robot, driven by the loop that `fieldarm run` uses.
pub(crate) fn ours(round: Round) -> Result<Arrivals, String> {
    let (here, there) = (address(), address());
    let meter = Meter::bind(there, round).map_err(|error| error.to_string())?;
    let is_over = AtomicBool::new(false);
    thread::scope(|scope| {
        let link = scope.spawn(|| drive(here, there, round, &is_over));
        let arrivals = meter.receive(round);
        is_over.store(true, Ordering::Relaxed);
        match link.join() {
            Ok(Ok(())) => arrivals,
            Ok(Err(error)) => Err(error),
            Err(_) => Err("the link panicked".into()),
        }
    })
}

fn drive(
    here: Ipv4Addr,
    there: Ipv4Addr,
    round: Round,
    is_over: &AtomicBool,
) -> Result<(), String> {
    let address = SocketAddrV4::new(there, MESSAGE_PORT);
    let settings = SocketSettings { bind: Some(here), ..SocketSettings::default() };
    let network = SocketNetwork::open(settings, &[address]).map_err(|error| error.to_string())?;
    let connection = ConnectionSettings {
        o2t_rpi: round.interval,
        t2o_rpi: round.interval,
        multiplier: MULTIPLIER,
        ..ConnectionSettings::meca500()
    };
    let settings = EnipSettings {
        targets: vec![TargetSettings { address, connection }],
        originator: Originator { vendor: 0xFA, serial: seed() as u32 },
        seed: seed(),
        cycle: round.interval,
        start_limit: PATIENCE,
    };
    let segment = EnipSegment::start(network, settings)
        .map_err(|failure| format!("no start: {}", failure.error))?;
    let cycle = segment.cycle();
    let mut cycles = Periodic::over_segment::<Idle>(segment, RealTime::default(), cycle);
    let mut plc = Idle;
    while !is_over.load(Ordering::Relaxed) {
        cycles.turn([Some(&mut plc)]).map_err(|error| error.to_string())?;
    }
    Ok(())
}

/// The scanner `ethernetip` in a process of its own.
pub(crate) fn ethernetip(round: Round) -> Result<Arrivals, String> {
    let python = python("ethernetip==1.2.0", "ethernetip")?;
    let there = address();
    let meter = Meter::bind(there, round).map_err(|error| error.to_string())?;
    let mut child = Command::new(python)
        .arg("benches/peers/ethernetip_cycle.py")
        .args([there.to_string(), round.interval.as_millis().to_string()])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .stdin(Stdio::piped())
        .spawn()
        .map_err(|error| error.to_string())?;
    let arrivals = meter.receive(round);
    // It ends when its input does; the meter answers no Forward Close any more.
    drop(child.stdin.take());
    thread::sleep(Duration::from_millis(200));
    let _ = child.kill();
    let _ = child.wait();
    arrivals
}
