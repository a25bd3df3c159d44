//! How evenly EtherNet/IP frames come, ours beside those of others, in one run.
//!
//! `cargo bench --bench enip`, with `-- --quick` for a first look. On loopback addresses, without
//! root: T->O of our virtual robot beside the adapter of `ciplink`, O->T of our link beside the
//! scanner `ethernetip`, in turns. One meter a direction meets all who send in it and stamps each frame when
//! it was received; the first frames of a round are left out. The mean is that of all gaps, so it is off by
//! what was lost or sent too much; gaps themselves contain the delays of sender and meter alike.
//!
//! A machine that stalls spoils the figures of all. `ciplink` tells then: it leaves frames out that it is a
//! whole interval late for, so its mean shows how often that happened.

#[path = "enip/adapters.rs"]
mod adapters;
#[path = "enip/gaps.rs"]
mod gaps;
#[path = "enip/listener.rs"]
mod listener;
#[path = "../tests/support/python.rs"]
mod python;
#[path = "enip/scanners.rs"]
mod scanners;
#[path = "enip/target.rs"]
mod target;

use std::net::Ipv4Addr;
use std::process::ExitCode;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use fieldarm::wire::enip::parameters::TimeoutMultiplier;

use gaps::{Arrivals, Gaps};

/// The longest watchdog there is: a busy machine stalls, and rates are what is measured.
const MULTIPLIER: TimeoutMultiplier = match TimeoutMultiplier::from_factor(512) {
    Some(multiplier) => multiplier,
    None => unreachable!(),
};

/// How far a mean may be from the API.
const TOLERANCE_PERCENT: f64 = 0.1;

/// What is measured at once.
#[derive(Clone, Copy, Debug)]
struct Round {
    /// The API.
    interval: Duration,
    /// Frames that are not counted.
    warm_up: usize,
    /// Gaps that are.
    frames: usize,
}

impl Round {
    /// Far longer than the frames of a round take.
    fn limit(self) -> Duration {
        let frames = u32::try_from(self.warm_up + self.frames).unwrap_or(u32::MAX);
        self.interval * frames * 3 + Duration::from_secs(10)
    }
}

/// Who sends, and how to measure it once.
struct Contender {
    name: &'static str,
    measure: fn(Round) -> Result<Arrivals, String>,
}

const T2O: [Contender; 2] = [
    Contender { name: "fieldarm", measure: adapters::ours },
    Contender { name: "ciplink", measure: adapters::ciplink },
];
const O2T: [Contender; 2] = [
    Contender { name: "fieldarm", measure: scanners::ours },
    Contender { name: "ethernetip", measure: scanners::ethernetip },
];

/// Differs from call to call and from process to process.
fn seed() -> u64 {
    static CALLS: AtomicU32 = AtomicU32::new(0);
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let call = u64::from(CALLS.fetch_add(1, Ordering::Relaxed));
    (since.as_nanos() as u64).rotate_left(20) ^ call
}

/// A loopback address that nobody else has in this process, and hardly anybody in another.
fn address() -> Ipv4Addr {
    static CALLS: AtomicU32 = AtomicU32::new(1);
    let call = CALLS.fetch_add(1, Ordering::Relaxed);
    let [low, high, ..] = std::process::id().to_le_bytes();
    let [call, ..] = call.to_le_bytes();
    Ipv4Addr::new(127, 64 | high & 63, low, call)
}

fn main() -> ExitCode {
    let is_quick = std::env::args().any(|argument| argument == "--quick");
    let (seconds, rounds) = if is_quick { (2, 1) } else { (6, 5) };
    println!(
        "Gaps between frames that arrive, in us; {rounds} rounds of {seconds} s each, in turns."
    );
    let mut is_whole = true;
    for interval_ms in [2, 5, 10] {
        let interval = Duration::from_millis(interval_ms);
        let frames = usize::try_from(seconds * 1000 / interval_ms).unwrap_or(1);
        let round = Round { interval, warm_up: 20, frames };
        println!("\nevery {interval_ms} ms");
        let columns =
            ["mean", "off by", "p1", "p50", "p99", "max"].map(|name| format!("{name:>10}"));
        println!("{:22}{}", "", columns.concat());
        let t2o = compare("T->O", &T2O, round, rounds, &mut is_whole);
        let o2t = compare("O->T", &O2T, round, rounds, &mut is_whole);
        for (direction, ours) in [("T->O", t2o.first()), ("O->T", o2t.first())] {
            if let Some(ours) = ours {
                judge(interval, direction, ours, t2o.get(1));
            }
        }
    }
    if is_whole { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Measures all contenders in turns and prints a row for each.
fn compare(
    direction: &str,
    contenders: &[Contender],
    round: Round,
    rounds: usize,
    is_whole: &mut bool,
) -> Vec<Gaps> {
    let mut found: Vec<Gaps> = contenders.iter().map(|_| Gaps::default()).collect();
    for _ in 0..rounds {
        for (contender, gaps) in contenders.iter().zip(&mut found) {
            match (contender.measure)(round) {
                Ok(arrivals) => gaps.add(&arrivals),
                Err(reason) => {
                    println!("  {direction:<8}{:<12}{reason}", contender.name);
                    // A peer may be missing; we may not.
                    *is_whole &= contender.name != "fieldarm";
                }
            }
        }
    }
    for (contender, gaps) in contenders.iter().zip(&mut found) {
        gaps.sort();
        let (Some(mean), Some(off)) = (gaps.mean_us(), gaps.off_percent(round.interval)) else {
            continue;
        };
        print!("  {direction:<8}{:<12}{mean:>10.1}{off:>+9.3}%", contender.name);
        for per_mille in [10, 500, 990, 1000] {
            print!("{:>10.1}", gaps.quantile_us(per_mille).unwrap_or(f64::NAN));
        }
        println!();
    }
    found
}

/// Says whether ours reach what they should: the API within 0.1 %, and a p99 no worse than that of `ciplink`,
/// which only sends T->O. Where it does not hold the mean either, the machine stalled.
fn judge(interval: Duration, direction: &str, ours: &Gaps, ciplink: Option<&Gaps>) {
    let off = |gaps: &Gaps| gaps.off_percent(interval);
    if let Some(ours) = off(ours) {
        let verdict = match ciplink.and_then(off) {
            _ if ours.abs() <= TOLERANCE_PERCENT => "reached".into(),
            Some(theirs) if theirs.abs() > TOLERANCE_PERCENT => {
                format!("missed; ciplink T->O missed as well ({theirs:+.3} %)")
            }
            _ => "missed".to_owned(),
        };
        println!("  {direction} mean off by at most {TOLERANCE_PERCENT} %: {verdict}");
    }
    let p99 = |gaps: &Gaps| gaps.quantile_us(990);
    if let (Some(ours), Some(theirs)) = (p99(ours), ciplink.and_then(p99)) {
        let ratio = ours / theirs;
        let verdict = if ratio <= 1.0 { "reached" } else { "missed" };
        println!("  {direction} p99 / T->O p99 of ciplink {ratio:.3}, at most 1: {verdict}");
    }
}
