//! Numbers on pages that follow from the code or from a file: each is compared with its source.

use super::pages::{Page, all, root};
use remora_core::advanced::nn::Model;
use remora_core::advanced::planner::PlanSettings;
use remora_core::advanced::planner::memory::{TOTAL_BYTES, parts};
use remora_core::advanced::scp::Settings;
use remora_core::advanced::stages::NODES;
use remora_core::advanced::warmstart::MAX_JOINTS;
use remora_core::prelude::{Integrator, Mode};
use std::fs;

/// A page by its path.
fn page(path: &str) -> Page {
    all().into_iter().find(|page| page.path == path).unwrap_or_else(|| panic!("no page {path}"))
}

/// Cells of the rows of a page's tables.
fn rows(page: &Page) -> Vec<Vec<&str>> {
    let rows = page.text.lines().filter(|line| line.starts_with('|'));
    rows.map(|line| line.trim_matches('|').split('|').map(str::trim).collect()).collect()
}

/// A setting's value by its name; none for a name that is no setting.
fn setting(settings: &Settings, name: &str) -> Option<f64> {
    Some(match name {
        "max_iterations" => settings.max_iterations as f64,
        "cost_tolerance" => settings.cost_tolerance,
        "absolute_cost_tolerance" => settings.absolute_cost_tolerance,
        "radius" => settings.radius,
        "min_radius" => settings.min_radius,
        "max_radius" => settings.max_radius,
        "eta_0" => settings.eta_0,
        "eta_1" => settings.eta_1,
        "eta_2" => settings.eta_2,
        "shrink" => settings.shrink,
        "grow" => settings.grow,
        "penalty_parameter" => settings.penalty_parameter,
        "max_penalty_parameter" => settings.max_penalty_parameter,
        "penalty_growth" => settings.penalty_growth,
        "curvature_below" => settings.curvature_below,
        "correct_below" => settings.correct_below,
        "max_corrections" => f64::from(settings.max_corrections),
        _ => return None,
    })
}

#[test]
fn the_settings_on_the_page_of_the_scp_solver_are_the_codes() {
    let page = page("docs/concepts/scp-and-qp.md");
    let settings = PlanSettings::new(Mode::Optimal, Integrator::RK4);
    let mut seen = 0;
    for row in rows(&page) {
        let [names, first, second, _] = row[..] else { continue };
        let names: Vec<&str> = names.split('`').skip(1).step_by(2).collect();
        let second = if second == "same" { first } else { second };
        for (stage, cell) in [(&settings.translation, first), (&settings.reorientation, second)] {
            let written: Vec<&str> = cell.split(", ").collect();
            for (name, written) in names.iter().zip(written).filter(|(_, written)| *written != "-")
            {
                let Some(value) = setting(stage, name) else { continue };
                assert_eq!(written.parse(), Ok(value), "docs/concepts/scp-and-qp.md: {name}");
                seen += 1;
            }
        }
    }
    assert_eq!(seen, 33, "settings on docs/concepts/scp-and-qp.md");
}

#[test]
fn the_memory_on_the_page_of_the_planner_is_the_codes() {
    let page = page("docs/concepts/planner.md");
    for part in parts() {
        let written = rows(&page).into_iter().find(|row| row[0] == format!("`{}`", part.name));
        let written =
            written.unwrap_or_else(|| panic!("docs/concepts/planner.md has no {}", part.name));
        assert_eq!(written[1], part.bytes.to_string(), "docs/concepts/planner.md: {}", part.name);
    }
    let total = rows(&page).into_iter().find(|row| row[0] == "together").unwrap();
    assert_eq!(total[1], TOTAL_BYTES.to_string());
}

#[test]
fn readmes_tell_the_sizes_that_the_build_has_room_for() {
    assert_eq!(MAX_JOINTS, 7, "the pages say seven");
    for path in ["README.md", "core/README.md"] {
        let text = page(path).text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(text.contains("one to seven revolute joints"), "{path}: joints");
        assert!(text.contains(&format!("at most {NODES} nodes")), "{path}: nodes");
    }
}

/// Parameters and bytes of the built-in models, from the files.
#[test]
fn the_sizes_of_the_built_in_models_are_the_files() {
    let page = page("fixtures/models/README.md");
    for name in ["euler", "rk4"] {
        let bytes = fs::read(root().join(format!("fixtures/models/{name}.model"))).unwrap();
        assert!(Model::open(&bytes).is_ok(), "{name}");
        let length = thousands(bytes.len());
        assert!(
            page.text.contains(&length),
            "fixtures/models/README.md: {name} has {length} bytes"
        );
    }
}

/// A whole number as pages write it: 421,279.
fn thousands(number: usize) -> String {
    let digits = number.to_string();
    let groups: Vec<&str> =
        digits.as_bytes().rchunks(3).rev().map(|g| str::from_utf8(g).unwrap()).collect();
    groups.join(",")
}
