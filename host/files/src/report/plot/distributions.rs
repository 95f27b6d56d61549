//! Cumulative distributions.

use super::{Area, DrawResult, FONT, Mark, colour, headed, ticks, to_svg};
use crate::error::Error;
use plotters::prelude::*;

/// Cumulative distributions over a logarithmic axis.
pub struct Distributions {
    /// Title of the plot.
    pub title: String,
    /// Quantity along the horizontal axis, with its unit.
    pub x_label: String,
    /// Names and positive numbers.
    pub series: Vec<(String, Vec<f64>)>,
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
        to_svg(&self.title, |area| self.draw(area, left, right))
    }

    fn draw(&self, area: &Area<'_>, left: f64, right: f64) -> DrawResult {
        let series = self.series.iter().enumerate();
        let names: Vec<_> =
            series.map(|(i, (name, _))| (name.as_str(), Mark::Line(colour(i)))).collect();
        let area = headed(area, &self.title, &names)?;
        let axis = (left..right).log_scale().with_key_points(ticks(left, right));
        let mut chart = ChartBuilder::on(&area)
            .margin(12)
            .x_label_area_size(44)
            .y_label_area_size(64)
            .build_cartesian_2d(axis, 0.0..1.0)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(BLACK.mix(0.1))
            .x_label_formatter(&|x| format!("{}", (x * 1e6).round() / 1e6))
            .x_desc(&self.x_label)
            .y_desc("share")
            .label_style(FONT)
            .draw()?;
        for (number, (_, values)) in self.series.iter().enumerate() {
            let colour = colour(number);
            let mut sorted = values.clone();
            sorted.sort_by(f64::total_cmp);
            let steps = sorted
                .iter()
                .enumerate()
                .flat_map(|(i, x)| [i, i + 1].map(|rank| (*x, rank as f64 / values.len() as f64)));
            chart.draw_series(LineSeries::new(steps, colour.stroke_width(2)))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
