//! The image: on bare metal started by the board's own code, on the host an ordinary program whose
//! output the images are held against.
#![cfg_attr(target_os = "none", no_std, no_main)]
// Debian's compiler alone builds for this one, and lets its assembly through.
#![cfg_attr(target_arch = "sparc", feature(asm_experimental_arch))]

#[cfg(target_os = "none")]
mod bare;
#[cfg(not(target_os = "none"))]
mod host;
mod models;

#[cfg(not(target_os = "none"))]
fn main() -> std::process::ExitCode {
    host::main()
}
