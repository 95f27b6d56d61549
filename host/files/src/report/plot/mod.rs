//! Plots as SVG, the same text for the same numbers.

mod bars;
mod distributions;
mod heat;
mod lines;
mod panels;
mod points;
mod scatter;

pub use bars::Bars;
pub use distributions::Distributions;
pub use heat::Heat;
pub use lines::{Lines, Series};
pub use panels::{Panel, Sheet};
pub use points::Points;
pub use scatter::Scatter;

use super::page::{LOOK, escaped};
use crate::error::Error;
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use std::ops::Range;

const SIZE: (u32, u32) = (760, 460);
const FONT: (&str, u32) = ("sans-serif", 15);
const TITLE: (&str, u32) = ("sans-serif", 19);

/// Series that have a colour of their own.
const SERIES: usize = 6;
/// Ink and paper as plotters writes them.
const INK: &str = "#000000";
const PAPER: &str = "#FFFFFF";

/// Values of a colour of the look on light and on dark pages.
fn tones(name: &str) -> (&'static str, &'static str) {
    let value = LOOK.split_once(&format!("--{name}: light-dark(")).map(|(_, value)| value);
    let tones = value.and_then(|value| value.split_once(')')?.0.split_once(", "));
    tones.unwrap_or((INK, INK))
}

fn colour(number: usize) -> RGBColor {
    let (light, _) = tones(&format!("series-{}", number % SERIES + 1));
    let part = |at: usize| light.get(at..at + 2).and_then(|hex| u8::from_str_radix(hex, 16).ok());
    let [red, green, blue] = [1, 3, 5].map(|at| part(at).unwrap_or_default());
    RGBColor(red, green, blue)
}

/// Some points of one kind.
#[derive(Clone, Debug, PartialEq)]
pub struct Cloud {
    /// Name in the legend.
    pub name: String,
    /// Index of its colour.
    pub colour: usize,
    /// Whether its points are crosses, not dots.
    pub is_crossed: bool,
    /// Its points.
    pub points: Vec<(f64, f64)>,
}

impl Cloud {
    fn colour(&self) -> RGBColor {
        colour(self.colour)
    }

    fn mark(&self) -> (&str, Mark) {
        let mark = if self.is_crossed { Mark::Cross } else { Mark::Dot };
        (&self.name, mark(self.colour()))
    }

    fn draw(&self, chart: &mut Chart<'_, '_>) -> DrawResult {
        let (colour, points) = (self.colour(), self.points.iter());
        if self.is_crossed {
            let style = colour.stroke_width(2);
            chart.draw_series(points.map(|point| Cross::new(*point, 4, style)))?;
        } else {
            let style = colour.mix(0.75).filled();
            chart.draw_series(points.map(|point| Circle::new(*point, 3, style)))?;
        }
        Ok(())
    }
}

/// A chart of numbers over numbers.
type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// Draws the axes of a chart with their ranges and labels.
fn plane<'a, 'b>(
    area: &'a Area<'b>,
    (x, y): (Range<f64>, Range<f64>),
    (x_label, y_label): (&str, &str),
) -> Result<Chart<'a, 'b>, DrawingAreaErrorKind<std::io::Error>> {
    let mut chart = ChartBuilder::on(area)
        .margin(12)
        .x_label_area_size(44)
        .y_label_area_size(64)
        .build_cartesian_2d(x, y)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.1))
        .x_desc(x_label)
        .y_desc(y_label)
        .label_style(FONT)
        .draw()?;
    Ok(chart)
}

/// The area that a plot is drawn on.
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Result of drawing into a string.
type DrawResult = Result<(), DrawingAreaErrorKind<std::io::Error>>;

/// Style that gives ink, paper and series the colours of the look, light and dark.
fn style() -> String {
    let ((text, dark_text), (card, dark_card)) = (tones("text"), tones("card"));
    let base = |text: &str, card: &str| {
        format!(
            "rect[fill=\"{PAPER}\"]{{fill:{card}}}[fill=\"{INK}\"]{{fill:{text}}}\
             [stroke=\"{INK}\"]{{stroke:{text}}}"
        )
    };
    let series = (1..=SERIES).map(|number| tones(&format!("series-{number}")));
    let series: String = series
        .map(|(light, dark)| {
            let light = light.to_uppercase();
            format!("[fill=\"{light}\"]{{fill:{dark}}}[stroke=\"{light}\"]{{stroke:{dark}}}")
        })
        .collect();
    format!(
        "<style>text{{font-family:system-ui,sans-serif}}{}@media (prefers-color-scheme:dark){{{}{series}}}</style>",
        base(text, card),
        base(dark_text, dark_card)
    )
}

fn to_svg(title: &str, draw: impl FnOnce(&Area<'_>) -> DrawResult) -> Result<String, Error> {
    to_svg_of(SIZE, title, draw)
}

/// Draws a plot of this size as SVG with a title and a style.
fn to_svg_of(
    size: (u32, u32),
    title: &str,
    draw: impl FnOnce(&Area<'_>) -> DrawResult,
) -> Result<String, Error> {
    let mut svg = String::new();
    let drawn = {
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        area.fill(&WHITE).and_then(|()| draw(&area)).and_then(|()| area.present())
    };
    drawn.map_err(|error| Error::Plot { reason: error.to_string() })?;
    // Plotters writes neither the document's title nor a style.
    let (head, body) = svg.split_at(svg.find('>').map_or(0, |at| at + 1));
    let title = escaped(title);
    Ok(format!("{head}\n<title>{title}</title>\n{}{body}", style()))
}

/// How a series is drawn, for the legend.
#[derive(Clone, Copy)]
enum Mark {
    Line(RGBColor),
    Dashed,
    Dot(RGBColor),
    Cross(RGBColor),
    Patch(RGBColor),
}

/// Names a row of a legend.
const NAMES: usize = 3;

/// Draws title and legend; the plot's place is below them, so that no name hides a curve.
fn headed<'a>(
    area: &Area<'a>,
    title: &str,
    names: &[(&str, Mark)],
) -> Result<Area<'a>, DrawingAreaErrorKind<std::io::Error>> {
    let (head, below) = area.split_vertically(34 + 20 * names.len().div_ceil(NAMES) as u32);
    head.draw(&Text::new(title.to_string(), (12, 12), TITLE))?;
    for (i, (name, mark)) in names.iter().enumerate() {
        let (x, y) = (14 + 245 * (i % NAMES) as i32, 40 + 20 * (i / NAMES) as i32);
        let line = [(x, y + 6), (x + 12, y + 6)];
        match *mark {
            Mark::Patch(colour) => {
                head.draw(&Rectangle::new([(x, y), (x + 12, y + 12)], colour.filled()))?;
            }
            Mark::Dot(colour) => head.draw(&Circle::new((x + 6, y + 6), 4, colour.filled()))?,
            Mark::Cross(colour) => {
                head.draw(&Cross::new((x + 6, y + 6), 4, colour.stroke_width(2)))?;
            }
            Mark::Line(colour) => head.draw(&PathElement::new(line, colour.stroke_width(3)))?,
            Mark::Dashed => {
                head.draw(&PathElement::new([line[0], (x + 5, y + 6)], BLACK.stroke_width(1)))?;
                head.draw(&PathElement::new([(x + 8, y + 6), line[1]], BLACK.stroke_width(1)))?;
            }
        }
        head.draw(&Text::new(name.to_string(), (x + 18, y - 1), FONT))?;
    }
    Ok(below)
}

/// A number at an axis: nine digits hide errors of rounding, and zero has no sign.
pub fn tick_label(x: f64) -> String {
    let rounded = format!("{x:.8e}").parse().unwrap_or(x);
    if x.abs() < 1e-10 { "0".into() } else { format!("{rounded}") }
}

/// Where a logarithmic axis is labelled: once, twice and five times the powers of ten; every digit
/// where these would be few.
fn ticks(left: f64, right: f64) -> Vec<f64> {
    let powers = left.log10().floor() as i32..=right.log10().ceil() as i32;
    let of = |digits: &[f64]| -> Vec<f64> {
        let all = powers.clone().flat_map(|power| {
            digits.iter().map(move |digit| match power {
                0.. => digit * 10_f64.powi(power),
                _ => digit / 10_f64.powi(-power),
            })
        });
        all.filter(|x| (left..=right).contains(x)).collect()
    };
    match of(&[1.0, 2.0, 5.0]) {
        few if few.len() < 3 => of(&[1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]),
        enough => enough,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_at_an_axis_are_short() {
        let shown = [-0.0, -1e-17, 0.1 + 0.2, -0.05, 1200.0, 1e-6].map(tick_label);
        assert_eq!(shown, ["0", "0", "0.3", "-0.05", "1200", "0.000001"]);
    }

    #[test]
    fn a_logarithmic_axis_has_labels_however_short() {
        assert_eq!(ticks(0.9, 110.0), [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0]);
        assert_eq!(ticks(0.02, 0.3), [0.02, 0.05, 0.1, 0.2]);
        assert_eq!(ticks(2.2, 7.5), [2.5, 3.0, 4.0, 5.0, 6.0, 7.0]);
    }

    #[test]
    fn colours_are_those_of_the_look() {
        assert_eq!(tones("card"), ("#ffffff", "#121920"));
        assert_eq!(colour(1), RGBColor(0xd5, 0x5e, 0x00));
        assert_eq!(colour(SERIES), colour(0));
        assert!((0..SERIES).all(|number| colour(number) != RGBColor(0, 0, 0)));
    }

    #[test]
    fn a_plot_has_a_title_and_both_inks() {
        let svg = to_svg("a < b & c", |area| area.draw(&Text::new("x", (5, 5), FONT))).unwrap();
        assert!(svg.starts_with("<svg") && svg.contains("<title>a &lt; b &amp; c</title>"));
        // The style matches the colours only in the spelling of plotters.
        assert!(svg.contains("prefers-color-scheme:dark"));
        assert!(svg.contains("fill=\"#FFFFFF\"") && svg.contains("fill=\"#000000\""), "{svg}");
        assert!(svg.contains("[fill=\"#0072B2\"]{fill:#3e9fe0}"), "{svg}");
    }
}
