//! Virtual robots served on the loopback addresses of this machine.
#![cfg(all(feature = "enip", feature = "sim"))]

#[path = "support/loopback.rs"]
mod loopback;

use std::io::{ErrorKind, Read, Write};
use std::net::{Ipv4Addr, SocketAddrV4, TcpStream};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::thread::JoinHandle;

use fieldarm::bus::enip::adapter::{AdapterEvent, AdapterSettings};
use fieldarm::bus::enip::scanner::{ConnectionSettings, Originator};
use fieldarm::cycle::{CyclicSegment, InputQuality};
use fieldarm::link::clock::MonotonicClock;
use fieldarm::link::enip::explicit::ExplicitClient;
use fieldarm::link::enip::list_identity::list_identity;
use fieldarm::link::enip::serve::{BindError, Ports, Purpose, Server, ServerCounts};
use fieldarm::link::enip::served::ServedRobot;
use fieldarm::link::enip::sockets::{SocketNetwork, SocketSettings};
use fieldarm::link::enip::{EnipSegment, EnipSettings, TargetSettings};
use fieldarm::sim::meca500::{LifecycleTimes, RobotSettings, VirtualRobot};
use fieldarm::time::Duration;
use fieldarm::wire::enip::MESSAGE_PORT;
use fieldarm::wire::enip::parameters::TimeoutMultiplier;
use fieldarm::wire::meca500::image::INPUT_LEN;

type Robots = Server<VirtualRobot>;
type Request = Box<dyn FnOnce(&mut Robots) + Send>;

/// Longest that a client waits for an answer; it usually comes at once.
const PATIENCE: std::time::Duration = std::time::Duration::from_secs(20);

fn robot(address: Ipv4Addr) -> (Ipv4Addr, ServedRobot<VirtualRobot>) {
    let times = LifecycleTimes { boot: Duration::from_millis(20), ..LifecycleTimes::default() };
    let device = VirtualRobot::new(RobotSettings { times, ..RobotSettings::default() });
    let netmask = Ipv4Addr::new(255, 0, 0, 0);
    let settings = AdapterSettings { netmask, ..AdapterSettings::meca500() };
    (address, ServedRobot::new(device, settings, address, 1))
}

fn bind(addresses: &[Ipv4Addr]) -> Result<Robots, BindError> {
    Server::bind(addresses.iter().map(|address| robot(*address)).collect(), Ports::default())
}

/// A server in a thread of its own, stopped when this is dropped.
struct Served {
    requests: Option<Sender<Request>>,
    thread: Option<JoinHandle<()>>,
}

impl Served {
    fn at(addresses: &[Ipv4Addr]) -> Self {
        let mut server = bind(addresses).expect("the addresses are free");
        let (requests, inbox): (Sender<Request>, Receiver<Request>) = channel();
        let thread = std::thread::spawn(move || {
            loop {
                match inbox.try_recv() {
                    Ok(request) => request(&mut server),
                    Err(TryRecvError::Empty) => {}
                    Err(TryRecvError::Disconnected) => return,
                }
                server.step().expect("sockets can be waited for");
            }
        });
        Self { requests: Some(requests), thread: Some(thread) }
    }

    /// Asks the server something between two steps.
    fn ask<T: Send + 'static>(&self, what: impl FnOnce(&mut Robots) -> T + Send + 'static) -> T {
        let (answer, answered) = channel();
        let request: Request = Box::new(move |server| drop(answer.send(what(server))));
        self.requests.as_ref().expect("it runs").send(request).expect("it runs");
        answered.recv_timeout(PATIENCE).expect("it answers")
    }

    fn counts(&self) -> ServerCounts {
        self.ask(|server| server.counts())
    }

    /// Asks until the answer is yes.
    fn until(&self, what: &str, mut done: impl FnMut(&mut Robots) -> bool + Send + Copy + 'static) {
        // Each question is a step of a millisecond.
        assert!((0..20_000).any(|_| self.ask(move |server| done(server))), "never: {what}");
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        drop(self.requests.take());
        if let Some(Err(panic)) = self.thread.take().map(JoinHandle::join)
            && !std::thread::panicking()
        {
            std::panic::resume_unwind(panic);
        }
    }
}

fn segment(scanner: Ipv4Addr, robots: &[Ipv4Addr]) -> EnipSegment<SocketNetwork> {
    let connection = ConnectionSettings {
        multiplier: TimeoutMultiplier::from_factor(128).expect("a power of two"),
        ..ConnectionSettings::meca500()
    };
    let target = |robot: &Ipv4Addr| TargetSettings {
        address: SocketAddrV4::new(*robot, MESSAGE_PORT),
        connection,
    };
    let targets: Vec<_> = robots.iter().map(target).collect();
    let addresses: Vec<_> = targets.iter().map(|target| target.address).collect();
    let sockets = SocketSettings { bind: Some(scanner), ..SocketSettings::default() };
    let network = SocketNetwork::open(sockets, &addresses).expect("sockets");
    let settings = EnipSettings {
        targets,
        originator: Originator { vendor: 0xFFFF, serial: 1 },
        seed: 5,
        cycle: Duration::from_millis(10),
        start_limit: Duration::from_secs(20),
    };
    match EnipSegment::start(network, settings) {
        Ok(segment) => segment,
        Err(failure) => panic!("{}", failure.error),
    }
}

/// Cycles at 10 ms until `done`, at most for ten seconds.
fn cycles_until(
    segment: &mut EnipSegment<SocketNetwork>,
    mut done: impl FnMut(&EnipSegment<SocketNetwork>) -> bool,
) {
    let clock = MonotonicClock::new();
    let mut at = clock.now();
    for _ in 0..1_000 {
        segment.exchange(at).expect("sockets work");
        if done(segment) {
            return;
        }
        at += Duration::from_millis(10);
        clock.sleep_until(at);
    }
    panic!("not within ten seconds of cycles");
}

#[test]
fn robots_at_several_addresses_are_driven_by_one_scanner() {
    let addresses = [loopback::address(), loopback::address(), loopback::address()];
    let served = Served::at(&addresses);
    let mut segment = segment(loopback::address(), &addresses);
    let mut fresh = [0; 3];
    cycles_until(&mut segment, |segment| {
        for (target, fresh) in fresh.iter_mut().enumerate() {
            let quality = segment.read_inputs(target, &mut [0; INPUT_LEN]);
            *fresh += u32::from(quality == InputQuality::Fresh);
        }
        fresh.iter().all(|fresh| *fresh >= 30)
    });
    let owned: Vec<bool> = served.ask(|server| {
        server.robots().map(|robot| robot.adapter().owner().is_some_and(|o| o.is_running)).collect()
    });
    assert_eq!(owned, vec![true; 3]);
    // On a machine that stalls, frames of the two directions are skipped in different cycles.
    cycles_until(&mut segment, |_| {
        let counts = served.counts();
        counts.received >= 90 && counts.sent >= 90
    });
    segment.close();
    served.until("all connections are closed", |server| {
        server.robots().all(|robot| robot.adapter().connections().count() == 0)
    });
    let opened = served.ask(|server| {
        let events = core::iter::from_fn(|| server.next_event());
        let opened = events.filter(|(_, event)| matches!(event, AdapterEvent::Opened(_)));
        opened.map(|(robot, _)| robot).collect::<Vec<_>>()
    });
    let mut robots = opened;
    robots.sort_unstable();
    assert_eq!(robots, [0, 1, 2]);
}

#[test]
#[cfg(target_os = "linux")]
fn every_robot_answers_a_broadcast_from_its_own_address() {
    let addresses = [loopback::address(), loopback::address()];
    let _served = Served::at(&addresses);
    let to = SocketAddrV4::new(Ipv4Addr::new(127, 255, 255, 255), MESSAGE_PORT);
    let asker = loopback::address();
    // Robots of other tests may answer too.
    let found = (0..20).any(|_| {
        let listing = list_identity(Some(asker), to, Duration::from_millis(500)).expect("asked");
        addresses.iter().all(|address| {
            listing
                .found
                .iter()
                .any(|found| found.from.ip() == address && found.listed.address.ip() == address)
        })
    });
    assert!(found, "nobody answered a broadcast on the loopback network");
}

#[test]
fn one_robot_answers_who_it_is() {
    let address = loopback::address();
    let _served = Served::at(&[address]);
    let at = SocketAddrV4::new(address, MESSAGE_PORT);
    let listing = list_identity(None, at, Duration::from_secs(20)).expect("asked");
    assert_eq!(listing.found.len(), 1);
    let mut client = ExplicitClient::connect(None, at, Duration::from_secs(20)).expect("a session");
    let identity = client.identity().expect("an identity");
    let told = AdapterSettings::meca500().identity;
    assert_eq!((identity.vendor, identity.product_code), (told.vendor, told.product_code));
    assert_eq!(identity.name, told.name);
    assert_eq!(listing.found[0].listed.identity.serial, identity.serial);
}

/// A TCP connection to a robot.
fn connect(address: Ipv4Addr) -> TcpStream {
    let stream = TcpStream::connect((address, MESSAGE_PORT)).expect("the listener is there");
    stream.set_read_timeout(Some(PATIENCE)).expect("a limit");
    stream.set_write_timeout(Some(PATIENCE)).expect("a limit");
    stream
}

/// RegisterSession, typed by hand.
const REGISTER: [u8; 28] = {
    let mut bytes = [0; 28];
    (bytes[0], bytes[2], bytes[24]) = (0x65, 4, 1);
    bytes
};

/// Whether the robot closed the connection.
fn is_closed(stream: &mut TcpStream) -> bool {
    match stream.read(&mut [0; 64]) {
        Ok(0) => true,
        Ok(_) => false,
        Err(error) => match error.kind() {
            ErrorKind::WouldBlock | ErrorKind::TimedOut => panic!("neither bytes nor an end"),
            _ => true,
        },
    }
}

/// Which timer of the system runs for the connection from `peer` to `robot`: 2 asks whether the peer is alive.
#[cfg(target_os = "linux")]
fn timer(robot: SocketAddrV4, peer: SocketAddrV4) -> Option<String> {
    let shown = |address: SocketAddrV4| {
        let ip = u32::from_ne_bytes(address.ip().octets());
        format!("{ip:08X}:{:04X}", address.port())
    };
    let table = std::fs::read_to_string("/proc/net/tcp").expect("a table of connections");
    table.lines().find_map(|line| {
        let fields: Vec<&str> = line.split_whitespace().collect();
        let is_it = fields.get(1) == Some(&shown(robot).as_str())
            && fields.get(2) == Some(&shown(peer).as_str());
        is_it.then(|| fields.get(5).unwrap_or(&"").chars().take(2).collect())
    })
}

#[test]
#[cfg(target_os = "linux")]
fn the_system_asks_whether_a_silent_peer_is_still_there() {
    let address = loopback::address();
    let served = Served::at(&[address]);
    served.until("on its bus", |server| server.robots().all(|robot| robot.is_on_bus()));
    let stream = connect(address);
    let std::net::SocketAddr::V4(peer) = stream.local_addr().expect("a local address") else {
        panic!("not IPv4");
    };
    let robot = SocketAddrV4::new(address, MESSAGE_PORT);
    // Accepting takes a moment.
    let asks = (0..1_000).any(|_| {
        served.counts();
        timer(robot, peer).as_deref() == Some("02")
    });
    assert!(asks, "{:?}", timer(robot, peer));
}

#[test]
fn a_robot_without_power_closes_its_connections_and_serves_again_when_it_is_back() {
    let address = loopback::address();
    let served = Served::at(&[address]);
    let mut stream = connect(address);
    stream.write_all(&REGISTER).expect("written");
    assert!(!is_closed(&mut stream), "a session is registered");
    served.ask(|server| {
        server.robots_mut().for_each(|robot| robot.device_mut().panel().switch_off());
    });
    assert!(is_closed(&mut stream));
    let refused = TcpStream::connect((address, MESSAGE_PORT)).expect_err("nobody is there");
    assert_eq!(refused.kind(), ErrorKind::ConnectionRefused);
    served.ask(|server| {
        server.robots_mut().for_each(|robot| robot.device_mut().panel().switch_on());
    });
    served.until("it has booted", |server| server.robots().all(ServedRobot::is_on_bus));
    let mut stream = connect(address);
    stream.write_all(&REGISTER).expect("written");
    assert!(!is_closed(&mut stream));
}

#[test]
#[cfg(target_os = "linux")]
fn a_pulled_cable_is_silence_in_both_directions_and_breaks_nothing_by_itself() {
    let addresses = [loopback::address(), loopback::address()];
    let [pulled, other] = addresses;
    let served = Served::at(&addresses);
    let mut stream = connect(pulled);
    stream.write_all(&REGISTER).expect("written");
    assert!(!is_closed(&mut stream), "a session is registered");
    let mut segment = segment(loopback::address(), &addresses);
    let lost = |segment: &EnipSegment<SocketNetwork>| {
        [0, 1].map(|robot| segment.read_inputs(robot, &mut [0; INPUT_LEN]) == InputQuality::Lost)
    };
    cycles_until(&mut segment, |segment| lost(segment) == [false; 2]);
    served.ask(|server| server.set_plugged(0, false)).expect("filters are there");
    cycles_until(&mut segment, |segment| lost(segment) == [true, false]);
    // Bytes wait for the cable, and who knocks is not heard.
    stream.write_all(&REGISTER[..4]).expect("the system takes them");
    let brief = std::time::Duration::from_millis(200);
    let knocked = TcpStream::connect_timeout(&(pulled, MESSAGE_PORT).into(), brief);
    assert_eq!(knocked.expect_err("no answer").kind(), ErrorKind::TimedOut);
    let asked = SocketAddrV4::new(pulled, MESSAGE_PORT);
    let listing = list_identity(None, asked, Duration::from_millis(100)).expect("asked");
    assert!(listing.found.is_empty());
    drop(connect(other));
    served.ask(|server| server.set_plugged(0, true)).expect("filters are there");
    // A second registration in a session is refused: an answer, on the connection from before.
    stream.write_all(&REGISTER[4..]).expect("written");
    assert!(!is_closed(&mut stream), "it is still open");
    drop(connect(pulled));
    cycles_until(&mut segment, |segment| lost(segment) == [false; 2]);
    segment.close();
}

#[test]
fn who_never_reads_loses_the_connection_and_nobody_else_does() {
    let address = loopback::address();
    let served = Served::at(&[address]);
    let mut other = connect(address);
    let mut greedy = connect(address);
    // ListServices needs no session and is answered with more bytes than it has.
    let mut request = [0; 24];
    request[0] = 0x04;
    let requests = request.repeat(200);
    // What the system buffers for both ends is some megabytes at most.
    let is_cut = (0..20_000).any(|_| greedy.write_all(&requests).is_err());
    assert!(is_cut, "it buffers without end");
    served.until("it is closed", |server| server.counts().overfull == 1);
    other.write_all(&REGISTER).expect("written");
    assert!(!is_closed(&mut other));
}

#[test]
fn who_says_that_nothing_more_comes_gets_all_answers_first() {
    let address = loopback::address();
    let served = Served::at(&[address]);
    served.until("on its bus", |server| server.robots().all(|robot| robot.is_on_bus()));
    // ListServices is answered with 50 bytes; 200 of them come in many pieces.
    let mut request = [0; 24];
    request[0] = 0x04;
    for count in [1, 200] {
        let mut stream = connect(address);
        stream.write_all(&request.repeat(count)).expect("written");
        stream.shutdown(std::net::Shutdown::Write).expect("half closed");
        let mut answers = Vec::new();
        stream.read_to_end(&mut answers).expect("answers, then the end");
        assert_eq!(answers.len(), 50 * count, "{count} requests");
    }
}

#[test]
fn an_address_that_cannot_be_had_is_named_with_what_to_do() {
    let address = loopback::address();
    let twice = bind(&[address, address]).err().expect("refused").to_string();
    assert!(twice.contains(&address.to_string()) && twice.contains("two robots"), "{twice}");
    let _first = bind(&[address]).expect("free");
    let taken = bind(&[address]).err().expect("refused");
    assert!(matches!(taken, BindError::Socket { purpose: Purpose::Sessions, .. }), "{taken}");
    let taken = taken.to_string();
    for word in [&address.to_string(), "44818", "TCP", "ss -l", "another address"] {
        assert!(taken.contains(word), "{word}: {taken}");
    }
    // Set aside for documents: of no machine.
    let foreign = bind(&[Ipv4Addr::new(192, 0, 2, 1)]).err().expect("refused").to_string();
    for word in ["192.0.2.1:44818", "not of this machine", "127.0.0.0/8"] {
        assert!(foreign.contains(word), "{word}: {foreign}");
    }
}

#[test]
fn a_scanner_that_holds_the_port_of_the_frames_is_named() {
    let address = loopback::address();
    let _scanner = std::net::UdpSocket::bind((address, 2_222)).expect("free");
    let taken = bind(&[address]).err().expect("refused").to_string();
    for word in ["2222", "class 1 frames", "scanner"] {
        assert!(taken.contains(word), "{word}: {taken}");
    }
}
