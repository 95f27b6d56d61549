#![no_main]
//! See `remora_fuzz`.
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| remora_fuzz::run("table", bytes));
