//! Points with error bars over categories.

use super::{Area, DrawResult, FONT, Mark, colour, headed, to_svg};
use crate::error::Error;
use crate::statistics::Estimate;
use plotters::prelude::*;

/// Points with error bars over categories, such as sizes of a training set.
pub struct Lines {
    /// Title of the plot.
    pub title: String,
    /// Name of the categories along the horizontal axis.
    pub x_label: String,
    /// Quantity along the vertical axis, with its unit.
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
        to_svg(&self.title, |area| self.draw(area, 1.1 * top))
    }

    fn draw(&self, area: &Area<'_>, top: f64) -> DrawResult {
        let right = self.x.len() as f64 - 0.5;
        let reference = self.reference.iter().map(|(name, _)| (name.as_str(), Mark::Dashed));
        let series = self.series.iter().enumerate();
        let series = series.map(|(i, series)| (series.name.as_str(), Mark::Line(colour(i))));
        let names: Vec<_> = reference.chain(series).collect();
        let area = headed(area, &self.title, &names)?;
        let mut chart = ChartBuilder::on(&area)
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
        if let Some((_, Estimate { value, low, high })) = &self.reference {
            let band = Rectangle::new([(-0.5, *low), (right, *high)], BLACK.mix(0.12).filled());
            chart.draw_series([band])?;
            let ends = [(-0.5, *value), (right, *value)];
            chart.draw_series(DashedLineSeries::new(ends, 6, 4, BLACK.stroke_width(1)))?;
        }
        for (number, series) in self.series.iter().enumerate() {
            let colour = colour(number);
            // Side by side, so that no bar hides another.
            let aside = 0.05 * (number as f64 - 0.5 * (self.series.len() as f64 - 1.0));
            let at = |x: usize| x as f64 + aside;
            let line = series.points.iter().map(|(x, y)| (at(*x), y.value));
            chart.draw_series(LineSeries::new(line, colour.stroke_width(2)))?;
            chart.draw_series(series.points.iter().map(|(x, y)| {
                let Estimate { value, low, high } = *y;
                // Where an end is not known, the bar is but a point.
                let [low, high] = [low, high].map(|end| if end.is_finite() { end } else { value });
                ErrorBar::new_vertical(at(*x), low, value, high, colour.filled(), 8)
            }))?;
        }
        Ok(())
    }

    /// The category at a number of the axis; nothing between two of them.
    fn category(&self, x: f64) -> String {
        let at = x.round();
        let name = ((x - at).abs() < 1e-6 && at >= 0.0).then(|| self.x.get(at as usize));
        name.flatten().cloned().unwrap_or_default()
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
}
