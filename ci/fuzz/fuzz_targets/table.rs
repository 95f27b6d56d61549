#![no_main]
//! See `remora_fuzz`.

// libFuzzer's hook ends the program at a panic, before the reader can make a refusal of one of the library's. Without
// it a panic that leaves the reader still ends the program.
libfuzzer_sys::fuzz_target!(init: std::panic::set_hook(Box::new(|_| {})), |bytes: &[u8]| {
    remora_fuzz::run("table", bytes)
});
