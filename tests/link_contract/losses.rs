//! Images that get lost, few or many, in every cycle of a handshake.

use fieldarm::cycle::InputQuality;
use fieldarm::engine::meca500::{AbortReason, Event};

use crate::cell::Cell;
use crate::checkers::End;
use crate::contract::{Ability, BusKind, Cable, cannot};

/// Cycles of a handshake in which a loss begins.
const HANDSHAKE: u64 = 8;
/// Lengths of a loss in cycles: below and above the engine's limit, and above the robot's watchdog.
const LENGTHS: [u64; 5] = [1, 2, 18, 40, 250];

fn losses(kind: impl BusKind) -> impl Iterator<Item = Cable> {
    let one_way = kind.inability(Ability::LoseOneWay).is_none();
    let all = [Cable::Out, Cable::AnswersLost, Cable::OutputsLost];
    all.into_iter().filter(move |cable| *cable == Cable::Out || one_way)
}

pub(crate) fn a_few_lost_exchanges_are_stale_and_cost_nothing(kind: impl BusKind) {
    if cannot(kind, Ability::LoseImages) {
        return;
    }
    let notices_lost_outputs = kind.inability(Ability::NoticeLostOutputs).is_none();
    let mut cell = Cell::running(kind);
    for cable in losses(kind) {
        for cycles in 1..=5 {
            let tickets: Vec<_> = (0..20).map(|_| cell.submit_next().unwrap()).collect();
            cell.steps(5);
            let inputs = cell.plc.inputs;
            cell.set_cable(cable);
            for age_cycles in 1..=cycles {
                cell.step();
                if cable == Cable::OutputsLost && !notices_lost_outputs {
                    assert_eq!(cell.plc.quality, InputQuality::Fresh, "{cell:#?}");
                    continue;
                }
                assert_eq!(cell.plc.quality, InputQuality::Stale { age_cycles }, "{cell:#?}");
                assert_eq!(cell.plc.inputs, inputs, "the last good image is kept");
            }
            cell.set_cable(Cable::In);
            cell.step();
            assert_eq!(cell.plc.quality, InputQuality::Fresh, "{cable:?}\n{cell:#?}");
            cell.finish(1_000);
            let done = |ticket| cell.plc.state(ticket).end == Some(End::Done);
            assert!(tickets.into_iter().all(done), "{cable:?} for {cycles}\n{cell:#?}");
        }
    }
    assert!(!cell.plc.saw(|event| matches!(event, Event::ConnectionLost { .. })));
    assert_eq!(cell.taken(), cell.plc.submitted.len());
}

pub(crate) fn a_loss_in_any_cycle_of_a_handshake_has_a_true_verdict(kind: impl BusKind) {
    if cannot(kind, Ability::LoseImages) {
        return;
    }
    let mut cell = Cell::running(kind);
    for cable in losses(kind) {
        for cycles in LENGTHS {
            for at in 0..HANDSHAKE {
                cell.label = format!("{kind:?}: {cable:?} after {at} cycles, for {cycles}");
                cell.steps(30);
                for _ in 0..4 {
                    cell.submit_next().unwrap();
                }
                cell.steps(at);
                cell.set_cable(cable);
                cell.steps(cycles);
                cell.set_cable(Cable::In);
                cell.finish(10_000);
                cell.bring_up();
                let next = cell.submit_next().unwrap();
                cell.finish(2_000);
                assert_eq!(cell.plc.state(next).end, Some(End::Done), "{cell:#?}");
            }
        }
    }
    assert!(cell.plc.saw(|event| matches!(event, Event::ConnectionLost { .. })));
    let lost =
        |event: &Event| matches!(event, Event::Aborted { reason: AbortReason::LinkLost, .. });
    assert!(cell.plc.saw(lost), "no loss was in time to keep a command from the robot");
}

/// The robot has the command, the PLC does not know: the moment in which a careless one sends twice.
pub(crate) fn an_answer_that_is_lost_never_doubles_its_command(kind: impl BusKind) {
    if cannot(kind, Ability::LoseOneWay) {
        return;
    }
    let mut cell = Cell::running(kind);
    let mut taken_unseen = 0;
    for cycles in LENGTHS {
        for _ in 0..3 {
            cell.label = format!("{kind:?}: no answers for {cycles} cycles");
            cell.steps(30);
            cell.set_cable(Cable::AnswersLost);
            let ticket = cell.submit_next().unwrap();
            let before = cell.taken();
            cell.steps(cycles);
            let was_taken = cell.taken() > before;
            assert!(!cell.plc.state(ticket).accepted, "nobody told the PLC\n{cell:#?}");
            cell.set_cable(Cable::In);
            cell.finish(10_000);
            if was_taken {
                taken_unseen += 1;
                let state = cell.plc.state(ticket);
                let is_true = state.accepted || state.end == Some(End::Unknown);
                assert!(is_true, "the robot took it: {state:?}\n{cell:#?}");
            }
            cell.bring_up();
        }
    }
    assert!(taken_unseen > 0, "the robot never took a command unseen");
}
