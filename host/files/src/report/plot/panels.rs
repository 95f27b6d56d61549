//! Many small plots over time side by side, below a picture.

use super::{Area, DrawResult, FONT, colour, tick_label, to_svg_of};
use crate::error::Error;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// A plot of some lines over time.
pub struct Panel {
    /// Title: the quantity shown, with its unit.
    pub title: String,
    /// Names and points of the lines; names of several stand above, beside marks in their colours.
    pub lines: Vec<(String, Vec<(f64, f64)>)>,
    /// Limits, drawn as dashed lines.
    pub limits: Vec<f64>,
    /// A moment to be marked, where there is one [s].
    pub moment: Option<f64>,
}

/// Panels below a picture.
pub struct Sheet {
    /// Title of the document.
    pub title: String,
    /// Elements of SVG that stand above the panels.
    pub picture: String,
    /// Their height [pixels].
    pub height: u32,
    /// The panels, two a row.
    pub panels: Vec<Panel>,
}

const WIDTH: u32 = 980;
const PANEL: u32 = 232;
/// Height of a panel's title and names, and space left of its axis [pixels].
const HEAD: u32 = 28;
const LEFT: u32 = 72;

impl Sheet {
    /// The sheet as the text of an SVG file.
    ///
    /// # Errors
    /// Where there is nothing to draw.
    pub fn svg(&self) -> Result<String, Error> {
        let rows = self.panels.len().div_ceil(2);
        let svg = to_svg_of((WIDTH, self.height + rows as u32 * PANEL), &self.title, |area| {
            let (_, area) = area.split_vertically(self.height);
            let areas = area.split_evenly((rows, 2));
            self.panels.iter().zip(areas).try_for_each(|(panel, area)| panel.draw(&area))
        })?;
        // Plotters draws neither round ends of lines nor groups: the picture joins its elements as text.
        Ok(svg.replace("</svg>", &format!("{}</svg>", self.picture)))
    }

    /// The panels alone, without the picture.
    ///
    /// # Errors
    /// Where there is nothing to draw.
    pub fn panels_svg(title: &str, panels: Vec<Panel>) -> Result<String, Error> {
        Self { title: title.into(), picture: String::new(), height: 0, panels }.svg()
    }
}

impl Panel {
    fn draw(&self, area: &Area<'_>) -> DrawResult {
        let points = || self.lines.iter().flat_map(|(_, points)| points);
        let (left, right) = ends(points().map(|point| point.0));
        let reached = ends(points().map(|point| point.1));
        // A limit far away would flatten the lines: the nearest of these is named below.
        let span = (reached.1 - reached.0).max(1e-12);
        let near = |limit: &f64| (reached.0 - 3.0 * span..=reached.1 + 3.0 * span).contains(limit);
        let (mut shown, far): (Vec<f64>, Vec<f64>) = self.limits.iter().copied().partition(near);
        shown.sort_by(f64::total_cmp);
        shown.dedup();
        let (low, high) = ends(points().map(|point| point.1).chain(shown.iter().copied()));
        let room = 0.06 * (high - low).max(1e-12);
        let (head, area) = area.split_vertically(HEAD);
        self.draw_head(&head)?;
        if let Some(limit) = far.iter().map(|limit| limit.abs()).reduce(f64::min) {
            let (width, height) = area.dim_in_pixel();
            let text = format!("limit {} not shown", tick_label(limit));
            let style = FONT.into_font().color(&BLACK).pos(Pos::new(HPos::Right, VPos::Bottom));
            area.draw(&Text::new(text, (width as i32 - 24, height as i32 - 8), style))?;
        }
        let mut chart = ChartBuilder::on(&area)
            .margin_right(24)
            .margin_bottom(8)
            .x_label_area_size(42)
            .y_label_area_size(LEFT)
            .build_cartesian_2d(left..right, low - room..high + room)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(BLACK.mix(0.1))
            .x_labels(7)
            .y_labels(6)
            .x_desc("time [s]")
            .x_label_formatter(&|x| tick_label(*x))
            .y_label_formatter(&|y| tick_label(*y))
            .label_style(FONT)
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
            let style = line_colour(number).stroke_width(2);
            chart.draw_series(LineSeries::new(points.iter().copied(), style))?;
        }
        Ok(())
    }

    /// Draws the title and, where there are several lines, their names beside it.
    fn draw_head(&self, area: &Area<'_>) -> DrawResult {
        let y = HEAD as i32 - 10;
        let style = FONT.into_font().color(&BLACK).pos(Pos::new(HPos::Left, VPos::Center));
        let mut x = LEFT as i32;
        let mut last = self.title.len();
        area.draw(&Text::new(self.title.clone(), (x, y), style.clone()))?;
        for (number, (name, _)) in self.lines.iter().enumerate().filter(|_| self.lines.len() > 1) {
            x += 28 + 7 * last as i32;
            last = name.len();
            let mark = [(x - 17, y), (x - 5, y)];
            area.draw(&PathElement::new(mark, line_colour(number).stroke_width(3)))?;
            area.draw(&Text::new(name.clone(), (x, y), style.clone()))?;
        }
        Ok(())
    }
}

/// Colour of a line: a seventh joint's is that of the ink.
fn line_colour(number: usize) -> RGBColor {
    if number == 6 { BLACK } else { colour(number) }
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
