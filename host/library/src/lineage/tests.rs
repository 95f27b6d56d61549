use super::*;
use crate::formats::Mission;

fn provenance() -> Provenance {
    Provenance {
        integrator: "rk4:4".parse().unwrap(),
        dataset: "s3000:50".parse().unwrap(),
        config: "f8631d46 from 6dafa5fd old.model".parse().unwrap(),
        steps: 40,
        ..Provenance::default()
    }
}

/// A model that learnt from seed 3000 and started from one that learnt from seed 1000.
fn lineage() -> Lineage {
    let training = |name: &str, learnt_from: &str, steps| Training {
        name: name.into(),
        integrator: "euler".into(),
        learnt_from: learnt_from.into(),
        steps,
        batch: Some(49),
    };
    let trainings = vec![training("old", "s1000:90", 20), training("new", "s3000:50", 40)];
    Lineage { trainings, before: None, sources: Vec::new() }
}

#[test]
fn a_header_names_its_own_training_and_its_parent() {
    let found = Lineage::of_header("new", &provenance());
    assert_eq!(found.trainings.len(), 1);
    assert_eq!(found.before.as_deref(), Some("6dafa5fd old.model"));
    assert_eq!((found.size(), found.trainings[0].epochs()), (50, None));
    let synthetic = Provenance { dataset: "synthetic".parse().unwrap(), ..Provenance::default() };
    assert_eq!(Lineage::of_header("x", &synthetic).sources, []);
}

#[test]
fn what_any_ancestor_has_learnt_is_known() {
    let dir = tempfile::tempdir().unwrap();
    let model = dir.path().join("new.model");
    let set = |seed| crate::draw::draw(3, seed, &Mission::default()).unwrap().scenarios;
    let header_alone = Lineage::beside(&model, 7, &provenance()).unwrap();
    assert_eq!(header_alone.learnt(&set(1000)), None);
    let written = lineage().write_beside(&model, 7).unwrap();
    assert_eq!(written, dir.path().join("new.lineage.toml"));
    let found = Lineage::beside(&model, 7, &provenance()).unwrap();
    assert_eq!(found.trainings, lineage().trainings);
    assert_eq!(found.size(), 140);
    assert_eq!(found.trainings[1].epochs(), Some(40.0));
    assert_eq!(found.learnt(&set(1000)), Some("s1000-000"));
    assert_eq!(found.learnt(&set(3000)), Some("s3000-000"));
    assert_eq!(found.learnt(&set(7)), None);
    // Beyond what was learnt from, a seed is as good as another.
    let beyond: Vec<_> = set(3000).into_iter().skip(2).collect();
    let few = Lineage { sources: vec![Source { seed: 3000, count: 2 }], ..Lineage::default() };
    assert_eq!(few.learnt(&beyond), None);
    assert_eq!(drawn("s12-0345"), Some((12, 345)));
    assert_eq!(drawn("p000"), None);
}

#[test]
fn a_lineage_of_something_else_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let model = dir.path().join("new.model");
    let refused = |checksum| Lineage::beside(&model, checksum, &provenance()).unwrap_err();
    lineage().write_beside(&model, 7).unwrap();
    let error = refused(8).to_string();
    assert!(error.ends_with("new.lineage.toml: model: is 00000007, the model beside it 00000008"));
    let edit = |from: &str, to: &str| {
        lineage().write_beside(&model, 7).unwrap();
        let text = std::fs::read_to_string(path_of(&model)).unwrap();
        assert!(text.contains(from), "{text}");
        std::fs::write(path_of(&model), text.replacen(from, to, 1)).unwrap();
        refused(7).to_string()
    };
    for (from, to, reason) in [
        ("lineage/1", "lineage/2", "format: unknown format \"remora-lineage/2\""),
        ("s1000:90", "many", "training old: learnt_from: \"many\" is not of the form"),
        ("steps = 40", "steps = 41", "training: the last has not the 40 steps of the header"),
        ("batch", "bunch", "unknown field"),
    ] {
        let error = edit(from, to);
        assert!(error.contains(reason), "{error}");
    }
}

#[test]
fn scenarios_count_once() {
    let source = |seed, count| Source { seed, count };
    let sources = vec![source(1000, 5_000), source(1000, 9_000), source(2000, 500)];
    assert_eq!(Lineage { sources, ..Lineage::default() }.size(), 9_500);
}
