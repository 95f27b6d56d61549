//! The compiler's own figures: what each function takes of the stack.

use crate::error::ImageError;
use std::collections::HashMap;
use std::path::Path;

/// Bytes of the stack by a function's mangled name. A name may have been compiled more than once:
/// the largest counts.
pub type Frames = HashMap<String, u64>;

/// Reads the output of a build with `-C remark=prologepilog`.
///
/// # Errors
/// A file that cannot be read, or holds no figure.
pub fn read(file: &Path) -> Result<Frames, ImageError> {
    let bytes = std::fs::read(file).map_err(|e| ImageError::io(file, &e))?;
    let frames = parse(&String::from_utf8_lossy(&bytes));
    if frames.is_empty() {
        let reason = "no remark of the stack: build with -C remark=prologepilog, anew";
        return Err(ImageError::new(file, reason));
    }
    Ok(frames)
}

fn parse(text: &str) -> Frames {
    let mut frames = Frames::new();
    for (name, bytes) in text.lines().filter_map(remark) {
        let known = frames.entry(name.to_string()).or_insert(0);
        *known = bytes.max(*known);
    }
    frames
}

/// `... prologepilog (analysis): 16 stack bytes in function 'NAME'`.
fn remark(line: &str) -> Option<(&str, u64)> {
    let (_, remark) = line.split_once("prologepilog (analysis): ")?;
    let (bytes, name) = remark.split_once(" stack bytes in function '")?;
    Some((name.trim_end().strip_suffix('\'')?, bytes.parse().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_figure_of_a_name_counts() {
        let text = "   Compiling x v0\n\
            note: <unknown file>:0:0 prologepilog (analysis): 16 stack bytes in function '_RNvC1a1f'\n\
            note: <unknown file>:0:0 prologepilog (analysis): 48 stack bytes in function '_RNvC1a1f'\n\
            note: <unknown file>:0:0 prologepilog (analysis): 0 stack bytes in function 'g'\n\
            note: <unknown file>:0:0 inline (missed): 8 stack bytes in function 'h'\n";
        let frames = parse(text);
        assert_eq!(frames.len(), 2);
        assert_eq!((frames["_RNvC1a1f"], frames["g"]), (48, 0));
    }

    #[test]
    fn a_file_without_figures_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("remarks");
        assert!(read(&file).unwrap_err().to_string().ends_with("no such file or directory"));
        std::fs::write(&file, "Finished\n").unwrap();
        assert!(read(&file).unwrap_err().to_string().contains("-C remark=prologepilog"));
    }
}
