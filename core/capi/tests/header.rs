//! The header that is checked in is the one that the crate's code makes.

use std::path::Path;

/// Makes the header. `REMORA_WRITE_HEADER=1 cargo test -p remora-capi --test header` writes it.
// Verifies REM-DOR-001.
#[test]
fn the_header_is_what_the_code_makes() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(folder.join("cbindgen.toml")).unwrap();
    let bindings = cbindgen::generate_with_config(folder, config).unwrap();
    let mut made = Vec::new();
    bindings.write(&mut made);
    let made = String::from_utf8(made).unwrap();
    let file = folder.join("include/remora.h");
    if std::env::var_os("REMORA_WRITE_HEADER").is_some() {
        std::fs::write(&file, &made).unwrap();
    }
    let kept = std::fs::read_to_string(&file).unwrap();
    assert!(kept == made, "include/remora.h is stale: REMORA_WRITE_HEADER=1 writes it");
}
