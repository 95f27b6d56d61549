//! Lines of `key=value`. The standard formatting code panics where a formatter misbehaves; this
//! cannot.

use crate::Board;

/// One line on its way out: words separated by blanks.
pub struct Line<'a, B: Board>(&'a B);

impl<'a, B: Board> Line<'a, B> {
    /// Starts a line of this kind.
    pub fn new(board: &'a B, kind: &str) -> Self {
        let line = Self(board);
        line.raw(kind);
        line
    }

    /// Starts a line of this kind about a scenario. One copy of it makes images smaller.
    #[inline(never)]
    pub fn about(board: &'a B, kind: &str, scenario: &str) -> Self {
        Self::new(board, kind).text("scenario", scenario)
    }

    #[inline(never)]
    fn raw(&self, text: &str) {
        text.bytes().for_each(|byte| self.0.write(byte));
    }

    fn key(&self, key: &str) {
        self.raw(" ");
        self.raw(key);
        self.raw("=");
    }

    /// A word.
    pub fn text(self, key: &str, value: &str) -> Self {
        self.key(key);
        self.raw(value);
        self
    }

    /// A number in decimal; one copy of it, as above.
    #[inline(never)]
    pub fn number(self, key: &str, value: u64) -> Self {
        self.key(key);
        self.decimal(value);
        self
    }

    /// A number in sixteen hexadecimal digits; one copy of it, as above.
    #[inline(never)]
    pub fn bits(self, key: &str, value: u64) -> Self {
        self.key(key);
        self.hexadecimal(value);
        self
    }

    /// A number by its bits, and in brackets in three decimal digits for people.
    pub fn float(self, key: &str, value: f64) -> Self {
        self.key(key);
        self.hexadecimal(value.to_bits());
        self.raw("(");
        self.scientific(value);
        self.raw(")");
        self
    }

    /// Ends the line.
    pub fn end(self) {
        self.raw("\n");
    }

    fn digit(&self, value: u64) {
        let value = value as u8;
        self.0.write(if value < 10 { b'0' + value } else { b'a' + value % 16 - 10 });
    }

    #[inline(never)]
    fn decimal(&self, value: u64) {
        // The longest number has 20 digits; the last is written even where it is zero.
        let mut digits = [0; 20];
        let mut rest = value;
        for digit in digits.iter_mut().rev() {
            *digit = rest % 10;
            rest /= 10;
        }
        let mut leading = true;
        for (i, digit) in digits.iter().enumerate() {
            leading &= *digit == 0 && i != 19;
            if !leading {
                self.digit(*digit);
            }
        }
    }

    #[inline(never)]
    fn hexadecimal(&self, value: u64) {
        for shift in (0..16).rev() {
            self.digit((value >> (4 * shift)) & 15);
        }
    }

    /// Three digits, by repeated scaling: good to look at, not to calculate with.
    fn scientific(&self, value: f64) {
        if !value.is_finite() {
            return self.raw(if value.is_nan() { "nan" } else { "inf" });
        }
        if value < 0.0 {
            self.raw("-");
        }
        let mut magnitude = value.abs();
        let mut exponent = 0;
        // At most 324 turns; a zero needs none.
        while magnitude >= 9.995 {
            magnitude /= 10.0;
            exponent += 1;
        }
        while magnitude > 0.0 && magnitude < 0.9995 {
            magnitude *= 10.0;
            exponent -= 1;
        }
        let digits = (magnitude * 100.0 + 0.5) as u64;
        self.digit(digits / 100 % 10);
        self.raw(".");
        self.digit(digits / 10 % 10);
        self.digit(digits % 10);
        self.raw(if exponent < 0 { "e-" } else { "e" });
        self.decimal(i32::unsigned_abs(exponent).into());
    }
}

/// Prints the mark that an entry point left on the stack since it was painted.
pub fn print_stack<B: Board>(board: &B, entry: &str) {
    if let Some(stack) = board.stack() {
        let line = Line::new(board, "stack").text("entry", entry);
        line.number("used", stack.used as u64).number("size", stack.size as u64).end();
    }
}
