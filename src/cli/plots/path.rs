//! The tool's path from three sides, in one scale.

use core::ops::Range;
use std::prelude::v1::*;

use plotters::prelude::*;

use super::PlotError;
use super::style::{Area, Axis, LABEL, SERIES, at, chart, px, range, sheet};
use crate::run::recording::Recording;

/// Three panels side by side; high enough for their plots to be square.
const SIZE: (u32, u32) = (1_320, 544);
/// The smallest span worth showing, in mm.
const LEAST_SPAN: f64 = 10.0;

/// A side to look from: which coordinates go right and up.
struct Side {
    name: &'static str,
    right: (usize, &'static str),
    up: (usize, &'static str),
}

const SIDES: [Side; 3] = [
    Side { name: "from above", right: (0, "x [mm]"), up: (1, "y [mm]") },
    Side { name: "from the right side", right: (0, "x [mm]"), up: (2, "z [mm]") },
    Side { name: "from the front", right: (1, "y [mm]"), up: (2, "z [mm]") },
];

pub(super) fn draw(program: &str, recording: &Recording) -> Result<String, PlotError> {
    let points: Vec<[f64; 3]> = recording
        .samples()
        .iter()
        .map(|sample| {
            let [x, y, z, ..] = sample.seen.pose;
            [x, y, z].map(f64::from)
        })
        .filter(|point| point.iter().all(|coordinate| coordinate.is_finite()))
        .collect();
    let spans: [Range<f64>; 3] = core::array::from_fn(|axis| {
        range(points.iter().filter_map(|point| point.get(axis).copied()), LEAST_SPAN)
    });
    // One scale for all panels: the widest span fills a panel, the others are centered.
    let widest = spans.iter().map(|span| span.end - span.start).fold(LEAST_SPAN, f64::max);
    let squares = spans.map(|span| {
        let middle = (span.start + span.end) / 2.0;
        middle - widest / 2.0..middle + widest / 2.0
    });
    sheet(&format!("Path of the tool: {program}"), SIZE, |root| {
        let mut panels = SIDES.iter().zip(root.split_evenly((1, 3)));
        panels.try_for_each(|(side, panel)| draw_side(side, &panel, &points, &squares))
    })
}

fn draw_side(
    side: &Side,
    panel: &Area<'_>,
    points: &[[f64; 3]],
    squares: &[Range<f64>; 3],
) -> Result<(), PlotError> {
    let span = |axis: usize| squares.get(axis).cloned().unwrap_or(0.0..1.0);
    let project = |point: &[f64; 3]| {
        let coordinate = |axis: usize| point.get(axis).copied().unwrap_or(0.0);
        (coordinate(side.right.0), coordinate(side.up.0))
    };
    let axis = |(axis, name)| Axis { name, span: span(axis), labels: 6 };
    let mut chart = chart(panel, side.name, axis(side.right), axis(side.up))?;
    let [blue, _, green, red, ..] = SERIES;
    chart.draw_series(LineSeries::new(points.iter().map(project), blue.stroke_width(px(2))))?;
    let ends = [(points.first(), green, "start"), (points.last(), red, "end")];
    for (point, color, name) in ends {
        let Some(point) = point else { continue };
        let point = project(point);
        chart.draw_series([Circle::new(point, px(5), color.filled())])?;
        let below = if name == "start" { -18 } else { 6 };
        let label = EmptyElement::at(point)
            + Text::new(name, (at(8), at(below)), LABEL.into_font().color(&color));
        chart.draw_series([label])?;
    }
    Ok(())
}
