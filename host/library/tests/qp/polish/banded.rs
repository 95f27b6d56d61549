//! Banded systems of linear equations, by elimination with row exchanges.

/// A square matrix whose entries lie within `band` of its diagonal.
pub(super) struct BandedMatrix {
    size: usize,
    band: usize,
    /// Row by row, from `band` left of the diagonal to twice that right of it: exchanges fill in.
    entries: Vec<f64>,
}

/// Its factors.
pub(super) struct Factors {
    upper: BandedMatrix,
    exchanged: Vec<usize>,
    /// Multiples of each column's pivot row that were subtracted from the rows below.
    taken: Vec<f64>,
}

impl BandedMatrix {
    /// All zero.
    pub(super) fn zeros(size: usize, band: usize) -> Self {
        Self { size, band, entries: vec![0.0; size * (3 * band + 1)] }
    }

    fn at(&self, row: usize, column: usize) -> usize {
        row * (3 * self.band + 1) + column + self.band - row
    }

    /// Adds to an entry, which must lie within the band.
    pub(super) fn add(&mut self, row: usize, column: usize, value: f64) {
        assert!(row.abs_diff(column) <= self.band, "{row} {column}");
        let at = self.at(row, column);
        self.entries[at] += value;
    }

    /// Factors of the matrix with these numbers added to its diagonal; none where it is singular.
    pub(super) fn factors(&self, diagonal: &[f64]) -> Option<Factors> {
        let Self { size, band, .. } = *self;
        let mut upper = Self { entries: self.entries.clone(), size, band };
        for (i, value) in diagonal.iter().enumerate() {
            upper.add(i, i, *value);
        }
        let (mut exchanged, mut taken) = (Vec::with_capacity(size), vec![0.0; size * band]);
        for column in 0..size {
            let below = column..(column + band + 1).min(size);
            let right = column..(column + 2 * band + 1).min(size);
            let magnitude = |row: &usize| upper.entries[upper.at(*row, column)].abs();
            let pivot = below.clone().max_by(|a, b| magnitude(a).total_cmp(&magnitude(b)))?;
            if !(magnitude(&pivot) > 0.0) {
                return None;
            }
            exchanged.push(pivot);
            if pivot != column {
                for j in right.clone() {
                    let (a, b) = (upper.at(pivot, j), upper.at(column, j));
                    upper.entries.swap(a, b);
                }
            }
            let head = upper.entries[upper.at(column, column)];
            for row in below.skip(1) {
                let at = upper.at(row, column);
                let share = upper.entries[at] / head;
                taken[column * band + row - column - 1] = share;
                if share != 0.0 {
                    for j in right.clone() {
                        let (to, from) = (upper.at(row, j), upper.at(column, j));
                        upper.entries[to] -= share * upper.entries[from];
                    }
                }
            }
        }
        Some(Factors { upper, exchanged, taken })
    }
}

impl Factors {
    /// Solves for a right-hand side.
    pub(super) fn solve(&self, mut side: Vec<f64>) -> Vec<f64> {
        let BandedMatrix { size, band, .. } = self.upper;
        for column in 0..size {
            side.swap(column, self.exchanged[column]);
            for row in column + 1..(column + band + 1).min(size) {
                side[row] -= self.taken[column * band + row - column - 1] * side[column];
            }
        }
        for row in (0..size).rev() {
            let entry = |column| self.upper.entries[self.upper.at(row, column)];
            let known = row + 1..(row + 2 * band + 1).min(size);
            let sum: f64 = known.map(|column| entry(column) * side[column]).sum();
            side[row] = (side[row] - sum) / entry(row);
        }
        side
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_solution_gives_its_right_hand_side_again() {
        let (size, band) = (12, 3);
        let mut matrix = BandedMatrix::zeros(size, band);
        for row in 0..size {
            for column in row.saturating_sub(band)..(row + band + 1).min(size) {
                // A diagonal of zeros: rows must be exchanged.
                let value = ((7 * row + 3 * column + 1) % 11) as f64 - 5.0;
                matrix.add(row, column, if row == column { 0.0 } else { value });
            }
        }
        let side: Vec<f64> = (0..size).map(|i| i as f64 - 4.5).collect();
        let found = matrix.factors(&vec![0.0; size]).unwrap().solve(side.clone());
        for (row, side) in side.iter().enumerate() {
            let columns = row.saturating_sub(band)..(row + band + 1).min(size);
            let product: f64 =
                columns.map(|column| matrix.entries[matrix.at(row, column)] * found[column]).sum();
            assert!((product - side).abs() < 1e-10, "{product} {side}");
        }
        assert!(BandedMatrix::zeros(3, 1).factors(&[0.0; 3]).is_none());
        assert!(BandedMatrix::zeros(3, 1).factors(&[1.0; 3]).is_some());
    }
}
