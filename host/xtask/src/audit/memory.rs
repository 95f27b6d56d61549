//! Memory: static memory by part, code and constants, stack bounds, and the proofs that nothing is
//! allocated and nothing panics.

use super::budgets::{Measured, Quantity};
use super::emulation;
use super::firmware::{HOST, Target};
use super::image::PLANNER;
use image_audit::{Image, Kind, Proofs, Sizes, StackBound};
use remora_core::advanced::guidance::{FlightPlan, Guidance};
use remora_core::advanced::planner::memory;
use remora_host::allocations;
use remora_host::error::Error;
use remora_host::formats::{Mission, ScenarioSet};
use remora_host::learned::Learned;
use remora_host::memory::on_large_stack;
use remora_host::method::{Integrator, Method, Mode, WarmStart};
use remora_host::planning::Planner;
use remora_host::request::PlanRequest;
use remora_host::threads::Threads;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Memory findings of an audit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Memory {
    /// Static memory of the planner by part, on a 64-bit machine.
    pub parts: Vec<Part>,
    /// Memory that flying a plan needs besides.
    pub guidance: Vec<Part>,
    /// The built-in models.
    pub models: Vec<Part>,
    /// Requests for memory while planning on the host; none where the program does not count.
    pub allocations: Option<Vec<Allocations>>,
    /// The images.
    pub images: Vec<ImageMemory>,
}

/// Something with a size.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Part {
    /// Its name.
    pub name: String,
    /// Its size.
    pub bytes: u64,
}

/// Requests for memory with one way of planning, once it had planned.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Allocations {
    /// Integrator, mode, start, threads.
    pub method: String,
    /// How many plans.
    pub plans: u64,
    /// How often memory was asked for, by any thread.
    pub requests: u64,
}

/// Memory of one image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImageMemory {
    /// The target's triple, or `host`.
    pub target: String,
    /// Its code and data.
    pub sizes: Sizes,
    /// Bounds of its stack by entry point.
    pub stacks: Vec<StackBound>,
    /// Proofs from its symbols.
    pub proofs: Proofs,
}

/// The images that are looked at: the host's, and those of a report whose code is understood.
pub fn images() -> impl Iterator<Item = &'static str> {
    [HOST].into_iter().chain(Target::audited().map(|target| target.name))
}

/// Plans of each method whose requests are counted.
const PLANS: usize = 5;

impl Memory {
    /// Looks at the images in `folder`, and counts requests for memory of this program.
    ///
    /// # Errors
    /// An image that is not there or cannot be understood; a thread that cannot be started.
    pub fn measure(folder: &Path) -> Result<Self, Error> {
        let part = |name: &str, bytes: usize| Part { name: name.into(), bytes: bytes as u64 };
        let images = images().map(|target| ImageMemory::read(folder, target));
        Ok(Self {
            parts: memory::parts().map(|of| part(of.name, of.bytes)).into(),
            guidance: [
                part("guidance", <Guidance>::BYTES),
                part("flight_plan", <FlightPlan>::BYTES),
            ]
            .into(),
            models: [Integrator::Euler, Integrator::RK4]
                .map(|integrator| {
                    let model = Learned::built_in(integrator);
                    part(&model.record().name, Learned::built_in_file(integrator).len())
                })
                .into(),
            allocations: match allocations::are_counted() {
                true => Some(count()?),
                false => None,
            },
            images: images.collect::<Result<_, _>>()?,
        })
    }

    /// The numbers that there may be budgets for.
    pub fn measured(&self) -> Measured {
        let mut measured = Measured::new();
        let parts: u64 = self.parts.iter().map(|part| part.bytes).sum();
        measured.insert(Quantity::new("host", "planner_memory_bytes"), parts);
        measured.extend(self.images.iter().flat_map(ImageMemory::measured));
        measured
    }
}

impl ImageMemory {
    /// Reads an image as `cargo xtask firmware` leaves it.
    ///
    /// # Errors
    /// As [`Image::read`].
    pub fn read(folder: &Path, target: &str) -> Result<Self, Error> {
        let file = |extension: &str| folder.join(format!("{target}.{extension}"));
        let image = Image::read(&file("elf"), &file("remarks"), &PLANNER)
            .map_err(|error| Error::input(&error.file, "", error.reason))?;
        Ok(Self {
            target: target.into(),
            sizes: image.sizes(),
            stacks: image.stacks(),
            proofs: image.proofs(),
        })
    }

    /// Read-only data, the models apart.
    pub fn constants_bytes(&self) -> u64 {
        let models = self.sizes.models.iter().map(|model| model.bytes).sum();
        self.sizes.total(Kind::ReadOnly).saturating_sub(models)
    }

    /// The numbers that there may be budgets for.
    pub fn measured(&self) -> Measured {
        let mut measured = Measured::new();
        let mut add = |name: &str, value: u64| {
            measured.insert(Quantity::new(&self.target, name), value);
        };
        // The host's image is mostly the standard library.
        if self.target != "host" {
            add("code_bytes", self.sizes.total(Kind::Code));
            add("constants_bytes", self.constants_bytes());
        }
        if let Some(bound) = self.bound("plan") {
            add("stack_bound_bytes", bound);
        }
        if let Some(bound) = self.bound("guidance") {
            add("guidance_stack_bytes", bound);
        }
        measured
    }

    /// High-water mark of the stack at an entry point, less the frames of the image's functions
    /// above it; none where it was not painted.
    pub fn mark(&self, target: &emulation::Target, entry: &str) -> Option<u64> {
        if entry == "guidance" {
            // The image itself leaves out the callers of a step.
            return target.guidance()?.stack_bytes;
        }
        let above = match entry {
            "image" => 0,
            // The worst chain from the image's entry leads to a plan.
            _ => self.bound("image")?.checked_sub(self.bound("plan")?)?,
        };
        let mark = match entry {
            "image" => target.stack_bytes.values().max(),
            "verification" => target.stack_bytes.get("verify"),
            "opening a model" => target.stack_bytes.get("open_model"),
            _ => target.stack_bytes.get(entry),
        };
        mark.map(|mark| mark.saturating_sub(above))
    }

    /// Bound of the stack below an entry point.
    pub fn bound(&self, entry: &str) -> Option<u64> {
        self.stacks.iter().find(|bound| bound.name == entry)?.bytes
    }
}

/// Counts requests for memory over all ways of planning.
fn count() -> Result<Vec<Allocations>, Error> {
    let set = ScenarioSet::built_in()?;
    let mut counted = Vec::new();
    for threads in [Threads::One, Threads::Two] {
        for integrator in [Integrator::Euler, Integrator::RK4] {
            for mode in [Mode::Optimal, Mode::Feasible] {
                for warm_start in [WarmStart::Heuristic, WarmStart::Model] {
                    let method = Method { mode, integrator, warm_start, ..Method::default() };
                    let request = PlanRequest::new(Mission::default(), method, None)?;
                    let request = PlanRequest { threads, ..request };
                    let requests = on_large_stack(|| {
                        let mut planner = Planner::new();
                        let mut plan = |i: usize| {
                            planner.plan_in_place(&request, &set.scenarios[i]);
                        };
                        // Starts the second thread, makes the network's memory.
                        plan(0);
                        allocations::during(|| (0..PLANS).for_each(plan))
                    })?;
                    let shared = if threads == Threads::Two { ", two threads" } else { "" };
                    let (mode, start) = (mode.name(), warm_start.name());
                    counted.push(Allocations {
                        method: format!("{integrator}, {mode}, {start}{shared}"),
                        plans: PLANS as u64,
                        requests: requests as u64,
                    });
                }
            }
        }
    }
    Ok(counted)
}
