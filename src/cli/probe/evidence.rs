//! The verdict about a robot's byte order with its evidence, piece by piece.

use std::prelude::v1::*;

use serde::Serialize;
use serde_json::Value;

use crate::cli::grid::real;
use crate::engine::meca500::{Echo, OrderEvidence, OrderReading};

/// A byte order and why it is that one.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ReportedOrder {
    /// As `--byte-order` takes it; `null` when it is open.
    pub(super) verdict: Option<String>,
    /// `big` or `little`; `null` when it is open.
    pub(super) integers: Option<String>,
    /// `big` or `little`; `null` when it is open.
    pub(super) reals: Option<String>,
    pub(super) evidence: Vec<Piece>,
    /// Whether the robot understood what was asked of it in this order; `null` when nothing was asked.
    pub(super) echo: Option<ReportedEcho>,
}

/// One thing that reads differently in the two orders.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Piece {
    pub(super) what: String,
    /// Bytes on the wire, in hex; `null` for what is counted over several values.
    pub(super) bytes: Option<String>,
    /// What it reads as.
    pub(super) little: Value,
    pub(super) big: Value,
    /// The order in which alone it makes sense: `big`, `little`, or `null` when it says nothing.
    pub(super) speaks_for: Option<&'static str>,
}

/// A dynamic type that was asked for.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ReportedEcho {
    pub(super) asked: String,
    /// `big` or `little`.
    pub(super) integers: String,
    pub(super) answered: bool,
}

/// `evidence` for the report.
pub(super) fn order(evidence: &OrderEvidence) -> ReportedOrder {
    let OrderEvidence { integers, reals, ref big, ref little, echo, .. } = *evidence;
    ReportedOrder {
        verdict: evidence.verdict().map(|order| order.to_string()),
        integers: integers.map(|order| order.to_string()),
        reals: reals.map(|order| order.to_string()),
        evidence: pieces(big, little),
        echo: echo.map(|Echo { asked, integers, answered }| ReportedEcho {
            asked: asked.to_string(),
            integers: integers.to_string(),
            answered,
        }),
    }
}

fn pieces(big: &OrderReading, little: &OrderReading) -> Vec<Piece> {
    let mut pieces = vec![
        Piece {
            what: "FifoSpace".into(),
            bytes: Some(hex(&big.fifo_space.to_be_bytes())),
            little: little.fifo_space.into(),
            big: big.fifo_space.into(),
            speaks_for: alone(little.fifo_space_fits(), big.fifo_space_fits()),
        },
        Piece {
            what: "timestamp microseconds".into(),
            bytes: Some(hex(&big.microseconds.to_be_bytes())),
            little: little.microseconds.into(),
            big: big.microseconds.into(),
            speaks_for: alone(little.microseconds_fit(), big.microseconds_fit()),
        },
    ];
    // All four count; the first that is not zero is shown.
    let slot = big.dynamic_types.iter().position(|ty| ty.0 != 0).unwrap_or(0);
    if let (Some(in_big), Some(in_little)) =
        (big.dynamic_types.get(slot), little.dynamic_types.get(slot))
    {
        pieces.push(Piece {
            what: format!("type of dynamic slot {slot}"),
            bytes: Some(hex(&in_big.0.to_be_bytes())),
            little: in_little.0.into(),
            big: in_big.0.into(),
            speaks_for: alone(little.dynamic_types_fit(), big.dynamic_types_fit()),
        });
    }
    let reals = NAMES.into_iter().zip(big.reals).zip(little.reals);
    // The first that makes sense in one order only.
    let telling = reals.filter_map(|((name, in_big), in_little)| {
        let fits = OrderReading::is_sensible;
        let speaks_for = alone(fits(in_little), fits(in_big))?;
        Some(Piece {
            what: name.into(),
            bytes: Some(hex(&in_big.to_bits().to_be_bytes())),
            little: real(in_little),
            big: real(in_big),
            speaks_for: Some(speaks_for),
        })
    });
    pieces.extend(telling.take(1));
    pieces.push(Piece {
        what: "plausible of 12 target joints and pose values".into(),
        bytes: None,
        little: little.sensible_reals().into(),
        big: big.sensible_reals().into(),
        speaks_for: alone(little.has_better_reals_than(big), big.has_better_reals_than(little)),
    });
    pieces
}

/// The Reals that are looked at.
const NAMES: [&str; 12] = [
    "target joint 1",
    "target joint 2",
    "target joint 3",
    "target joint 4",
    "target joint 5",
    "target joint 6",
    "target pose x",
    "target pose y",
    "target pose z",
    "target pose alpha",
    "target pose beta",
    "target pose gamma",
];

/// The order that fits when the other does not.
fn alone(little: bool, big: bool) -> Option<&'static str> {
    match (little, big) {
        (true, false) => Some("little"),
        (false, true) => Some("big"),
        _ => None,
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" ")
}
