//! Rows of a flat slice, without panics.

/// The first `length` numbers of every row, rows being `stride` apart.
pub(super) fn rows<T>(data: &[T], stride: usize, length: usize) -> impl Iterator<Item = &[T]> {
    data.chunks(stride.max(1)).map(move |row| row.get(..length).unwrap_or(row))
}

/// [`rows`], mutable.
pub(super) fn rows_mut<T>(
    data: &mut [T],
    stride: usize,
    length: usize,
) -> impl Iterator<Item = &mut [T]> {
    data.chunks_mut(stride.max(1)).map(move |row| {
        let length = length.min(row.len());
        row.get_mut(..length).unwrap_or_default()
    })
}

/// The slice from `at` on; empty where it is shorter.
pub(super) fn from<T>(data: &[T], at: usize) -> &[T] {
    data.get(at..).unwrap_or_default()
}

/// [`from`], mutable.
pub(super) fn from_mut<T>(data: &mut [T], at: usize) -> &mut [T] {
    data.get_mut(at..).unwrap_or_default()
}
