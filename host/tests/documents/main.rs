//! The pages that people read: README.md lists each, links lead somewhere, lines are short, code is
//! compiled. What commands they name is looked at by the program's own tests.

mod numbers;
mod pages;
mod reference;
mod schemas;
mod supply;

use pages::{LAB, Page, all, root};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Columns of a line.
const WIDTH: usize = 120;

/// The page that lists all pages of the book.
const CONTENTS: &str = "README.md";

/// Where links of a page lead to, without those to the web.
fn links(page: &Page) -> Vec<String> {
    // Code holds brackets that are no links.
    let prose = page.prose();
    let text: String = prose.split('`').step_by(2).collect::<Vec<_>>().join("code");
    let targets = text.split("](").skip(1).filter_map(|rest| rest.split_once(')'));
    let targets = targets.map(|(target, _)| target.split_whitespace().collect::<String>());
    targets.filter(|target| !target.contains("://")).collect()
}

/// The name by which a heading is linked to.
fn anchor(heading: &str) -> String {
    let kept = heading.trim_start_matches('#').trim().to_lowercase();
    let kept = kept.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

fn has_heading(page: &Path, name: &str) -> bool {
    let text = fs::read_to_string(page).unwrap_or_default();
    let page = Page { path: String::new(), text };
    let prose = page.prose();
    prose.lines().any(|line| line.starts_with('#') && anchor(line) == name)
}

/// The file that a link of a page names.
fn target(page: &Page, link: &str) -> PathBuf {
    let here = root().join(&page.path);
    match link.split('#').next() {
        Some("") | None => here,
        Some(file) => here.parent().unwrap_or(&here).join(file),
    }
}

#[test]
fn every_link_leads_somewhere() {
    let mut faults = Vec::new();
    for page in &all() {
        for link in links(page) {
            let file = target(page, &link);
            let name = link.split_once('#').map(|(_, name)| name);
            if !file.exists() {
                faults.push(format!("{}: {link}: no such file", page.path));
            } else if name.is_some_and(|name| !has_heading(&file, name)) {
                faults.push(format!("{}: {link}: no such heading", page.path));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn every_page_of_the_book_is_in_the_readme() {
    let pages = all();
    let readme = pages.iter().find(|page| page.path == CONTENTS).unwrap();
    let listed: BTreeSet<PathBuf> =
        links(readme).iter().filter_map(|link| target(readme, link).canonicalize().ok()).collect();
    let missing = pages.iter().filter(|page| {
        page.path.starts_with("docs/")
            && !page.path.starts_with(LAB)
            && !listed.contains(&root().join(&page.path))
    });
    let missing: Vec<&str> = missing.map(|page| page.path.as_str()).collect();
    assert!(missing.is_empty(), "not in {CONTENTS}: {missing:?}");
}

/// Notes are dated, outside the book, and in the index of their folder.
#[test]
fn every_lab_note_is_dated_and_in_the_index() {
    let pages = all();
    let index = pages.iter().find(|page| page.path == format!("{LAB}README.md")).unwrap();
    let readme = pages.iter().find(|page| page.path == CONTENTS).unwrap();
    assert!(links(readme).iter().all(|link| !link.starts_with(LAB)), "a note in the book");
    let listed = links(index);
    for entry in fs::read_dir(root().join(LAB)).unwrap().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        if name == "README.md" {
            continue;
        }
        let form = name.chars().take(11).map(|c| if c.is_ascii_digit() { '0' } else { c });
        assert_eq!(form.collect::<String>(), "0000-00-00-", "{name}: no date");
        let is_listed = listed.iter().any(|link| link.split('/').next() == Some(name.as_str()));
        assert!(is_listed, "{name}: not in the index");
    }
}

#[test]
fn lines_are_short() {
    let mut faults = Vec::new();
    for page in all().iter().filter(|page| page.is_current()) {
        // What programs print stands as they print it.
        let printed = page.fences().into_iter().filter(|fence| fence.language == "text");
        let printed: Vec<_> =
            printed.map(|fence| fence.first..fence.first + fence.lines.len()).collect();
        for (i, line) in page.text.lines().enumerate() {
            let is_free = line.starts_with('|') || line.starts_with("![");
            let is_printed = printed.iter().any(|lines| lines.contains(&(i + 1)));
            if line.chars().count() > WIDTH && !is_free && !is_printed {
                faults.push(format!("{}:{}: longer than {WIDTH}", page.path, i + 1));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn every_fence_names_its_language_and_rust_is_compiled() {
    let crates =
        ["core", "core/nn", "core/qp", "host/image-audit", "host/learn", "host/truth", "host/urdf"];
    let compiled: BTreeSet<PathBuf> = crates.iter().flat_map(|folder| included(folder)).collect();
    let mut faults = Vec::new();
    for page in all() {
        for fence in page.fences() {
            if fence.language.is_empty() {
                faults.push(format!("{}:{}: no language", page.path, fence.first));
            }
            let is_rust = fence.language.starts_with("rust");
            if is_rust && !compiled.contains(&root().join(&page.path)) {
                faults.push(format!("{}: no crate's tests include it", page.path));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Pages that a crate includes in its documentation.
fn included(folder: &str) -> Vec<PathBuf> {
    let sources = root().join(folder).join("src");
    let text = fs::read_to_string(sources.join("lib.rs")).unwrap();
    let names = text.split("include_str!(\"").skip(1).filter_map(|rest| rest.split('"').next());
    names.filter_map(|name| sources.join(name).canonicalize().ok()).collect()
}

#[test]
fn paths_of_the_checkout_exist() {
    let mut faults = Vec::new();
    for page in all().iter().filter(|page| page.is_current() && page.path != "CHANGELOG.md") {
        for code in page.inline_code() {
            let is_path = ["core/", "host/", "ci/", "docs/", "fixtures/"]
                .iter()
                .any(|top| code.starts_with(top));
            // Placeholders, patterns and arguments name no file.
            let is_plain =
                code.chars().all(|c| c.is_ascii_lowercase() || "/._-0123456789".contains(c));
            if is_path && is_plain && !root().join(&code).exists() {
                faults.push(format!("{}: {code}: no such file", page.path));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn drawings_say_what_they_show_on_light_and_dark_pages() {
    for name in ["architecture", "frames", "loop", "network"] {
        let path = format!("docs/pictures/{name}.svg");
        let text = fs::read_to_string(root().join(&path)).unwrap();
        for part in ["<title", "<desc", "prefers-color-scheme: dark"] {
            assert!(text.contains(part), "{path} has no {part}");
        }
        let used = all().iter().any(|page| page.text.contains(&format!("pictures/{name}.svg")));
        assert!(used, "no page shows {path}");
    }
}
