//! The Markdown pages of the checkout, and what stands in their code.

use std::fs;
use std::path::{Path, PathBuf};

/// The page that a program wrote, and the folder of dated notes, which keep the words of their day.
const NOT_CURRENT: [&str; 2] = ["docs/evidence/results.md", LAB];

/// Dated notes, outside the book.
#[allow(dead_code, reason = "two programs of tests use this file")]
pub const LAB: &str = "docs/lab/";

/// A Markdown file.
pub struct Page {
    /// Path from the root of the checkout, with slashes.
    pub path: String,
    pub text: String,
}

/// A fenced block of code.
pub struct Fence<'a> {
    pub language: &'a str,
    /// Line of its first line, from one.
    pub first: usize,
    pub lines: Vec<&'a str>,
}

impl Fence<'_> {
    /// Whether it holds commands or a script; words after `sh` are for `ci/guides.sh`.
    #[allow(dead_code, reason = "two programs of tests use this file")]
    pub fn is_shell(&self) -> bool {
        matches!(self.language.split(' ').next(), Some("sh" | "bash"))
    }
}

impl Page {
    /// Whether people keep it up to date by hand.
    pub fn is_current(&self) -> bool {
        !NOT_CURRENT.iter().any(|folder| self.path.starts_with(folder))
    }

    /// Blocks of code, in their order.
    pub fn fences(&self) -> Vec<Fence<'_>> {
        let (mut fences, mut open) = (Vec::new(), None::<Fence<'_>>);
        for (i, line) in self.text.lines().enumerate() {
            match (line.trim().strip_prefix("```"), open.take()) {
                (Some(language), None) => {
                    open = Some(Fence { language, first: i + 2, lines: Vec::new() });
                }
                (Some(_), Some(fence)) => fences.push(fence),
                (None, Some(mut fence)) => {
                    fence.lines.push(line);
                    open = Some(fence);
                }
                (None, None) => {}
            }
        }
        assert!(open.is_none(), "{}: a fence has no end", self.path);
        fences
    }

    /// All that is outside of fences; lines keep their numbers.
    pub fn prose(&self) -> String {
        let mut lines: Vec<&str> = self.text.lines().collect();
        for fence in self.fences() {
            for line in &mut lines[fence.first - 2..fence.first + fence.lines.len()] {
                *line = "";
            }
        }
        lines.join("\n")
    }

    /// Code within lines of prose, on one line each.
    #[allow(dead_code, reason = "two programs of tests use this file")]
    pub fn inline_code(&self) -> Vec<String> {
        let prose = self.prose();
        let paragraphs = prose.split("\n\n").flat_map(|text| text.split('`').skip(1).step_by(2));
        paragraphs.map(|code| code.split_whitespace().collect::<Vec<_>>().join(" ")).collect()
    }
}

/// The root of the checkout.
pub fn root() -> PathBuf {
    let mut folders = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
    let root = folders.find(|folder| folder.join("Cargo.lock").is_file());
    root.expect("a checkout").canonicalize().expect("a folder")
}

/// Every Markdown file of the checkout.
pub fn all() -> Vec<Page> {
    let (root, mut pages) = (root(), Vec::new());
    gather(&root, &root, &mut pages);
    assert!(pages.len() > 30, "pages are missing");
    pages.sort_by(|a, b| a.path.cmp(&b.path));
    pages
}

fn gather(root: &Path, folder: &Path, pages: &mut Vec<Page>) {
    for entry in fs::read_dir(folder).expect("a folder").flatten() {
        let (path, name) = (entry.path(), entry.file_name().to_string_lossy().into_owned());
        if path.is_dir() {
            // Nothing of what was built or planned.
            if !name.starts_with('.')
                && !["target", "runs", "node_modules"].contains(&name.as_str())
            {
                gather(root, &path, pages);
            }
        } else if name.ends_with(".md") {
            let text = fs::read_to_string(&path).expect("a page");
            let path = path.strip_prefix(root).expect("below the root").to_string_lossy();
            pages.push(Page { path: path.replace('\\', "/"), text });
        }
    }
}
