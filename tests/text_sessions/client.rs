//! The PC's end of the text interface among robots that obey a string of bytes: right, nearly right or
//! nonsense.

use std::collections::BTreeSet;

use fieldarm::bus::text::client::{
    ClientSession, ClientSettings, Incoming, Outcome, Phase, RequestId, SubmitError,
};
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::meca500::text::TextCommandSpec;

use crate::choices::Choices;

const PENDING: usize = 6;
const OUT: usize = 512;

/// A session and what is known of its requests.
pub(crate) struct Surrounded {
    session: ClientSession<PENDING, OUT>,
    now: Instant,
    /// Requests that neither ended nor were given up with their connection.
    open: BTreeSet<u64>,
    last: u64,
    /// What it sent and is not a whole line yet.
    sent: Vec<u8>,
    /// Requests, those that ended, messages, connections.
    pub(crate) counts: [u64; 4],
}

impl Surrounded {
    pub(crate) fn new() -> Self {
        let watchdog = Some(Duration::from_millis(500));
        let settings = ClientSettings { watchdog, ..ClientSettings::default() };
        Self {
            session: ClientSession::new(settings),
            now: Instant::ZERO,
            open: BTreeSet::new(),
            last: 0,
            sent: Vec::new(),
            counts: [0; 4],
        }
    }

    /// Does what the bytes say, one thing after the other.
    pub(crate) fn obey(&mut self, bytes: &[u8]) {
        let mut choices = Choices::new(bytes);
        while let Some(choice) = choices.next() {
            match choice % 16 {
                0 if choices.one_in(4) => self.connect(),
                1 if choices.one_in(8) => self.disconnect(),
                0 | 1 => self.hear(b"[3000][Connected to Meca500 R4 v11.3.84]\0"),
                2..=5 => self.submit(&mut choices),
                6 => {
                    let result = self.session.submit_sync();
                    self.submitted(result);
                }
                7..=10 => {
                    let message = message(&mut choices);
                    self.hear(message.as_bytes());
                }
                11 => self.hear(choices.some(200)),
                12 => self.read(choices.word().into()),
                13 => {
                    self.now += Duration::from_millis(choices.word().into());
                    if let Some(next) = self.session.advance(self.now) {
                        assert!(self.session.phase() == Phase::Ready && next >= self.now);
                    }
                }
                14 => self.read(OUT),
                _ => {
                    let _ = self.session.is_silent(self.now);
                }
            }
            self.look();
        }
    }

    pub(crate) fn connect(&mut self) {
        self.session.connected(self.now);
        self.open.clear();
        self.sent.clear();
        self.counts[3] += 1;
    }

    fn disconnect(&mut self) {
        self.session.disconnected();
        self.open.clear();
        self.sent.clear();
        assert!(self.session.waiting().is_empty());
    }

    fn submit(&mut self, choices: &mut Choices<'_>) {
        let text: String;
        let line = if choices.one_in(8) {
            text = String::from_utf8_lossy(choices.some(60)).into_owned();
            text.as_str()
        } else {
            let count = TextCommandSpec::all().count();
            let spec = TextCommandSpec::all().nth(choices.below(count)).expect("below the count");
            let number = choices.pick(&["", "1", "2", "3", "a,b"]);
            text = format!("{}{}({number})", choices.pick(&["", "-"]), spec.name);
            text.as_str()
        };
        let result = self.session.submit(line);
        self.submitted(result);
    }

    fn submitted(&mut self, result: Result<RequestId, SubmitError>) {
        match result {
            Ok(RequestId(id)) => {
                assert_eq!(self.session.phase(), Phase::Ready);
                assert!(id > self.last, "numbers go up");
                self.last = id;
                self.open.insert(id);
                self.counts[0] += 1;
            }
            Err(error) => assert!(!error.to_string().is_empty()),
        }
    }

    /// The robot sends, in one piece or in two.
    fn hear(&mut self, bytes: &[u8]) {
        let (one, other) = bytes.split_at(bytes.len() / 2);
        for piece in [one, other] {
            let mut rest = piece;
            while let Some(incoming) = self.session.receive(self.now, &mut rest) {
                let Incoming::Message(received) = incoming else { continue };
                self.counts[2] += 1;
                if let Some((RequestId(id), outcome)) = received.ends {
                    assert!(self.open.remove(&id), "{id} has ended before, or never began");
                    self.counts[1] += 1;
                    if let Outcome::Refused(code) = outcome {
                        assert_eq!(code, received.message.code);
                    }
                }
                if let Some(RequestId(before)) = received.accepts_before {
                    assert!(before <= self.last);
                }
            }
            assert!(rest.is_empty());
        }
    }

    /// The network takes some of what waits: whole lines in the end, without anything in them that ends one.
    fn read(&mut self, count: usize) {
        let waiting = self.session.waiting();
        let count = count.min(waiting.len());
        self.sent.extend(&waiting[..count]);
        self.session.sent(count);
        while let Some(end) = self.sent.iter().position(|byte| *byte == 0) {
            let line: Vec<u8> = self.sent.drain(..=end).collect();
            let line = &line[..end];
            assert!(!line.is_empty() && line.iter().all(|b| matches!(b, b' '..=b'~' | b'\t')));
        }
    }

    /// What must hold at any time.
    fn look(&self) {
        let waiting = self.session.waiting();
        assert!(waiting.len() <= OUT && (waiting.is_empty() || waiting.ends_with(&[0])));
        let pending: Vec<u64> = self.session.pending().map(|id| id.0).collect();
        assert!(pending.len() <= PENDING);
        assert!(pending.is_sorted() && pending.iter().all(|id| self.open.contains(id)));
    }
}

/// A message that could be the answer to something, or nearly.
fn message(choices: &mut Choices<'_>) -> String {
    let count = TextCommandSpec::all().count();
    let spec = TextCommandSpec::all().nth(choices.below(count)).expect("below the count");
    let answers = spec.answers();
    let code = match choices.below(4) {
        0 => choices.pick(&[1000, 1001, 1003, 1005, 1011, 2097, 3030, 3040, 3001, 2007]),
        1 => choices.word() % 10_000,
        _ if answers.is_empty() => 2085,
        _ => answers[choices.below(answers.len())].0,
    };
    let content = match choices.below(4) {
        0 => choices.pick(&["1", "2", "3"]).to_owned(),
        1 => "1,2,3,4,5,6,7".to_owned(),
        2 => format!("Argument error. - Command: '{}(1)'", spec.name),
        _ => String::from_utf8_lossy(choices.some(30)).into_owned(),
    };
    format!("[{code:04}][{content}]{}", choices.pick(&["\0", "\0", "\n", ""]))
}
