//! Many small plots over time side by side, beside a picture.

use super::{Area, DrawResult, FONT, TITLE, colour, to_svg_of};
use crate::error::Error;
use plotters::prelude::*;

/// A plot of some lines over time.
pub struct Panel {
    /// Title: the quantity shown, with its unit.
    pub title: String,
    /// Names and points of the lines; the names stand above, in the lines' colours.
    pub lines: Vec<(String, Vec<(f64, f64)>)>,
    /// Limits, drawn as dashed lines.
    pub limits: Vec<f64>,
    /// A moment to be marked, where there is one [s].
    pub moment: Option<f64>,
}

/// A closed or open outline in the picture's plane.
pub struct Outline {
    /// Its corners [m].
    pub points: Vec<(f64, f64)>,
    /// Index of its colour; none is black.
    pub colour: Option<usize>,
    /// How wide.
    pub width: u32,
}

/// A picture to scale and panels below it.
pub struct Sheet {
    /// Title of the whole plot.
    pub title: String,
    /// The picture's axes.
    pub axes: (String, String),
    /// The picture.
    pub outlines: Vec<Outline>,
    /// The panels, two a row.
    pub panels: Vec<Panel>,
}

const WIDTH: u32 = 980;
const PICTURE: u32 = 560;
const PANEL: u32 = 210;

impl Sheet {
    /// The sheet as the text of an SVG file.
    ///
    /// # Errors
    /// Where there is nothing to draw.
    pub fn svg(&self) -> Result<String, Error> {
        let rows = self.panels.len().div_ceil(2) as u32;
        to_svg_of((WIDTH, PICTURE + rows * PANEL), &self.title, |area| self.draw(area))
    }

    /// The panels alone, without the picture.
    ///
    /// # Errors
    /// Where there is nothing to draw.
    pub fn panels_svg(title: &str, panels: &[Panel]) -> Result<String, Error> {
        let rows = panels.len().div_ceil(2);
        to_svg_of((WIDTH, rows as u32 * PANEL), title, |area| {
            for (panel, area) in panels.iter().zip(area.split_evenly((rows, 2))) {
                panel.draw(&area)?;
            }
            Ok(())
        })
    }

    fn draw(&self, area: &Area<'_>) -> DrawResult {
        let (picture, panels) = area.split_vertically(PICTURE);
        self.draw_picture(&picture)?;
        let rows = self.panels.len().div_ceil(2);
        for (panel, area) in self.panels.iter().zip(panels.split_evenly((rows, 2))) {
            panel.draw(&area)?;
        }
        Ok(())
    }

    fn draw_picture(&self, area: &Area<'_>) -> DrawResult {
        let points = || self.outlines.iter().flat_map(|outline| &outline.points);
        let (left, right) = ends(points().map(|point| point.0));
        let (low, high) = ends(points().map(|point| point.1));
        // To scale: the shorter side gets the room that the other's metres leave it.
        let scale = ((right - left) / f64::from(WIDTH - 120)).max((high - low) / 440.0) * 0.55;
        let (x, y) = (0.5 * (left + right), 0.5 * (low + high));
        let (half_x, half_y) = (scale * f64::from(WIDTH - 120), scale * 440.0);
        let mut chart = ChartBuilder::on(area)
            .caption(&self.title, TITLE)
            .margin(12)
            .x_label_area_size(44)
            .y_label_area_size(64)
            .build_cartesian_2d(x - half_x..x + half_x, y - half_y..y + half_y)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(BLACK.mix(0.1))
            .x_desc(&self.axes.0)
            .y_desc(&self.axes.1)
            .label_style(FONT)
            .draw()?;
        for outline in &self.outlines {
            let style = outline.colour.map_or(BLACK, colour).stroke_width(outline.width);
            chart.draw_series([PathElement::new(outline.points.clone(), style)])?;
        }
        Ok(())
    }
}

impl Panel {
    fn draw(&self, area: &Area<'_>) -> DrawResult {
        let points = || self.lines.iter().flat_map(|(_, points)| points);
        let (left, right) = ends(points().map(|point| point.0));
        let reached = ends(points().map(|point| point.1));
        // A limit far away would flatten the lines: it is then named only.
        let span = (reached.1 - reached.0).max(1e-12);
        let near =
            |limit: &&f64| (reached.0 - 3.0 * span..=reached.1 + 3.0 * span).contains(*limit);
        let shown: Vec<f64> = self.limits.iter().filter(near).copied().collect();
        let (low, high) = ends(points().map(|point| point.1).chain(shown.iter().copied()));
        let room = 0.06 * (high - low).max(1e-12);
        let names: Vec<&str> = self.lines.iter().map(|(name, _)| name.as_str()).collect();
        let mut chart = ChartBuilder::on(area)
            .caption(format!("{} ({})", self.title, names.join(", ")), FONT)
            .margin(8)
            .x_label_area_size(26)
            .y_label_area_size(64)
            .build_cartesian_2d(left..right, low - room..high + room)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(BLACK.mix(0.1))
            .x_labels(7)
            .y_labels(5)
            .label_style(("sans-serif", 12))
            .draw()?;
        for limit in shown {
            let ends = [(left, limit), (right, limit)];
            chart.draw_series(DashedLineSeries::new(ends, 6, 4, BLACK.stroke_width(1)))?;
        }
        if let Some(moment) = self.moment {
            let ends = [(moment, low - room), (moment, high + room)];
            chart.draw_series(DashedLineSeries::new(ends, 2, 4, BLACK.mix(0.5).stroke_width(1)))?;
        }
        for (number, (_, points)) in self.lines.iter().enumerate() {
            let style = colour(number).stroke_width(2);
            chart.draw_series(LineSeries::new(points.iter().copied(), style))?;
        }
        Ok(())
    }
}

/// Least and largest of some numbers, those that are finite; apart from each other.
fn ends(numbers: impl Iterator<Item = f64>) -> (f64, f64) {
    let finite = numbers.filter(|x| x.is_finite());
    let (low, high) =
        finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    match low < high {
        true => (low, high),
        false if low.is_finite() => (low - 1e-6, low + 1e-6),
        false => (0.0, 1.0),
    }
}
