//! The plots of a run, as SVG.

mod handshake;
mod joints;
mod path;
mod style;

use std::prelude::v1::*;

use crate::run::recording::Recording;

/// Why a plot could not be drawn.
type PlotError = Box<dyn std::error::Error>;

/// Every plot with the name of its file; `program` is what their titles call it.
pub(super) fn all(
    program: &str,
    recording: &Recording,
) -> [(&'static str, Result<String, PlotError>); 3] {
    [
        ("joints.svg", joints::draw(program, recording)),
        ("path.svg", path::draw(program, recording)),
        ("handshake.svg", handshake::draw(program, recording)),
    ]
}
