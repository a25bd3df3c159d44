//! How evenly EtherNet/IP frames come, ours beside those of others, in one run.
//!
//! `cargo bench --bench enip`, with `-- --quick` for a first look. On loopback addresses, without
//! root: T->O of our virtual robot beside the adapter of `ciplink`, O->T of our link beside the
//! scanner `ethernetip`, in turns, each met by the same meter, which stamps frames as they arrive.

#[path = "enip/adapters.rs"]
mod adapters;
#[path = "enip/gaps.rs"]
mod gaps;
#[path = "enip/listener.rs"]
mod listener;
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
        println!("  {:<8}{:<12}{:>10}{:>10}{:>10}{:>10}", "", "", "mean", "off by", "p50", "p99");
        let t2o = compare("T->O", &T2O, round, rounds, &mut is_whole);
        let o2t = compare("O->T", &O2T, round, rounds, &mut is_whole);
        judge(interval, t2o.first(), t2o.get(1), "T->O");
        judge(interval, o2t.first(), t2o.get(1), "O->T");
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
        let (Some(mean), Some(p50), Some(p99)) =
            (gaps.mean_us(), gaps.quantile_us(500), gaps.quantile_us(990))
        else {
            continue;
        };
        let off = (mean / (round.interval.as_secs_f64() * 1e6) - 1.0) * 100.0;
        println!(
            "  {direction:<8}{:<12}{mean:>10.1}{off:>+9.3}%{p50:>10.1}{p99:>10.1}",
            contender.name
        );
    }
    found
}

/// Says whether ours reach what they should: the API within 0.1 %, and a p99 no worse than ciplink's.
fn judge(interval: Duration, ours: Option<&Gaps>, ciplink: Option<&Gaps>, direction: &str) {
    let api_us = interval.as_secs_f64() * 1e6;
    let verdict = |reached: bool| if reached { "reached" } else { "missed" };
    if let Some(mean) = ours.and_then(Gaps::mean_us) {
        let off = (mean / api_us - 1.0).abs() * 100.0;
        println!("  {direction} mean off by at most 0.1 %: {}", verdict(off <= 0.1));
    }
    let p99 = |gaps: Option<&Gaps>| gaps.and_then(|gaps| gaps.quantile_us(990));
    if let (Some(ours), Some(theirs)) = (p99(ours), p99(ciplink)) {
        let ratio = ours / theirs;
        println!(
            "  {direction} p99 / T->O p99 of ciplink {ratio:.3}, at most 1: {}",
            verdict(ratio <= 1.0)
        );
    }
}
