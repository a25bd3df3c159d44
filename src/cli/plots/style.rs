//! What the plots share: the sheet, the charts on it, colors that people with any color vision tell
//! apart, fonts, ranges.

use core::ops::Range;
use std::prelude::v1::*;

use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

use super::PlotError;

/// A part of a sheet.
pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
/// A chart on a part of a sheet.
pub(super) type Chart<'a, 'b> =
    ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// Six colors for six joints (the palette of Okabe and Ito).
pub(super) const SERIES: [RGBColor; 6] = [
    RGBColor(0x00, 0x72, 0xB2),
    RGBColor(0xE6, 0x9F, 0x00),
    RGBColor(0x00, 0x9E, 0x73),
    RGBColor(0xD5, 0x5E, 0x00),
    RGBColor(0xCC, 0x79, 0xA7),
    RGBColor(0x56, 0xB4, 0xE9),
];
/// Grid lines.
pub(super) const FAINT: RGBColor = RGBColor(0xE6, 0xE6, 0xE6);
/// Axes and secondary text.
const GREY: RGBColor = RGBColor(0x66, 0x66, 0x66);

/// The backend rounds to whole pixels, so plots are drawn this much larger and shown smaller.
const SCALE: u32 = 8;

/// A length in pixels of the plot as shown.
pub(super) const fn px(length: u32) -> u32 {
    length * SCALE
}

/// The same where the backend wants a signed number.
pub(super) const fn at(length: i32) -> i32 {
    length * SCALE.cast_signed()
}

const TITLE: (&str, u32) = ("sans-serif", px(21));
pub(super) const LABEL: (&str, u32) = ("sans-serif", px(15));

/// A sheet with a title, filled by `draw`, as SVG.
pub(super) fn sheet(
    title: &str,
    (width, height): (u32, u32),
    draw: impl FnOnce(&Area<'_>) -> Result<(), PlotError>,
) -> Result<String, PlotError> {
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, (px(width), px(height))).into_drawing_area();
        root.fill(&WHITE)?;
        let root = root.margin(at(10), at(0), at(0), at(4)).titled(title, TITLE)?;
        draw(&root)?;
        root.present()?;
    }
    // Shown at the size that was asked for.
    let drawn = format!("width=\"{}\" height=\"{}\"", px(width), px(height));
    Ok(svg.replacen(&drawn, &format!("width=\"{width}\" height=\"{height}\""), 1))
}

/// An axis of a chart: what it means, what it spans, and about how many numbers stand at it.
pub(super) struct Axis<'a> {
    pub(super) name: &'a str,
    pub(super) span: Range<f64>,
    pub(super) labels: usize,
}

/// A chart with its axes, and nothing in it yet. An empty caption takes no room.
pub(super) fn chart<'a, 'b>(
    area: &'a Area<'b>,
    caption: &str,
    x: Axis<'_>,
    y: Axis<'_>,
) -> Result<Chart<'a, 'b>, PlotError> {
    let mut builder = ChartBuilder::on(area);
    builder.margin(px(12)).x_label_area_size(px(48)).y_label_area_size(px(68));
    if !caption.is_empty() {
        builder.caption(caption, LABEL);
    }
    let mut chart = builder.build_cartesian_2d(x.span, y.span)?;
    chart
        .configure_mesh()
        .x_desc(x.name)
        .y_desc(y.name)
        .x_labels(x.labels)
        .y_labels(y.labels)
        .x_label_formatter(&tick)
        .y_label_formatter(&tick)
        .axis_desc_style(LABEL)
        .label_style(LABEL)
        .axis_style(GREY.stroke_width(px(1)))
        .bold_line_style(FAINT.stroke_width(px(1)))
        .set_all_tick_mark_size(px(4))
        .light_line_style(TRANSPARENT)
        .draw()?;
    Ok(chart)
}

/// The range of `values` with a margin; at least `least` wide, and never empty.
pub(super) fn range(values: impl Iterator<Item = f64>, least: f64) -> Range<f64> {
    let (min, max) = values
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(min, max), value| {
            (min.min(value), max.max(value))
        });
    let (min, max) = if min <= max { (min, max) } else { (0.0, 0.0) };
    let missing = (least - (max - min)).max(0.0);
    let margin = (max - min) * 0.05 + missing / 2.0;
    min - margin..max + margin
}

/// A tick label without needless digits.
fn tick(value: &f64) -> String {
    let rounded = (value * 1_000.0).round() / 1_000.0;
    // Adding zero turns -0 into 0.
    format!("{}", rounded + 0.0)
}
