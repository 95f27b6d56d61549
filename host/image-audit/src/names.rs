//! Rust's mangled names: a readable path, and the crate and module that code comes from.

use serde::{Deserialize, Serialize};

/// Origin of code or data.
///
/// A function belongs to the crate and module that its definition stands in: a method's is that of
/// its `impl` block, a provided method's that of its trait, a closure's that of the function around
/// it. So what a crate of matrices generates for the planner's sizes counts for that crate.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Origin {
    /// Crate, or a word in brackets where there is none.
    #[serde(rename = "crate")]
    pub krate: String,
    /// Modules from the crate's root on; empty at the root and where nothing is known.
    pub modules: Vec<String>,
}

impl Origin {
    /// Origin of code or data that no Rust crate owns.
    pub fn other(word: &str) -> Self {
        Self { krate: format!("[{word}]"), modules: Vec::new() }
    }

    /// Crate and the first `depth` modules.
    pub fn to_depth(&self, depth: usize) -> String {
        let modules = self.modules.iter().take(depth).map(String::as_str);
        std::iter::once(self.krate.as_str()).chain(modules).collect::<Vec<_>>().join("::")
    }

    /// Origin of a mangled name; `None` where it is not Rust's.
    pub fn of(mangled: &str) -> Option<Self> {
        v0(mangled).or_else(|| of_path(&readable(mangled)?))
    }
}

/// A mangled name as a Rust path with its generic arguments; `None` where it is not Rust's.
pub fn readable(mangled: &str) -> Option<String> {
    let name = rustc_demangle::try_demangle(mangled).ok()?;
    Some(format!("{name:#}"))
}

/// A readable path without generic arguments; `<T as Trait>::f` becomes `T::f`.
///
/// The path of an instance of a generic function so is that of the function.
pub fn plain(path: &str) -> String {
    let mut out = String::new();
    let mut rest = path;
    while let Some(c) = rest.chars().next() {
        if c != '<' {
            out.push(c);
            rest = &rest[c.len_utf8()..];
            continue;
        }
        let (inner, behind) = bracketed(rest);
        let starts_path = out.is_empty() || out.ends_with(['&', ' ', '(', '*']);
        if starts_path {
            out += &plain(split_as(inner).0);
        } else if let Some((_, of)) = split_impl(inner) {
            out = plain(of);
        } else if out.ends_with("::") {
            out.truncate(out.len() - 2);
        }
        rest = behind;
    }
    out
}

/// `<inner>behind`, the brackets matched; an arrow's is none.
fn bracketed(text: &str) -> (&str, &str) {
    let (mut depth, mut before) = (0, ' ');
    for (i, c) in text.char_indices() {
        match c {
            '<' => depth += 1,
            '>' if !matches!(before, '-' | '=') => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return (&text[1..i], &text[i + 1..]);
        }
        before = c;
    }
    (&text[1..], "")
}

/// Type and trait of `T as Trait`.
fn split_as(inner: &str) -> (&str, Option<&str>) {
    let (mut depth, mut before) = (0, ' ');
    for (i, c) in inner.char_indices() {
        match c {
            '<' | '(' | '[' => depth += 1,
            '>' if matches!(before, '-' | '=') => {}
            '>' | ')' | ']' => depth -= 1,
            ' ' if depth == 0 && inner[i..].starts_with(" as ") => {
                return (&inner[..i], Some(&inner[i + 4..]));
            }
            _ => {}
        }
        before = c;
    }
    (inner, None)
}

/// Trait and type of `impl Trait for T`, as the first mangling has it.
fn split_impl(inner: &str) -> Option<(&str, &str)> {
    inner.strip_prefix("impl ")?.split_once(" for ")
}

/// Module path before an `impl` block in a path of the first mangling, and the block.
fn impl_block(path: &str) -> Option<(&str, &str)> {
    let (module, block) = path.split_at(path.find("::<impl ")?);
    Some((module, bracketed(&block[2..]).0))
}

/// The trait whose method an implementation is: the plain path of `Trait` in `<T as Trait>::f`, or
/// in `module::<impl Trait for T>::f`.
pub fn implemented_trait(path: &str) -> Option<String> {
    if !path.starts_with('<') {
        return impl_block(path).and_then(|(_, block)| Some(plain(split_impl(block)?.0)));
    }
    split_as(bracketed(path).0).1.map(plain)
}

/// Crate and modules as a readable path tells them: the least that is known. Of `<T as Trait>::f`
/// the trait's, which is right where the method is a provided one.
fn of_path(path: &str) -> Option<Origin> {
    let path = match (impl_block(path), implemented_trait(path)) {
        (Some((module, _)), _) => format!("{module}::impl"),
        (None, Some(name)) => name,
        (None, None) => plain(path),
    };
    let mut parts = path.trim_start_matches(['&', '*', '(', ' ']).split("::");
    let krate = parts.next().filter(|name| is_word(name))?;
    let rest: Vec<&str> = parts.take_while(|name| is_word(name)).collect();
    // A name that begins with a capital is a type's; without one the last is the function's.
    let is_type = |name: &&str| name.starts_with(char::is_uppercase);
    let modules = rest.iter().position(is_type).unwrap_or(rest.len().saturating_sub(1));
    Some(Origin {
        krate: krate.into(),
        modules: rest[..modules].iter().map(|m| m.to_string()).collect(),
    })
}

fn is_word(name: &str) -> bool {
    !name.is_empty() && name.chars().all(|c| c.is_alphanumeric() || c == '_')
}

/// Crate and modules of a name of Rust's second mangling, which says in which module an `impl`
/// block stands; its readable form does not.
///
/// Tags come before what they are about: those ahead of the crate's root say what each of the
/// identifiers after it is.
fn v0(mangled: &str) -> Option<Origin> {
    let mut rest = mangled.strip_prefix("_R")?;
    let mut tags = Vec::new();
    loop {
        let tag = rest.chars().next()?;
        rest = &rest[1..];
        match tag {
            'C' => break,
            // Generic arguments stand behind the path; they name nothing.
            'I' => tags.push('I'),
            'N' => {
                tags.push(rest.chars().next()?);
                rest = &rest[1..];
            }
            'M' | 'X' => {
                tags.push(tag);
                rest = disambiguated(rest)?;
            }
            _ => return None,
        }
    }
    let (krate, mut rest) = identifier(rest)?;
    let mut modules = Vec::new();
    // Modules and types are of one namespace; types begin with a capital.
    while tags.pop() == Some('t') {
        let (name, behind) = identifier(rest)?;
        if name.starts_with(char::is_uppercase) {
            break;
        }
        modules.push(name.to_string());
        rest = behind;
    }
    Some(Origin { krate: krate.into(), modules })
}

/// Text behind a disambiguator: `s`, a number in base 62 and `_`, if there is one.
fn disambiguated(text: &str) -> Option<&str> {
    let Some(number) = text.strip_prefix('s') else { return Some(text) };
    let digits = number.bytes().take_while(u8::is_ascii_alphanumeric).count();
    number[digits..].strip_prefix('_')
}

/// An identifier and what is behind it: disambiguator, length in decimal, `_` where the name begins
/// with a digit or `_`, name. Names beyond ASCII (`u`) are not decoded.
fn identifier(text: &str) -> Option<(&str, &str)> {
    let text = disambiguated(text)?;
    let text = text.strip_prefix('u').unwrap_or(text);
    let digits = text.bytes().take_while(u8::is_ascii_digit).count();
    let length: usize = text[..digits].parse().ok()?;
    let name = text[digits..].strip_prefix('_').unwrap_or(&text[digits..]);
    Some((name.get(..length)?, name.get(length..)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(mangled: &str) -> String {
        Origin::of(mangled).map_or("none".into(), |origin| origin.to_depth(9))
    }

    #[test]
    fn methods_belong_where_their_impl_stands() {
        for (mangled, origin) in [
            // A function with generic arguments.
            (
                "_RINvNtCsi59ke8b5RWb_11remora_core7planner16plan_translationINtNtNtB4_2qp8embedded\
                 10EmbeddedQpKj3c_Kjc_Kj6_Kj1_EECskvu9ShPqsFl_15remora_firmware",
                "remora_core::planner",
            ),
            // An inherent method in another module than its type.
            (
                "_RNvMNtNtNtCsi59ke8b5RWb_11remora_core2qp8embedded9iterationINtB4_10EmbeddedQpKj3c\
                 _Kjc_Kj6_Kj1_E9factoriseCskvu9ShPqsFl_15remora_firmware",
                "remora_core::qp::embedded::iteration",
            ),
            // A closure in a method.
            (
                "_RNCNvMs_NtNtCsi59ke8b5RWb_11remora_core6stages8verifierINtB6_7CheckedKj3c_Kj3_E4s\
                 tep0Cskvu9ShPqsFl_15remora_firmware",
                "remora_core::stages::verifier",
            ),
            // A trait's method, implemented in one crate for a type of another.
            (
                "_RNvXNtCskz9254emdO9_15remora_firmware5boardINtB2_16InstructionClockNtNtNtCskvu9Sh\
                 PqsFl_15remora_firmware4bare5board9ThisBoardENtNtCsi59ke8b5RWb_11remora_core4time5\
                 Clock7secondsB19_",
                "remora_firmware::board",
            ),
            // A static.
            (
                "_RNvNtNtNtCsgvjEey7UIGT_4libm4math7generic4sqrt9RSQRT_TAB",
                "libm::math::generic::sqrt",
            ),
            // The crate's root.
            ("_RNvCsgvjEey7UIGT_4libm4sqrt", "libm"),
            // A provided method belongs to its trait.
            ("_RNvYNtCs1234_3foo3BarNtNtCs5678_4core3fmt5Write9write_fmtB4_", "core::fmt"),
            // The first mangling.
            ("_ZN4core3fmt9Formatter3pad17h0123456789abcdefE", "core::fmt"),
            ("_ZN4core3fmt5write17h0123456789abcdefE", "core::fmt"),
            (
                "_ZN11remora_core9warmstart7network112_$LT$impl$u20$remora_core..warmstart..rolling\
                 ..Policy$u20$for$u20$remora_core..nn..network..Network$LT$M$GT$$GT$3act17h59096\
                 74ac42226d7E",
                "remora_core::warmstart::network",
            ),
            ("memcpy", "none"),
            ("_R", "none"),
            ("_RNvC", "none"),
        ] {
            assert_eq!(of(mangled), origin, "{mangled}");
        }
    }

    #[test]
    fn plain_paths_have_no_arguments() {
        for (path, expected) in [
            ("a::b::plan::<a::S<3>, c::P>", "a::b::plan"),
            ("<a::S<60, 12>>::solve", "a::S::solve"),
            ("<a::S<60> as b::Q<3>>::solve::<x::Y>::{closure#0}", "a::S::solve::{closure#0}"),
            ("<&mut a::S as b::Q>::f", "&mut a::S::f"),
            ("<fn(u8) -> <a::T as b::U>::V as b::Q>::f", "fn(u8) -> a::T::V::f"),
            ("main", "main"),
        ] {
            assert_eq!(plain(path), expected);
        }
        assert_eq!(implemented_trait("<a::S<6> as b::Q<3>>::f").as_deref(), Some("b::Q"));
        assert_eq!(implemented_trait("<a::S<6>>::f"), None);
        assert_eq!(implemented_trait("a::f"), None);
        // The first mangling.
        let path = "a::m::<impl b::Q<3> for a::S<M>>::act";
        assert_eq!(plain(path), "a::S::act");
        assert_eq!(implemented_trait(path).as_deref(), Some("b::Q"));
        assert_eq!(implemented_trait("a::m::<impl a::S<M>>::act"), None);
    }
}
