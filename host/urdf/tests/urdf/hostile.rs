//! Texts that nobody wrote, or somebody with bad intentions: refused, never a panic or a hang.

use crate::{GRIPPER, options, text};
use proptest::prelude::*;
use remora_urdf::{Fault, MAX_BYTES, explain, import};

fn faults(text: &[u8]) -> Vec<Fault> {
    import("hostile", text, &options("")).unwrap_err().faults
}

#[test]
fn nesting_does_not_reach_the_stack() {
    let (open, close) = ("<a>".repeat(100_000), "</a>".repeat(100_000));
    for nested in [
        open.clone(),
        format!("{open}{close}"),
        format!("<robot name='a'>{open}{close}</robot>"),
        format!("<robot name='a'><!-- > --><b c='/>'>{open}"),
        "<robot name='a'><link name='b'>".repeat(50_000),
    ] {
        assert_eq!(faults(nested.as_bytes()), [Fault::TooDeep]);
    }
    // What is in a comment is not nested.
    let comment = text("planar.urdf").replace("</robot>", &format!("<!--{open}--></robot>"));
    assert!(import("hostile", comment.as_bytes(), &options("")).is_ok());
}

#[test]
fn size_attributes_and_elements_are_limited() {
    let large = vec![b' '; MAX_BYTES + 1];
    assert_eq!(faults(&large), [Fault::TooLarge { bytes: MAX_BYTES + 1 }]);
    assert_eq!(faults(b"<robot\xff"), [Fault::NotUtf8 { at: 6 }]);
    let attributes: String = (0..200_000).map(|i| format!(" a{i}=''")).collect();
    assert_eq!(faults(format!("<robot{attributes}/>").as_bytes()), [Fault::TooMany]);
    let elements = "<a/>".repeat(200_000);
    assert_eq!(faults(format!("<robot>{elements}</robot>").as_bytes()), [Fault::TooMany]);
    let entities = "<!DOCTYPE a [<!ENTITY b 'bbbbbbbb'>]><robot name='&b;'/>";
    assert!(matches!(&faults(entities.as_bytes())[..], [Fault::NotXml { .. }]));
    let bomb: String =
        (1..30).map(|i| format!("<!entity e{i} '&e{};&e{};'>", i - 1, i - 1)).collect();
    for subset in [bomb, "<!-- ' --><!ENTITY % p SYSTEM 'file:///etc/passwd'>%p;".to_owned()] {
        let text = format!("<!DOCTYPE robot [{subset}]><robot name='&e29;'/>");
        assert!(faults(text.as_bytes())[0].to_string().contains("declares entities"));
    }
}

/// The search for the end of each could run to the end of the text.
#[test]
fn references_without_an_end_are_read_in_no_time() {
    for part in ["&#", "&", "<!", "<!-", "&#x", "='"] {
        let text = format!("<robot name='{}", part.repeat(MAX_BYTES / 8));
        assert!(!faults(text.as_bytes()).is_empty());
    }
}

/// As many links as there can be, in a row and side by side.
#[test]
fn large_trees_are_read_in_no_time() {
    for parent in [|i: usize| i - 1, |_| 0] {
        let mut text = "<robot name='a'><link name='l0'/>".to_owned();
        for i in 1..9_000 {
            text += &format!(
                "<link name='l{i}'/><joint name='j{i}' type='revolute'><parent link='l{}'/><child link='l{i}'/></joint>",
                parent(i)
            );
        }
        text += "</robot>";
        assert_eq!(faults(text.as_bytes()).len(), 1);
    }
    let links: String =
        (0..20_000).map(|i| format!("<link name='{}{i}'/>", "x".repeat(150))).collect();
    assert_eq!(faults(format!("<robot name='a'>{links}</robot>").as_bytes()).len(), 1);
}

/// Numbers and words that mean trouble.
const WORDS: [&str; 16] = [
    "NaN", "inf", "-inf", "1e308", "-1e308", "1e-320", "0", "-1", "1e9", "-1e9", "", "x",
    "1 2 3 4", "link", "\"", "&lt;",
];

fn read_and_explain(text: &[u8]) {
    for flags in ["", "--end-effector tip", GRIPPER] {
        let options = options(flags);
        let told = explain("hostile", text, &options);
        match import("hostile", text, &options) {
            Ok(arm) => {
                assert!(!told.contains("\nfaults\n"));
                for joint in &arm.joints {
                    let body = &joint.body;
                    assert!(body.mass > 0.0 && body.inertia.iter().all(|entry| entry.is_finite()));
                    assert!(
                        (joint.axis.norm() - 1.0).abs() < 1e-12 && joint.capsule.radius.is_finite()
                    );
                    assert!(joint.limits.lower < joint.limits.upper);
                }
            }
            Err(refusal) => {
                assert!(!refusal.faults.is_empty() && told.contains("\nfaults\n"));
                assert!(
                    !refusal.faults.iter().any(|fault| matches!(fault, Fault::Parser { .. })),
                    "{refusal}"
                );
            }
        }
    }
}

/// A fixture with some values replaced: between quotes, where a file has its values.
fn replaced(name: &str, changes: &[(prop::sample::Index, usize)]) -> String {
    let text = text(name);
    let mut parts: Vec<&str> = text.split('"').collect();
    for (place, word) in changes {
        let values = parts.len() / 2;
        let at = 2 * place.index(values) + 1;
        parts[at] = WORDS[*word];
    }
    parts.join("\"")
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]

    #[test]
    fn bytes_do_no_harm(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        read_and_explain(&bytes);
    }

    #[test]
    fn almost_xml_does_no_harm(parts in prop::collection::vec(
        prop::sample::select(vec!["<robot name='a'>", "</robot>", "<link name='b'>", "<link name='c'/>", "</link>", "<joint",
            " name='d'", " type='fixed'", ">", "/>", "</joint>", "<parent link='b'/>", "<child link='c'/>", "<!--", "-->",
            "<![CDATA[", "]]>", "<?x", "?>", "<!DOCTYPE r [", "<!ENTITY e 'x'>", "]>", " p:q='<&e;'",
            "<p:q>", "</p:q>", "'", "\"", "&amp;", "&#0;", "\u{fffd}", "<inertial>", "<mass value='1'/>"]),
        0..30)) {
        read_and_explain(parts.concat().as_bytes());
    }

    #[test]
    fn values_that_mean_trouble_do_none(
        name in prop::sample::select(vec!["planar.urdf", "spatial.urdf", "gripper.urdf"]),
        changes in prop::collection::vec((any::<prop::sample::Index>(), 0..WORDS.len()), 1..5),
    ) {
        read_and_explain(replaced(name, &changes).as_bytes());
    }

    #[test]
    fn bytes_that_flip_do_no_harm(
        name in prop::sample::select(vec!["planar.urdf", "spatial.urdf", "gripper.urdf"]),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..3), 1..6),
    ) {
        let mut bytes = text(name).into_bytes();
        for (place, byte, kind) in changes {
            let at = place.index(bytes.len());
            match kind {
                0 => bytes[at] = byte,
                1 => { bytes.remove(at); }
                _ => bytes.insert(at, byte),
            }
        }
        read_and_explain(&bytes);
    }
}
