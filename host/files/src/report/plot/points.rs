//! Points over two axes.

use super::{Area, Cloud, DrawResult, headed, plane, to_svg};
use crate::error::Error;
use std::ops::Range;

/// Clouds of points.
pub struct Points {
    /// Title of the plot.
    pub title: String,
    /// Quantity along the horizontal axis, with its unit.
    pub x_label: String,
    /// Quantity along the vertical axis, with its unit.
    pub y_label: String,
    /// The clouds.
    pub series: Vec<Cloud>,
}

impl Points {
    /// The plot as the text of an SVG file.
    ///
    /// # Errors
    /// Where there is nothing to draw.
    pub fn svg(&self) -> Result<String, Error> {
        let ends = |of: fn(&(f64, f64)) -> f64| {
            let all = self.series.iter().flat_map(|cloud| &cloud.points).map(of);
            all.fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), x| (low.min(x), high.max(x)))
        };
        let [x, y] = [ends(|point| point.0), ends(|point| point.1)];
        if ![x, y].iter().all(|(low, high)| low <= high && high.is_finite()) {
            return Err(Error::Plot { reason: "no numbers to draw".into() });
        }
        to_svg(&self.title, |area| self.draw(area, axis(x), axis(y)))
    }

    fn draw(&self, area: &Area<'_>, x: Range<f64>, y: Range<f64>) -> DrawResult {
        let names: Vec<_> = self.series.iter().map(Cloud::mark).collect();
        let area = headed(area, &self.title, &names)?;
        let mut chart = plane(&area, (x, y), (&self.x_label, &self.y_label))?;
        self.series.iter().try_for_each(|cloud| cloud.draw(&mut chart))
    }
}

/// An axis from zero, or from near the least number where zero is far below.
fn axis((low, high): (f64, f64)) -> Range<f64> {
    let room = 0.05 * (high - low);
    let low = if 2.0 * low > high { low - room.max(1e-3 * low) } else { 0.0 };
    low..if high > 0.0 { high + (0.05 * (high - low)) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(points: &[(f64, f64)], is_crossed: bool) -> Result<String, Error> {
        Points {
            title: "Iterations".into(),
            x_label: "iterations".into(),
            y_label: "ms".into(),
            series: vec![Cloud {
                name: "model".into(),
                colour: 0,
                is_crossed,
                points: points.into(),
            }],
        }
        .svg()
    }

    #[test]
    fn points_hold_what_they_were_given() {
        let points = [(3.0, 8.0), (14.0, 30.0)];
        let svg = plot(&points, false).unwrap();
        assert!(svg.contains("model") && svg.contains("<circle"));
        assert!(!plot(&points, true).unwrap().contains("<circle"));
        assert!(plot(&[(5.0, 0.0)], true).is_ok());
        assert_eq!(plot(&[], false).unwrap_err().to_string(), "plot: no numbers to draw");
        assert!(plot(&[(1.0, f64::INFINITY)], false).is_err());
    }

    #[test]
    fn an_axis_begins_at_zero_where_that_is_near() {
        assert_eq!(axis((0.0, 0.0)), 0.0..1.0);
        assert_eq!(axis((1.0, 4.0)), 0.0..4.2);
        assert_eq!(axis((10.0, 12.0)).start, 9.9);
    }
}
