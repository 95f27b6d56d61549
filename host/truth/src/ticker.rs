//! Instants that come again at a constant rate.

/// Times nearer than this [s] are the same instant: 0.1 times 3 and 3 over 10 differ in the last bit.
pub const SAME: f64 = 1e-9;

/// Counts instants `0, 1/rate, 2/rate, ...`, so that nothing adds up.
#[derive(Clone, Copy, Debug)]
pub struct Ticker {
    rate: f64,
    count: u64,
}

impl Ticker {
    /// So many instants a second; none at all for a rate of zero.
    pub fn new(rate: f64) -> Self {
        Self { rate, count: 0 }
    }

    /// The next instant [s].
    pub fn next(&self) -> f64 {
        if self.rate == 0.0 { f64::INFINITY } else { self.count as f64 / self.rate }
    }

    /// Whether it is time; then the next instant is a later one.
    pub fn strikes(&mut self, now: f64) -> bool {
        let due = self.next() <= now + SAME;
        while self.next() <= now + SAME {
            self.count += 1;
        }
        due
    }
}
