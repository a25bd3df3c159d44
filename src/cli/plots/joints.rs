//! Joints over time.

use std::prelude::v1::*;

use plotters::prelude::*;

use super::PlotError;
use super::style::{FAINT, GREY, LABEL, SERIES, TITLE, range, tick};
use crate::run::recording::Recording;

const SIZE: (u32, u32) = (1_000, 520);
/// Room for the legend at the right.
const LEGEND: u32 = 110;

pub(super) fn draw(program: &str, recording: &Recording) -> Result<String, PlotError> {
    let samples = recording.samples();
    let time = |at: crate::time::Instant| at.as_nanos() as f64 * 1e-9;
    let times = range(samples.iter().map(|sample| time(sample.at)), 1e-3);
    let degrees =
        range(samples.iter().flat_map(|sample| sample.seen.joints_deg.map(f64::from)), 10.0);
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        root.fill(&WHITE)?;
        let root = root.titled(&format!("Joints over time: {program}"), TITLE)?;
        let (plot, legend) = root.split_horizontally(SIZE.0 - LEGEND);
        let mut chart = ChartBuilder::on(&plot)
            .margin(12)
            .x_label_area_size(44)
            .y_label_area_size(64)
            .build_cartesian_2d(times.start.max(0.0)..times.end, degrees)?;
        chart
            .configure_mesh()
            .x_desc("time [s]")
            .y_desc("joint position [deg]")
            .x_label_formatter(&tick)
            .y_label_formatter(&tick)
            .axis_desc_style(LABEL)
            .label_style(LABEL)
            .axis_style(GREY)
            .bold_line_style(FAINT)
            .light_line_style(TRANSPARENT)
            .draw()?;
        for (joint, color) in SERIES.iter().enumerate() {
            let points = samples.iter().filter_map(|sample| {
                let degrees = f64::from(*sample.seen.joints_deg.get(joint)?);
                Some((time(sample.at), degrees))
            });
            chart.draw_series(LineSeries::new(points, color.stroke_width(2)))?;
            let y = 40 + 26 * i32::try_from(joint).unwrap_or(0);
            legend.draw(&Rectangle::new([(4, y - 2), (28, y + 1)], color.filled()))?;
            let text = (format!("Joint {}", joint + 1), (36, y - 7));
            legend.draw(&Text::new(text.0, text.1, LABEL.into_font()))?;
        }
        root.present()?;
    }
    Ok(svg)
}
