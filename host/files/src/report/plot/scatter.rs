//! Points about an origin, to scale, with circles and ellipses.

use super::{Area, Cloud, DrawResult, Mark, headed, plane, to_svg_of};
use crate::error::Error;
use plotters::prelude::*;

/// Clouds of points about an origin: where shots land.
pub struct Scatter {
    /// Title of the plot.
    pub title: String,
    /// Quantities along the two axes, with their unit.
    pub axes: (String, String),
    /// The clouds.
    pub series: Vec<Cloud>,
    /// Name and radius of a circle about the origin.
    pub circle: Option<(String, f64)>,
    /// Whether each cloud gets the ellipse of two standard deviations about its mean.
    pub ellipses: bool,
}

const SIZE: (u32, u32) = (620, 660);
const CORNERS: usize = 90;

impl Scatter {
    /// The plot as the text of an SVG file.
    ///
    /// # Errors
    /// Where there is nothing to draw.
    pub fn svg(&self) -> Result<String, Error> {
        let points = self.series.iter().flat_map(|cloud| &cloud.points);
        let far = points.fold(0.0, |far: f64, (x, y)| far.max(x.abs()).max(y.abs()));
        let far = self.circle.as_ref().map_or(far, |(_, radius)| far.max(*radius)) * 1.08;
        if !(far > 0.0 && far.is_finite()) {
            return Err(Error::Plot { reason: "no points to draw".into() });
        }
        to_svg_of(SIZE, &self.title, |area| self.draw(area, far))
    }

    fn draw(&self, area: &Area<'_>, far: f64) -> DrawResult {
        let mut names: Vec<_> = self.series.iter().map(Cloud::mark).collect();
        names.extend(self.circle.iter().map(|(name, _)| (name.as_str(), Mark::Dashed)));
        let area = headed(area, &self.title, &names)?;
        let mut chart = plane(&area, (-far..far, -far..far), (&self.axes.0, &self.axes.1))?;
        for cloud in &self.series {
            cloud.draw(&mut chart)?;
            if let Some(ellipse) = self.ellipses.then(|| ellipse(&cloud.points)).flatten() {
                chart.draw_series([PathElement::new(ellipse, cloud.colour().stroke_width(2))])?;
            }
        }
        if let Some((_, radius)) = &self.circle {
            let round = |i: usize| {
                let (sin, cos) = (std::f64::consts::TAU * i as f64 / CORNERS as f64).sin_cos();
                (radius * cos, radius * sin)
            };
            let dashes = (0..CORNERS).step_by(2);
            chart.draw_series(
                dashes.map(|i| PathElement::new([round(i), round(i + 1)], BLACK.stroke_width(1))),
            )?;
        }
        Ok(())
    }
}

/// The ellipse of two standard deviations about the mean; none of fewer than three points.
fn ellipse(points: &[(f64, f64)]) -> Option<Vec<(f64, f64)>> {
    let n = points.len() as f64;
    if points.len() < 3 {
        return None;
    }
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / n;
    let (mx, my) = (mean(&|p| p.0), mean(&|p| p.1));
    let xx = mean(&|p| (p.0 - mx) * (p.0 - mx));
    let yy = mean(&|p| (p.1 - my) * (p.1 - my));
    let xy = mean(&|p| (p.0 - mx) * (p.1 - my));
    // Cholesky's factor of the covariance maps a circle to the ellipse.
    let a = xx.sqrt();
    let b = if a > 0.0 { xy / a } else { 0.0 };
    let c = (yy - b * b).max(0.0).sqrt();
    let corner = |i: usize| {
        let (sin, cos) = (std::f64::consts::TAU * i as f64 / CORNERS as f64).sin_cos();
        (mx + 2.0 * a * cos, my + 2.0 * (b * cos + c * sin))
    };
    Some((0..=CORNERS).map(corner).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ellipse_holds_two_deviations() {
        let cross = [(1.0, 0.0), (-1.0, 0.0), (0.0, 2.0), (0.0, -2.0)];
        let ellipse = ellipse(&cross).unwrap();
        let right = ellipse.iter().fold(0.0, |far: f64, p| far.max(p.0));
        let top = ellipse.iter().fold(0.0, |far: f64, p| far.max(p.1));
        assert!((right - 2.0 * 0.5_f64.sqrt()).abs() < 1e-9);
        assert!((top - 2.0 * 2.0_f64.sqrt()).abs() < 1e-2);
    }

    fn cloud(points: Vec<(f64, f64)>) -> Cloud {
        Cloud { name: "one".into(), colour: 0, is_crossed: false, points }
    }

    #[test]
    fn nothing_to_draw_is_an_error() {
        let scatter = Scatter {
            title: "a".into(),
            axes: ("x".into(), "y".into()),
            series: vec![cloud(Vec::new())],
            circle: None,
            ellipses: true,
        };
        assert!(scatter.svg().is_err());
        let series = vec![cloud(vec![(1.0, 2.0)])];
        assert!(Scatter { series, ..scatter }.svg().unwrap().contains("<svg"));
    }
}
