//! The bars that images are held to.

use super::image::Built;
use super::log::Log;
use super::target::Target;

/// Largest image where memories are small [bytes]. It was 384 KiB before clearances, refusals and the
/// verifier's own truth came into it, which were allowed a quarter more than the 370,912 bytes before
/// them. Models are no part of the image: data of their own.
const MAX_IMAGE_BYTES: u64 = 452 << 10;

/// Largest memory of planner, solver and network [bytes].
const MAX_MEMORY_BYTES: u64 = 1024 << 10;

/// Largest mark of the stack where memories are small [bytes].
const MAX_STACK_BYTES: u64 = 32 << 10;

/// Most instructions of a step of guidance, and of planning between two of them, where processors are slow:
/// 0.2 ms and 50 ms of 300 MHz.
const MAX_STEP: u64 = 60_000;
const MAX_SLICE: u64 = 15_000_000;

/// Largest stack of a step of guidance where memories are small [bytes].
const MAX_STEP_STACK_BYTES: u64 = 4 << 10;

/// The bars that an image breaks, a line each.
pub fn of_image(target: &Target, built: &Built) -> Vec<String> {
    let mut broken = Vec::new();
    if !built.panics.is_empty() {
        broken.push(format!("a panic can be reached: {}", built.panics.join(", ")));
    }
    if target.is_small {
        most(&mut broken, "image", built.image_bytes, MAX_IMAGE_BYTES);
    }
    broken
}

/// The bars that a run breaks, a line each.
pub fn of_run(target: &Target, log: &Log) -> Vec<String> {
    let mut broken = Vec::new();
    let memory = log.workspace_bytes + log.solver_bytes + log.network_bytes;
    most(&mut broken, "memory", memory, MAX_MEMORY_BYTES);
    let stack = log.stack_bytes.values().copied().max().unwrap_or_default();
    if stack > 0 && stack == log.stack_size_bytes {
        broken.push("the stack ran over".into());
    }
    if target.is_small {
        most(&mut broken, "stack", stack, MAX_STACK_BYTES);
        guidance(&mut broken, log);
    }
    match log.counter {
        Some(counter) if counter.is_right() => {}
        Some(counter) => broken.push(format!(
            "counter: {} instructions of {}, resolution {}",
            counter.counted, counter.expected, counter.resolution
        )),
        None => broken.push("the counter was not held against its loop".into()),
    }
    broken
}

/// Guidance flies in every run, and planning leaves it its turns.
fn guidance(broken: &mut Vec<String>, log: &Log) {
    match log.guidance {
        Some(flown) => {
            // Not of a first step, which may have a whole interval to catch up with.
            let step = flown.next.instructions;
            above(broken, "step of guidance", step, MAX_STEP, "instructions");
            let stack = flown.stack_bytes.unwrap_or_default();
            most(broken, "stack of guidance", stack, MAX_STEP_STACK_BYTES);
        }
        None => broken.push("guidance did not fly".into()),
    }
    let slice = log.plans.iter().filter_map(|plan| plan.longest_slice).max().unwrap_or_default();
    above(broken, "slice of planning", slice, MAX_SLICE, "instructions");
}

fn most(broken: &mut Vec<String>, what: &str, value: u64, bar: u64) {
    above(broken, what, value, bar, "bytes");
}

fn above(broken: &mut Vec<String>, what: &str, value: u64, bar: u64, unit: &str) {
    if value > bar {
        broken.push(format!("{what}: {value} {unit} of {bar}"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::audit::emulation::{Counter, GuidanceRecord, Steps};
    use crate::audit::firmware::target::TARGETS;

    #[test]
    fn what_is_too_large_is_named_with_its_bar() {
        let [small, large, ..] = &TARGETS;
        let mut built = Built {
            image_bytes: MAX_IMAGE_BYTES,
            model_bytes: 1 << 40,
            static_bytes: 0,
            request: 0,
            panics: vec![],
        };
        assert_eq!(of_image(small, &built), [""; 0]);
        built.image_bytes += 1;
        assert_eq!(of_image(small, &built), ["image: 462849 bytes of 462848"]);
        assert_eq!(of_image(large, &built), [""; 0]);
        built.panics = vec!["core::panicking::panic".into()];
        assert_eq!(of_image(large, &built), ["a panic can be reached: core::panicking::panic"]);
    }

    #[test]
    fn a_run_is_held_to_memory_stack_and_counter() {
        let [small, large, ..] = &TARGETS;
        let counter = Some(Counter { expected: 100, counted: 108, resolution: 0 });
        let guidance = Some(GuidanceRecord {
            next: Steps { steps: 53, instructions: MAX_STEP },
            first: Steps { steps: 7, instructions: 3 * MAX_STEP },
            stack_bytes: Some(MAX_STEP_STACK_BYTES),
        });
        let mut log = Log { stack_size_bytes: 40_000, counter, guidance, ..Log::default() };
        log.stack_bytes.insert("plan".into(), MAX_STACK_BYTES);
        log.workspace_bytes = MAX_MEMORY_BYTES;
        assert_eq!(of_run(small, &log), [""; 0]);
        log.network_bytes = 1;
        log.stack_bytes.insert("verify".into(), 40_000);
        log.counter = Some(Counter { expected: 100, counted: 109, resolution: 0 });
        let broken = of_run(small, &log);
        assert_eq!(broken[0], "memory: 1048577 bytes of 1048576");
        assert_eq!(broken[1..3], ["the stack ran over", "stack: 40000 bytes of 32768"]);
        assert!(broken[3].starts_with("counter: 109"), "{broken:?}");
        log.guidance = guidance.map(|flown| GuidanceRecord {
            next: Steps { instructions: MAX_STEP + 1, ..flown.next },
            stack_bytes: Some(MAX_STEP_STACK_BYTES + 1),
            ..flown
        });
        let broken = of_run(small, &log);
        assert_eq!(
            broken[3..5],
            [
                "step of guidance: 60001 instructions of 60000",
                "stack of guidance: 4097 bytes of 4096"
            ]
        );
        log.guidance = None;
        assert_eq!(of_run(small, &log)[3], "guidance did not fly");
        log.counter = None;
        assert_eq!(of_run(large, &log).len(), 3);
    }
}
