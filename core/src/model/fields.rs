//! A mission's fields, each listed once, with its key, default and range. Checks, checksums, the structure of C
//! and its numbers on a line follow from the list.

use super::Switch;
use nalgebra::{Matrix3, SVector, Vector3};
use remora_qp::dense::{cholesky_in_place, is_not_negative, is_positive, is_usable, is_within};

/// Largest distance from one of the norm of a direction that is not normalised.
pub(super) const UNIT: f64 = 1e-9;

/// Ends of intervals that are open there.
pub(super) const ABOVE_ZERO: f64 = 0.0_f64.next_up();
pub(super) const BELOW_ONE: f64 = 1.0_f64.next_down();

/// Range of a field's numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Range {
    /// Finite, up to 1e30.
    Finite,
    /// From 1e-30 to 1e30.
    Positive,
    /// From zero to 1e30.
    NotNegative,
    /// A vector of unit length.
    Unit,
    /// Principal moments of inertia of a body.
    Moments,
    /// Inertia tensor of a body.
    Inertia,
    /// Within two bounds, with the reason to give otherwise.
    Within(f64, f64, &'static str),
    /// A count.
    Count,
    /// A code below this.
    Code(u32),
}

/// A field as a visitor sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Field {
    /// Section and name, such as `servicer.bus_mass_kg`; the key in a mission file.
    pub key: &'static str,
    /// Range of its values.
    pub range: Range,
    /// The link that it belongs to, from 0.
    pub link: Option<usize>,
}

/// Work on a mission's fields, in their order.
pub trait FieldVisitor {
    /// Numbers of a field: one, or those of a vector or a symmetric matrix.
    fn numbers(&mut self, field: Field, values: &mut [f64]);

    /// A count, a code of a switch, or 1 for a part that is given and 0 for one that is not.
    fn word(&mut self, field: Field, value: &mut u32);
}

/// Types of fields.
pub(super) trait Value {
    fn visit(&mut self, field: Field, visitor: &mut impl FieldVisitor);
}

impl Value for f64 {
    fn visit(&mut self, field: Field, visitor: &mut impl FieldVisitor) {
        visitor.numbers(field, core::slice::from_mut(self));
    }
}

impl<const D: usize> Value for SVector<f64, D> {
    fn visit(&mut self, field: Field, visitor: &mut impl FieldVisitor) {
        visitor.numbers(field, self.as_mut_slice());
    }
}

impl Value for Matrix3<f64> {
    fn visit(&mut self, field: Field, visitor: &mut impl FieldVisitor) {
        visitor.numbers(field, self.as_mut_slice());
    }
}

/// Zero stands for a number that is not given.
impl Value for Option<f64> {
    fn visit(&mut self, field: Field, visitor: &mut impl FieldVisitor) {
        let mut value = self.unwrap_or(0.0);
        value.visit(field, visitor);
        *self = Some(value).filter(|value| *value != 0.0 || self.is_some());
    }
}

impl Value for usize {
    fn visit(&mut self, field: Field, visitor: &mut impl FieldVisitor) {
        let mut value = u32::try_from(*self).unwrap_or(u32::MAX);
        visitor.word(field, &mut value);
        *self = value as usize;
    }
}

/// An unknown code leaves it as it is.
impl Value for Switch {
    fn visit(&mut self, field: Field, visitor: &mut impl FieldVisitor) {
        let mut code = *self as u32;
        visitor.word(field, &mut code);
        *self = [Self::Auto, Self::On, Self::Off].get(code as usize).copied().unwrap_or(*self);
    }
}

/// Visits a part that may be missing: its fields, those of `blank` where it is, then whether it is given.
pub(super) fn optional<T, V: FieldVisitor>(
    part: &mut Option<T>,
    key: &'static str,
    blank: T,
    visitor: &mut V,
    visit: impl FnOnce(&mut T, &mut V),
) {
    let mut is_given = u32::from(part.is_some());
    let mut fields = part.take().unwrap_or(blank);
    visit(&mut fields, visitor);
    visitor.word(Field { key, range: Range::Code(2), link: None }, &mut is_given);
    *part = Some(fields).filter(|_| is_given == 1);
}

/// A section of a mission: its structure, its defaults and the visit of its fields, in the same order.
macro_rules! section {
    (
        $(#[$about:meta])*
        $name:ident in $section:literal {
            $($(#[$field_about:meta])* $field:ident: $type:ty = $default:expr, $range:expr;)*
        }
    ) => {
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
        $(#[$about])*
        pub struct $name {
            $($(#[$field_about])* pub $field: $type,)*
        }

        impl Default for $name {
            fn default() -> Self {
                #[allow(unused_imports, reason = "not every section has ranges with bounds")]
                use $crate::model::fields::Range::*;
                Self { $($field: $default,)* }
            }
        }

        impl $name {
            /// Visits the fields, which belong to `link` of an arm.
            pub(super) fn visit(
                &mut self,
                link: Option<usize>,
                visitor: &mut impl $crate::model::fields::FieldVisitor,
            ) {
                #[allow(unused_imports, reason = "not every section has ranges with bounds")]
                use $crate::model::fields::{Field, Range::*, Value};
                $(
                    let key = concat!($section, ".", stringify!($field));
                    Value::visit(&mut self.$field, Field { key, range: $range, link }, visitor);
                )*
            }
        }
    };
}
pub(super) use section;

/// A field whose value makes no sense, and why.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InvalidField {
    /// Its key, such as `servicer.bus_mass_kg`.
    pub field: &'static str,
    /// The link or joint that it belongs to, from 0, where it belongs to one.
    pub index: Option<usize>,
    /// Reason why it makes no sense.
    pub reason: &'static str,
}

impl core::fmt::Display for InvalidField {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{}: {}", self.field, self.reason)
    }
}

impl core::error::Error for InvalidField {}

/// Share of an inertia's trace by which rounding may make a flat body's second mass moment negative.
const FLAT: f64 = 1e-12;

/// Judges fields by their ranges; keeps the first that is wrong.
#[derive(Default)]
pub(super) struct Judge(Option<InvalidField>);

impl Judge {
    /// Requires a condition of a field.
    pub fn that(
        &mut self,
        is_met: bool,
        field: &'static str,
        index: Option<usize>,
        reason: &'static str,
    ) {
        if !is_met && self.0.is_none() {
            self.0 = Some(InvalidField { field, index, reason });
        }
    }

    /// The first field found wrong.
    pub fn verdict(self) -> Result<(), InvalidField> {
        self.0.map_or(Ok(()), Err)
    }
}

impl FieldVisitor for Judge {
    // Not inlined: before planning time does not count, and an image's room does.
    #[inline(never)]
    fn numbers(&mut self, field: Field, values: &mut [f64]) {
        if let Err(reason) = judge(field.range, values) {
            self.that(false, field.key, field.link, reason);
        }
    }

    fn word(&mut self, field: Field, value: &mut u32) {
        if let Range::Code(codes) = field.range {
            self.that(*value < codes, field.key, field.link, "is no code that has a meaning");
        }
    }
}

const NOT_FINITE: &str = "must be finite, up to 1e30";
const NOT_POSITIVE: &str = "must be positive and finite, from 1e-30 to 1e30";

/// Judges numbers by a range; an error is the reason why they are out of it.
fn judge(range: Range, values: &[f64]) -> Result<(), &'static str> {
    match range {
        Range::Finite | Range::Count | Range::Code(_) => all(values, is_usable, NOT_FINITE),
        Range::Positive => all(values, is_positive, NOT_POSITIVE),
        Range::NotNegative => {
            all(values, is_not_negative, "must be finite and not negative, up to 1e30")
        }
        Range::Within(least, most, reason) => all(values, |v| is_within(v, least, most), reason),
        Range::Unit => {
            all(values, is_usable, NOT_FINITE)?;
            let square: f64 = values.iter().map(|v| v * v).sum();
            require((libm::sqrt(square) - 1.0).abs() <= UNIT, "must be a unit vector")
        }
        Range::Moments => match *values {
            [x, y, z] => judge_inertia(&Matrix3::from_diagonal(&Vector3::new(x, y, z))),
            _ => Ok(()),
        },
        Range::Inertia => match values.first_chunk::<9>() {
            Some(columns) => judge_inertia(&Matrix3::from_column_slice(columns.as_slice())),
            None => Ok(()),
        },
    }
}

fn all(
    values: &[f64],
    is_sound: impl Fn(f64) -> bool,
    reason: &'static str,
) -> Result<(), &'static str> {
    require(values.iter().all(|v| is_sound(*v)), reason)
}

fn require(is_met: bool, reason: &'static str) -> Result<(), &'static str> {
    if is_met { Ok(()) } else { Err(reason) }
}

/// The tensor must be symmetric and positive definite, and so must, but for rounding, be the body's second mass
/// moments: no principal moment is then above the sum of the other two.
#[inline(never)]
pub(super) fn judge_inertia(m: &Matrix3<f64>) -> Result<(), &'static str> {
    let is_definite = |m: &Matrix3<f64>| cholesky_in_place(&mut m.clone_owned()).is_ok();
    require((0..3).all(|i| is_positive(m[(i, i)])), NOT_POSITIVE)?;
    require(m.iter().all(|v| is_usable(*v)), NOT_FINITE)?;
    require(*m == m.transpose(), "must be symmetric")?;
    require(is_definite(m), "must be positive definite")?;
    let second = Matrix3::from_diagonal_element((0.5 + FLAT) * m.trace()) - m;
    require(
        is_definite(&second),
        "no body has such moments: each must be at most the sum of the other two",
    )
}
