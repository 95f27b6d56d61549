//! Sizes of an image: code and data by crate, by module, by symbol.

use super::elf::{Elf, Kind, Section, SymbolKind, Use, is_unwinding};
use super::functions::{Function, Program, is_padding};
use super::names::Origin;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// Longest gap that is taken for padding.
const MOST_PADDING: u64 = 64;
/// How far constants that only constants refer to are followed.
const MOST_STEPS: usize = 8;

/// Bytes of one kind from one module.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Share {
    /// Their kind.
    pub kind: Kind,
    /// Their owner. Words in brackets are no crates: `[model]`, `[padding]`, `[several]`
    /// (constants that several crates refer to), `[unattributed]`, `[assembly]`, `[image]` (the
    /// image's own functions with names for the linker), `[vectors]`, `[unwinding]`, and sections
    /// without symbols by their name.
    pub origin: Origin,
    /// Number of bytes.
    pub bytes: u64,
}

/// An object in memory.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Named {
    /// Its name.
    pub name: String,
    /// Kind of memory it lies in.
    pub kind: Kind,
    /// Its size.
    pub bytes: u64,
}

/// The sizes of an image. All sections in memory, each byte once.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sizes {
    /// Sections in memory: name, kind, size.
    pub sections: Vec<Named>,
    /// Their bytes by kind, crate and module, in this order; they sum up to those of the sections.
    pub shares: Vec<Share>,
    /// Learned models that are built in.
    pub models: Vec<Named>,
    /// Objects in memory that is written, largest first.
    pub memory: Vec<Named>,
}

impl Sizes {
    /// Bytes of a kind.
    pub fn total(&self, kind: Kind) -> u64 {
        self.shares.iter().filter(|share| share.kind == kind).map(|share| share.bytes).sum()
    }

    /// Bytes by crate and the first `depth` modules: code, read-only data; largest first.
    pub fn by_origin(&self, depth: usize) -> Vec<(String, u64, u64)> {
        let mut sums = BTreeMap::<String, (u64, u64)>::new();
        for share in &self.shares {
            let sum = sums.entry(share.origin.to_depth(depth)).or_default();
            match share.kind {
                Kind::Code => sum.0 += share.bytes,
                Kind::ReadOnly => sum.1 += share.bytes,
                Kind::Data | Kind::Zero => {}
            }
        }
        let mut rows: Vec<_> =
            sums.into_iter().map(|(name, (code, data))| (name, code, data)).collect();
        rows.retain(|(_, code, data)| code + data > 0);
        rows.sort_by_key(|(_, code, data)| std::cmp::Reverse(code + data));
        rows
    }
}

/// A stretch of bytes with one owner.
struct Piece {
    section: usize,
    from: u64,
    to: u64,
    owner: Owner,
    name: Option<String>,
}

enum Owner {
    Known(Origin),
    /// The common owner of all that refers to it.
    Referrers,
}

/// Takes an image apart.
pub fn of(elf: &Elf, program: &Program, model_prefix: &str) -> Sizes {
    let references = references(elf, program);
    let mut pieces = Vec::new();
    for (i, section) in elf.sections.iter().enumerate() {
        match section.kind {
            Kind::Code => code(elf, program, i, &mut pieces),
            _ if is_unwinding(&section.name) => pieces.push(whole(i, section, "unwinding")),
            _ => data(elf, i, &references, model_prefix, &mut pieces),
        }
    }
    let owners = Owners { program, pieces: &pieces, references: &references };
    let mut shares = BTreeMap::<(Kind, Origin), u64>::new();
    for (i, piece) in pieces.iter().enumerate() {
        let key = (elf.sections[piece.section].kind, owners.of(i, MOST_STEPS));
        *shares.entry(key).or_default() += piece.to - piece.from;
    }
    let shares = shares
        .into_iter()
        .filter(|(_, bytes)| *bytes > 0)
        .map(|((kind, origin), bytes)| Share { kind, origin, bytes });
    let named = |piece: &Piece, name: &str| Named {
        name: super::names::readable(name).unwrap_or_else(|| name.into()),
        kind: elf.sections[piece.section].kind,
        bytes: piece.to - piece.from,
    };
    let all = || pieces.iter().filter_map(|piece| Some(named(piece, piece.name.as_deref()?)));
    let mut memory: Vec<Named> =
        all().filter(|n| matches!(n.kind, Kind::Data | Kind::Zero) && n.bytes > 0).collect();
    memory.sort_by(|a, b| b.bytes.cmp(&a.bytes).then_with(|| a.name.cmp(&b.name)));
    let section = |s: &Section| Named { name: s.name.clone(), kind: s.kind, bytes: s.size };
    Sizes {
        sections: elf.sections.iter().map(section).collect(),
        shares: shares.collect(),
        models: all().filter(|n| is_model(&n.name, model_prefix)).collect(),
        memory,
    }
}

/// Whether a name is a learned model's.
fn is_model(name: &str, prefix: &str) -> bool {
    name.rsplit("::").next().is_some_and(|last| last.starts_with(prefix))
}

fn whole(i: usize, section: &Section, word: &str) -> Piece {
    Piece {
        section: i,
        from: section.address,
        to: section.end(),
        owner: Owner::Known(Origin::other(word)),
        name: Some(section.name.clone()),
    }
}

/// Functions and the gaps between.
fn code(elf: &Elf, program: &Program, i: usize, pieces: &mut Vec<Piece>) {
    let section = &elf.sections[i];
    let mut at = section.address;
    let gap = |from: u64, to: u64| {
        let word = match () {
            () if is_padding(elf.machine, section.slice(from, to)) => "padding",
            // Data before any code.
            () if !elf.is_hosted => "vectors",
            () => section.name.as_str(),
        };
        Piece { section: i, from, to, owner: Owner::Known(Origin::other(word)), name: None }
    };
    for function in &program.functions {
        if !(section.address..section.end()).contains(&function.address) {
            continue;
        }
        if at < function.address {
            pieces.push(gap(at, function.address));
        }
        let (from, to) = (function.address, function.end);
        let owner = Owner::Known(origin(function));
        pieces.push(Piece { section: i, from, to, owner, name: None });
        at = to;
    }
    if at < section.end() {
        pieces.push(gap(at, section.end()));
    }
}

/// Crate and module of a function. Names for the linker are those of the compiler's run-time
/// library, of assembly where the compiler gave no figure, otherwise of the image.
fn origin(function: &Function) -> Origin {
    const LIBRARY: [&str; 6] = ["memcpy", "memmove", "memset", "memcmp", "bcmp", "strlen"];
    let is_library = |name: &String| name.starts_with("__") || LIBRARY.contains(&&**name);
    let known = function.symbols.iter().find_map(|name| Origin::of(name));
    known.unwrap_or_else(|| match function.frame {
        _ if function.symbols.iter().any(is_library) => {
            Origin { krate: "compiler_builtins".into(), modules: Vec::new() }
        }
        None => Origin::other("assembly"),
        Some(_) => Origin::other("image"),
    })
}

/// Objects with symbols, and what lies between them, cut where something refers to it.
fn data(
    elf: &Elf,
    i: usize,
    references: &[(u64, u64)],
    model_prefix: &str,
    pieces: &mut Vec<Piece>,
) {
    let section = &elf.sections[i];
    let mut objects: Vec<_> = elf
        .symbols
        .iter()
        .filter(|s| s.section == i && s.kind == SymbolKind::Object && s.size > 0)
        .filter(|s| (section.address..section.end()).contains(&s.address))
        .collect();
    // The longest object counts where a place has several names, then the first name.
    objects.sort_by(|a, b| {
        (a.address, std::cmp::Reverse(a.size), &a.name).cmp(&(
            b.address,
            std::cmp::Reverse(b.size),
            &b.name,
        ))
    });
    let mut at = section.address;
    for object in &objects {
        let (from, to) =
            (object.address.max(at), object.address.saturating_add(object.size).min(section.end()));
        if from >= to {
            continue;
        }
        gap(section, i, (at, from), references, pieces);
        let readable = super::names::readable(&object.name).unwrap_or_default();
        let owner = if is_model(&readable, model_prefix)
            || is_model(&object.name, model_prefix)
            || section.name.contains("model")
        {
            Owner::Known(Origin::other("model"))
        } else {
            owner(&object.name)
        };
        pieces.push(Piece { section: i, from, to, owner, name: Some(object.name.clone()) });
        at = to;
    }
    if objects.is_empty() && section.kind == Kind::Zero {
        pieces.push(whole(i, section, section.name.trim_start_matches('.')));
        return;
    }
    gap(section, i, (at, section.end()), references, pieces);
}

fn owner(name: &str) -> Owner {
    // A table in place of a `match` is its function's.
    let name = name.trim_start_matches(".L").trim_start_matches("switch.table.");
    Origin::of(name).map_or(Owner::Referrers, Owner::Known)
}

/// Bytes without a symbol.
fn gap(
    section: &Section,
    i: usize,
    (from, to): (u64, u64),
    references: &[(u64, u64)],
    pieces: &mut Vec<Piece>,
) {
    let mut cuts: BTreeSet<u64> = references
        .iter()
        .map(|(_, target)| *target)
        .filter(|target| (from..to).contains(target))
        .collect();
    let first = cuts.first().copied().unwrap_or(to);
    // Sections without symbols that nothing refers to are whole: tables for a dynamic linker.
    if (from, to, first) == (section.address, section.end(), to) {
        pieces.push(whole(i, section, section.name.trim_start_matches('.')));
        return;
    }
    if from < first {
        let is_blank =
            section.slice(from, first).iter().all(|b| *b == 0) && first - from < MOST_PADDING;
        let word = if is_blank { "padding" } else { "unattributed" };
        let owner = Owner::Known(Origin::other(word));
        pieces.push(Piece { section: i, from, to: first, owner, name: None });
    }
    cuts.insert(to);
    for (from, to) in cuts.iter().zip(cuts.iter().skip(1)) {
        let (from, to) = (*from, *to);
        pieces.push(Piece { section: i, from, to, owner: Owner::Referrers, name: None });
    }
}

/// References as place and target, in the order of the targets.
fn references(elf: &Elf, program: &Program) -> Vec<(u64, u64)> {
    let addresses = elf.relocations.iter().filter(|r| r.used == Use::Address);
    let relocations = addresses.map(|r| (r.at, r.target));
    let mut references: Vec<_> = relocations.chain(program.formed.iter().copied()).collect();
    references.sort_by_key(|(place, target)| (*target, *place));
    references
}

/// Finds the owners of bytes that have no name of their own.
struct Owners<'a> {
    program: &'a Program,
    pieces: &'a [Piece],
    references: &'a [(u64, u64)],
}

impl Owners<'_> {
    fn of(&self, piece: usize, steps: usize) -> Origin {
        let Piece { from, to, owner, .. } = &self.pieces[piece];
        if let Owner::Known(origin) = owner {
            return origin.clone();
        }
        let start = self.references.partition_point(|(_, target)| target < from);
        let here = self.references[start..].iter().take_while(|(_, target)| target < to);
        let owners: BTreeSet<Origin> =
            here.filter_map(|(place, _)| self.referrer(*place, piece, steps)).collect();
        common(&owners)
    }

    fn referrer(&self, place: u64, piece: usize, steps: usize) -> Option<Origin> {
        if let Some(function) = self.program.at(place) {
            return Some(origin(&self.program.functions[function]));
        }
        let holder = self.pieces.iter().position(|p| (p.from..p.to).contains(&place))?;
        (holder != piece && steps > 0).then(|| self.of(holder, steps - 1))
    }
}

/// The one owner, what several modules of a crate have in common, or `[several]`.
fn common(owners: &BTreeSet<Origin>) -> Origin {
    let mut all = owners.iter().filter(|origin| origin.krate != "[unattributed]");
    let Some(first) = all.next() else { return Origin::other("unattributed") };
    all.fold(first.clone(), |common, origin| {
        if common.krate != origin.krate {
            return Origin::other("several");
        }
        let same = common.modules.iter().zip(&origin.modules).take_while(|(a, b)| a == b);
        Origin { modules: same.map(|(a, _)| a.clone()).collect(), krate: common.krate }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn origin(path: &str) -> Origin {
        let mut parts = path.split("::").map(String::from);
        Origin { krate: parts.next().unwrap(), modules: parts.collect() }
    }

    #[test]
    fn constants_belong_to_what_their_users_have_in_common() {
        let of = |paths: &[&str]| common(&paths.iter().map(|p| origin(p)).collect()).to_depth(9);
        assert_eq!(of(&["a::b::c"]), "a::b::c");
        assert_eq!(of(&["a::b::c", "a::b::d"]), "a::b");
        assert_eq!(of(&["a::b", "a::c"]), "a");
        assert_eq!(of(&["a::b", "c::b"]), "[several]");
        assert_eq!(of(&["a::b", "c", "a::b"]), "[several]");
        assert_eq!(of(&["a::b", "[unattributed]"]), "a::b");
        assert_eq!(of(&[]), "[unattributed]");
    }

    #[test]
    fn models_are_known_by_their_names() {
        assert!(is_model("remora_firmware::models::REMORA_MODEL_EULER", "REMORA_MODEL"));
        assert!(is_model("REMORA_MODEL_RK4", "REMORA_MODEL"));
        assert!(!is_model("remora_firmware::REMORA_REQUEST", "REMORA_MODEL"));
        assert!(!is_model("remora_core::model::TABLE", "REMORA_MODEL"));
    }
}
