//! Shares over two axes, a coloured cell each.

use super::{Area, DrawResult, FONT, TITLE, to_svg_of};
use crate::error::Error;
use crate::statistics::Estimate;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// A map of shares: columns from left to right, rows from the bottom.
pub struct Heat {
    /// Title of the plot.
    pub title: String,
    /// Quantity of the columns, with its unit.
    pub x_label: String,
    /// Quantity of the rows, with its unit.
    pub y_label: String,
    /// Names of the columns.
    pub x: Vec<String>,
    /// Names of the rows.
    pub y: Vec<String>,
    /// Share of each cell of each row with its interval, 0 to 1; none where there is no number.
    pub shares: Vec<Vec<Option<Estimate>>>,
    /// Footer that tells how the plot was made.
    pub footer: String,
}

/// Size of a cell [pixels].
const CELL: (i32, i32) = (66, 42);
/// Left of the cells, and above them.
const CORNER: (i32, i32) = (84, 68);
/// Shares that the legend shows, and the distance of its patches.
const LEGEND: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];
const LEGEND_STEP: i32 = 66;
/// Below the cells, footer apart.
const BELOW: i32 = 52;
/// A line of the footer, and most characters on it.
const LINE: i32 = 14;
const LINE_LENGTH: usize = 105;
/// Narrowest figure: title and footer must fit.
const LEAST_WIDTH: i32 = 580;
const LEGEND_FONT: (&str, u32) = ("sans-serif", 13);

/// Colours of nothing, half and all: orange, white, blue. None is that of a series, which a dark page changes.
const ENDS: [(f64, f64, f64); 3] = [(213.0, 94.0, 1.0), (246.0, 240.0, 224.0), (1.0, 114.0, 178.0)];
/// Ink on a light cell. It is not pure black, which a dark page turns light.
const INK: RGBColor = RGBColor(1, 1, 1);
const NO_NUMBER: RGBColor = RGBColor(224, 224, 224);

impl Heat {
    /// The plot as the text of an SVG file.
    ///
    /// # Errors
    /// Where there is no cell, or not one for each row and column.
    pub fn svg(&self) -> Result<String, Error> {
        let fits = self.shares.len() == self.y.len()
            && self.shares.iter().all(|row| row.len() == self.x.len());
        if self.x.is_empty() || self.y.is_empty() || !fits {
            return Err(Error::Plot { reason: "needs a cell for each row and column".into() });
        }
        let width = CORNER.0 + CELL.0 * self.x.len() as i32 + 20;
        let lines = wrapped(&self.footer).len() as i32;
        let height = CORNER.1 + CELL.1 * self.y.len() as i32 + BELOW + LINE * lines;
        let size = (width.max(LEAST_WIDTH) as u32, height as u32);
        to_svg_of(size, &self.title, |area| self.draw(area))
    }

    fn draw(&self, area: &Area<'_>) -> DrawResult {
        let bottom = CORNER.1 + CELL.1 * self.y.len() as i32;
        area.draw(&Text::new(self.title.clone(), (12, 12), TITLE))?;
        let centred = |size: u32, colour: RGBColor| {
            let font = ("sans-serif", size).into_font().color(&colour);
            font.pos(Pos::new(HPos::Center, VPos::Center))
        };
        self.draw_legend(area)?;
        for (row, (name, shares)) in self.y.iter().zip(&self.shares).enumerate() {
            let y = bottom - CELL.1 * (row as i32 + 1);
            let right = Pos::new(HPos::Right, VPos::Center);
            let style = FONT.into_font().color(&BLACK).pos(right);
            area.draw(&Text::new(name.clone(), (CORNER.0 - 8, y + CELL.1 / 2), style))?;
            for (column, share) in shares.iter().enumerate() {
                let x = CORNER.0 + CELL.0 * column as i32;
                let value = share.map(|share| share.value);
                let box_ = [(x + 1, y + 1), (x + CELL.0 - 1, y + CELL.1 - 1)];
                area.draw(&Rectangle::new(box_, colour_of(value).filled()))?;
                let ink = if is_dark(value) { WHITE } else { INK };
                let (x, y) = (x + CELL.0 / 2, y + CELL.1 / 2);
                let Some(Estimate { value, low, high }) = share else {
                    area.draw(&Text::new("-", (x, y), centred(15, ink)))?;
                    continue;
                };
                let [value, low, high] = [value, low, high].map(|x| format!("{:.0}", 100.0 * x));
                area.draw(&Text::new(value, (x, y - 7), centred(15, ink)))?;
                area.draw(&Text::new(format!("{low} to {high}"), (x, y + 11), centred(11, ink)))?;
            }
        }
        for (column, name) in self.x.iter().enumerate() {
            let x = CORNER.0 + CELL.0 * column as i32 + CELL.0 / 2;
            area.draw(&Text::new(name.clone(), (x, bottom + 12), centred(15, BLACK)))?;
        }
        let middle = CORNER.0 + CELL.0 * self.x.len() as i32 / 2;
        area.draw(&Text::new(self.x_label.clone(), (middle, bottom + 32), centred(15, BLACK)))?;
        let turned = centred(15, BLACK).transform(FontTransform::Rotate270);
        let beside = (16, (CORNER.1 + bottom) / 2);
        area.draw(&Text::new(self.y_label.clone(), beside, turned))?;
        for (i, line) in wrapped(&self.footer).into_iter().enumerate() {
            let small = ("sans-serif", 11).into_font().color(&BLACK.mix(0.7));
            area.draw(&Text::new(line, (12, bottom + 48 + LINE * i as i32), small))?;
        }
        Ok(())
    }

    fn draw_legend(&self, area: &Area<'_>) -> DrawResult {
        let shares = LEGEND.into_iter().map(Some).chain([None]);
        for (i, share) in shares.enumerate() {
            let (x, y) = (14 + LEGEND_STEP * i as i32, 40);
            let patch = [(x, y), (x + 14, y + 14)];
            area.draw(&Rectangle::new(patch, colour_of(share).filled()))?;
            let name = share.map_or("no plan".into(), |share| format!("{:.0} %", 100.0 * share));
            area.draw(&Text::new(name, (x + 19, y + 1), LEGEND_FONT))?;
        }
        let x = 14 + LEGEND_STEP * (LEGEND.len() as i32 + 1) + 16;
        area.draw(&Text::new("small: 95 % interval", (x, 41), LEGEND_FONT))
    }
}

/// The words of a text on lines that are short enough, as far as words are.
fn wrapped(text: &str) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ') {
        match lines.last_mut() {
            Some(line) if line.len() + word.len() < LINE_LENGTH => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.into()),
        }
    }
    lines
}

/// Colour of a share.
fn colour_of(share: Option<f64>) -> RGBColor {
    let Some(share) = share.filter(|share| share.is_finite()) else { return NO_NUMBER };
    let at = 2.0 * share.clamp(0.0, 1.0);
    let (from, to) = if at < 1.0 { (ENDS[0], ENDS[1]) } else { (ENDS[1], ENDS[2]) };
    let part = if at < 1.0 { at } else { at - 1.0 };
    let mix = |a: f64, b: f64| (a + part * (b - a)).round() as u8;
    RGBColor(mix(from.0, to.0), mix(from.1, to.1), mix(from.2, to.2))
}

/// Whether white is easier to read on it: dark is the blue end alone.
fn is_dark(share: Option<f64>) -> bool {
    share.is_some_and(|share| share > 0.93)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn heat(shares: Vec<Vec<Option<Estimate>>>) -> Result<String, Error> {
        Heat {
            title: "strong, 60 s & more".into(),
            x_label: "distance [m]".into(),
            y_label: "tumble rate [deg/s]".into(),
            x: ["2", "5"].map(String::from).into(),
            y: ["0", "7"].map(String::from).into(),
            shares,
            footer: "remora campaign envelope; 0.1.0, abc".into(),
        }
        .svg()
    }

    #[test]
    fn a_map_holds_what_it_was_given() {
        let share = |value| Some(Estimate { value, low: 0.9 * value, high: 1.1 * value });
        let cells = vec![vec![None, share(1.0)], vec![share(0.0), share(0.4)]];
        let svg = heat(cells.clone()).unwrap();
        for text in [
            "remora campaign envelope",
            "60 s &amp; more",
            "distance [m]",
            "deg/s",
            "100",
            "36 to 44",
            "75 %",
            "no plan",
        ] {
            assert!(svg.contains(text), "{text}\n{svg}");
        }
        // Nothing, all, no number.
        for colour in ["#D55E01", "#0172B2", "#E0E0E0"] {
            assert!(svg.contains(colour), "{colour}");
        }
        assert_eq!(svg, heat(cells).unwrap());
    }

    #[test]
    fn a_long_footer_has_several_lines() {
        let text = "word ".repeat(50);
        let lines = wrapped(text.trim());
        assert_eq!(lines.len(), 3);
        assert!(lines.iter().all(|line| line.len() <= LINE_LENGTH));
        assert_eq!(lines.join(" "), text.trim());
    }

    #[test]
    fn a_map_needs_all_its_cells() {
        let expected = "plot: needs a cell for each row and column";
        for cells in [vec![], vec![vec![None], vec![None, None]]] {
            assert_eq!(heat(cells).unwrap_err().to_string(), expected);
        }
    }
}
