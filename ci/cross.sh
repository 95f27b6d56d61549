#!/usr/bin/env bash
# Compiles what flies for the processors it may fly on, crate by crate, and proves that it needs neither
# `std` nor an allocator there. Usage: ci/cross.sh [TARGET...]
#
# Which compiler builds them is `ci/toolchain.sh`'s choice.
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/.."
root=$PWD
out=${CARGO_TARGET_DIR:-$root/target}/cross

targets=("$@")
if [ ${#targets[@]} -eq 0 ]; then
    targets=(thumbv7em-none-eabihf aarch64-unknown-none riscv64gc-unknown-none-elf
        sparc-unknown-none-elf)
fi

# shellcheck source=ci/toolchain.sh
source ci/toolchain.sh
export CARGO_TARGET_DIR=$out
# Whether it compiles is asked; that it links and runs is shown by `cargo xtask firmware`, whose images are
# made from the same code.
export CARGO_PROFILE_DEV_OPT_LEVEL=0 CARGO_PROFILE_DEV_DEBUG=false CARGO_PROFILE_DEV_PANIC=abort

# The proof. A library may use an allocator without anyone noticing until it is linked into an
# image, so this links (well, checks: the compiler looks for an allocator before it makes any code)
# an image of remora-core alone, which has none. The compiler then refuses any `extern crate alloc`
# in core or in what it depends on; `std` does not exist on these targets at all.
write_probe() {
    mkdir -p "$out/probe"
    # The same versions as the workspace's; cargo drops what the probe does not need.
    cp Cargo.lock "$out/probe/Cargo.lock"
    cat >"$out/probe/Cargo.toml" <<TOML
[workspace]
[package]
name = "probe"
edition = "2024"
[lib]
path = "probe.rs"
crate-type = ["staticlib"]
[dependencies]
remora-core = { path = "$root/core" }
TOML
    cat >"$out/probe/probe.rs" <<'RUST'
#![no_std]
use remora_core as _;
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    loop {}
}
RUST
}

# compile TARGET
compile() {
    require_toolchain "$1" &&
        cargo_for "$1" check --locked -p remora-qp &&
        cargo_for "$1" check --locked -p remora-nn &&
        cargo_for "$1" check --locked -p remora-core &&
        cargo_for "$1" check --locked -p remora-capi &&
        cargo_for "$1" check --manifest-path "$out/probe/Cargo.toml"
}

write_probe
failed=0
table=()
for target in "${targets[@]}"; do
    compile "$target" && result=ok || result=FAILED
    [ "$result" = ok ] || failed=1
    table+=("$(printf '%-28s %-8s %s' "$target" "$result" "$(toolchain_name "$target")")")
done

printf '\n%-28s %-8s %s\n' target result toolchain
printf '%s\n' "${table[@]}"
exit $failed
