//! Writes the seeds of a target into a folder: `seeds TARGET FOLDER`.

use std::path::Path;

fn main() -> std::io::Result<()> {
    let mut words = std::env::args().skip(1);
    let (Some(target), Some(folder)) = (words.next(), words.next()) else {
        return Err(std::io::Error::other("usage: seeds TARGET FOLDER"));
    };
    std::fs::create_dir_all(&folder)?;
    for (i, seed) in remora_fuzz::seeds::seeds(&target).iter().enumerate() {
        std::fs::write(Path::new(&folder).join(format!("seed-{i}")), seed)?;
    }
    Ok(())
}
