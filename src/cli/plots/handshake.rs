//! The handshake: commands sent, accepted and done over the run, and MoveID cycle by cycle.

use std::prelude::v1::*;

use plotters::prelude::*;

use super::PlotError;
use super::style::{Area, Axis, Chart, FAINT, LABEL, SERIES, at, chart, px, range, sheet};
use crate::run::observation::MoveIds;
use crate::run::recording::{Recording, Sample};

const SIZE: (u32, u32) = (1_000, 760);

/// What a curve shows of a sample.
type Read<T> = fn(&Sample) -> T;

pub(super) fn draw(program: &str, recording: &Recording) -> Result<String, PlotError> {
    sheet(&format!("Handshake: {program}"), SIZE, |root| {
        if recording.first_handshakes().is_empty() {
            // The text interface has no MoveIDs.
            return draw_run(root, recording.samples());
        }
        let (upper, lower) = root.split_vertically(px(SIZE.1 / 2 - 20));
        draw_run(&upper, recording.samples())?;
        draw_first(&lower, recording.first_handshakes())
    })
}

/// Commands over the whole run.
fn draw_run(area: &Area<'_>, samples: &[Sample]) -> Result<(), PlotError> {
    let time = |sample: &Sample| sample.at.as_secs_f64();
    let times = range(samples.iter().map(time), 1e-3);
    let most = samples.last().map_or(0, |sample| sample.submitted);
    let series: [(&str, Read<u32>); 3] = [
        ("given to the engine", |sample| sample.submitted),
        ("accepted by the robot", |sample| sample.accepted),
        ("done (checkpoint reached)", |sample| sample.done),
    ];
    let commands = 0.0..f64::from(most) * 1.05 + 1.0;
    let x = Axis { name: "time [s]", span: times.start.max(0.0)..times.end, labels: 11 };
    let y = Axis { name: "commands", span: commands, labels: 11 };
    let mut chart = chart(area, "Commands over the run", x, y)?;
    for ((name, count), (color, width)) in series.iter().zip(LINES) {
        let points = samples.iter().map(|sample| (time(sample), f64::from(count(sample))));
        let line = LineSeries::new(stairs(points), color.stroke_width(px(width)));
        chart.draw_series(line)?.label(*name).legend(move |(x, y)| {
            Rectangle::new([(x, y - at(2)), (x + at(20), y + at(2))], color.filled())
        });
    }
    draw_legend(&mut chart)
}

fn ids(sample: &Sample) -> MoveIds {
    sample.seen.move_ids.unwrap_or_default()
}

/// MoveID in every cycle from the first command on.
fn draw_first(area: &Area<'_>, samples: &[Sample]) -> Result<(), PlotError> {
    let first = samples.first().map_or(0, |sample| ids(sample).sent);
    // MoveID counts up and wraps: the distance from the first one is what can be drawn.
    let distance = |move_id: u16| f64::from(move_id.wrapping_sub(first).cast_signed());
    let series: [(&str, Read<u16>); 2] = [
        ("MoveID sent", |sample| ids(sample).sent),
        ("MoveID echoed", |sample| ids(sample).echoed),
    ];
    let is_near = |value: f64| value >= -2.0;
    let values =
        samples.iter().flat_map(|sample| series.map(|(_, move_id)| distance(move_id(sample))));
    let span = range(values.filter(|value| is_near(*value)), 4.0);
    let cycles = u32::try_from(samples.len()).unwrap_or(0).max(2);
    let caption = format!(
        "MoveID in the first {} cycles (first: {first}); every other command is a checkpoint of the engine",
        samples.len()
    );
    let x = Axis { name: "cycle", span: 0.0..f64::from(cycles), labels: 11 };
    let y = Axis { name: "MoveID, counted from the first", span, labels: 11 };
    let mut chart = chart(area, &caption, x, y)?;
    for ((name, move_id), (color, width)) in series.iter().zip(LINES) {
        let points = (0_u32..)
            .zip(samples)
            .map(|(cycle, sample)| (f64::from(cycle), distance(move_id(sample))))
            .filter(|(_, value)| is_near(*value));
        let line = LineSeries::new(stairs(points), color.stroke_width(px(width)));
        chart.draw_series(line)?.label(*name).legend(move |(x, y)| {
            Rectangle::new([(x, y - at(2)), (x + at(20), y + at(2))], color.filled())
        });
    }
    draw_legend(&mut chart)
}

/// Colors and widths: where lines lie upon each other, the thicker ones below still show.
const LINES: [(RGBColor, u32); 3] = {
    let [blue, orange, green, ..] = SERIES;
    [(blue, 6), (orange, 4), (green, 2)]
};

fn draw_legend<'b: 'a, 'a>(chart: &mut Chart<'a, 'b>) -> Result<(), PlotError> {
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::LowerRight)
        .margin(at(10))
        .legend_area_size(at(30))
        .background_style(WHITE.mix(0.85))
        .border_style(FAINT.stroke_width(px(1)))
        .label_font(LABEL)
        .draw()?;
    Ok(())
}

/// The points of a line that keeps each value until the next.
fn stairs(points: impl Iterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    let mut line: Vec<(f64, f64)> = Vec::new();
    for (x, y) in points {
        match line.last() {
            // A run of equal values needs its two ends only.
            Some(&(_, before)) if before == y => {
                if let [.., (_, two_before), last] = line.as_mut_slice()
                    && *two_before == y
                {
                    *last = (x, y);
                    continue;
                }
            }
            Some(&(_, before)) => line.push((x, before)),
            None => {}
        }
        line.push((x, y));
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stairs_keep_each_value_until_the_next() {
        let points = [(0.0, 1.0), (1.0, 1.0), (2.0, 1.0), (3.0, 2.0), (4.0, 2.0)];
        let expected = [(0.0, 1.0), (2.0, 1.0), (3.0, 1.0), (3.0, 2.0), (4.0, 2.0)];
        assert_eq!(stairs(points.into_iter()), expected);
        assert_eq!(stairs(core::iter::empty()), []);
    }
}
