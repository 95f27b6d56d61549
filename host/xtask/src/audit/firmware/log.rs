//! Output of an image: lines of a kind and `key=value`, the last of them `end`.

use crate::audit::emulation::{
    Counter, GuidanceRecord, Instructions, Part, PlanRecord, StageCounts, Steps,
};
use remora_host::error::{Error, FieldError};
use remora_host::formats::{Limit, read_bytes};
use std::collections::BTreeMap;
use std::path::Path;
use std::str::FromStr;

/// Kinds of lines that must be the same text on every processor: the same bits.
const RESULTS: [&str; 6] = ["stage", "plan", "residual", "verified", "guidance", "kernel"];

/// Output of one run of an image.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Log {
    /// The board that it ran on.
    pub board: String,
    /// Memory of planner, solver and network [bytes].
    pub workspace_bytes: u64,
    /// The solver's.
    pub solver_bytes: u64,
    /// The network's.
    pub network_bytes: u64,
    /// The state of guidance, and a plan as it is flown [bytes].
    pub guidance_bytes: u64,
    pub flight_plan_bytes: u64,
    /// The instruction counter against a loop of known length.
    pub counter: Option<Counter>,
    /// Largest mark of the stack by entry point [bytes].
    pub stack_bytes: BTreeMap<String, u64>,
    /// Room for the stack [bytes].
    pub stack_size_bytes: u64,
    /// Instructions of opening the model, the most of them, where one was opened.
    pub open_model_instructions: Option<u64>,
    /// Parts of a plan that were called and counted on their own.
    pub parts: Vec<Part>,
    /// Steps of guidance.
    pub guidance: Option<GuidanceRecord>,
    /// The plans, in their order.
    pub plans: Vec<PlanRecord>,
    /// Lines that must be the same everywhere.
    pub results: Vec<String>,
}

/// A log with what was read of the plan that has not ended: its stages and phases.
#[derive(Default)]
struct Reader {
    log: Log,
    stages: BTreeMap<String, StageCounts>,
    phases: BTreeMap<String, u64>,
    longest_slice: Option<u64>,
    plan: Option<PlanLine>,
}

/// Content of a plan's line.
struct PlanLine {
    scenario: String,
    status: u32,
    verified: bool,
    start: u32,
    output: String,
}

/// Bytes below the frame that paints which it leaves alone: see `ci/firmware/src/bare/mod.rs`.
const FRAME_BYTES: u64 = 512;

/// The entry point of a step of guidance.
const GUIDANCE: &str = "guidance";

impl Log {
    /// Reads a log that was written to its end.
    ///
    /// # Errors
    /// A file that cannot be read; a run that ended early, with the last thing it said; a line that
    /// cannot be understood.
    pub fn read(file: &Path) -> Result<Self, Error> {
        let text = read_bytes(file, Limit::BINARY)?;
        Self::parse(&String::from_utf8_lossy(&text)).map_err(|error| error.at(file))
    }

    /// Parses the text of a log.
    fn parse(text: &str) -> Result<Self, FieldError> {
        let lines: Vec<&str> = text.lines().collect();
        match lines.split_last() {
            Some((&"end", lines)) => {
                let mut reader = Reader::default();
                for (i, line) in lines.iter().enumerate() {
                    reader.take(line).map_err(|error| FieldError {
                        field: format!("line {}: {}", i + 1, error.field),
                        ..error
                    })?;
                }
                Ok(reader.log)
            }
            Some((last, _)) => Err(FieldError::new("", format!("ended early, after: {last}"))),
            None => Err(FieldError::new("", "ended early: it is empty")),
        }
    }
}

impl Reader {
    fn take(&mut self, line: &str) -> Result<(), FieldError> {
        let (kind, rest) = line.split_once(' ').unwrap_or((line, ""));
        let words = Words(rest.split(' ').filter_map(|word| word.split_once('=')).collect());
        if RESULTS.contains(&kind) {
            self.log.results.push(line.into());
        }
        match kind {
            "image" => self.log.board = words.text("board")?.into(),
            "size" => {
                self.log.workspace_bytes = words.number("workspace")?;
                self.log.solver_bytes = words.number("solver")?;
                self.log.network_bytes = words.number("network")?;
                self.log.guidance_bytes = words.number("guidance")?;
                self.log.flight_plan_bytes = words.number("flight_plan")?;
            }
            "calibration" => {
                self.log.counter = Some(Counter {
                    expected: words.number("expected")?,
                    counted: words.number("counted")?,
                    resolution: words.number("resolution")?,
                });
            }
            "stack" => {
                self.log.stack_size_bytes = words.number("size")?;
                let used = words.number("used")?;
                let most = self.log.stack_bytes.entry(words.text("entry")?.into()).or_insert(used);
                *most = used.max(*most);
            }
            "count" => self.log.parts.push(Part {
                name: words.text("name")?.into(),
                calls: words.number("calls")?,
                instructions: words.number("instructions")?,
            }),
            "most" => self.take_most(&words)?,
            "above" if words.text("entry")? == GUIDANCE => {
                let above: u64 = words.number("used")?;
                let used = self.log.stack_bytes.get(GUIDANCE);
                let own = used.map(|used| (used + FRAME_BYTES).saturating_sub(above));
                self.flown().stack_bytes = own;
            }
            "stage" => {
                self.stages.insert(words.text("name")?.into(), words.stage()?);
            }
            "plan" => self.plan = Some(words.plan()?),
            "phase" => self.take_phase(&words)?,
            // For people, and for the comparison alone.
            _ => {}
        }
        Ok(())
    }

    fn flown(&mut self) -> &mut GuidanceRecord {
        self.log.guidance.get_or_insert_default()
    }

    /// The most instructions of one of several.
    fn take_most(&mut self, words: &Words<'_>) -> Result<(), FieldError> {
        let steps = words.number("calls")?;
        let instructions: u64 = words.number("instructions")?;
        match words.text("name")? {
            "open_model" => {
                let most = self.log.open_model_instructions.get_or_insert_default();
                *most = instructions.max(*most);
            }
            "slice" => self.longest_slice = Some(instructions),
            "step" => self.flown().next = Steps { steps, instructions },
            "first_step" => self.flown().first = Steps { steps, instructions },
            name => return Err(FieldError::new("name", format!("'{name}' is not known"))),
        }
        Ok(())
    }

    /// The phases of a plan come after it, the last of them in all.
    fn take_phase(&mut self, words: &Words<'_>) -> Result<(), FieldError> {
        let name = words.text("name")?;
        self.phases.insert(name.into(), words.number("instructions")?);
        if name != "total" {
            return Ok(());
        }
        let phases = std::mem::take(&mut self.phases);
        let mut stages = std::mem::take(&mut self.stages);
        let mut stage = |name: &str| {
            stages.remove(name).ok_or_else(|| FieldError::new("stage", format!("none of {name}")))
        };
        let plan =
            self.plan.take().ok_or_else(|| FieldError::new("plan", "none before its phases"))?;
        self.log.plans.push(PlanRecord {
            scenario: plan.scenario,
            status: plan.status,
            verified: plan.verified,
            start: plan.start,
            output: plan.output,
            translation: stage("translation")?,
            reorientation: stage("reorientation")?,
            instructions: Instructions::by(|name| phases.get(name).copied())?,
            longest_slice: self.longest_slice.take(),
        });
        Ok(())
    }
}

/// The words of a line.
struct Words<'a>(Vec<(&'a str, &'a str)>);

impl Words<'_> {
    fn text(&self, key: &'static str) -> Result<&str, FieldError> {
        let found = self.0.iter().find(|(known, _)| *known == key);
        found.map(|(_, value)| *value).ok_or_else(|| FieldError::new(key, "missing"))
    }

    fn number<T: FromStr>(&self, key: &'static str) -> Result<T, FieldError> {
        let text = self.text(key)?;
        text.parse().map_err(|_| FieldError::new(key, format!("'{text}' is not a whole number")))
    }

    fn stage(&self) -> Result<StageCounts, FieldError> {
        Ok(StageCounts {
            status: self.number("status")?,
            iterations: self.number("iterations")?,
            corrections: self.number("corrections")?,
            qp_iterations: self.number("qp_iterations")?,
        })
    }

    fn plan(&self) -> Result<PlanLine, FieldError> {
        Ok(PlanLine {
            scenario: self.text("scenario")?.into(),
            status: self.number("status")?,
            verified: self.number::<u8>("verified")? == 1,
            start: self.number("start")?,
            output: self.text("output")?.into(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLANNED: &str = "\
image board=mps2-an500
size workspace=436896 solver=544088 network=64560 guidance=720 flight_plan=16904
calibration expected=2000000 counted=2000040 resolution=40
most name=open_model calls=1 instructions=77
stack entry=plan used=27688 size=262144
stage scenario=pub-000 name=translation status=0 iterations=4 corrections=0 qp_iterations=28 cost=3f(8e-4)
stage scenario=pub-000 name=reorientation status=0 iterations=9 corrections=1 qp_iterations=91 cost=3f(2e-1)
plan scenario=pub-000 status=0 verified=1 start=1 input=9e settings=57 output=e5a5f9ce46963a5d
residual scenario=pub-000 dynamics1=3d64aa0000000000(5.87e-13)
most scenario=pub-000 name=slice calls=1 instructions=6615960
phase scenario=pub-000 name=translation instructions=1
phase scenario=pub-000 name=start instructions=2
phase scenario=pub-000 name=inference instructions=3
phase scenario=pub-000 name=linearise instructions=4
phase scenario=pub-000 name=qp instructions=5
phase scenario=pub-000 name=step instructions=6
phase scenario=pub-000 name=verify instructions=7
phase scenario=pub-000 name=rest instructions=8
phase scenario=pub-000 name=total instructions=36
stack entry=plan used=27700 size=262144
verified scenario=pub-000 claim=af9ecf86c2b85ff5 accepted=yes
guidance scenario=pub-000 place=start steps=8 checksum=96004bece59a4cc9
most scenario=pub-000 name=first_step calls=7 instructions=142680
most scenario=pub-000 name=step calls=53 instructions=51240
stack entry=guidance used=9376 size=262144
above entry=guidance used=6232
end
";

    #[test]
    fn a_log_is_read_to_its_end() {
        let log = Log::parse(PLANNED).unwrap();
        assert_eq!((log.board.as_str(), log.solver_bytes), ("mps2-an500", 544_088));
        assert!(log.counter.unwrap().is_right());
        assert_eq!((log.stack_bytes["plan"], log.stack_size_bytes), (27_700, 262_144));
        assert_eq!(log.open_model_instructions, Some(77));
        let [plan] = &log.plans[..] else { panic!("{log:?}") };
        assert!(plan.is_solved() && plan.start == 1 && plan.reorientation.corrections == 1);
        assert_eq!(plan.qp_iterations(), 28 + 91);
        assert_eq!(plan.longest_slice, Some(6_615_960));
        // Two stages, the plan, a residual, what the verifier found, and some steps of guidance.
        assert_eq!(log.results.len(), 6);
    }

    #[test]
    fn steps_of_guidance_are_read_with_the_stack_of_one() {
        let log = Log::parse(PLANNED).unwrap();
        assert_eq!((log.guidance_bytes, log.flight_plan_bytes), (720, 16_904));
        let flown = log.guidance.unwrap();
        assert_eq!(flown.next, Steps { steps: 53, instructions: 51_240 });
        assert_eq!(flown.first, Steps { steps: 7, instructions: 142_680 });
        assert_eq!(flown.stack_bytes, Some(9376 + FRAME_BYTES - 6232));
        // The host paints nothing.
        let host: String = PLANNED
            .lines()
            .filter(|line| !line.starts_with("stack"))
            .fold(String::new(), |text, line| text + line + "\n");
        assert_eq!(Log::parse(&host).unwrap().guidance.unwrap().stack_bytes, None);
        let damaged = PLANNED.replace("name=first_step", "name=last_step");
        assert!(Log::parse(&damaged).unwrap_err().reason.contains("'last_step' is not known"));
    }

    #[test]
    fn a_log_that_ended_early_or_is_damaged_is_refused() {
        let reason = |text: &str| {
            let FieldError { field, reason } = Log::parse(text).unwrap_err();
            format!("{field}: {reason}")
        };
        assert!(reason("").contains("is empty"));
        assert!(
            reason(&PLANNED.replace("end\n", "fault 3\n")).contains("ended early, after: fault 3")
        );
        let damaged = PLANNED.replace("solver=544088", "solver=x");
        assert_eq!(reason(&damaged), "line 2: solver: 'x' is not a whole number");
        let damaged = PLANNED.replace("used=27688 ", "");
        assert_eq!(reason(&damaged), "line 5: used: missing");
        let damaged = PLANNED.replace("name=verify", "name=verified");
        assert!(reason(&damaged).ends_with("verify: missing"), "{}", reason(&damaged));
        let damaged = PLANNED.replace("plan scenario", "plans scenario");
        assert!(reason(&damaged).contains("none before its phases"));
    }
}
