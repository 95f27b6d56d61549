//! The whole of it, on small images of four processors. `fixtures/images/README.md` tells what is in
//! them and how they were made.

use super::*;
use std::path::PathBuf;

const TARGETS: [&str; 4] = [
    "thumbv7em-none-eabihf",
    "aarch64-unknown-none",
    "riscv64gc-unknown-none-elf",
    "x86_64-unknown-none",
];

const SUBJECT: Subject = Subject {
    crates: &["sample"],
    entry_points: &[EntryPoint { name: "image", paths: &["remora_main"] }, PLAN],
    traits: &[TraitObject { path: "sample::clocks::Clock", callers: &[] }],
    main: "remora_main",
    panic_mark: "remora_panic_reachable",
    models: "REMORA_MODEL",
};

const IMAGE: EntryPoint = SUBJECT.entry_points[0];

const PLAN: EntryPoint = EntryPoint { name: "plan", paths: &["sample::planner::plan"] };

fn file(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/images").join(name)
}

fn image(target: &str) -> Image {
    let (elf, remarks) = (file(&format!("{target}.elf")), file(&format!("{target}.remarks")));
    Image::read(&elf, &remarks, &SUBJECT).unwrap()
}

#[test]
fn a_bound_is_the_sum_of_the_compilers_frames() {
    for target in TARGETS {
        let frames = remarks::read(&file(&format!("{target}.remarks"))).unwrap();
        let frame = |part: &str| {
            let of = |(name, bytes): (&String, &u64)| name.contains(part).then_some(*bytes);
            frames.iter().find_map(of).unwrap()
        };
        let image = image(target);
        let bound = image.stack(&PLAN);
        let chain: Vec<&str> = bound.chain.iter().map(|f| f.function.as_str()).collect();
        // Through the pointer to the clock; on x86-64, which has no floating point here, the
        // library's conversions lie below.
        let expected =
            ["sample::planner::plan", "sample::planner::deep", "sample::clocks::Ticks::seconds"];
        assert_eq!(chain[..3], expected, "{target}");
        let sum = frame("4plan") + frame("4deep") + frame("7seconds");
        let pushed = image.machine().call_bytes();
        assert_eq!(bound.chain[2].sum_bytes, sum + 3 * pushed, "{target}");
        let last = bound.chain.last().unwrap().sum_bytes;
        assert_eq!(bound.bytes, Some(last + image.machine().red_zone_bytes()), "{target}");
        assert_eq!((bound.instances, bound.path.as_str()), (1, "sample::planner::plan"));
        assert_eq!(bound.indirect.dispatch, Dispatch::AnyTaken);
        assert!(bound.indirect.callees.contains(&expected[2].to_string()), "{target}");
        assert_eq!(bound.not_covered, NotCovered::default(), "{target}");
    }
}

#[test]
fn calls_in_tail_position_and_jump_tables_are_told_apart() {
    let entry = EntryPoint { name: "", paths: &["sample::planner::shallow"] };
    for target in &TARGETS[..3] {
        let bound = image(target).stack(&entry);
        let chain: Vec<&str> = bound.chain.iter().map(|f| f.function.as_str()).collect();
        assert_eq!(chain, ["sample::planner::shallow", "sample::planner::leaf"], "{target}");
        // The table is no call.
        assert_eq!(bound.indirect.places, 0, "{target}");
    }
}

#[test]
fn recursion_has_no_bound_and_is_named() {
    for target in TARGETS {
        let bound = image(target).stack(&IMAGE);
        assert_eq!((bound.bytes, bound.instances), (None, 1), "{target}");
        let circle = vec!["sample::recursion::even".to_string(), "sample::recursion::odd".into()];
        assert_eq!(bound.not_covered.cycles, [circle], "{target}");
        // A bound exists without the circle.
        let rest = image(target).stack_without(&IMAGE, &["sample::recursion::even"]);
        assert!(rest.bytes > image(target).stack(&PLAN).bytes, "{target}");
    }
}

#[test]
fn what_was_inlined_or_has_no_figure_is_said() {
    let image = image(TARGETS[0]);
    let inlined = image.stack(&EntryPoint { name: "none", paths: &["sample::nobody"] });
    assert_eq!((inlined.instances, inlined.bytes), (0, None));
    let reset = image.stack(&EntryPoint { name: "start", paths: &["reset"] });
    assert_eq!(reset.not_covered.without_figure, ["reset"]);
    assert!(image.limits().iter().any(|limit| limit.contains("108 bytes")));
}

/// The linker's relocations are another witness of the calls that were found in the code.
#[test]
fn decoded_calls_are_those_that_were_relocated() {
    for target in TARGETS {
        let image = image(target);
        let witness = image.witness();
        assert!(witness.relocated >= 5, "{target}: {witness:?}");
        assert_eq!(witness.found, witness.relocated, "{target}");
    }
}

#[test]
fn every_byte_is_counted_once() {
    for target in TARGETS {
        let image = image(target);
        let sizes = image.sizes();
        for kind in [Kind::Code, Kind::ReadOnly, Kind::Data, Kind::Zero] {
            let of_kind = sizes.sections.iter().filter(|section| section.kind == kind);
            assert_eq!(
                sizes.total(kind),
                of_kind.map(|s| s.bytes).sum::<u64>(),
                "{target} {kind:?}"
            );
        }
        let in_elf: u64 = image.elf.sections.iter().map(|section| section.size).sum();
        assert_eq!(sizes.shares.iter().map(|share| share.bytes).sum::<u64>(), in_elf, "{target}");
    }
}

#[test]
fn bytes_are_their_owners() {
    for target in TARGETS {
        let sizes = image(target).sizes();
        let bytes = |kind: Kind, name: &str| {
            let of = |share: &&Share| share.kind == kind && share.origin.to_depth(9) == name;
            sizes.shares.iter().filter(of).map(|share| share.bytes).sum::<u64>()
        };
        assert_eq!(bytes(Kind::ReadOnly, "[model]"), 96, "{target}");
        let model = ("sample::REMORA_MODEL_TINY".to_string(), 96);
        let models: Vec<_> = sizes.models.iter().map(|m| (m.name.clone(), m.bytes)).collect();
        assert_eq!(models, [model], "{target}");
        assert!(bytes(Kind::ReadOnly, "sample") >= 48, "{target}: the table");
        assert_eq!(bytes(Kind::Zero, "sample"), 400, "{target}: the workspace");
        assert!(bytes(Kind::Code, "sample::planner") > 100, "{target}");
        assert!(bytes(Kind::Code, "sample::recursion") > 10, "{target}");
        assert!(bytes(Kind::Code, "sample::clocks") > 10, "{target}");
        assert!((1..16).contains(&bytes(Kind::Code, "[assembly]")), "{target}: reset");
    }
    // Constants without a name belong to the code that refers to them: here the jump table as data.
    let sizes = image("riscv64gc-unknown-none-elf").sizes();
    let planner = sizes.by_origin(1).into_iter().find(|(name, ..)| name == "sample::planner");
    assert_eq!(planner.map(|(_, _, data)| data), Some(48));
}

#[test]
fn the_symbols_prove_that_nothing_panics_or_allocates() {
    for target in TARGETS {
        let proofs = image(target).proofs();
        assert_eq!(proofs.panic.verdict, Verdict::Proven, "{target}: {:?}", proofs.panic.found);
        assert_eq!(proofs.allocation.verdict, Verdict::Proven, "{target}");
    }
}

/// The error of an image whose section headers of one type are made void.
fn without(kinds: &[u32]) -> String {
    let mut bytes = std::fs::read(file("thumbv7em-none-eabihf.elf")).unwrap();
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let count = usize::from(u16::from_le_bytes([bytes[0x30], bytes[0x31]]));
    let types: Vec<usize> = (0..count).map(|i| word(0x20) + 40 * i + 4).collect();
    for at in types {
        let kind = u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        if kinds.contains(&kind) {
            bytes[at..at + 4].fill(0);
        }
    }
    refused(&bytes)
}

fn refused(bytes: &[u8]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("image.elf");
    std::fs::write(&path, bytes).unwrap();
    let error = Image::read(&path, &file("thumbv7em-none-eabihf.remarks"), &SUBJECT).err().unwrap();
    error.to_string().replace(&path.display().to_string(), "image.elf")
}

#[test]
fn what_cannot_be_judged_is_refused_with_the_reason() {
    assert_eq!(without(&[2]), "image.elf: has no symbols: it was stripped");
    let reason = "image.elf: has no relocations: link with -C link-arg=--emit-relocs";
    assert_eq!(without(&[4, 9]), reason);
    assert_eq!(refused(b"not ELF"), "image.elf: is no ELF file");
    let mut other = std::fs::read(file("thumbv7em-none-eabihf.elf")).unwrap();
    other[0x12] = 2;
    assert!(refused(&other).contains("a processor whose code is not understood"));
    // The end of the file is where its section headers are.
    other.truncate(1000);
    assert!(refused(&other).starts_with("image.elf: is no sound ELF file: "));

    // Every section where the first is.
    let mut heap = std::fs::read(file("thumbv7em-none-eabihf.elf")).unwrap();
    let headers = u32::from_le_bytes(heap[0x20..0x24].try_into().unwrap()) as usize;
    for i in 1..4 {
        heap[headers + 40 * i + 12..][..4].copy_from_slice(&[0, 0, 2, 0]);
    }
    assert_eq!(refused(&heap), "image.elf: is no sound ELF file: two sections share memory");

    let elf = file("aarch64-unknown-none.elf");
    let missing = Image::read(&elf, &file("none"), &SUBJECT).err().unwrap().to_string();
    assert!(missing.ends_with("none: no such file or directory"), "{missing}");
    let missing =
        Image::read(&file("none"), &file("aarch64-unknown-none.remarks"), &SUBJECT).err().unwrap();
    assert!(missing.to_string().ends_with("none: no such file or directory"), "{missing}");
    let folder = tempfile::tempdir().unwrap();
    let remarks = folder.path().join("other.remarks");
    let text = "prologepilog (analysis): 8 stack bytes in function 'f'\n";
    std::fs::write(&remarks, text).unwrap();
    let other = Image::read(&elf, &remarks, &SUBJECT).err().unwrap().to_string();
    assert!(other.contains("it is of another build"), "{other}");
}

/// Whatever a damaged file is taken for, it ends with an image or an error.
#[test]
fn damaged_files_do_no_harm() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("image.elf");
    for (target, step) in TARGETS.into_iter().zip([19, 37, 37, 41]) {
        let whole = std::fs::read(file(&format!("{target}.elf"))).unwrap();
        let remarks = file(&format!("{target}.remarks"));
        for (i, at) in (0..whole.len()).step_by(step).enumerate() {
            let mut bytes = whole.clone();
            bytes[at] ^= [0xff, 0x01, 0x80, 0x40][i % 4];
            std::fs::write(&path, &bytes).unwrap();
            if let Ok(image) = Image::read(&path, &remarks, &SUBJECT) {
                let sizes = image.sizes();
                let in_elf: u64 = sizes.sections.iter().map(|section| section.bytes).sum();
                let shares: u64 = sizes.shares.iter().map(|share| share.bytes).sum();
                assert_eq!(shares, in_elf, "{target}, byte {at}");
                assert_eq!(image.stacks().len(), SUBJECT.entry_points.len());
                image.witness();
            }
        }
    }
}
