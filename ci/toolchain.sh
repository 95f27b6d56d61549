# shellcheck shell=bash
# Compilers for bare-metal targets and WebAssembly; sourced by the scripts beside it that build for
# those.
#
# A target that the user's own toolchain has is built with it. For the others Debian's compiler
# builds `core` from its own source, so that no toolchain has to be fetched by hand. `cargo xtask firmware`
# makes the same choice. Nothing is installed here.

# Started from within cargo (or with flags meant for the host) these would leak into the build.
unset CARGO RUSTC RUSTC_WRAPPER RUSTC_WORKSPACE_WRAPPER RUSTFLAGS CARGO_ENCODED_RUSTFLAGS \
    CARGO_BUILD_RUSTC CARGO_BUILD_RUSTC_WRAPPER CARGO_BUILD_RUSTFLAGS CARGO_BUILD_TARGET \
    LD_LIBRARY_PATH

own_toolchain_has() {
    local sysroot
    sysroot=$(rustc --print sysroot 2>/dev/null) && command -v cargo >/dev/null &&
        [ -d "$sysroot/lib/rustlib/$1/lib" ]
}

debian_is_ready() {
    [ -x /usr/bin/cargo ] && [ -x /usr/bin/rustc ] &&
        [ -d "$(/usr/bin/rustc --print sysroot)/lib/rustlib/src/rust/library/core" ]
}

# require_toolchain TARGET - says what is missing where there is no compiler.
require_toolchain() {
    own_toolchain_has "$1" || debian_is_ready || {
        echo "error: missing: 'rustup target add $1', or Debian's rustc-web cargo-web rust-web-src" >&2
        return 1
    }
}

# cargo_for TARGET COMMAND [ARGUMENT...] - cargo's COMMAND for a bare-metal target.
cargo_for() {
    local target=$1 command=$2
    shift 2
    if own_toolchain_has "$target"; then
        cargo "$command" --target "$target" "$@"
    else
        debian_cargo_for "$target" "$command" "$@"
    fi
}

# debian_cargo_for TARGET COMMAND [ARGUMENT...] - the same with Debian's compiler, whatever else there is.
debian_cargo_for() {
    local target=$1 command=$2
    shift 2
    RUSTC_BOOTSTRAP=1 RUSTC=/usr/bin/rustc \
        /usr/bin/cargo "$command" --target "$target" -Zbuild-std=core "$@"
}

# toolchain_name TARGET - which compiler that is, with its version.
toolchain_name() {
    local version
    if own_toolchain_has "$1"; then
        version=$(rustc --version)
    else
        version="Debian $(/usr/bin/rustc --version 2>/dev/null || echo 'rustc missing')"
    fi
    echo "${version%% (*}"
}
