//! Forms of numbers in files: vectors as lists, angles in degrees, inertias as three or six numbers.

/// A vector as a list of its three numbers.
pub mod vector {
    use nalgebra::Vector3;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    /// Writes it in this form.
    pub fn serialize<S: Serializer>(vector: &Vector3<f64>, to: S) -> Result<S::Ok, S::Error> {
        <[f64; 3]>::from(*vector).serialize(to)
    }

    /// Reads it in this form.
    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vector3<f64>, D::Error> {
        <[f64; 3]>::deserialize(from).map(Into::into)
    }
}

/// An angle or a rate in degrees [deg, deg/s]; in memory radians.
pub mod degrees {
    use core::f64::consts::PI;
    use core::fmt::{self, Write};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    /// Radians of degrees.
    pub fn radians(degrees: f64) -> f64 {
        degrees * PI / 180.0
    }

    /// The degrees that [`radians`] turns into exactly these, the shortest of those next to the quotient; the
    /// quotient itself where there are none.
    pub fn degrees(angle: f64) -> f64 {
        let near = angle * 180.0 / PI;
        let (mut below, mut above) = (near, near);
        let mut best = near;
        let is_exact = |degrees: f64| radians(degrees).to_bits() == angle.to_bits();
        for _ in 0..4 {
            (below, above) = (below.next_down(), above.next_up());
            for other in [below, above] {
                let is_better = !is_exact(best) || digits(other) < digits(best);
                if is_exact(other) && is_better {
                    best = other;
                }
            }
        }
        best
    }

    /// Characters of the shortest text of a number.
    fn digits(value: f64) -> usize {
        struct Count(usize);
        impl Write for Count {
            fn write_str(&mut self, text: &str) -> fmt::Result {
                self.0 += text.len();
                Ok(())
            }
        }
        let mut count = Count(0);
        // Counting cannot fail.
        let _ = write!(count, "{value}");
        count.0
    }

    /// Writes it in this form.
    pub fn serialize<S: Serializer>(angle: &f64, to: S) -> Result<S::Ok, S::Error> {
        degrees(*angle).serialize(to)
    }

    /// Reads it in this form.
    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
        f64::deserialize(from).map(radians)
    }
}

/// Form of [`degrees`](mod@degrees) for an angle that may be missing.
pub mod degrees_if_given {
    use super::degrees::{degrees, radians};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    /// Writes it in this form.
    pub fn serialize<S: Serializer>(angle: &Option<f64>, to: S) -> Result<S::Ok, S::Error> {
        angle.map(degrees).serialize(to)
    }

    /// Reads it in this form.
    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Option<f64>, D::Error> {
        Option::<f64>::deserialize(from).map(|degrees| degrees.map(radians))
    }
}

/// An inertia tensor as its three principal moments, or as `[xx, yy, zz, xy, xz, yz]`, elements of the tensor
/// (products of inertia with the tensor's sign).
pub mod inertia {
    use core::fmt;
    use nalgebra::Matrix3;
    use serde::de::{Error, IgnoredAny, SeqAccess, Visitor};
    use serde::ser::SerializeSeq;
    use serde::{Deserializer, Serializer};

    /// Writes it in this form.
    pub fn serialize<S: Serializer>(m: &Matrix3<f64>, to: S) -> Result<S::Ok, S::Error> {
        let products = [m[(0, 1)], m[(0, 2)], m[(1, 2)]];
        let products = if products == [0.0; 3] { &[] } else { products.as_slice() };
        let mut list = to.serialize_seq(Some(3 + products.len()))?;
        for i in 0..3 {
            list.serialize_element(&m[(i, i)])?;
        }
        for product in products {
            list.serialize_element(product)?;
        }
        list.end()
    }

    struct Elements;

    impl<'de> Visitor<'de> for Elements {
        type Value = Matrix3<f64>;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("a list of 3 principal moments or 6 elements, [xx, yy, zz, xy, xz, yz]")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Self::Value, A::Error> {
            let (mut given, mut count) = ([0.0; 6], 0);
            for slot in &mut given {
                let Some(element) = list.next_element()? else { break };
                *slot = element;
                count += 1;
            }
            let expected = "3 principal moments or 6 elements, [xx, yy, zz, xy, xz, yz]";
            if list.next_element::<IgnoredAny>()?.is_some() {
                return Err(A::Error::custom(format_args!("{expected}, not more")));
            }
            if count != 3 && count != 6 {
                return Err(A::Error::custom(format_args!("{expected}, not {count} numbers")));
            }
            let [xx, yy, zz, xy, xz, yz] = given;
            Ok(Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz))
        }
    }

    /// Reads it in this form.
    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Matrix3<f64>, D::Error> {
        from.deserialize_seq(Elements)
    }
}
