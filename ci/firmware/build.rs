//! Turns the audit's scenarios into constants and names the board's linker script.

use std::fmt::Write as _;
use std::{env, fs, path::Path};

/// Form of a scenario in the file, in order; `#` is a number. The build fails on any other
/// form, so that no number can end up in the wrong place.
const FORM: &str = "id $ target attitude # # # # rate # # # servicer position # # # velocity # # #";

fn main() {
    let root = env::var("CARGO_MANIFEST_DIR").expect("set by cargo");
    let fixture = Path::new(&root).join("../../fixtures/scenarios/audit.scenarios.json");
    println!("cargo:rerun-if-changed={}", fixture.display());
    let text = fs::read_to_string(&fixture).expect("the fixture is readable");
    let out = Path::new(&env::var("OUT_DIR").expect("set by cargo")).join("scenarios.rs");
    fs::write(out, table(&text)).expect("the output folder is writable");

    if env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        let arch = env::var("CARGO_CFG_TARGET_ARCH").expect("set by cargo");
        let script = Path::new(&root).join("link").join(format!("{arch}.ld"));
        println!("cargo:rerun-if-changed={}", script.display());
        println!("cargo:rustc-link-arg-bins=-T{}", script.display());
        println!("cargo:rustc-link-arg-bins=--gc-sections");
    }
}

/// The scenarios as Rust source. Numbers are written by their bits: nothing is rounded twice.
fn table(text: &str) -> String {
    let tokens = tokens(text);
    let header = ["format", "remora-scenarios/1", "scenarios"];
    assert!(tokens.iter().take(3).eq(header.iter()), "the fixture's header");
    let form: Vec<&str> = FORM.split(' ').collect();
    let mut rows = String::new();
    let mut count = 0;
    for scenario in tokens[3..].chunks(form.len()) {
        assert_eq!(scenario.len(), form.len(), "a scenario is cut short");
        let mut numbers = String::new();
        for (token, expected) in scenario.iter().zip(&form) {
            match *expected {
                "#" => {
                    let value: f64 = token.parse().expect("a number");
                    write!(numbers, "f64::from_bits({:#018x}), ", value.to_bits()).expect("text");
                }
                "$" => {}
                name => assert_eq!(token, name, "the fixture's form"),
            }
        }
        writeln!(rows, "    ({:?}, [{numbers}]),", scenario[1]).expect("text");
        count += 1;
    }
    format!("const ROWS: [(&str, [f64; 13]); {count}] = [\n{rows}];\n")
}

/// Strings and numbers of a JSON text, in order; none of its strings holds an escape.
fn tokens(text: &str) -> Vec<String> {
    assert!(!text.contains('\\'), "the fixture's strings are plain");
    text.split('"')
        .enumerate()
        .flat_map(|(i, part)| match i % 2 {
            1 => vec![part.to_string()],
            _ => part
                .split(|c: char| c.is_whitespace() || "{}[]:,".contains(c))
                .filter(|word| !word.is_empty())
                .map(String::from)
                .collect(),
        })
        .collect()
}
