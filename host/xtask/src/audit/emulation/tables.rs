//! Measurements under emulation, as tables.

use super::{Emulation, IntegratorName, Phase, Run, StartName, Steps, Target};
use remora_host::report::{Align, Table, number};

impl Emulation {
    /// Headings and tables: the images, the runs, the stack, instructions by phase for each
    /// integrator and start, the observed maxima, the parts of a plan.
    pub fn tables(&self) -> Vec<(String, Table)> {
        let mut tables = vec![
            ("Images".to_string(), self.images()),
            ("Runs under emulation".to_string(), self.runs()),
            ("Stack, high-water mark [bytes]".to_string(), self.stacks()),
        ];
        for (integrator, start) in self.kinds() {
            let runs = self.targets.iter().filter_map(|t| Some((t, t.run(integrator, start)?)));
            let (integrator, start) = (integrator.label(), start.name());
            tables.push((
                format!("Instructions [10^6]: {integrator}, start from the {start}"),
                phases(runs),
            ));
        }
        tables.push(("Observed maxima".to_string(), self.maxima()));
        if self.targets.iter().any(|target| !target.parts.is_empty()) {
            tables.push(("Parts of a plan, one by one".to_string(), self.parts()));
        }
        tables
    }

    /// Integrators and initial guesses of all runs, in their order.
    fn kinds(&self) -> Vec<(IntegratorName, StartName)> {
        let mut kinds = Vec::new();
        for (_, run) in self.each() {
            if !kinds.contains(&(run.integrator, run.start)) {
                kinds.push((run.integrator, run.start));
            }
        }
        kinds
    }

    /// Most instructions of a whole plan [10^6] and its scenario, a row a run, a column a target.
    pub fn plan_maxima(&self) -> Table {
        let mut table = self.table_by_target("integrator, initial guess");
        for (integrator, start) in self.kinds() {
            let most = |target: &Target| {
                let plan = target.run(integrator, start)?.observed(Phase::Total)?;
                Some(format!("{}, {}", millions(plan.max_instructions), plan.max_scenario))
            };
            let cells =
                self.targets.iter().map(|target| most(target).unwrap_or_else(|| "-".into()));
            let name = format!("{}, {}", integrator.label(), start.name());
            table.push([name].into_iter().chain(cells).collect());
        }
        table
    }

    /// Most instructions between two pauses of planning and of a step of guidance, and its stack.
    pub fn cycle_maxima(&self) -> Table {
        let mut table = Table::new(" | >slice | >step | >first step | >stack [bytes]");
        let or_none = |number: Option<u64>| number.map_or("-".into(), |number| number.to_string());
        for target in &self.targets {
            let guidance = target.guidance();
            table.row([
                target.cpu.clone(),
                or_none(target.longest_slice()),
                or_none(guidance.map(|flown| flown.next.instructions)),
                or_none(guidance.map(|flown| flown.first.instructions)),
                or_none(guidance.and_then(|flown| flown.stack_bytes)),
            ]);
        }
        table
    }

    /// An empty table with a first column and a column a target.
    fn table_by_target(&self, first: &str) -> Table {
        let targets = self.targets.iter().map(|target| (target.cpu.clone(), Align::Right));
        Table::with_columns([(first.to_string(), Align::Left)].into_iter().chain(targets).collect())
    }

    /// Most of a plan [10^6], of a slice between two pauses of planning and of a step of guidance, a row a run.
    pub fn maxima(&self) -> Table {
        let mut table = Table::new(
            " | integrator | start | >plan | of | >slice | of | >step | >first step | >stack",
        );
        let steps = |of: Steps| format!("{} of {}", of.instructions, of.steps);
        let or_none = |text: Option<String>| text.unwrap_or_else(|| "-".into());
        for (target, run) in self.each() {
            let (plan, slice) = (run.observed(Phase::Total), run.longest_slice());
            let stack = run.guidance.and_then(|flown| flown.stack_bytes);
            table.row([
                target.cpu.clone(),
                run.integrator.label().into(),
                run.start.name().into(),
                or_none(plan.map(|plan| millions(plan.max_instructions))),
                or_none(plan.map(|plan| plan.max_scenario.clone())),
                or_none(slice.map(|(instructions, _)| instructions.to_string())),
                or_none(slice.map(|(_, scenario)| scenario.to_string())),
                or_none(run.guidance.map(|flown| steps(flown.next))),
                or_none(run.guidance.map(|flown| steps(flown.first))),
                or_none(stack.map(|bytes| bytes.to_string())),
            ]);
        }
        table
    }

    /// Observed maxima over all runs, a row a phase, a column a target.
    pub fn phase_maxima(&self) -> Table {
        let mut table = self.table_by_target("phase");
        let most = |target: &Target, phase: Phase| {
            let observed = target.runs.iter().filter_map(|run| run.observed(phase));
            observed.map(|observed| observed.max_instructions).max().unwrap_or(0)
        };
        for phase in Phase::ALL {
            let cells = self.targets.iter().map(|target| millions(most(target, phase)));
            table.push([phase.label().to_string()].into_iter().chain(cells).collect());
        }
        table
    }

    fn images(&self) -> Table {
        let mut table = Table::new(
            " | compiler | >image | >models | >workspace | >solver | >network | >static | panics",
        );
        for t in &self.targets {
            let bytes = [t.image_bytes, t.model_bytes, t.workspace_bytes, t.solver_bytes];
            let [image, models, workspace, solver] = bytes.map(|bytes| bytes.to_string());
            table.row([
                t.cpu.clone(),
                t.toolchain.clone(),
                image,
                models,
                workspace,
                solver,
                t.network_bytes.to_string(),
                t.static_bytes.to_string(),
                if t.panic_free { "none" } else { "REACHABLE" }.into(),
            ]);
        }
        table
    }

    fn runs(&self) -> Table {
        let mut table = Table::new(
            " | integrator | start | >solved | >fell back | bits of the host | second run | >counter off by",
        );
        for (target, run) in self.each() {
            let counter = run.counter;
            let error = counter.counted.cast_signed() - counter.expected.cast_signed();
            table.row([
                target.cpu.clone(),
                run.integrator.label().into(),
                run.start.name().into(),
                format!("{} of {}", run.solved, run.scenarios),
                run.fell_back.to_string(),
                if run.same_bits_as_host { "yes" } else { "NO" }.into(),
                match run.repeatable {
                    Some(true) => "the same",
                    Some(false) => "DIFFERS",
                    None => "-",
                }
                .into(),
                format!("{error} of {}", counter.expected),
            ]);
        }
        table
    }

    fn stacks(&self) -> Table {
        let mut table = Table::new(" | integrator | start | entry point | >used");
        for (target, run) in self.each() {
            for (entry, used) in &run.stack_bytes {
                table.row([
                    target.cpu.clone(),
                    run.integrator.label().into(),
                    run.start.name().into(),
                    entry.clone(),
                    used.to_string(),
                ]);
            }
        }
        table
    }

    fn parts(&self) -> Table {
        let mut table = Table::new(" | part | >calls | >instructions");
        for target in &self.targets {
            for part in &target.parts {
                table.row([
                    target.cpu.clone(),
                    part.name.clone(),
                    part.calls.to_string(),
                    part.instructions.to_string(),
                ]);
            }
        }
        table
    }

    fn each(&self) -> impl Iterator<Item = (&Target, &Run)> {
        self.targets.iter().flat_map(|target| target.runs.iter().map(move |run| (target, run)))
    }
}

fn millions(instructions: u64) -> String {
    number(instructions as f64 * 1e-6)
}

/// Millions of instructions by phase, a row a target and phase.
fn phases<'a>(runs: impl Iterator<Item = (&'a Target, &'a Run)>) -> Table {
    let mut table = Table::new(" | phase | >min | >median | >observed maximum, emulated | on");
    for (target, run) in runs {
        // A phase that never was is none: the learned start where nobody asked for it.
        for observed in run.phases.iter().filter(|observed| observed.max_instructions > 0) {
            table.row([
                target.cpu.clone(),
                observed.phase.label().into(),
                millions(observed.min_instructions),
                millions(observed.median_instructions),
                millions(observed.max_instructions),
                observed.max_scenario.clone(),
            ]);
        }
    }
    table
}
