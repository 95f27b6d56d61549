//! `loss.svg`: how a training went.

use crate::checkpoint::LossRow;
use plotters::prelude::*;

const SIZE: (u32, u32) = (760, 460);
const FONT: (&str, u32) = ("sans-serif", 15);
/// Colours that are told apart by everybody (Okabe and Ito 2008).
const TRAINING: RGBColor = RGBColor(0, 114, 178);
const VALIDATION: RGBColor = RGBColor(213, 94, 0);
const ROLLOUT: RGBColor = RGBColor(0, 158, 115);

/// The curves as the text of an SVG file, on a logarithmic axis: losses, and the rollout's error
/// in metres where it was measured. `None` where there is nothing to draw.
pub fn svg(rows: &[LossRow]) -> Option<String> {
    let curve = |value: &dyn Fn(&LossRow) -> Option<f64>| -> Vec<(f64, f64)> {
        let point = |row: &LossRow| Some((row.step as f64, value(row)?));
        rows.iter().filter_map(point).filter(|(_, y)| y.is_finite() && *y > 0.0).collect()
    };
    let curves = [
        ("training loss", TRAINING, curve(&|row| Some(row.train))),
        ("validation loss", VALIDATION, curve(&|row| Some(row.validation))),
        ("roll-out: end effector [m]", ROLLOUT, curve(&|row| Some(row.rollout?.mean_m))),
    ];
    let heights = || curves.iter().flat_map(|(_, _, points)| points).map(|(_, y)| *y);
    let (low, high) = (heights().fold(f64::MAX, f64::min), heights().fold(0.0, f64::max));
    let last = rows.last()?.step as f64;
    if low > high {
        return None;
    }
    let mut text = String::new();
    draw(&mut text, &curves, last, 0.8 * low..1.25 * high).ok()?;
    Some(text)
}

/// Name, colour and points of a curve.
type Curve = (&'static str, RGBColor, Vec<(f64, f64)>);

fn draw(
    text: &mut String,
    curves: &[Curve],
    last: f64,
    heights: core::ops::Range<f64>,
) -> Result<(), DrawingAreaErrorKind<std::io::Error>> {
    let area = SVGBackend::with_string(text, SIZE).into_drawing_area();
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&area)
        .margin(12)
        .x_label_area_size(44)
        .y_label_area_size(64)
        .build_cartesian_2d(0.0..last, heights.log_scale())?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.1))
        .x_desc("optimiser steps")
        .y_label_formatter(&|y| format!("{y:.3}"))
        .label_style(FONT)
        .draw()?;
    for (name, colour, points) in curves.iter().filter(|(_, _, points)| !points.is_empty()) {
        let colour = *colour;
        chart
            .draw_series(LineSeries::new(points.iter().copied(), colour.stroke_width(2)))?
            .label(*name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
    }
    chart
        .configure_series_labels()
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK.mix(0.3))
        .label_font(FONT)
        .position(SeriesLabelPosition::UpperRight)
        .draw()?;
    area.present()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_are_drawn_where_there_are_any() {
        assert_eq!(svg(&[]), None);
        let row = |step, train| LossRow { step, train, validation: 0.1, ..LossRow::default() };
        let text = svg(&[row(1, 1.0), row(2, f64::NAN), row(3, 0.3)]).unwrap();
        assert!(text.starts_with("<svg") && text.contains("validation loss"));
        assert!(!text.contains("roll-out"));
    }
}
