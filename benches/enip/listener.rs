//! Meters T->O: a scanner that does nothing but receive, and stamps each frame as it comes.

use std::net::{Ipv4Addr, SocketAddrV4};
use std::time::Duration;

use fieldarm::bus::enip::scanner::{
    ConnectionSettings, Originator, Scanner, ScannerEvent, Target, Transmit,
};
use fieldarm::link::enip::network::{Arrival, Network, ROOM};
use fieldarm::link::enip::sockets::{SocketNetwork, SocketSettings};

use crate::gaps::Arrivals;
use crate::{MULTIPLIER, Round, seed};

/// Longest time to a running connection.
const PATIENCE: Duration = Duration::from_secs(10);

/// Owns the adapter at `adapter` and stamps its frames for a round.
pub(crate) fn listen(here: Ipv4Addr, adapter: Ipv4Addr, round: Round) -> Result<Arrivals, String> {
    let address = SocketAddrV4::new(adapter, fieldarm::wire::enip::MESSAGE_PORT);
    let settings = SocketSettings { bind: Some(here), ..SocketSettings::default() };
    let mut network =
        SocketNetwork::open(settings, &[address]).map_err(|error| error.to_string())?;
    let connection = ConnectionSettings {
        o2t_rpi: round.interval,
        t2o_rpi: round.interval,
        multiplier: MULTIPLIER,
        io_port: network.io_port(),
        ..ConnectionSettings::meca500()
    };
    let target = Target::new(address, connection).map_err(|mistake| mistake.to_string())?;
    let originator = Originator { vendor: 0xFA, serial: seed() as u32 };
    let mut scanner = Scanner::new([target], originator, seed());
    let mut room = [0; ROOM];
    let mut arrivals = Arrivals::with_capacity(round.frames + 1);
    let mut is_running = false;
    let mut left = round.warm_up;
    let mut deadline = network.now() + PATIENCE;
    loop {
        let now = network.now();
        scanner.handle_timeout(now);
        while let Some(transmit) = scanner.poll_transmit(now, &mut room) {
            perform(&mut network, transmit, address, &room).map_err(|error| error.to_string())?;
        }
        while let Some(event) = scanner.poll_event() {
            match event {
                ScannerEvent::Running { .. } => {
                    is_running = true;
                    deadline = now + round.limit();
                }
                ScannerEvent::Failed { trouble, .. } => return Err(trouble.to_string()),
                _ => {}
            }
        }
        if now >= deadline {
            return Err(format!("{} frames in time", arrivals_text(is_running)));
        }
        let until = scanner.poll_timeout().map_or(deadline, |due| due.min(deadline));
        match network.receive(&mut room, until).map_err(|error| error.to_string())? {
            Some(Arrival::Datagram { from, len }) => {
                arrivals.stamp();
                scanner.handle_datagram(network.now(), from, &room[..len]);
                if left > 0 {
                    left -= 1;
                    if left == 0 {
                        arrivals.clear();
                    }
                } else if arrivals.len() > round.frames {
                    break;
                }
            }
            Some(Arrival::Connected { target }) => scanner.handle_connected(network.now(), target),
            Some(Arrival::Disconnected { target }) => {
                scanner.handle_disconnected(network.now(), target);
            }
            Some(Arrival::Stream { target, len }) => {
                scanner.handle_stream(network.now(), target, &room[..len]);
            }
            None => {}
        }
    }
    close(&mut scanner, &mut network, address);
    Ok(arrivals)
}

fn arrivals_text(is_running: bool) -> &'static str {
    if is_running { "not enough" } else { "no" }
}

fn perform(
    network: &mut SocketNetwork,
    transmit: Transmit,
    address: SocketAddrV4,
    room: &[u8],
) -> std::io::Result<()> {
    match transmit {
        Transmit::Connect { target } => network.connect(target, address),
        Transmit::Stream { target, len } => network.send_stream(target, &room[..len]),
        Transmit::Disconnect { target } => {
            network.disconnect(target);
            Ok(())
        }
        // A lost frame is none of the meter's business.
        Transmit::Datagram { to, len } => {
            let _ = network.send_datagram(to, &room[..len]);
            Ok(())
        }
        Transmit::JoinGroup { group } => network.join_group(group),
        Transmit::LeaveGroup { group } => {
            network.leave_group(group);
            Ok(())
        }
    }
}

/// A Forward Close, as far as it gets within a second.
fn close(scanner: &mut Scanner<[Target; 1]>, network: &mut SocketNetwork, address: SocketAddrV4) {
    let mut room = [0; ROOM];
    scanner.close(network.now(), 0);
    let deadline = network.now() + Duration::from_secs(1);
    while network.now() < deadline {
        let now = network.now();
        scanner.handle_timeout(now);
        while let Some(transmit) = scanner.poll_transmit(now, &mut room) {
            let _ = perform(network, transmit, address, &room);
        }
        while let Some(event) = scanner.poll_event() {
            if matches!(event, ScannerEvent::Closed { .. }) {
                return;
            }
        }
        match network.receive(&mut room, now + Duration::from_millis(5)) {
            Ok(Some(Arrival::Stream { target, len })) => {
                scanner.handle_stream(network.now(), target, &room[..len]);
            }
            Ok(Some(Arrival::Disconnected { target })) => {
                scanner.handle_disconnected(network.now(), target);
            }
            _ => {}
        }
    }
}
