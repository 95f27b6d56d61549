//! Plots as SVG, the same text for the same numbers.

mod bars;
mod distributions;
mod heat;
mod lines;
mod panels;
mod points;

pub use bars::Bars;
pub use distributions::Distributions;
pub use heat::Heat;
pub use lines::{Lines, Series};
pub use panels::{Outline, Panel, Sheet};
pub use points::Points;

use crate::error::Error;
use plotters::coord::Shift;
use plotters::coord::ranged1d::Ranged;
use plotters::prelude::*;

const SIZE: (u32, u32) = (760, 460);
const FONT: (&str, u32) = ("sans-serif", 15);
const TITLE: (&str, u32) = ("sans-serif", 19);

/// Colours that are told apart by everybody (Okabe and Ito 2008).
const COLOURS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
];

fn colour(number: usize) -> RGBColor {
    COLOURS[number % COLOURS.len()]
}

/// The area that a plot is drawn on.
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// What drawing into a string may answer.
type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

fn to_svg(draw: impl FnOnce(&Area<'_>) -> Drawn) -> Result<String, Error> {
    to_svg_of(SIZE, draw)
}

/// The same of another size.
fn to_svg_of(size: (u32, u32), draw: impl FnOnce(&Area<'_>) -> Drawn) -> Result<String, Error> {
    let mut svg = String::new();
    let drawn = {
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        area.fill(&WHITE).and_then(|()| draw(&area)).and_then(|()| area.present())
    };
    drawn.map(|()| svg).map_err(|error| Error::Plot { reason: error.to_string() })
}

/// Names of the series, in a corner.
fn draw_legend<'b, X: Ranged, Y: Ranged>(
    chart: &mut ChartContext<'b, SVGBackend<'b>, Cartesian2d<X, Y>>,
) -> Drawn {
    chart
        .configure_series_labels()
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK.mix(0.3))
        .label_font(FONT)
        .position(SeriesLabelPosition::LowerRight)
        .draw()
}
