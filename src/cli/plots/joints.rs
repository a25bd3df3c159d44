//! Joints over time.

use std::prelude::v1::*;

use plotters::prelude::*;

use super::PlotError;
use super::style::{Axis, LABEL, SERIES, at, chart, px, range, sheet};
use crate::run::recording::{Recording, Sample};

const SIZE: (u32, u32) = (1_000, 520);
/// Room for the legend at the right.
const LEGEND: u32 = 110;

pub(super) fn draw(program: &str, recording: &Recording) -> Result<String, PlotError> {
    let samples = recording.samples();
    let time = |sample: &Sample| sample.at.as_secs_f64();
    let times = range(samples.iter().map(time), 1e-3);
    let degrees =
        range(samples.iter().flat_map(|sample| sample.seen.joints_deg.map(f64::from)), 10.0);
    sheet(&format!("Joints over time: {program}"), SIZE, |root| {
        let (plot, legend) = root.split_horizontally(px(SIZE.0 - LEGEND));
        let x = Axis { name: "time [s]", span: times.start.max(0.0)..times.end, labels: 11 };
        let y = Axis { name: "joint position [deg]", span: degrees, labels: 11 };
        let mut chart = chart(&plot, "", x, y)?;
        // Where lines lie upon each other, the thicker ones below still show.
        let widths = [5, 4, 4, 3, 3, 2];
        for (joint, (color, width)) in SERIES.iter().zip(widths).enumerate() {
            let points = samples.iter().filter_map(|sample| {
                let degrees = f64::from(*sample.seen.joints_deg.get(joint)?);
                Some((time(sample), degrees))
            });
            chart.draw_series(LineSeries::new(points, color.stroke_width(px(width))))?;
            let y = 40 + 26 * i32::try_from(joint).unwrap_or(0);
            let stroke = [(at(4), at(y - 2)), (at(28), at(y + 2))];
            legend.draw(&Rectangle::new(stroke, color.filled()))?;
            let name = format!("Joint {}", joint + 1);
            legend.draw(&Text::new(name, (at(36), at(y - 7)), LABEL.into_font()))?;
        }
        Ok(())
    })
}
