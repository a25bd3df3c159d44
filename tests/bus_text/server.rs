//! The robot's end: who controls, who listens, who is sent away.

use crate::text_support::{ScriptedDevice, Told};
use fieldarm::bus::text::server::{ANOTHER_USER, CloseReason, Peer, ServerSession};
use fieldarm::text_device::LineProblem;
use fieldarm::time::Instant;
use proptest::prelude::*;

type Session = ServerSession<3, 64, 512>;

struct Bench {
    session: Session,
    device: ScriptedDevice,
    now: Instant,
}

impl Bench {
    fn new() -> Self {
        Self { session: Session::new(), device: ScriptedDevice::default(), now: Instant::ZERO }
    }

    fn connected() -> Self {
        let mut bench = Self::new();
        assert!(bench.accept());
        assert_eq!(bench.read(Peer::Control), ["[3000][Connected to Meca500 R3 v11.3.84]"]);
        bench
    }

    fn accept(&mut self) -> bool {
        self.session.accept_control(self.now, &mut self.device)
    }

    fn monitor(&mut self) -> Option<Peer> {
        self.session.accept_monitor(self.now, &mut self.device)
    }

    fn send(&mut self, bytes: &[u8]) {
        self.session.receive(self.now, &mut self.device, Peer::Control, bytes);
    }

    fn tick(&mut self) {
        self.now += fieldarm::time::Duration::from_millis(1);
        self.session.advance(self.now, &mut self.device);
    }

    fn close(&mut self, peer: Peer) {
        self.session.closed(self.now, &mut self.device, peer);
    }

    /// Reads everything that waits for a peer.
    fn read(&mut self, peer: Peer) -> Vec<String> {
        let bytes = self.session.waiting(peer).to_vec();
        self.session.sent(peer, bytes.len());
        let text = String::from_utf8(bytes).unwrap();
        assert!(text.is_empty() || text.ends_with('\0'), "a torn message: {text:?}");
        text.split_terminator('\0').map(str::to_owned).collect()
    }
}

#[test]
fn commands_come_in_and_answers_go_out_in_order() {
    let mut bench = Bench::connected();
    bench.send(b"\0Say(1)\nSa");
    bench.send(b"y(2)\r\n-Say(3)\0");
    assert_eq!(bench.device.commands(), ["Say(1)", "Say(2)", "-Say(3)"]);
    assert_eq!(bench.read(Peer::Control), ["[2000][1]", "[2000][2]", "[2000][3]"]);
    assert_eq!(bench.session.counts().commands, 3);
}

#[test]
fn one_controls_and_the_second_is_told_so() {
    let mut bench = Bench::connected();
    assert!(!bench.accept());
    assert!(ANOTHER_USER.starts_with(b"[3001][") && ANOTHER_USER.ends_with(b"]\0"));
    bench.send(b"Say(1)\0");
    assert_eq!(bench.read(Peer::Control), ["[2000][1]"]);
    bench.close(Peer::Control);
    assert_eq!(bench.device.told.last(), Some(&Told::Closed));
    // Closing twice is nothing, and the next one begins with an empty line buffer.
    bench.close(Peer::Control);
    assert!(bench.accept());
    bench.send(b"half a li");
    bench.close(Peer::Control);
    assert!(bench.accept());
    bench.read(Peer::Control);
    bench.send(b"Say(2)\0");
    assert_eq!(bench.device.commands(), ["Say(1)", "Say(2)"]);
    assert_eq!(bench.session.counts().refused, 1);
}

#[test]
fn a_robot_that_somebody_else_controls_refuses() {
    let mut bench = Bench::new();
    bench.device.is_free = false;
    assert!(!bench.accept());
    assert!(bench.monitor().is_some());
    assert_eq!(bench.session.peers().collect::<Vec<_>>(), [Peer::Monitor(0)]);
    bench.device.is_free = true;
    assert!(bench.accept());
}

#[test]
fn monitors_are_told_the_state_first_and_then_the_same_news() {
    let mut bench = Bench::connected();
    let first = bench.monitor().unwrap();
    assert_eq!(bench.read(first), ["[2007][0,0,0,0,0,1,1]", "[2095][m500]"]);
    bench.send(b"Shout(a)\0");
    let second = bench.monitor().unwrap();
    bench.send(b"Shout(b)\0");
    assert_eq!(bench.read(first), ["[2095][a]", "[2095][b]"]);
    assert_eq!(bench.read(second), ["[2007][0,0,0,0,0,1,1]", "[2095][m500]", "[2095][b]"]);
    assert!(bench.read(Peer::Control).is_empty());
    // Nobody listens to what monitors say.
    bench.session.receive(bench.now, &mut bench.device, first, b"Say(1)\0");
    assert_eq!(bench.device.commands(), ["Shout(a)", "Shout(b)"]);
    let third = bench.monitor().unwrap();
    assert_eq!(bench.monitor(), None);
    bench.close(second);
    assert_eq!(bench.monitor(), Some(second));
    assert_ne!(third, first);
}

#[test]
fn lines_that_are_none_are_answered_once() {
    let mut bench = Bench::connected();
    bench.send(&[b'x'; 1_000]);
    bench.send(&[b'x'; 1_000]);
    bench.send(b"\0\xff\xfe\0   \0\0Say(1)\0");
    let expected = [LineProblem::TooLong, LineProblem::NotAscii, LineProblem::Empty];
    assert_eq!(bench.device.rejected(), expected);
    let answers = bench.read(Peer::Control);
    assert_eq!(answers.len(), 4);
    assert!(answers[0].starts_with("[3003]") && answers[1].starts_with("[1001]"));
    assert_eq!(answers[3], "[2000][1]");
    assert_eq!(bench.session.counts().rejected, 3);
}

#[test]
fn who_does_not_read_loses_the_connection_and_nobody_else_does() {
    let mut bench = Bench::connected();
    let (slow, quick) = (bench.monitor().unwrap(), bench.monitor().unwrap());
    bench.read(quick);
    for round in 0..100 {
        bench.send(b"Shout(news)\0");
        assert_eq!(bench.read(quick), ["[2095][news]"], "{round}");
    }
    assert_eq!(bench.session.next_to_close(), Some((slow, CloseReason::Overfull)));
    assert_eq!(bench.session.counts().overfull, 1);
    // What was promised to it is whole.
    assert!(bench.read(slow).len() > 20);
    bench.close(slow);
    assert_eq!(bench.session.next_to_close(), None);

    bench.send(b"Flood(1000)\0Say(never)\0");
    assert_eq!(bench.session.next_to_close(), Some((Peer::Control, CloseReason::Overfull)));
    assert!(!bench.device.commands().contains(&"Say(never)"));
    assert_eq!(bench.device.told.last(), Some(&Told::Closed));
    assert!(!bench.accept(), "its socket is still there");
    bench.close(Peer::Control);
    assert_eq!(bench.device.told.iter().filter(|told| **told == Told::Closed).count(), 1);
    assert!(bench.accept());
    assert_eq!(bench.read(Peer::Control), ["[3000][Connected to Meca500 R3 v11.3.84]"]);
}

#[test]
fn a_message_that_no_outbox_holds_ends_the_connection() {
    let mut bench = Bench::connected();
    bench.send(b"Wide(400)\0");
    assert_eq!(bench.read(Peer::Control)[0].len(), 408);
    bench.send(b"Wide(600)\0");
    assert_eq!(bench.session.next_to_close(), Some((Peer::Control, CloseReason::Overfull)));
    assert!(bench.read(Peer::Control).is_empty());
}

#[test]
fn the_robot_may_end_connections_itself() {
    let mut bench = Bench::connected();
    let monitor = bench.monitor().unwrap();
    bench.send(b"Hang()\0Say(1)\0");
    assert_eq!(bench.session.next_to_close(), Some((Peer::Control, CloseReason::Dropped)));
    assert_eq!(bench.device.told.last(), Some(&Told::Closed));
    bench.close(Peer::Control);
    bench.tick();
    assert_eq!(bench.session.next_to_close(), None);
    assert!(bench.accept());

    bench.device.is_on_text = false;
    bench.tick();
    assert_eq!(bench.session.next_to_close(), Some((Peer::Control, CloseReason::PortsClosed)));
    bench.close(Peer::Control);
    assert_eq!(bench.session.next_to_close(), Some((monitor, CloseReason::PortsClosed)));
    bench.close(monitor);
    assert!(!bench.accept());
    assert_eq!(bench.monitor(), None);
    bench.device.is_on_text = true;
    bench.tick();
    assert!(bench.accept());
}

#[test]
fn messages_for_nobody_are_thrown_away() {
    let mut bench = Bench::new();
    bench.device.control.push_back("[2042][Motion paused.]".into());
    bench.device.monitoring.push_back("[2015][100]".into());
    bench.tick();
    assert!(bench.device.control.is_empty() && bench.device.monitoring.is_empty());
    assert!(bench.accept());
    assert_eq!(bench.read(Peer::Control), ["[3000][Connected to Meca500 R3 v11.3.84]"]);
}

proptest! {
    /// Whatever comes in whatever order, the rules of the device are kept (it asserts them) and no message
    /// is torn (`read` asserts it).
    #[test]
    fn any_sequence_keeps_the_rules(steps in prop::collection::vec((0_u8..10, any::<u8>()), 1..120)) {
        let mut bench = Bench::new();
        for (step, number) in steps {
            let peer = match number % 4 { 3 => Peer::Control, place => Peer::Monitor(usize::from(place)) };
            match step {
                0 => { bench.accept(); }
                1 => { bench.monitor(); }
                2 => bench.close(peer),
                3 => bench.send(&[number; 70]),
                4 => bench.send(b"Flood(9)\0Shout(a)\0"),
                5 => bench.send(b"Hang()\n"),
                6 => bench.device.is_on_text = number > 60,
                7 => { bench.read(peer); }
                8 => while let Some((peer, _)) = bench.session.next_to_close() { bench.close(peer) },
                _ => bench.tick(),
            }
            let control = bench.session.peers().any(|peer| peer == Peer::Control);
            prop_assert!(control || !bench.device.is_open);
        }
    }
}
