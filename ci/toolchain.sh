# shellcheck shell=bash
# Compilers for bare-metal targets; sourced by the scripts beside it.
#
# A target that the user's own toolchain has is built with it. For the others Debian's compiler
# builds `core` from its own source, so that no toolchain has to be fetched by hand.

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

# install_packages PURPOSE PACKAGE... - of Debian, as root only.
install_packages() {
    local purpose=$1
    shift
    if [ "$(id -u)" -ne 0 ] || ! command -v apt-get >/dev/null; then
        echo "error: $purpose needs, as root, 'apt-get install $*'" >&2
        return 1
    fi
    # What it prints is no part of what a script's functions return.
    { apt-get update && apt-get install --yes "$@"; } >&2
}

# prepare_toolchain TARGET - sees to it that there is a compiler.
prepare_toolchain() {
    own_toolchain_has "$1" || debian_is_ready ||
        { install_packages "'rustup target add $1' or Debian's compiler, which" \
            rustc-web cargo-web rust-web-src && debian_is_ready; }
}

# cargo_for TARGET COMMAND [ARGUMENT...] - cargo's COMMAND for a bare-metal target.
cargo_for() {
    local target=$1 command=$2
    shift 2
    if own_toolchain_has "$target"; then
        cargo "$command" --target "$target" "$@"
    else
        RUSTC_BOOTSTRAP=1 RUSTC=/usr/bin/rustc \
            /usr/bin/cargo "$command" --target "$target" -Zbuild-std=core "$@"
    fi
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
