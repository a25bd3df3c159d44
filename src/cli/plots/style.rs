//! What the plots share: colors that people with any color vision tell apart, fonts, ranges.

use core::ops::Range;
use std::prelude::v1::*;

use plotters::style::RGBColor;

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
pub(super) const GREY: RGBColor = RGBColor(0x66, 0x66, 0x66);

/// The backend rounds to whole pixels, so plots are drawn this much larger and shown smaller.
pub(super) const SCALE: u32 = 8;

/// A length in pixels of the plot as shown.
pub(super) const fn px(length: u32) -> u32 {
    length * SCALE
}

/// The same where the backend wants a signed number.
pub(super) const fn at(length: i32) -> i32 {
    length * SCALE.cast_signed()
}

pub(super) const TITLE: (&str, u32) = ("sans-serif", px(21));
pub(super) const LABEL: (&str, u32) = ("sans-serif", px(15));

/// The drawing at the size it is shown in.
pub(super) fn shown(svg: &str, (width, height): (u32, u32)) -> String {
    let drawn = format!("width=\"{}\" height=\"{}\"", px(width), px(height));
    svg.replacen(&drawn, &format!("width=\"{width}\" height=\"{height}\""), 1)
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
pub(super) fn tick(value: &f64) -> String {
    let rounded = (value * 1_000.0).round() / 1_000.0;
    // Adding zero turns -0 into 0.
    format!("{}", rounded + 0.0)
}
