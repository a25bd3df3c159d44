//! The table of a case, and the targets.

use crate::beat::Figures;
use crate::rounds::{Case, Contender, Outcome};

/// A figure that is to be reached.
struct Target {
    what: &'static str,
    of: Contender,
    to: Contender,
    per_mille: usize,
    at_most: f64,
}

/// The targets, for a cycle of 1 ms.
const TARGETS: [Target; 5] = [
    target("ours / raw, p50", Contender::Raw, 500, 1.3),
    target("ours / stock, p50", Contender::Stock, 500, 0.5),
    target("ours / stock, p99", Contender::Stock, 990, 0.5),
    target("ours / pysoem, p50", Contender::Pysoem, 500, 1.0),
    target("ours / pysoem, p99", Contender::Pysoem, 990, 1.0),
];

const fn target(what: &'static str, to: Contender, per_mille: usize, at_most: f64) -> Target {
    Target { what, of: Contender::Ours, to, per_mille, at_most }
}

/// The value below which so many of 1000 sorted values lie, in us.
fn quantile(sorted_ns: &[u64], per_mille: usize) -> Option<f64> {
    let at = (sorted_ns.len() * per_mille / 1000).min(sorted_ns.len().checked_sub(1)?);
    sorted_ns.get(at).map(|&ns| ns as f64 / 1e3)
}

fn shown(figure: Option<f64>, decimals: usize) -> String {
    figure.map_or_else(|| "-".into(), |figure| format!("{figure:.decimals$}"))
}

/// Prints what came of a case.
pub(crate) fn print(case: Case, outcome: &mut Outcome) {
    let cycles = case.beat.cycles;
    println!(
        "\n{} at {} us, {} rounds of {cycles} cycles each",
        robots(case.robots),
        case.beat.period.as_micros(),
        case.rounds
    );
    print_budget(case, outcome);
    for figures in outcome.figures.values_mut() {
        figures.exchange_ns.sort_unstable();
        figures.engine_ns.sort_unstable();
    }
    println!(
        "  {:<10}{:>9}{:>9}{:>9}{:>12}{:>12}{:>10}{:>7}{:>13}",
        "us", "p50", "p99", "p99.9", "engine p50", "engine p99", "overruns", "lost", "allocations"
    );
    for contender in Contender::ALL {
        if let Some(figures) = outcome.figures.get(&contender) {
            print_row(contender, figures);
        }
    }
    for Target { what, of, to, per_mille, at_most } in TARGETS {
        let value = |contender| quantile(&outcome.figures.get(contender)?.exchange_ns, per_mille);
        let (Some(of), Some(to)) = (value(&of), value(&to)) else { continue };
        let ratio = of / to;
        let verdict = if ratio <= at_most { "reached" } else { "missed" };
        let verdict = if case.beat.period.as_micros() == 1000 { verdict } else { "for 1 ms" };
        print!("  {what:<20}{ratio:>6.2}   at most {at_most:.1}: {verdict}");
        // What the kernel and the robots alone take of the other's time: nobody gets below.
        match value(&Contender::Raw).map(|raw| raw / to) {
            Some(floor) if floor < 1.0 => println!(" (raw itself {floor:.2})"),
            _ => println!(),
        }
    }
    for mishap in &outcome.mishaps {
        println!("  failed in a round: {mishap}");
    }
}

fn robots(count: usize) -> String {
    if count == 1 { "1 robot".into() } else { format!("{count} robots") }
}

fn print_budget(case: Case, outcome: &Outcome) {
    let datagrams = outcome.frame.datagrams();
    let (Some((process_data, others)), bytes) =
        (datagrams.split_first(), outcome.frame.wire_bytes())
    else {
        return;
    };
    let us = outcome.frame.wire_us();
    let share = us / case.beat.period.as_micros() as f64 * 100.0;
    println!(
        "  wire budget at 100 Mbit/s: LRW of {process_data} and {} more datagrams, {bytes} bytes, \
         {us:.1} us, {share:.1} % of the cycle",
        others.len()
    );
}

fn print_row(contender: Contender, figures: &Figures) {
    let exchange = |per_mille| shown(quantile(&figures.exchange_ns, per_mille), 1);
    let engine = |per_mille| shown(quantile(&figures.engine_ns, per_mille), 2);
    let cycles = figures.exchange_ns.len() as f64;
    let allocations = figures.allocations.map(|count| count as f64 / cycles);
    println!(
        "  {:<10}{:>9}{:>9}{:>9}{:>12}{:>12}{:>10}{:>7}{:>13}",
        contender.name(),
        exchange(500),
        exchange(990),
        exchange(999),
        engine(500),
        engine(990),
        figures.overruns,
        figures.lost,
        shown(allocations, 2)
    );
}
