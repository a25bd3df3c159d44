//! Those that send T->O: our virtual robot as `fieldarm sim` serves it, and the adapter of `ciplink`.

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use ciplink::adapter::{Adapter, AdapterConfig, AdapterIdentity, Assembly};
use fieldarm::bus::enip::adapter::AdapterSettings;
use fieldarm::link::enip::serve::{Ports, Server};
use fieldarm::link::enip::served::ServedRobot;
use fieldarm::sim::meca500::{CyclicBus, RobotSettings, VirtualRobot};
use fieldarm::wire::meca500::image::INPUT_LEN;

use crate::gaps::Arrivals;
use crate::listener::listen;
use crate::{Round, address, seed};

/// A virtual robot behind our adapter.
pub(crate) fn ours(round: Round) -> Result<Arrivals, String> {
    let (here, there) = (address(), address());
    let settings = AdapterSettings {
        min_rpi: round.interval,
        rpi_step: Duration::from_micros(500),
        ..AdapterSettings::meca500()
    };
    let robot = RobotSettings { bus: CyclicBus::EtherNetIp, ..RobotSettings::default() };
    let served = ServedRobot::new(VirtualRobot::new(robot), settings, there, seed());
    let mut server =
        Server::bind(vec![(there, served)], Ports::default()).map_err(|error| error.to_string())?;
    let is_over = AtomicBool::new(false);
    thread::scope(|scope| {
        scope.spawn(|| {
            while !is_over.load(Ordering::Relaxed) {
                if server.step().is_err() {
                    break;
                }
            }
        });
        let arrivals = listen(here, there, round);
        is_over.store(true, Ordering::Relaxed);
        arrivals
    })
}

/// The adapter of `ciplink`, set up as the robot.
pub(crate) fn ciplink(round: Round) -> Result<Arrivals, String> {
    let (here, there) = (address(), address());
    let config = AdapterConfig {
        identity: AdapterIdentity {
            vendor_id: 1565,
            device_type: 43,
            product_code: 500,
            ..AdapterIdentity::default()
        },
        assemblies: vec![
            Assembly::input(100, 252),
            Assembly::output(150, 60),
            Assembly::config(151, 0),
        ],
        bind: there,
        rpi_min: round.interval,
        ..AdapterConfig::default()
    };
    let adapter = Adapter::start(config).map_err(|error| error.to_string())?;
    // New data now and then, as a robot has.
    let is_over = AtomicBool::new(false);
    thread::scope(|scope| {
        scope.spawn(|| {
            let mut image = [0_u8; INPUT_LEN];
            while !is_over.load(Ordering::Relaxed) {
                image[0] = image[0].wrapping_add(1);
                let _ = adapter.set_input(100, &image);
                thread::sleep(Duration::from_millis(1));
            }
        });
        let arrivals = listen(here, there, round);
        is_over.store(true, Ordering::Relaxed);
        arrivals
    })
}
