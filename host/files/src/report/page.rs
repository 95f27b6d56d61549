//! Pages for people: the same blocks as Markdown for a repository, and as HTML that holds all it
//! shows, plots included.

use super::Table;
use std::fmt::Write;

/// A page of blocks, read from top to bottom.
pub struct Page {
    /// Name of its file, without an extension; the anchor in HTML.
    pub name: &'static str,
    /// Its title.
    pub title: String,
    /// Its blocks, from top to bottom.
    pub blocks: Vec<Block>,
}

/// A part of a page. Texts may hold `code`, **strong words** and [links](to), nothing else.
pub enum Block {
    /// A heading below the title.
    Heading(String),
    /// A paragraph.
    Text(String),
    /// A table.
    Table(Table),
    /// A plot: name of its file without the extension, what it shows, its SVG.
    Plot(String, String, String),
    /// Command line that reproduces the blocks above.
    Command(String),
}

impl Page {
    /// An empty page.
    pub fn new(name: &'static str, title: impl Into<String>) -> Self {
        Self { name, title: title.into(), blocks: Vec::new() }
    }

    /// Adds a heading.
    pub fn heading(&mut self, text: impl Into<String>) -> &mut Self {
        self.add(Block::Heading(text.into()))
    }

    /// Adds a paragraph.
    pub fn text(&mut self, text: impl Into<String>) -> &mut Self {
        self.add(Block::Text(text.into()))
    }

    /// Adds a table.
    pub fn table(&mut self, table: Table) -> &mut Self {
        self.add(Block::Table(table))
    }

    /// Adds a plot.
    pub fn plot(&mut self, name: &str, caption: &str, svg: String) -> &mut Self {
        self.add(Block::Plot(name.into(), caption.into(), svg))
    }

    /// Adds the command that makes it again.
    pub fn command(&mut self, line: impl Into<String>) -> &mut Self {
        self.add(Block::Command(line.into()))
    }

    fn add(&mut self, block: Block) -> &mut Self {
        self.blocks.push(block);
        self
    }

    /// The page as Markdown; plots are linked as `NAME.svg` beside it.
    pub fn markdown(&self) -> String {
        format!("# {}\n{}", self.title, self.blocks_below("#"))
    }

    /// The page as a section of a larger one, an empty line before it.
    pub fn section(&self) -> String {
        format!("\n## {}\n{}", self.title, self.blocks_below("##"))
    }

    /// Blocks as Markdown; headings are one level below `above`.
    fn blocks_below(&self, above: &str) -> String {
        let mut out = String::new();
        for block in &self.blocks {
            // Writing to a string cannot fail.
            let _ = match block {
                Block::Heading(text) => writeln!(out, "\n{above}# {text}"),
                Block::Text(text) => writeln!(out, "\n{text}"),
                Block::Table(table) => write!(out, "\n{}", table.markdown()),
                Block::Plot(name, caption, _) => writeln!(out, "\n![{caption}]({name}.svg)"),
                Block::Command(line) => writeln!(out, "\nAgain: `{line}`"),
            };
        }
        out
    }

    /// Names and texts of the plots.
    pub fn plots(&self) -> impl Iterator<Item = (&str, &str)> {
        self.blocks.iter().filter_map(|block| match block {
            Block::Plot(name, _, svg) => Some((name.as_str(), svg.as_str())),
            _ => None,
        })
    }

    fn html(&self) -> String {
        let mut out = format!("<section id=\"{}\">\n<h1>{}</h1>\n", self.name, inline(&self.title));
        for block in &self.blocks {
            let _ = match block {
                Block::Heading(text) => writeln!(out, "<h2>{}</h2>", inline(text)),
                Block::Text(text) => writeln!(out, "<p>{}</p>", inline(text)),
                Block::Table(table) => writeln!(out, "{}", table.html()),
                Block::Plot(_, caption, svg) => writeln!(
                    out,
                    "<figure>{}<figcaption>{}</figcaption></figure>",
                    svg.trim(),
                    inline(caption)
                ),
                Block::Command(line) => {
                    writeln!(out, "<p class=\"again\">Again: <code>{}</code></p>", escaped(line))
                }
            };
        }
        out + "</section>\n"
    }
}

/// Colours, type and base rules of reports, plots and the interactive page.
pub(super) const LOOK: &str = include_str!("look.css");
/// Rules of reports alone.
const STYLE: &str = include_str!("report.css");
/// The sign before the title.
const MARK: &str = include_str!("mark.svg");

/// Pages as one Markdown page: the first gives it its title, each other is a section.
pub fn document(pages: &[Page]) -> String {
    let Some((first, others)) = pages.split_first() else { return String::new() };
    first.markdown() + &others.iter().map(Page::section).collect::<String>()
}

/// Pages in one document that loads nothing; `made` says by what and when, below the title.
pub fn html(title: &str, made: &str, pages: &[Page]) -> String {
    let links: String = pages
        .iter()
        .filter(|_| pages.len() > 1)
        .map(|page| format!("<a href=\"#{}\">{}</a>\n", page.name, inline(&page.title)))
        .collect();
    let nav = if links.is_empty() { links } else { format!("<nav>\n{links}</nav>\n") };
    let sections: String = pages.iter().map(Page::html).collect();
    let (title, made) = (escaped(title), inline(made));
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n\
         <title>{title}</title>\n<style>\n{LOOK}{STYLE}</style>\n</head>\n<body>\n\
         <header>{MARK}<strong>{title}</strong> <span>{made}</span></header>\n{nav}<main>\n{sections}</main>\n</body>\n</html>\n"
    )
}

/// Text with what HTML would read as its own replaced.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Escapes text and marks up its code, strong words and links.
pub(super) fn inline(text: &str) -> String {
    let mut out = String::new();
    // Between backquotes every other piece is code.
    for (i, piece) in text.split('`').enumerate() {
        match i % 2 {
            1 => out += &format!("<code>{}</code>", escaped(piece)),
            _ => out += &strong(&linked(&escaped(piece))),
        }
    }
    out
}

fn strong(text: &str) -> String {
    let pieces = text.split("**").enumerate();
    pieces
        .map(|(i, piece)| match i % 2 {
            1 => format!("<strong>{piece}</strong>"),
            _ => piece.to_string(),
        })
        .collect()
}

/// `[name](to)`. A page beside this one is a section of the same document; of other pages the name stands.
fn linked(text: &str) -> String {
    let mut pieces = text.split('[');
    let mut out = pieces.next().unwrap_or_default().to_string();
    for piece in pieces {
        let link = piece.split_once("](").and_then(|(name, rest)| {
            let (to, rest) = rest.split_once(')')?;
            let to = match to.strip_suffix(".md") {
                Some(page) if !page.contains('/') => format!("#{page}"),
                _ => to.to_string(),
            };
            let is_elsewhere = to.ends_with(".md") || to.contains(".md#");
            Some(if is_elsewhere {
                format!("{name}{rest}")
            } else {
                format!("<a href=\"{to}\">{name}</a>{rest}")
            })
        });
        out += &link.unwrap_or_else(|| format!("[{piece}"));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::Align;

    fn page() -> Page {
        let mut table = Table::new([("part", Align::Left), ("bytes", Align::Right)]);
        table.row(["code `a<b>`".into(), "12".into()]);
        let mut page = Page::new("memory", "Memory");
        page.text("All of it, **static**, see [stack](stack.md) & more.")
            .heading("By part")
            .table(table)
            .plot("split", "Bytes by part", "<svg><g/></svg>\n".into())
            .command("cargo xtask audit --only memory");
        page
    }

    #[test]
    fn markdown_is_as_written() {
        let expected = "# Memory\n\nAll of it, **static**, see [stack](stack.md) & more.\n\n\
            ## By part\n\n| part | bytes |\n| --- | ---: |\n| code `a<b>` | 12 |\n\n\
            ![Bytes by part](split.svg)\n\nAgain: `cargo xtask audit --only memory`\n";
        assert_eq!(page().markdown(), expected);
        assert_eq!(page().plots().collect::<Vec<_>>(), [("split", "<svg><g/></svg>\n")]);
    }

    #[test]
    fn sections_of_a_document_are_one_level_lower() {
        let text = document(&[page(), page()]);
        let (first, second) = text.split_at(page().markdown().len());
        assert_eq!(first, page().markdown());
        assert!(second.starts_with("\n## Memory\n\nAll of it"), "{second}");
        assert!(second.contains("\n### By part\n\n| part |"), "{second}");
        assert_eq!(document(&[]), "");
    }

    #[test]
    fn html_holds_everything() {
        let html = html("Audit", "Made at `abc`, 2026-11-22.", &[page()]);
        for part in [
            "<title>Audit</title>",
            "<strong>Audit</strong> <span>Made at <code>abc</code>, 2026-11-22.</span>",
            "<strong>static</strong>",
            "<a href=\"#stack\">stack</a> &amp; more",
            "<td>code <code>a&lt;b&gt;</code></td><td class=\"r\">12</td>",
            "<figure><svg><g/></svg><figcaption>Bytes by part</figcaption></figure>",
            "<code>cargo xtask audit --only memory</code>",
        ] {
            assert!(html.contains(part), "{part}\n{html}");
        }
        // Nothing is loaded from anywhere, and a single page needs no list of pages.
        assert!(!html.contains("src=") && !html.contains("http") && !html.contains("<nav>"));
        let html = super::html("Audit", "", &[page(), Page::new("stack", "Stack")]);
        assert!(
            html.contains("<nav>\n<a href=\"#memory\">Memory</a>\n<a href=\"#stack\">Stack</a>")
        );
    }

    #[test]
    fn brackets_that_are_no_links_stay() {
        assert_eq!(inline("times [ms], [0, 1)"), "times [ms], [0, 1)");
        assert_eq!(inline("[a](../b.md)"), "a");
        assert_eq!(inline("[a](b.md#c), [b](pages/1.html)"), "a, <a href=\"pages/1.html\">b</a>");
    }
}
