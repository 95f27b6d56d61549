//! Plots as SVG.

use super::statistics::Estimate;
use crate::error::Error;
use plotters::coord::Shift;
use plotters::prelude::*;

/// Points with error bars over categories, such as sizes of a training set.
pub struct Lines {
    /// What is seen.
    pub title: String,
    /// What the categories are.
    pub x_label: String,
    /// What the numbers are, with their unit.
    pub y_label: String,
    /// The categories, from left to right.
    pub x: Vec<String>,
    /// The lines.
    pub series: Vec<Series>,
    /// Something to compare with, at every category: a line with a band.
    pub reference: Option<(String, Estimate)>,
}

/// A line of [`Lines`].
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Category and number of each point.
    pub points: Vec<(usize, Estimate)>,
}

/// Cumulative distributions over a logarithmic axis.
pub struct Distributions {
    /// What is seen.
    pub title: String,
    /// What the numbers are, with their unit.
    pub x_label: String,
    /// Names and positive numbers.
    pub series: Vec<(String, Vec<f64>)>,
}

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
    let mut svg = String::new();
    let drawn = {
        let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        area.fill(&WHITE).and_then(|()| draw(&area)).and_then(|()| area.present())
    };
    drawn.map(|()| svg).map_err(|error| Error::Plot { reason: error.to_string() })
}

impl Lines {
    /// The plot as the text of an SVG file.
    ///
    /// # Errors
    /// Where there is nothing to draw.
    pub fn svg(&self) -> Result<String, Error> {
        let reference = self.reference.iter().map(|(_, estimate)| estimate);
        let points = self.series.iter().flat_map(|series| &series.points);
        let all = points.map(|(_, estimate)| estimate).chain(reference);
        let ends = all.flat_map(|estimate| [estimate.low, estimate.value, estimate.high]);
        let top = ends.filter(|x| x.is_finite()).fold(f64::MIN_POSITIVE, f64::max);
        to_svg(|area| self.draw(area, 1.1 * top))
    }

    fn draw(&self, area: &Area<'_>, top: f64) -> Drawn {
        let right = self.x.len() as f64 - 0.5;
        let mut chart = ChartBuilder::on(area)
            .caption(&self.title, TITLE)
            .margin(12)
            .x_label_area_size(44)
            .y_label_area_size(64)
            .build_cartesian_2d(-0.5..right, 0.0..top)?;
        chart
            .configure_mesh()
            .disable_x_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(BLACK.mix(0.1))
            .x_labels(2 * self.x.len() + 1)
            .x_label_formatter(&|x| self.category(*x))
            .x_desc(&self.x_label)
            .y_desc(&self.y_label)
            .label_style(FONT)
            .draw()?;
        if let Some((name, Estimate { value, low, high })) = &self.reference {
            let band = Rectangle::new([(-0.5, *low), (right, *high)], BLACK.mix(0.12).filled());
            chart.draw_series([band])?;
            chart
                .draw_series(DashedLineSeries::new(
                    [(-0.5, *value), (right, *value)],
                    6,
                    4,
                    BLACK.stroke_width(1),
                ))?
                .label(name)
                .legend(|(x, y)| PathElement::new([(x, y), (x + 18, y)], BLACK.stroke_width(1)));
        }
        for (number, series) in self.series.iter().enumerate() {
            let colour = colour(number);
            // Side by side, so that no bar hides another.
            let aside = 0.05 * (number as f64 - 0.5 * (self.series.len() as f64 - 1.0));
            let at = |x: usize| x as f64 + aside;
            let line = series.points.iter().map(|(x, y)| (at(*x), y.value));
            chart
                .draw_series(LineSeries::new(line, colour.stroke_width(2)))?
                .label(&series.name)
                .legend(move |(x, y)| {
                    PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2))
                });
            chart.draw_series(series.points.iter().map(|(x, y)| {
                let Estimate { value, low, high } = *y;
                // Where an end is not known, the bar is but a point.
                let [low, high] = [low, high].map(|end| if end.is_finite() { end } else { value });
                ErrorBar::new_vertical(at(*x), low, value, high, colour.filled(), 8)
            }))?;
        }
        chart
            .configure_series_labels()
            .background_style(WHITE.mix(0.8))
            .border_style(BLACK.mix(0.3))
            .label_font(FONT)
            .position(SeriesLabelPosition::LowerRight)
            .draw()
    }

    /// The category at a number of the axis; nothing between two of them.
    fn category(&self, x: f64) -> String {
        let at = x.round();
        let name = ((x - at).abs() < 1e-6 && at >= 0.0).then(|| self.x.get(at as usize));
        name.flatten().cloned().unwrap_or_default()
    }
}

impl Distributions {
    /// The plot as the text of an SVG file.
    ///
    /// # Errors
    /// Where there is nothing to draw.
    pub fn svg(&self) -> Result<String, Error> {
        let all = || self.series.iter().flat_map(|(_, values)| values);
        let left = all().fold(f64::INFINITY, |a, b| a.min(*b)) / 1.1;
        let right = all().fold(0.0, |a: f64, b| a.max(*b)) * 1.1;
        if !(left > 0.0 && left < right && right.is_finite()) {
            return Err(Error::Plot { reason: "no positive numbers to draw".into() });
        }
        to_svg(|area| self.draw(area, left, right))
    }

    fn draw(&self, area: &Area<'_>, left: f64, right: f64) -> Drawn {
        let mut chart = ChartBuilder::on(area)
            .caption(&self.title, TITLE)
            .margin(12)
            .x_label_area_size(44)
            .y_label_area_size(64)
            .build_cartesian_2d((left..right).log_scale(), 0.0..1.0)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(BLACK.mix(0.1))
            .x_label_formatter(&|x| format!("{}", (x * 1e6).round() / 1e6))
            .x_desc(&self.x_label)
            .y_desc("share of the plans")
            .label_style(FONT)
            .draw()?;
        for (number, (name, values)) in self.series.iter().enumerate() {
            let colour = colour(number);
            let mut sorted = values.clone();
            sorted.sort_by(f64::total_cmp);
            let steps = sorted
                .iter()
                .enumerate()
                .flat_map(|(i, x)| [i, i + 1].map(|rank| (*x, rank as f64 / values.len() as f64)));
            chart.draw_series(LineSeries::new(steps, colour.stroke_width(2)))?.label(name).legend(
                move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)),
            );
        }
        chart
            .configure_series_labels()
            .background_style(WHITE.mix(0.8))
            .border_style(BLACK.mix(0.3))
            .label_font(FONT)
            .position(SeriesLabelPosition::LowerRight)
            .draw()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimate(value: f64) -> Estimate {
        Estimate { value, low: value - 1.0, high: value + 1.0 }
    }

    fn lines() -> Lines {
        Lines {
            title: "Iterations & data".into(),
            x_label: "trajectories".into(),
            y_label: "iterations".into(),
            x: ["5k", "10k", "90k"].map(String::from).into(),
            series: vec![
                Series {
                    name: "linear".into(),
                    points: vec![(0, estimate(17.0)), (2, estimate(14.0))],
                },
                Series { name: "flow".into(), points: vec![(0, estimate(13.0))] },
            ],
            reference: Some(("heuristic".into(), estimate(18.5))),
        }
    }

    #[test]
    fn lines_hold_what_they_were_given() {
        let svg = lines().svg().unwrap();
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
        for text in ["Iterations &amp; data", "5k", "10k", "90k", "linear", "flow", "heuristic"] {
            assert!(svg.contains(text), "{text}");
        }
        assert_eq!(svg, lines().svg().unwrap());
    }

    #[test]
    fn an_estimate_without_an_interval_is_still_drawn() {
        let unknown = Estimate { value: 9.0, low: f64::NAN, high: f64::NAN };
        let mut plot = lines();
        plot.series[1].points = vec![(1, unknown)];
        plot.svg().unwrap();
    }

    #[test]
    fn distributions_need_positive_numbers() {
        let plot = |values: &[f64]| {
            let series = vec![("heuristic".into(), values.to_vec())];
            Distributions { title: "Cost".into(), x_label: "cost".into(), series }.svg()
        };
        assert!(plot(&[0.3, 0.4, 11.0]).unwrap().contains("heuristic"));
        assert!(plot(&[0.3]).is_ok());
        for nothing in [&[][..], &[0.0], &[f64::INFINITY]] {
            let error = plot(nothing).unwrap_err().to_string();
            assert_eq!(error, "plot: no positive numbers to draw");
        }
    }
}
