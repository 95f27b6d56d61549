//! Tables: as plain text, Markdown and HTML.

use super::page::inline;
use std::fmt;

/// Whether a cell behind a name says that something is as it must be, as a class of HTML.
fn verdict(cell: &str) -> Option<&'static str> {
    match cell {
        "met" | "proven" | "tested" => Some("met"),
        "missed" | "MISSED" | "REFUTED" | "BROKEN" => Some("missed"),
        _ => None,
    }
}

/// A whole number of five digits or more in groups of three, with narrow spaces that do not break.
fn grouped(cell: &str) -> String {
    if cell.len() < 5 || !cell.bytes().all(|byte| byte.is_ascii_digit()) {
        return cell.into();
    }
    let digits = cell.char_indices().flat_map(|(i, digit)| {
        let is_first_of_three = i > 0 && (cell.len() - i).is_multiple_of(3);
        is_first_of_three.then_some('\u{202f}').into_iter().chain([digit])
    });
    digits.collect()
}

/// A cell as people read it: large whole numbers in groups, powers of ten raised.
fn readable(cell: &str) -> String {
    let power = cell.split_once('e').and_then(|(factor, power)| {
        factor.parse::<f64>().ok()?;
        Some((factor, power.parse::<i32>().ok()?))
    });
    let Some((factor, power)) = power else {
        return cell.split(", ").map(grouped).collect::<Vec<_>>().join(", ");
    };
    let power = power.to_string();
    let raised = power.chars().map(|c| match c.to_digit(10) {
        Some(digit) => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][digit as usize],
        None => '⁻',
    });
    format!("{factor} × 10{}", raised.collect::<String>())
}

/// How a column is aligned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Align {
    /// To the left: words.
    Left,
    /// To the right: numbers.
    Right,
}

/// A table: a head, a rule, the rows; columns as wide as they need, two spaces apart.
#[derive(Clone, Debug)]
pub struct Table {
    head: Vec<(String, Align)>,
    rows: Vec<Vec<String>>,
}

/// The head of a table: names and alignments of its columns.
pub struct Head(Vec<(String, Align)>);

impl From<&str> for Head {
    fn from(names: &str) -> Self {
        let column = |name: &str| match name.strip_prefix('>') {
            Some(name) => (name.to_string(), Align::Right),
            None => (name.to_string(), Align::Left),
        };
        Self(names.split('|').map(|name| column(name.trim())).collect())
    }
}

impl<const N: usize> From<[(&str, Align); N]> for Head {
    fn from(columns: [(&str, Align); N]) -> Self {
        Self(columns.map(|(name, align)| (name.to_string(), align)).into())
    }
}

impl Table {
    /// An empty table with a head: a text as `name | >number`, columns with `>` to the right, or an array.
    pub fn new(head: impl Into<Head>) -> Self {
        Self::with_columns(head.into().0)
    }

    /// An empty table with so many columns as there are.
    pub fn with_columns(head: Vec<(String, Align)>) -> Self {
        Self { head, rows: Vec::new() }
    }

    /// The table in Markdown.
    pub fn markdown(&self) -> String {
        let line = |cells: Vec<&str>| format!("| {} |\n", cells.join(" | "));
        let head = line(self.head.iter().map(|(name, _)| name.as_str()).collect());
        let rule = self.head.iter().map(|(_, align)| match align {
            Align::Left => "---",
            Align::Right => "---:",
        });
        let rows = self.rows.iter().map(|row| line(row.iter().map(|cell| cell.trim()).collect()));
        head + &line(rule.collect()) + &rows.collect::<String>()
    }

    /// The table in HTML. Cells may hold the markup of a page's texts.
    pub fn html(&self) -> String {
        let class = |i: usize| match self.head.get(i) {
            Some((_, Align::Right)) => " class=\"r\"",
            _ => "",
        };
        let line = |tag: &str, cells: Vec<&str>| {
            let cells = cells.into_iter().enumerate();
            let cells = cells.map(|(i, cell)| {
                let cell = cell.trim();
                match verdict(cell).filter(|_| i > 0) {
                    Some(class) => format!("<{tag} class=\"{class}\">{}</{tag}>", inline(cell)),
                    None => format!("<{tag}{}>{}</{tag}>", class(i), inline(&readable(cell))),
                }
            });
            format!("<tr>{}</tr>\n", cells.collect::<String>())
        };
        let head = line("th", self.head.iter().map(|(name, _)| name.as_str()).collect());
        let rows = self.rows.iter().map(|row| line("td", row.iter().map(String::as_str).collect()));
        let rows: String = rows.collect();
        format!("<div class=\"table\"><table>\n<thead>{head}</thead>\n{rows}</table></div>")
    }

    /// Rows as names, the words before the first number, and values, the other cells with heads.
    pub fn named_rows(&self) -> impl Iterator<Item = (String, String)> {
        let numbers = self.head.iter().position(|(_, align)| *align == Align::Right);
        let words = numbers.unwrap_or(1).max(1);
        self.rows.iter().map(move |row| {
            let (name, values) = row.split_at(words.min(row.len()));
            let heads = self.head.iter().skip(words).map(|(head, _)| head);
            let values = heads.zip(values).filter(|(_, value)| !value.is_empty());
            let values = values.map(|(head, value)| format!("{head} {value}").trim().to_string());
            (name.join(", "), values.collect::<Vec<_>>().join("; "))
        })
    }

    /// Adds a row; cells beyond the head are dropped.
    pub fn row<const N: usize>(&mut self, cells: [String; N]) {
        self.rows.push(cells.into());
    }

    /// Adds a row with any number of cells.
    pub fn push(&mut self, cells: Vec<String>) {
        self.rows.push(cells);
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let head: Vec<String> = self.head.iter().map(|(name, _)| name.clone()).collect();
        let width = |i: usize| {
            let cells = self.rows.iter().chain([&head]).filter_map(|row| row.get(i));
            cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..head.len()).map(width).collect();
        let line = |cells: &[String]| {
            let columns = cells.iter().zip(&widths).zip(&self.head);
            let cells: Vec<String> = columns
                .map(|((cell, width), (_, align))| match align {
                    Align::Left => format!("{cell:<width$}"),
                    Align::Right => format!("{cell:>width$}"),
                })
                .collect();
            cells.join("  ").trim_end().to_string()
        };
        writeln!(f, "{}", line(&head))?;
        let total = widths.iter().sum::<usize>() + 2 * widths.len().saturating_sub(1);
        writeln!(f, "{}", "-".repeat(total))?;
        self.rows.iter().try_for_each(|row| writeln!(f, "{}", line(row)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_line_up() {
        let mut table = Table::new("name | >n |");
        table.row(["a".into(), "1".into(), "ok".into()]);
        table.row(["longer".into(), "1000".into(), String::new()]);
        let expected = "name       n\n----------------\na          1  ok\nlonger  1000\n";
        assert_eq!(table.to_string(), expected);
        let expected =
            "| name | n |  |\n| --- | ---: | --- |\n| a | 1 | ok |\n| longer | 1000 |  |\n";
        assert_eq!(table.markdown(), expected);
    }

    #[test]
    fn people_read_numbers_and_verdicts() {
        assert_eq!(readable("1234567"), "1\u{202f}234\u{202f}567");
        assert_eq!(readable("51640, 60000"), "51\u{202f}640, 60\u{202f}000");
        assert_eq!(readable("1.00e-12"), "1.00 × 10⁻¹²");
        assert_eq!(
            ["1e", "e5", "link_3e2", "one", "12.5"].map(readable).concat(),
            "1ee5link_3e2one12.5"
        );
        let mut table = Table::new([("ended", Align::Left), ("", Align::Left)]);
        table.row(["missed".into(), "met".into()]);
        assert!(table.html().contains("<td>missed</td><td class=\"met\">met</td>"));
    }

    #[test]
    fn rows_have_names_and_values_with_their_heads() {
        let rows = |table: &Table| table.named_rows().collect::<Vec<_>>();
        let row = |name: &str, value: &str| (name.to_string(), value.to_string());
        let (left, right) = (Align::Left, Align::Right);
        let mut table = Table::new([("", left), ("of", left), ("n", right), ("", left)]);
        table.row(["a".into(), "b".into(), "1".into(), "ok".into()]);
        table.row(["c".into(), "d".into(), "2".into(), String::new()]);
        assert_eq!(rows(&table), [row("a, b", "n 1; ok"), row("c, d", "n 2")]);
        let mut words = Table::new([("", left), ("", left)]);
        words.row(["compiler".into(), "rustc".into()]);
        assert_eq!(rows(&words), [row("compiler", "rustc")]);
    }
}
