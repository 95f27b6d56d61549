//! Text that `cargo xtask inject` prints.

use crate::inject::{Class, Extra, Injection, Record, Replay, Share};
use remora_host::campaign::Statistics;
use remora_host::report::{Table, iteration_log, number};
use std::fmt::Write;
use std::path::PathBuf;

/// Most cases that are listed.
const LISTED: usize = 20;

/// Head, tables, the cases that must not be, files.
pub fn injection_report(injection: &Injection, files: &[PathBuf]) -> String {
    let Injection { seed, integrator, scenarios, total, model, .. } = injection;
    let mut out = format!(
        "{} cases of seed {seed} in {scenarios} scenarios: {} wrong, hung or panicked\n\
         optimal mode, start from {} ({}), {integrator}, embedded\n",
        total.cases,
        total.classes.forbidden(),
        model.name,
        model.checksum,
    );
    for (heading, table) in injection.tables() {
        let _ = write!(out, "\n{heading}\n\n{table}");
    }
    let _ = writeln!(
        out,
        "\nof those that failed cleanly, plans that can be flown: {}\n\
         plans without a fault made after one with a fault, on the same planner: {}",
        total.failed_but_verified, injection.leak_checks,
    );
    for record in injection.forbidden.iter().take(LISTED) {
        let _ = writeln!(
            out,
            "{}: {} (again: cargo xtask inject --seed {seed} --integrator {integrator} --case {} -v)",
            record.class.name(),
            summary(record),
            record.case,
        );
    }
    for file in files {
        let _ = writeln!(out, "written: {}", file.display());
    }
    out
}

/// One case.
pub fn replay_report(replay: &Replay, verbose: bool) -> String {
    let Replay { record, logs } = replay;
    let mut out = String::new();
    if verbose {
        out.push_str(&iteration_log("Stage 1, translation", &logs[0]));
        out.push_str(&iteration_log("Stage 2, reorientation", &logs[1]));
    }
    let verified = if record.is_verified { "verified" } else { "not verified" };
    let _ = writeln!(
        out,
        "case {}: {}\n{}\n{}, {verified}, start {}, iterations {} and {}\n\
         {:+} iterations, {:+.3} % cost against the plan without the fault; checksum {}",
        record.case,
        record.class.name(),
        summary(record),
        record.status,
        record.start.name(),
        record.stage1_iterations,
        record.stage2_iterations,
        record.extra_iterations,
        100.0 * record.extra_cost,
        record.output,
    );
    out
}

fn summary(r: &Record) -> String {
    let (site, bit, element, part) = (r.site.name(), r.bit, r.element, &r.part);
    let (node, moment, id) = (r.node, r.moment, &r.scenario);
    format!("{site}: bit {bit} of {part}[{element}], node {node}, moment {moment}, scenario {id}")
}

impl Injection {
    /// Mean and most extra iterations and cost of all sites together, a row a class.
    pub fn costs_of_classes(&self) -> Table {
        let mut table =
            Table::new("class | >extra iterations, mean, most | >extra cost [%], mean, most");
        let both = |of: &Statistics, scale: f64| {
            [of.mean, of.max].map(|value| sign(number(scale * value))).join(", ")
        };
        for (class, extra) in extras(&self.total) {
            let Extra { iterations, cost } = extra;
            table.row([class.name().into(), both(iterations, 1.0), both(cost, 100.0)]);
        }
        table
    }

    /// Classes by site, without those that must not occur.
    pub fn overview(&self) -> Table {
        let mut table = Table::new("site | >same | >tolerated | >fell back | >detected | >failed");
        let shown = [
            Class::NoEffect,
            Class::Tolerated,
            Class::FellBack,
            Class::Detected,
            Class::FailedCleanly,
        ];
        for share in self.sites.iter().chain([&self.total]) {
            let [same, tolerated, fell_back, detected, failed] =
                shown.map(|class| share.classes.of(class).to_string());
            table.row([share.site.clone(), same, tolerated, fell_back, detected, failed]);
        }
        table
    }

    /// Tables with their headings: classes by site, what faults cost, classes by kind of data.
    pub fn tables(&self) -> Vec<(String, Table)> {
        let sites = || self.sites.iter().chain([&self.total]);
        vec![
            ("Cases by site".into(), classes(sites(), false)),
            ("What faults cost where the plan is solved".into(), costs(sites())),
            ("Cases by kind of data".into(), classes(self.kinds.iter(), true)),
        ]
    }
}

/// Classes of cases, one row per share.
fn classes<'a>(shares: impl Iterator<Item = &'a Share>, by_kind: bool) -> Table {
    let first = if by_kind { "site, data" } else { "site" };
    let classes =
        "cases | >same | >tolerated | >fell back | >detected | >failed | >wrong | >panic | >hung";
    let mut table = Table::new(format!("{first} | >{classes}").as_str());
    for share in shares {
        let name = match &share.kind {
            Some(kind) => format!("{} {kind}", short(&share.site)),
            None => share.site.clone(),
        };
        let [same, tolerated, fell_back, detected, failed, wrong, panicked, hung] =
            Class::ALL.map(|class| share.classes.of(class).to_string());
        let cases = share.cases.to_string();
        table.row([
            name, cases, same, tolerated, fell_back, detected, failed, wrong, panicked, hung,
        ]);
    }
    table
}

/// A site's name where there is little room.
fn short(site: &str) -> &str {
    match site {
        "weights_before_check" => "file",
        "weights_after_check" => "weights",
        "activations" => "act.",
        "kv_cache" => "cache",
        "loop_iterate" => "iterate",
        "loop_residuals" => "residuals",
        "loop_multipliers" => "mult.",
        "loop_scalars" => "scalars",
        "start_before_check" => "start",
        "start_after_check" => "accepted",
        "qp_data" => "qp",
        "qp_solution" => "solution",
        other => other,
    }
}

/// Iterations and cost above those without the fault.
fn costs<'a>(shares: impl Iterator<Item = &'a Share>) -> Table {
    let mut table =
        Table::new("site | class | >cases | >it. mean | >max | >cost mean | >p99 | >max");
    for share in shares {
        for (class, extra) in extras(share) {
            let cases = share.classes.of(class);
            let Statistics { mean, max, .. } = extra.iterations;
            let [it_mean, it_max] = [mean, max].map(|value| sign(number(value)));
            let Statistics { mean, p99, max, .. } = extra.cost;
            let percent = |value: f64| format!("{} %", sign(number(100.0 * value)));
            let [mean, p99, max] = [mean, p99, max].map(percent);
            let (name, cases) = (class.name().to_string(), cases.to_string());
            let site = share.site.clone();
            table.row([site, name, cases, it_mean, it_max, mean, p99, max]);
        }
    }
    table
}

/// Classes of solved plans with cases, and what these cost.
fn extras(share: &Share) -> impl Iterator<Item = (Class, &Extra)> {
    let all = [
        (Class::Tolerated, &share.tolerated),
        (Class::FellBack, &share.fell_back),
        (Class::Detected, &share.detected),
    ];
    all.into_iter().filter(move |(class, _)| share.classes.of(*class) > 0)
}

/// A number with its sign, but for zero.
fn sign(number: String) -> String {
    if number == "0" || number.starts_with('-') { number } else { format!("+{number}") }
}
