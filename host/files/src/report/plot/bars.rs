//! Bars made of parts.

use super::{Area, DrawResult, FONT, Mark, colour, headed, to_svg};
use crate::error::Error;
use plotters::prelude::*;

/// A bar a row, from left to right its parts, each in its own colour.
pub struct Bars {
    /// Title of the plot.
    pub title: String,
    /// Quantity along the horizontal axis, with its unit.
    pub x_label: String,
    /// Names of the parts, in the order of the bars' parts.
    pub parts: Vec<String>,
    /// Names of the bars, from the top, and the size of each of their parts.
    pub bars: Vec<(String, Vec<f64>)>,
}

impl Bars {
    /// The plot as the text of an SVG file.
    ///
    /// # Errors
    /// Where there is nothing to draw.
    pub fn svg(&self) -> Result<String, Error> {
        let lengths = self.bars.iter().map(|(_, parts)| parts.iter().sum::<f64>());
        let longest = lengths.fold(0.0, f64::max);
        if !(longest > 0.0 && longest.is_finite()) {
            return Err(Error::Plot { reason: "no bar has a length".into() });
        }
        to_svg(&self.title, |area| self.draw(area, 1.03 * longest))
    }

    fn draw(&self, area: &Area<'_>, longest: f64) -> DrawResult {
        let parts = self.parts.iter().enumerate();
        let parts: Vec<_> =
            parts.map(|(i, name)| (name.as_str(), Mark::Patch(colour(i)))).collect();
        let area = headed(area, &self.title, &parts)?;
        let bottom = self.bars.len() as f64 - 0.5;
        let mut chart = ChartBuilder::on(&area)
            .margin(12)
            .x_label_area_size(44)
            .y_label_area_size(130)
            .build_cartesian_2d(0.0..longest, bottom..-0.5)?;
        chart
            .configure_mesh()
            .disable_y_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(BLACK.mix(0.1))
            .y_labels(2 * self.bars.len() + 1)
            .y_label_formatter(&|y| self.name(*y))
            .x_desc(&self.x_label)
            .label_style(FONT)
            .draw()?;
        for (row, (_, parts)) in self.bars.iter().enumerate() {
            let mut from = 0.0;
            for (i, size) in parts.iter().enumerate() {
                let corners = [(from, row as f64 - 0.32), (from + size, row as f64 + 0.32)];
                chart.draw_series([Rectangle::new(corners, colour(i).filled())])?;
                from += size;
            }
        }
        Ok(())
    }

    /// The bar at a number of the axis; nothing between two of them.
    fn name(&self, y: f64) -> String {
        let at = y.round();
        let bar = ((y - at).abs() < 1e-6 && at >= 0.0).then(|| self.bars.get(at as usize));
        bar.flatten().map(|(name, _)| name.clone()).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bars(sizes: &[f64]) -> Result<String, Error> {
        Bars {
            title: "Memory & code".into(),
            x_label: "KiB".into(),
            parts: ["code", "constants"].map(String::from).into(),
            bars: vec![("Cortex-M7".into(), sizes.into()), ("RV64".into(), vec![2.0, 1.0])],
        }
        .svg()
    }

    #[test]
    fn bars_hold_what_they_were_given() {
        let svg = bars(&[3.0, 1.5]).unwrap();
        for text in ["Memory &amp; code", "code", "constants", "Cortex-M7", "RV64", "KiB"] {
            assert!(svg.contains(text), "{text}");
        }
        assert_eq!(svg, bars(&[3.0, 1.5]).unwrap());
    }

    #[test]
    fn a_bar_needs_a_finite_length() {
        assert_eq!(bars(&[f64::INFINITY]).unwrap_err().to_string(), "plot: no bar has a length");
    }
}
