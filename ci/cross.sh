#!/usr/bin/env bash
# Builds remora-core for the processors it may fly on and proves that it needs neither `std` nor an
# allocator there. Usage: ci/cross.sh [TARGET...]
#
# A target that the user's own toolchain has is built with it. For the others Debian's compiler
# builds `core` from its own source, so that no toolchain has to be fetched by hand.
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/.."
root=$PWD
out=${CARGO_TARGET_DIR:-$root/target}/cross

targets=("$@")
if [ ${#targets[@]} -eq 0 ]; then
    targets=(thumbv7em-none-eabihf aarch64-unknown-none riscv64gc-unknown-none-elf
        sparc-unknown-none-elf)
fi

# Started from within cargo (or with flags meant for the host) these would leak into the build.
unset CARGO RUSTC RUSTC_WRAPPER RUSTC_WORKSPACE_WRAPPER RUSTFLAGS CARGO_ENCODED_RUSTFLAGS \
    CARGO_BUILD_RUSTC CARGO_BUILD_RUSTC_WRAPPER CARGO_BUILD_RUSTFLAGS CARGO_BUILD_TARGET \
    LD_LIBRARY_PATH
export CARGO_TARGET_DIR=$out

own_toolchain_has() {
    local sysroot
    sysroot=$(rustc --print sysroot 2>/dev/null) && command -v cargo >/dev/null &&
        [ -d "$sysroot/lib/rustlib/$1/lib" ]
}

debian_is_ready() {
    [ -x /usr/bin/cargo ] && [ -x /usr/bin/rustc ] &&
        [ -d "$(/usr/bin/rustc --print sysroot)/lib/rustlib/src/rust/library/core" ]
}

install_debian() {
    local packages=(rustc-web cargo-web rust-web-src)
    debian_is_ready && return
    if [ "$(id -u)" -ne 0 ] || ! command -v apt-get >/dev/null; then
        echo "error: needs 'rustup target add $1', or as root 'apt-get install ${packages[*]}'" >&2
        return 1
    fi
    apt-get update && apt-get install --yes "${packages[@]}" && debian_is_ready
}

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
    # And the same profile, so that the dependencies are not built twice.
    sed -n '/^\[profile.release\]/,/^$/p' Cargo.toml >>"$out/probe/Cargo.toml"
    cat >"$out/probe/probe.rs" <<'RUST'
#![no_std]
use remora_core as _;
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    loop {}
}
RUST
}

# build CARGO TARGET [FLAG...]
build() {
    local cargo=$1 target=$2
    shift 2
    "$cargo" build --locked --release --target "$target" -p remora-core "$@" &&
        "$cargo" check --release --target "$target" --manifest-path "$out/probe/Cargo.toml" "$@"
}

build_with_debian() {
    install_debian "$1" &&
        RUSTC_BOOTSTRAP=1 RUSTC=/usr/bin/rustc build /usr/bin/cargo "$1" -Zbuild-std=core
}

write_probe
failed=0
table=()
for target in "${targets[@]}"; do
    if own_toolchain_has "$target"; then
        toolchain=$(rustc --version)
        build cargo "$target" && result=ok || result=FAILED
    else
        build_with_debian "$target" && result=ok || result=FAILED
        toolchain="Debian $(/usr/bin/rustc --version 2>/dev/null || echo 'rustc missing')"
    fi
    [ "$result" = ok ] || failed=1
    table+=("$(printf '%-28s %-8s %s' "$target" "$result" "${toolchain%% (*}")")
done

printf '\n%-28s %-8s %s\n' target result toolchain
printf '%s\n' "${table[@]}"
exit $failed
