//! Tells the network's kernels whether the processor has Arm's DSP extension: stable Rust has no
//! `target_feature` for it, but every Armv7E-M has it.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rustc-check-cfg=cfg(remora_dsp)");
    if std::env::var("TARGET").is_ok_and(|target| target.starts_with("thumbv7em")) {
        println!("cargo:rustc-cfg=remora_dsp");
    }
}
