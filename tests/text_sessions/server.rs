//! The robot's end of the text interface with a virtual robot behind it, among peers that obey a string of
//! bytes.

use fieldarm::bus::text::server::{Peer, ServerSession};
use fieldarm::sim::meca500::{Controller, RobotSettings, VirtualRobot};
use fieldarm::text_device::TextDevice;
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::meca500::text::{Message, TextCommandSpec};

use crate::choices::Choices;

const MONITORS: usize = 3;
/// Longer than most commands, shorter than some.
const LINE: usize = 96;
/// Less than what a new connection is told, now and then.
const OUT: usize = 4_096;

/// A session, its robot, and what its peers have read.
pub(crate) struct Surrounded {
    session: ServerSession<MONITORS, LINE, OUT>,
    robot: VirtualRobot,
    now: Instant,
    /// For each peer, the control connection first: what it has of a message that is not whole yet.
    read: [Vec<u8>; MONITORS + 1],
    /// Connections, commands, messages that were read, connections that the session ended.
    pub(crate) counts: [u64; 4],
}

fn index(peer: Peer) -> usize {
    match peer {
        Peer::Control => 0,
        Peer::Monitor(place) => place + 1,
    }
}

fn peer(choices: &mut Choices<'_>) -> Peer {
    match choices.below(MONITORS + 3) {
        place if place < MONITORS => Peer::Monitor(place),
        _ => Peer::Control,
    }
}

/// A line of the table with arguments that are often right.
fn line(choices: &mut Choices<'_>) -> Vec<u8> {
    let count = TextCommandSpec::all().count();
    let spec = TextCommandSpec::all().nth(choices.below(count)).expect("it is below the count");
    let mut line = String::from(choices.pick(&["", "", "-", " "]));
    line.push_str(spec.name);
    line.push_str(choices.pick(&["(", "(", "(", "", "(("]));
    for position in 0..choices.pick(&[spec.arguments().count(), 1, 0]) {
        let comma = if position > 0 { "," } else { "" };
        let argument =
            choices.pick(&["0", "1", "10", "-1", "0.5", "vars.a", "*vars.b", "a", "[1,2]"]);
        line.push_str(comma);
        line.push_str(argument);
    }
    line.push_str(choices.pick(&[")", ")", ")", ""]));
    line.push_str(choices.pick(&["\0", "\n", "\r\n", "\0", ""]));
    line.into_bytes()
}

impl Surrounded {
    pub(crate) fn new() -> Self {
        Self {
            session: ServerSession::new(),
            robot: VirtualRobot::new(RobotSettings::default()),
            now: Instant::ZERO,
            read: Default::default(),
            counts: [0; 4],
        }
    }

    /// Does what the bytes say, one thing after the other.
    pub(crate) fn obey(&mut self, bytes: &[u8]) {
        let mut choices = Choices::new(bytes);
        while let Some(choice) = choices.next() {
            self.act(choice, &mut choices);
            self.look();
        }
    }

    fn act(&mut self, choice: u8, choices: &mut Choices<'_>) {
        let Self { session, robot, now, .. } = self;
        match choice % 16 {
            0 => self.open(Peer::Control),
            1 => self.open(Peer::Monitor(0)),
            2 if choices.one_in(4) => {
                let peer = peer(choices);
                session.closed(*now, robot, peer);
                self.read[index(peer)].clear();
            }
            3 => {
                let bytes = choices.some(200);
                session.receive(*now, robot, peer(choices), bytes);
            }
            4..=8 => {
                let line = line(choices);
                session.receive(*now, robot, Peer::Control, &line);
            }
            9 => {
                let mut bytes = choices.some(200);
                // As a link does that has nowhere to send what waits.
                for _ in 0..4 {
                    if !session.receive_some(*now, robot, Peer::Control, &mut bytes) {
                        break;
                    }
                }
            }
            10 | 11 => {
                *now += Duration::from_micros(u64::from(choices.word()) * 16);
                session.advance(*now, robot);
            }
            12 => {
                let count = choices.word().into();
                self.read(peer(choices), count);
            }
            13 => {
                for peer in [Peer::Control, Peer::Monitor(0), Peer::Monitor(1), Peer::Monitor(2)] {
                    self.read(peer, OUT);
                }
            }
            14 => self.close_ended(),
            _ => self.press(choices),
        }
    }

    fn open(&mut self, wanted: Peer) {
        let Self { session, robot, now, .. } = self;
        let opened = match wanted {
            Peer::Control => session.accept_control(*now, robot).then_some(Peer::Control),
            Peer::Monitor(_) => session.accept_monitor(*now, robot),
        };
        if let Some(peer) = opened {
            self.read[index(peer)].clear();
            self.counts[0] += 1;
        }
    }

    /// Somebody at the cell does something.
    fn press(&mut self, choices: &mut Choices<'_>) {
        let mut panel = self.robot.panel();
        match choices.below(9) {
            0 => panel.press_e_stop(),
            1 => panel.release_e_stop(),
            2 => panel.press_p_stop2(),
            3 => panel.release_p_stop2(),
            4 => panel.switch_off(),
            5 => drop(panel.press_start()),
            6 => panel.block_joint(1 + choices.below(6), choices.one_in(2)),
            7 => panel.switch_on(),
            _ => panel.press_reset(),
        }
    }

    /// A peer reads, and looks at every whole message.
    fn read(&mut self, peer: Peer, count: usize) {
        let waiting = self.session.waiting(peer);
        let bytes = waiting[..count.min(waiting.len())].to_vec();
        self.session.sent(peer, bytes.len());
        let held = &mut self.read[index(peer)];
        held.extend(bytes);
        while let Some(end) = held.iter().position(|byte| *byte == 0) {
            let message: Vec<u8> = held.drain(..=end).collect();
            let text = std::str::from_utf8(&message[..end]).expect("messages are text");
            assert!(text.bytes().all(|byte| matches!(byte, b' '..=b'~' | b'\t')), "{text:?}");
            assert!(Message::parse(text).is_ok(), "{text:?}");
            self.counts[2] += 1;
        }
    }

    fn close_ended(&mut self) {
        for _ in 0..=MONITORS {
            let Some((peer, _)) = self.session.next_to_close() else { return };
            self.read(peer, OUT);
            // What was promised to it is whole to the end.
            assert!(self.session.waiting(peer).is_empty() && self.read[index(peer)].is_empty());
            self.session.closed(self.now, &mut self.robot, peer);
            self.counts[3] += 1;
        }
        assert_eq!(self.session.next_to_close(), None);
    }

    /// What must hold at any time.
    fn look(&mut self) {
        let peers: Vec<Peer> = self.session.peers().collect();
        assert!(peers.len() <= MONITORS + 1);
        let ended = self.session.next_to_close().map(|(peer, _)| peer);
        let controls = peers.contains(&Peer::Control) && ended != Some(Peer::Control);
        assert_eq!(self.robot.controller() == Some(Controller::Text), controls);
        for peer in [Peer::Control, Peer::Monitor(0), Peer::Monitor(1), Peer::Monitor(2)] {
            let waiting = self.session.waiting(peer);
            assert!(waiting.len() <= OUT && (waiting.is_empty() || waiting.ends_with(&[0])));
            assert!(waiting.is_empty() || peers.contains(&peer));
        }
        let joints = self.robot.target_joints();
        assert!(joints.iter().all(|joint| joint.is_finite()), "{joints:?}");
        self.counts[1] = self.session.counts().commands;
        assert!(!self.robot.drops_control() || !controls);
    }
}
