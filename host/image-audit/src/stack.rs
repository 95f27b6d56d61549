//! Bounds on the stack: the compiler's frames along the worst chain of calls.

use super::elf::{Elf, Machine, SymbolKind};
use super::functions::{Function, Program};
use super::graph::{Below, Graph};
use super::names;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// A function to bound the stack below.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EntryPoint {
    /// Name for readers.
    pub name: &'static str,
    /// Its path without generic arguments, or its symbol where it has no Rust name; several where
    /// it goes by different names on different boards.
    pub paths: &'static [&'static str],
}

/// A trait whose methods the program calls through pointers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TraitObject {
    /// The trait's path.
    pub path: &'static str,
    /// Modules, `crate::module::`, whose code may call its methods: none where all may.
    pub callers: &'static [&'static str],
}

/// The program that is looked for in an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Subject {
    /// Its crates, as symbols spell them.
    pub crates: &'static [&'static str],
    /// Functions to bound the stack below.
    pub entry_points: &'static [EntryPoint],
    /// All traits of which its crates have objects, where they have no pointers to functions: a call
    /// through a pointer in their code is then a call of one of these traits' methods.
    pub traits: &'static [TraitObject],
    /// The symbol that every image has, if it has symbols at all: what the start-up code calls.
    pub main: &'static str,
    /// The symbol that only the panic handler refers to.
    pub panic_mark: &'static str,
    /// Prefix of the names of constants that are counted by themselves (learned models).
    pub models: &'static str,
}

/// How calls through pointers were bounded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Dispatch {
    /// Each may reach every function whose address is taken anywhere in the image.
    AnyTaken,
    /// In the program's own crates each may reach every method whose address is taken of those of
    /// [`Subject::traits`] that its module may call; elsewhere as [`Dispatch::AnyTaken`].
    OwnTraits,
}

/// A function on the worst chain.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Frame {
    /// Path without generic arguments.
    pub function: String,
    /// Its frame as the compiler says; `None` where it says nothing.
    pub frame_bytes: Option<u64>,
    /// All frames down to this one, with what the calls themselves push.
    pub sum_bytes: u64,
}

/// Parts of the stack that an entry point's bound leaves out.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct NotCovered {
    /// Functions below it of which the compiler gave no figure: assembly, precompiled code. Each
    /// counts nothing beyond the call itself.
    pub without_figure: Vec<String>,
    /// Functions below it that call a shared library, whose stack nothing is known of.
    pub library_callers: Vec<String>,
    /// Functions below it with a branch to where no function is known.
    pub astray: Vec<String>,
    /// Functions that may call each other in a circle. There is then no bound.
    pub cycles: Vec<Vec<String>>,
}

/// The calls through pointers below an entry point.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct IndirectCalls {
    /// How they were bounded.
    pub dispatch: Dispatch,
    /// How many places make one.
    pub places: usize,
    /// Functions they may reach.
    pub callees: Vec<String>,
}

/// The bound of one entry point.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StackBound {
    /// Name of the entry point.
    pub name: String,
    /// Its path or symbol.
    pub path: String,
    /// How many functions of the image have it: none where it was inlined into its callers or left
    /// out, several where it is generic. The bound is that of the worst.
    pub instances: usize,
    /// Bytes of the stack from its call on; `None` without an instance, or with a cycle below it.
    pub bytes: Option<u64>,
    /// The bound with calls through pointers resolved as [`Dispatch::OwnTraits`] says.
    pub narrow_bytes: Option<u64>,
    /// The chain of calls that takes the most.
    pub chain: Vec<Frame>,
    /// Bytes that the last function of the chain may use beyond its frame; part of the bound.
    pub red_zone_bytes: u64,
    /// How many functions there are below it, itself among them.
    pub functions: usize,
    /// Calls through pointers.
    pub indirect: IndirectCalls,
    /// Parts that the bound does not cover.
    pub not_covered: NotCovered,
}

/// Parts of the stack that no bound covers on a processor.
pub fn limits(machine: Machine) -> Vec<&'static str> {
    let mut limits = vec![
        "start-up code before the entry point, and whatever calls the entry point",
        "interrupts: their handlers' frames come on top, wherever they use the same stack",
    ];
    limits.extend(match machine {
        Machine::Arm => Some(
            "an exception's frame: the processor pushes up to 108 bytes (26 words with \
             floating-point registers, a word to align) for each level of nesting",
        ),
        Machine::AArch64 | Machine::RiscV64 => None,
        Machine::X86_64 => {
            Some("the operating system's signal handlers, and the stack of shared libraries")
        }
    });
    limits
}

/// The call graph with its indirect calls resolved.
pub struct Calls {
    dispatch: Dispatch,
    red_zone_bytes: u64,
    graph: Graph,
    /// Callees of each function's indirect calls.
    indirect: Vec<BTreeSet<usize>>,
}

impl Calls {
    /// The graph of a program.
    pub fn new(elf: &Elf, program: &Program, subject: &Subject, dispatch: Dispatch) -> Self {
        let any: BTreeSet<usize> = program.taken.keys().copied().collect();
        let methods = match dispatch {
            Dispatch::AnyTaken => Vec::new(),
            Dispatch::OwnTraits => {
                subject.traits.iter().map(|of| methods(elf, program, of.path)).collect()
            }
        };
        let resolve = |f: &Function| {
            // An image without methods of any has them by names that are not known.
            let is_narrow = is_own(f, subject) && methods.iter().any(|of| !of.is_empty());
            match dispatch {
                _ if f.calls.indirect.is_empty() => BTreeSet::new(),
                Dispatch::OwnTraits if is_narrow => {
                    let all = methods.iter().zip(subject.traits);
                    let of_trait = all.filter(|(_, object)| may_call(f, object.callers));
                    of_trait.flat_map(|(methods, _)| methods).copied().collect()
                }
                _ => any.clone(),
            }
        };
        let indirect: Vec<_> = program.functions.iter().map(resolve).collect();
        let functions = program.functions.iter().zip(&indirect);
        let graph = Graph {
            // A jump to another function in place of a call and a return would release the frame
            // first: to add it all the same is on the safe side.
            cost: program
                .functions
                .iter()
                .map(|f| f.frame.unwrap_or(0) + elf.machine.call_bytes())
                .collect(),
            callees: functions
                .map(|(f, more)| f.calls.direct.union(more).copied().collect())
                .collect(),
        };
        Self { dispatch, red_zone_bytes: elf.machine.red_zone_bytes(), graph, indirect }
    }

    /// The bound below the worst instance of an entry point, with functions of some plain paths
    /// taken out of the graph.
    pub fn bound(&self, program: &Program, entry: &EntryPoint, without: &[&str]) -> StackBound {
        let mut graph = self.graph.clone();
        if !without.is_empty() {
            let is_out = |i: usize| without.contains(&program.functions[i].plain().as_str());
            let out: Vec<bool> = (0..program.functions.len()).map(is_out).collect();
            graph.callees.iter_mut().for_each(|callees| callees.retain(|i| !out[*i]));
        }
        let instances = program.functions.iter().enumerate().filter(|(_, f)| {
            let is = |path: &&str| f.plain() == *path || f.symbols.iter().any(|name| name == path);
            entry.paths.iter().any(is)
        });
        let of = |(i, _)| self.instance(program, &graph, entry, i);
        let all: Vec<StackBound> = instances.map(of).collect();
        let count = all.len();
        // A cycle is worse than any number.
        let worst = all.into_iter().max_by_key(|bound| bound.bytes.map_or(u64::MAX, |bytes| bytes));
        match worst {
            Some(bound) => StackBound { instances: count, ..bound },
            None => self.absent(entry),
        }
    }

    fn absent(&self, entry: &EntryPoint) -> StackBound {
        StackBound {
            name: entry.name.into(),
            path: entry.paths.join(", "),
            instances: 0,
            bytes: None,
            narrow_bytes: None,
            chain: Vec::new(),
            red_zone_bytes: self.red_zone_bytes,
            functions: 0,
            indirect: IndirectCalls { dispatch: self.dispatch, places: 0, callees: Vec::new() },
            not_covered: NotCovered::default(),
        }
    }

    fn instance(
        &self,
        program: &Program,
        graph: &Graph,
        entry: &EntryPoint,
        function: usize,
    ) -> StackBound {
        let below = graph.below(function);
        let mut sum_bytes = 0;
        let frame = |i: &usize| {
            sum_bytes += graph.cost[*i];
            let f = &program.functions[*i];
            Frame { function: f.plain(), frame_bytes: f.frame, sum_bytes }
        };
        let chain: Vec<Frame> = below.chain.iter().map(frame).collect();
        let reached = || below.reached.iter().map(|i| &program.functions[*i]);
        StackBound {
            path: program.functions[function].plain(),
            bytes: chain.last().map(|frame| frame.sum_bytes + self.red_zone_bytes),
            chain,
            functions: below.reached.len(),
            indirect: IndirectCalls {
                places: reached().map(|f| f.calls.indirect.len()).sum(),
                callees: self.callees(program, &below),
                dispatch: self.dispatch,
            },
            not_covered: NotCovered {
                without_figure: sorted(reached().filter(|f| f.frame.is_none())),
                library_callers: sorted(reached().filter(|f| f.calls.external > 0)),
                astray: sorted(reached().filter(|f| !f.calls.astray.is_empty())),
                cycles: below
                    .cycles
                    .iter()
                    .map(|group| sorted(group.iter().map(|i| &program.functions[*i])))
                    .collect(),
            },
            ..self.absent(entry)
        }
    }

    fn callees(&self, program: &Program, below: &Below) -> Vec<String> {
        let callees: BTreeSet<usize> =
            below.reached.iter().flat_map(|i| &self.indirect[*i]).copied().collect();
        sorted(callees.iter().map(|i| &program.functions[*i]))
    }
}

fn sorted<'a>(functions: impl Iterator<Item = &'a Function>) -> Vec<String> {
    let mut names: Vec<String> = functions.map(Function::plain).collect();
    names.sort();
    names.dedup();
    names
}

fn is_own(function: &Function, subject: &Subject) -> bool {
    let origin = function.symbols.iter().find_map(|name| names::Origin::of(name));
    origin.is_some_and(|origin| subject.crates.contains(&origin.krate.as_str()))
}

/// Functions whose address a table of a trait's methods holds: an object that holds that of one of
/// them. The others in it may have been merged with equal functions of other names.
fn methods(elf: &Elf, program: &Program, name: &str) -> BTreeSet<usize> {
    let is_method = |i: &usize| implements(&program.functions[*i], name);
    let objects = || elf.symbols.iter().filter(|s| s.kind == SymbolKind::Object);
    let tables: Vec<_> = objects()
        .map(|s| s.address..s.address.saturating_add(s.size))
        .filter(|table| {
            let mut inside =
                program.taken.iter().filter(|(_, at)| at.range(table.clone()).count() > 0);
            inside.any(|(i, _)| is_method(i))
        })
        .collect();
    let in_table = |at: &BTreeSet<u64>| tables.iter().any(|t| at.range(t.clone()).count() > 0);
    let taken = program.taken.iter().filter(|(i, at)| is_method(i) || in_table(at));
    taken.map(|(i, _)| *i).collect()
}

/// Whether a function may hold code of one of these modules: its own, or handed to it as an argument
/// of a generic function. The first mangling does not tell the latter.
fn may_call(function: &Function, modules: &[&str]) -> bool {
    let is_told = function.symbols.iter().all(|name| name.starts_with("_R"));
    let names = |module: &&str| {
        let origins = || function.symbols.iter().filter_map(|name| names::Origin::of(name));
        let paths = || function.symbols.iter().filter_map(|name| names::readable(name));
        origins().any(|origin| format!("{}::", origin.to_depth(1)) == **module)
            || paths().any(|path| path.contains(*module))
    };
    modules.is_empty() || !is_told || modules.iter().any(names)
}

/// Whether one of a function's names is that of a method of this trait.
fn implements(function: &Function, name: &str) -> bool {
    let paths = function.symbols.iter().filter_map(|symbol| names::readable(symbol));
    paths.filter_map(|path| names::implemented_trait(&path)).any(|found| found == name)
}
