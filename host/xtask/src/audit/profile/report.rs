//! Text that `cargo xtask profile` prints.

use super::results::{CaseProfile, ConfigurationProfile, PHASES, Profile};
use super::spread::Spread;
use remora_host::report::{Align, Table, number, time};
use std::fmt::Write;

/// The machine, the tables, and which bars were reached.
pub fn profile_report(profile: &Profile) -> String {
    let mut out = profile_preamble(profile);
    out.push('\n');
    for (heading, table) in profile.tables().into_iter().chain(profile.phase_tables()) {
        let _ = writeln!(out, "{heading}\n{table}");
    }
    let missed: Vec<_> = profile.bars.iter().filter(|bar| !bar.is_met).collect();
    let _ =
        writeln!(out, "bars: {} of {} met", profile.bars.len() - missed.len(), profile.bars.len());
    for bar in missed {
        let _ = writeln!(
            out,
            "  missed: {}, {}: {:.2}, at least {:.1} wanted",
            bar.name, bar.configuration, bar.value, bar.least
        );
    }
    out
}

/// Preamble: the measurements, the machine, and its load.
pub fn profile_preamble(profile: &Profile) -> String {
    let Profile { machine, pinning, rounds, .. } = profile;
    let cores = match (&pinning.cores, &pinning.refused) {
        (Some([own, other]), _) => format!("pinned to cores {own} and {other}"),
        (None, reason) => format!("not pinned: {}", reason.as_deref().unwrap_or("unknown")),
    };
    let load = |load: Option<[f64; 3]>| load.map_or("unknown".into(), |load| load[0].to_string());
    let share = |share: Option<f64>| {
        share.map_or("unknown".into(), |share| format!("{:.1} %", 100.0 * share))
    };
    let counter = profile
        .no_counter
        .as_ref()
        .map_or("counted".into(), |reason| format!("not counted ({reason})"));
    format!(
        "{}, {cores}\n\
         {} scenarios; rounds: Euler {} ({} on two cores), RK4 {}; {} warm-up plans discarded in each case\n\
         load {} before, {} after; all cores together idle {}, stolen {}\n\
         timer: resolution {}, overhead {}; instructions: {counter}\n\
         jitter is max - min, tail is p99 - median; p99.9 needs a thousand measurements\n\
         took {}\n",
        machine.processor,
        profile.scenarios,
        rounds.euler,
        rounds.euler_second_core,
        rounds.rk4,
        profile.warm_up_plans,
        load(machine.load_before),
        load(machine.load_after),
        share(machine.idle_share),
        share(machine.steal_share),
        nanoseconds(machine.timer_resolution_s),
        nanoseconds(machine.timer_overhead_s),
        time(profile.wall_s),
    )
}

fn nanoseconds(seconds: f64) -> String {
    format!("{:.0} ns", seconds * 1e9)
}

fn milliseconds(seconds: f64) -> String {
    number(seconds * 1e3)
}

/// A table of spreads with this first column.
fn spread_table(first: &str) -> Table {
    let head =
        format!("{first} | >n | >min | >median | >p95 | >p99 | >p99.9 | >max | >jitter | >tail");
    Table::new(head.as_str())
}

fn spread_row(table: &mut Table, name: &str, s: &Spread, show: fn(f64) -> String) {
    let p999 = s.p999.map_or("-".into(), show);
    let [min, median, p95, p99, max] = [s.min, s.median, s.p95, s.p99, s.max].map(show);
    let [jitter, tail] = [s.jitter_range, s.jitter_p99].map(show);
    table.row([name.into(), s.n.to_string(), min, median, p95, p99, p999, max, jitter, tail]);
}

/// Spreads of a case's phases.
fn phases(case: &CaseProfile) -> Table {
    let mut table = spread_table("phase");
    for phase in &case.phase_s {
        spread_row(&mut table, &phase.phase.replace('_', " "), &phase.spread, milliseconds);
    }
    table
}

impl Profile {
    /// The tables over all configurations, each with its heading: whole plans in each case, single
    /// calls, what the second core is worth, instructions, bars.
    pub fn tables(&self) -> Vec<(String, Table)> {
        let mut tables = vec![
            self.plan_table("Whole plan on one core [ms]", |c| &c.one_core),
            self.plan_table("Whole plan on two cores [ms]", |c| &c.two_cores),
            self.plan_table("Whole plan while the other core plans too [ms]", |c| &c.two_plans),
            self.call_table("Single linearisation on one core [ms]", |c| {
                c.one_core.linearise_call_s
            }),
            self.call_table("Single linearisation on two cores [ms]", |c| {
                c.two_cores.linearise_call_s
            }),
            self.call_table("Single subproblem on one core [ms]", |c| c.one_core.qp_call_s),
            ("The second core (medians of ratios, plan by plan)".into(), self.second_core()),
        ];
        if self.configurations.iter().any(|c| c.instructions.is_some()) {
            tables.push(("Instructions retired on one core, medians".into(), self.counted()));
        }
        tables.push(("Bars".into(), self.bar_table()));
        tables
    }

    /// Whole plans on one core and what the second is worth, a row a configuration.
    pub fn overview(&self) -> Table {
        let mut table = Table::new(
            " | >n | >median | >p99 | >p99.9 | >max | >linearisation | >throughput | >p99 beside",
        );
        for c in &self.configurations {
            let plan = c.one_core.phase("whole_plan");
            table.row([
                c.name.clone(),
                plan.n.to_string(),
                milliseconds(plan.median),
                milliseconds(plan.p99),
                plan.p999.map_or("-".into(), milliseconds),
                milliseconds(plan.max),
                format!("{:.2}", c.linearisation_ratio),
                format!("{:.2}", c.throughput_ratio),
                milliseconds(c.two_plans.phase("whole_plan").p99),
            ]);
        }
        table
    }

    fn slowest_configuration(&self) -> Option<&ConfigurationProfile> {
        let time = |c: &ConfigurationProfile| c.one_core.phase("whole_plan").median;
        self.configurations.iter().max_by(|a, b| time(a).total_cmp(&time(b)))
    }

    /// The configuration whose plans take longest: median, p99 and maximum of its phases on one core.
    pub fn slowest(&self) -> Option<(&str, Table)> {
        let mut table = Table::new("phase | >median | >p99 | >max");
        let slowest = self.slowest_configuration()?;
        for phase in &slowest.one_core.phase_s {
            let [median, p99, max] =
                [phase.spread.median, phase.spread.p99, phase.spread.max].map(milliseconds);
            table.row([phase.phase.replace('_', " "), median, p99, max]);
        }
        Some((slowest.name.as_str(), table))
    }

    /// The phases of a plan on one core and on two, a table a configuration.
    pub fn phase_tables(&self) -> Vec<(String, Table)> {
        let both = |c: &ConfigurationProfile| {
            let heading = |cores| format!("Phases of a plan {cores}, {} [ms]", c.name);
            [
                (heading("on one core"), phases(&c.one_core)),
                (heading("on two cores"), phases(&c.two_cores)),
            ]
        };
        self.configurations.iter().flat_map(both).collect()
    }

    fn plan_table(
        &self,
        heading: &str,
        case: fn(&ConfigurationProfile) -> &CaseProfile,
    ) -> (String, Table) {
        let mut table = spread_table("");
        for c in &self.configurations {
            spread_row(&mut table, &c.name, &case(c).phase("whole_plan"), milliseconds);
        }
        (heading.into(), table)
    }

    fn call_table(
        &self,
        heading: &str,
        spread: fn(&ConfigurationProfile) -> Spread,
    ) -> (String, Table) {
        let mut table = spread_table("");
        for c in &self.configurations {
            spread_row(&mut table, &c.name, &spread(c), milliseconds);
        }
        (heading.into(), table)
    }

    /// Gain from the second core for one plan and for two, and its cost for the first one's tail.
    fn second_core(&self) -> Table {
        let mut table = Table::new(
            " | >linearisation | >plan | >throughput | >p99 alone | >p99 beside | >ratio | >preempted",
        );
        for c in &self.configurations {
            let p99 = |case: &CaseProfile| milliseconds(case.phase("whole_plan").p99);
            let cases = [&c.one_core, &c.two_cores, &c.two_plans];
            table.row([
                c.name.clone(),
                format!("{:.2} x", c.linearisation_ratio),
                format!("{:.2} x", c.plan_ratio),
                format!("{:.2} x", c.throughput_ratio),
                p99(&c.one_core),
                p99(&c.two_plans),
                format!("{:.2}", c.interference_p99_ratio),
                cases.map(|case| case.involuntary_switches.to_string()).join("/"),
            ]);
        }
        table
    }

    fn counted(&self) -> Table {
        let mut head = vec![("", Align::Left)];
        head.extend(PHASES.iter().map(|(name, _)| (*name, Align::Right)));
        let head: [(&str, Align); 9] = std::array::from_fn(|i| head[i]);
        let mut table = Table::new(head);
        for c in &self.configurations {
            let phases = c.instructions.iter().flatten();
            let mut cells = phases.map(|phase| format!("{:.2e}", phase.spread.median));
            let mut cell = || cells.next().unwrap_or_default();
            let cells: [String; 8] = std::array::from_fn(|_| cell());
            let [a, b, d, e, f, g, h, i] = cells;
            table.row([c.name.clone(), a, b, d, e, f, g, h, i]);
        }
        table
    }

    fn bar_table(&self) -> Table {
        let mut table = Table::new("bar | configuration | >value | >least | ");
        for bar in &self.bars {
            table.row([
                bar.name.clone(),
                bar.configuration.clone(),
                format!("{:.2}", bar.value),
                format!("{:.1}", bar.least),
                if bar.is_met { "met" } else { "missed" }.into(),
            ]);
        }
        table
    }
}
