//! Joints over time.

use std::prelude::v1::*;

use plotters::prelude::*;

use super::PlotError;
use super::style::{FAINT, GREY, LABEL, SERIES, TITLE, at, px, range, shown, tick};
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
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, (px(SIZE.0), px(SIZE.1))).into_drawing_area();
        root.fill(&WHITE)?;
        let root = root.margin(at(10), at(0), at(0), at(4));
        let root = root.titled(&format!("Joints over time: {program}"), TITLE)?;
        let (plot, legend) = root.split_horizontally(px(SIZE.0 - LEGEND));
        let mut chart = ChartBuilder::on(&plot)
            .margin(px(12))
            .x_label_area_size(px(48))
            .y_label_area_size(px(68))
            .build_cartesian_2d(times.start.max(0.0)..times.end, degrees)?;
        chart
            .configure_mesh()
            .x_desc("time [s]")
            .y_desc("joint position [deg]")
            .x_label_formatter(&tick)
            .y_label_formatter(&tick)
            .axis_desc_style(LABEL)
            .label_style(LABEL)
            .axis_style(GREY.stroke_width(px(1)))
            .bold_line_style(FAINT.stroke_width(px(1)))
            .set_all_tick_mark_size(px(4))
            .light_line_style(TRANSPARENT)
            .draw()?;
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
        root.present()?;
    }
    Ok(shown(&svg, SIZE))
}
