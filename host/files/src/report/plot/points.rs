//! Points over two axes.

use super::{Area, DrawResult, FONT, Mark, colour, headed, to_svg};
use crate::error::Error;
use plotters::prelude::*;

/// Clouds of points.
pub struct Points {
    /// Title of the plot.
    pub title: String,
    /// Quantity along the horizontal axis, with its unit.
    pub x_label: String,
    /// Quantity along the vertical axis, with its unit.
    pub y_label: String,
    /// Names of the clouds and their points.
    pub series: Vec<(String, Vec<(f64, f64)>)>,
}

impl Points {
    /// The plot as the text of an SVG file.
    ///
    /// # Errors
    /// Where there is nothing to draw.
    pub fn svg(&self) -> Result<String, Error> {
        let largest = |of: fn(&(f64, f64)) -> f64| {
            let all = self.series.iter().flat_map(|(_, points)| points).map(of);
            all.fold(0.0, f64::max)
        };
        let [right, top] = [largest(|point| point.0), largest(|point| point.1)];
        if !(right > 0.0 && top > 0.0 && right.is_finite() && top.is_finite()) {
            return Err(Error::Plot { reason: "no positive numbers to draw".into() });
        }
        to_svg(&self.title, |area| self.draw(area, 1.05 * right, 1.05 * top))
    }

    fn draw(&self, area: &Area<'_>, right: f64, top: f64) -> DrawResult {
        let series = self.series.iter().enumerate();
        let names: Vec<_> =
            series.map(|(i, (name, _))| (name.as_str(), Mark::Dot(colour(i)))).collect();
        let area = headed(area, &self.title, &names)?;
        let mut chart = ChartBuilder::on(&area)
            .margin(12)
            .x_label_area_size(44)
            .y_label_area_size(64)
            .build_cartesian_2d(0.0..right, 0.0..top)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(BLACK.mix(0.1))
            .x_desc(&self.x_label)
            .y_desc(&self.y_label)
            .label_style(FONT)
            .draw()?;
        for (number, (_, points)) in self.series.iter().enumerate() {
            let colour = colour(number);
            let dots = points.iter().map(|point| Circle::new(*point, 2, colour.mix(0.5).filled()));
            chart.draw_series(dots)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(points: &[(f64, f64)]) -> Result<String, Error> {
        Points {
            title: "Iterations".into(),
            x_label: "iterations".into(),
            y_label: "ms".into(),
            series: vec![("model".into(), points.into())],
        }
        .svg()
    }

    #[test]
    fn points_hold_what_they_were_given() {
        let svg = plot(&[(3.0, 8.0), (14.0, 30.0)]).unwrap();
        assert!(svg.contains("model") && svg.contains("<circle"));
        assert_eq!(plot(&[]).unwrap_err().to_string(), "plot: no positive numbers to draw");
        assert!(plot(&[(1.0, f64::INFINITY)]).is_err());
    }
}
