//! The planner in its images: what `image-audit` looks for, and its findings as tables.

use image_audit::{EntryPoint, Kind, Named, NotCovered, Sizes, StackBound, Subject, TraitObject};
use remora_host::report::{Align, Table};

/// The planner: its entry points, what starts the image or catches its exceptions, and its traits
/// behind pointers.
pub const PLANNER: Subject = Subject {
    crates: &CRATES,
    entry_points: &[
        EntryPoint { name: "image", paths: &["remora_main"] },
        EntryPoint { name: "plan", paths: &["remora_core::planner::plan"] },
        EntryPoint { name: "stage 1", paths: &["remora_core::planner::run::Run::translate"] },
        EntryPoint {
            name: "start of stage 2",
            paths: &["remora_core::planner::guess::InitialGuess::write"],
        },
        EntryPoint { name: "stage 2", paths: &["remora_core::planner::run::reorient"] },
        EntryPoint { name: "verification", paths: &["remora_core::stages::verifier::verify"] },
        EntryPoint { name: "roll-out", paths: &["remora_core::warmstart::rollout::rollout"] },
        EntryPoint { name: "guidance", paths: &["remora_core::guidance::Guidance::step"] },
        EntryPoint { name: "opening a model", paths: &["remora_nn::model::Model::open"] },
        EntryPoint { name: "network", paths: &["remora_nn::network::Network::act"] },
        EntryPoint { name: "exceptions", paths: &["remora_fault", "trap", "vectors"] },
    ],
    traits: &[
        TraitObject { path: "remora_qp::time::Clock", callers: &[] },
        // Data that a loop keeps are shown to solvers. No solver of an image looks, so nothing there calls it.
        // If one did, every call through a pointer might be it.
        TraitObject { path: "remora_qp::kept::Kept", callers: &[] },
        TraitObject {
            path: "remora_core::warmstart::rollout::Policy",
            callers: &["remora_core::planner::", "remora_core::warmstart::"],
        },
    ],
    main: "remora_main",
    panic_mark: "remora_panic_reachable",
    models: "REMORA_MODEL",
};

/// The crates that fly.
const CRATES: [&str; 3] = ["remora_core", "remora_qp", "remora_nn"];

/// The bounds side by side, and the chain of each.
pub fn stack_tables(bounds: &[StackBound]) -> Vec<(String, Table)> {
    let mut all = Table::new(
        "entry point | function | >bound [bytes] | >narrowed [bytes] | >functions | >indirect calls | not covered",
    );
    for bound in bounds {
        let bytes = match (bound.bytes, bound.instances) {
            (Some(bytes), _) => bytes.to_string(),
            (None, 0) => "no function of its own".into(),
            (None, _) => "none: recursion".into(),
        };
        let places = bound.indirect.places;
        all.row([
            bound.name.clone(),
            bound.path.clone(),
            bytes,
            bound.narrow_bytes.map_or(String::new(), |bytes| bytes.to_string()),
            bound.functions.to_string(),
            format!("{places} to {}", bound.indirect.callees.len()),
            not_covered(&bound.not_covered),
        ]);
    }
    let mut tables = vec![("Stack bounds".to_string(), all)];
    for bound in bounds.iter().filter(|bound| !bound.chain.is_empty()) {
        let mut chain = Table::new("function | >frame [bytes] | >sum [bytes]");
        for frame in &bound.chain {
            let bytes = frame.frame_bytes.map_or("unknown".into(), |bytes| bytes.to_string());
            chain.row([frame.function.clone(), bytes, frame.sum_bytes.to_string()]);
        }
        tables.push((format!("Worst chain of {} (`{}`)", bound.name, bound.path), chain));
    }
    tables
}

fn not_covered(not: &NotCovered) -> String {
    let group = |what: &str, names: &[String]| match names {
        [] => None,
        names => Some(format!("{what} {}", names.join(", "))),
    };
    let circles = not.cycles.iter().filter_map(|circle| group("circle of", circle));
    let libraries = match not.library_callers.len() {
        0 => None,
        count => Some(format!("libraries that {count} functions call")),
    };
    let mut parts: Vec<String> = group("no figure of", &not.without_figure).into_iter().collect();
    parts.extend(libraries);
    parts.extend(group("stray branches in", &not.astray));
    parts.extend(circles);
    parts.join("; ")
}

/// Sections, code and read-only data by crate and of what flies by module, models, memory that is written.
pub fn size_tables(sizes: &Sizes) -> Vec<(String, Table)> {
    let by_origin = |depth: usize| {
        let mut table = Table::new(" | >code | >read-only data");
        let flies = |name: &str| CRATES.contains(&name.split("::").next().unwrap_or_default());
        for (name, code, data) in sizes.by_origin(depth) {
            if depth == 0 || flies(&name) {
                table.row([name, code.to_string(), data.to_string()]);
            }
        }
        table
    };
    vec![
        ("Sections".into(), objects("section", &sizes.sections)),
        ("Crates [bytes]".into(), by_origin(0)),
        ("Modules [bytes]".into(), by_origin(2)),
        ("Learned models built in".into(), objects("model", &sizes.models)),
        ("Memory that is written".into(), objects("object", &sizes.memory)),
    ]
}

fn objects(what: &str, objects: &[Named]) -> Table {
    let mut table =
        Table::new([(what, Align::Left), ("kind", Align::Left), ("bytes", Align::Right)]);
    for object in objects {
        let kind = match object.kind {
            Kind::Code => "code",
            Kind::ReadOnly => "read-only data",
            Kind::Data => "data",
            Kind::Zero => "zero at the start",
        };
        table.row([object.name.clone(), kind.into(), object.bytes.to_string()]);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::path::{Path, PathBuf};

    /// `remora_core::advanced::planner::` of `src/planner/run.rs`.
    fn module(file: &Path) -> String {
        let parts: Vec<_> = file.iter().map(|part| part.to_string_lossy()).collect();
        let (krate, rest) = match parts[0].as_ref() {
            "src" => ("remora_core".to_string(), &parts[1..]),
            other => (format!("remora_{other}"), &parts[2..]),
        };
        format!("{krate}::{}::", rest[0].trim_end_matches(".rs"))
    }

    /// The narrow way to resolve calls in the core rests on this: it has no other trait objects than
    /// those of [`PLANNER`], and no pointers to functions. Tests are left out.
    #[test]
    fn the_core_has_no_other_trait_objects() {
        let (mut found, mut of_policy) = (BTreeSet::new(), BTreeSet::new());
        let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../core");
        let mut folders = vec![root.clone()];
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    let outside = ["tests", "examples", "capi"];
                    let is_inside = !outside.iter().any(|of| path.ends_with(of));
                    folders.extend(is_inside.then_some(path));
                    continue;
                }
                // A module of tests in a file of its own.
                if path.ends_with("tests.rs") || path.extension().is_none_or(|of| of != "rs") {
                    continue;
                }
                let text = std::fs::read_to_string(&path).unwrap();
                let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
                for line in code.lines().filter(|line| !line.trim_start().starts_with("//")) {
                    for part in line.split("dyn ").skip(1) {
                        let name =
                            part.split(|c: char| !c.is_alphanumeric() && c != ':' && c != '_');
                        found.insert(name.into_iter().next().unwrap_or_default().to_string());
                    }
                    let mut words = line.split(|c: char| !c.is_alphanumeric() && c != '_');
                    if words.any(|word| word == "Policy") {
                        of_policy.insert(module(path.strip_prefix(&root).unwrap()));
                    }
                    let pointers = [": fn(", "<fn(", "&fn(", "[fn(", "extern \"C\" fn("];
                    assert!(
                        !pointers.iter().any(|p| line.contains(p)),
                        "{}: {line}",
                        path.display()
                    );
                }
            }
        }
        let last = |path: &str| path.rsplit("::").next().unwrap_or_default().to_string();
        assert_eq!(found, PLANNER.traits.iter().map(|of| last(of.path)).collect());
        // Nobody else can name its methods.
        let policy = PLANNER.traits.iter().find(|of| last(of.path) == "Policy").unwrap();
        let callers = policy.callers.iter().map(|module| module.to_string());
        assert_eq!(of_policy, callers.collect());
    }
}
