//! Proofs from the absence of symbols: no panic, no allocation.

use super::names;
use super::stack::Subject;
use serde::{Deserialize, Serialize};

/// Outcome of a proof.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// It holds.
    Proven,
    /// It does not: the image holds what it must not.
    Refuted,
    /// The image does not say.
    Unknown,
    /// The claim is not made for this image.
    NotApplicable,
}

/// Claim with the symbols against it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Proof {
    /// The claim.
    pub claim: String,
    /// Its outcome.
    pub verdict: Verdict,
    /// Reason of the outcome.
    pub reason: String,
    /// Symbols of the image that speak against it.
    pub found: Vec<String>,
}

/// The proofs that an image's symbols give.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Proofs {
    /// No panic can be reached.
    pub panic: Proof,
    /// Nothing is allocated.
    pub allocation: Proof,
}

/// Judges an image by the names of its symbols, those of sections and files left out.
pub fn of(names: Vec<&str>, is_hosted: bool, subject: &Subject) -> Proofs {
    let image = Symbols { names, is_hosted, main: subject.main };
    Proofs {
        panic: image.judge(
            "no panic can be reached",
            |name| panics(name, subject.panic_mark),
            &format!(
                "every panic of Rust ends in the panic handler, which calls `{}`; the linker keeps a \
                 section only where a kept one refers to it, and it kept neither this one nor \
                 anything of `core::panicking`",
                subject.panic_mark
            ),
            "the host's program may panic; it runs the core's code, not what flies",
        ),
        allocation: image.judge(
            "nothing is allocated",
            allocates,
            "the image holds no symbol of an allocator and nothing of the crate `alloc`",
            "the host's program allocates; that its planner does not is proven by an allocator \
             that counts",
        ),
    }
}

/// An image's symbols.
struct Symbols<'a> {
    names: Vec<&'a str>,
    is_hosted: bool,
    main: &'a str,
}

impl Symbols<'_> {
    fn judge(
        &self,
        claim: &'static str,
        speaks_against: impl Fn(&str) -> bool,
        proven: &str,
        not_applicable: &str,
    ) -> Proof {
        let against = self.names.iter().filter(|name| speaks_against(name));
        let mut found: Vec<String> =
            against.map(|name| names::readable(name).unwrap_or_else(|| (*name).into())).collect();
        found.sort();
        found.dedup();
        let (verdict, reason) = if self.is_hosted {
            found.clear();
            (Verdict::NotApplicable, not_applicable.to_string())
        } else if !self.names.contains(&self.main) {
            let main = self.main;
            let reason =
                format!("the image has no symbol `{main}`: it cannot be judged by symbols");
            (Verdict::Unknown, reason)
        } else if found.is_empty() {
            (Verdict::Proven, proven.to_string())
        } else {
            let reason = "the image holds symbols that only what is to be excluded refers to";
            (Verdict::Refuted, reason.to_string())
        };
        Proof { claim: claim.into(), verdict, reason, found }
    }
}

fn panics(name: &str, mark: &str) -> bool {
    name == mark
        || ["9panicking", "rust_begin_unwind", "panic_fmt"].iter().any(|part| name.contains(part))
}

fn allocates(name: &str) -> bool {
    // Rust's allocator functions are mangled with a crate of their own, `__rustc`.
    const PARTS: [&str; 6] = [
        "__rust_alloc",
        "__rust_dealloc",
        "__rust_realloc",
        "__rust_no_alloc_shim",
        "__rg_",
        "__rdl_",
    ];
    ["malloc", "calloc", "realloc", "free", "sbrk", "_sbrk"].contains(&name)
        || PARTS.iter().any(|part| name.contains(part))
        || names::Origin::of(name).is_some_and(|origin| origin.krate == "alloc")
}

#[cfg(test)]
mod tests {
    use super::*;

    const MARK: &str = "remora_panic_reachable";

    fn panic(is_hosted: bool, names: &[&str]) -> Proof {
        let image = Symbols { names: names.to_vec(), is_hosted, main: "remora_main" };
        image.judge("", |name| panics(name, MARK), "proven", "not asked")
    }

    #[test]
    fn a_panic_refutes_and_missing_symbols_prove_nothing() {
        let sound = ["remora_main", "_RNvNtCs1_4core3fmt5write"];
        assert_eq!(panic(false, &sound).verdict, Verdict::Proven);
        for bad in [MARK, "_RNvNtCs1_4core9panicking5panic"] {
            let proof = panic(false, &["remora_main", bad, bad]);
            assert_eq!((proof.verdict, proof.found.len()), (Verdict::Refuted, 1), "{bad}");
        }
        assert_eq!(panic(false, &["main"]).verdict, Verdict::Unknown);
        assert_eq!(panic(false, &[]).verdict, Verdict::Unknown);
        let hosted = panic(true, &["remora_main", "rust_begin_unwind"]);
        assert_eq!((hosted.verdict, hosted.found.len()), (Verdict::NotApplicable, 0));
    }

    #[test]
    fn allocators_are_known_by_any_of_their_names() {
        for name in [
            "malloc",
            "__rust_alloc",
            "_RNvCs1_7___rustc12___rust_alloc",
            "_RNvCs1_7___rustc35___rust_no_alloc_shim_is_unstable_v2",
            "_RNvNtCs1_5alloc7raw_vec12handle_error",
            "_ZN5alloc7raw_vec12handle_error17h0123456789abcdefE",
        ] {
            assert!(allocates(name), "{name}");
        }
        for name in ["remora_main", "_RNvNtCs1_11remora_core7planner4plan", "memcpy", "mallocate"] {
            assert!(!allocates(name), "{name}");
        }
    }
}
