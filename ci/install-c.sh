#!/usr/bin/env bash
# Builds the archive for programs in C and puts it with its header, pkg-config file and CMake package below
# a folder: include/remora.h, lib/libremora.a, lib/pkgconfig/remora.pc, lib/cmake/Remora/.
# Usage: ci/install-c.sh PREFIX [TARGET]; TARGET is a Rust target such as thumbv7em-none-eabihf, this
# machine's where there is none.
#
# Which compiler builds it is `ci/toolchain.sh`'s choice.
set -euo pipefail

if [ $# -lt 1 ] || [ $# -gt 2 ]; then
    echo 'usage: ci/install-c.sh PREFIX [TARGET]' >&2
    exit 2
fi
mkdir -p "$1"
prefix=$(cd "$1" && pwd)
target=${2:-}
cd "$(dirname "${BASH_SOURCE[0]}")/.."
package=core/capi/package

# shellcheck source=ci/toolchain.sh
source ci/toolchain.sh
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target}/capi
build=(--locked -p remora-capi --lib --crate-type staticlib --profile archive)
if [ -z "$target" ]; then
    cargo rustc "${build[@]}"
    built=$CARGO_TARGET_DIR/archive/libremora_capi.a
else
    require_toolchain "$target"
    # The processor that the firmware images are made for: one with double precision.
    [ "$target" != thumbv7em-none-eabihf ] ||
        export CARGO_TARGET_THUMBV7EM_NONE_EABIHF_RUSTFLAGS='-C target-cpu=cortex-m7'
    cargo_for "$target" rustc "${build[@]}"
    built=$CARGO_TARGET_DIR/$target/archive/libremora_capi.a
fi

# What joins the objects of an archive for a target.
joiner() {
    case $target in
    thumb*) echo ld.lld -m armelf -T "$scratch/sections.ld" ;;
    aarch64*) echo ld.lld -m aarch64elf -T "$scratch/sections.ld" ;;
    riscv64*) echo ld.lld -m elf64lriscv -T "$scratch/sections.ld" ;;
    sparc*) echo sparc64-linux-gnu-ld -m elf32_sparc ;;
    *) echo ld ;;
    esac
}

# Of the compiler's own library only what is needed stays: all in one object, which needs nothing but
# memcpy, memmove and memset of the image, at most. The compiler's notes for itself would confuse other tools.
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
echo 'SECTIONS { /DISCARD/ : { *(.llvmbc) *(.llvmcmd) } }' >"$scratch/sections.ld"
mapfile -t needed < <(sed -n 's/.*\b\(remora_[a-z_]*\)(.*/-u\n\1/p' core/capi/include/remora.h)
$(joiner) -r --gc-sections --entry=remora_abi -o "$scratch/remora.o" "${needed[@]}" "$built"

version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -1)
IFS=. read -r major minor _ <<<"$version"
fill() {
    sed -e "s/@VERSION@/$version/" -e "s/@MAJOR@/$major/" -e "s/@MINOR@/$minor/" "$1"
}

mkdir -p "$prefix/include" "$prefix/lib/pkgconfig" "$prefix/lib/cmake/Remora"
rm -f "$prefix/lib/libremora.a"
ar rcs "$prefix/lib/libremora.a" "$scratch/remora.o"
cp core/capi/include/remora.h "$prefix/include/remora.h"
fill $package/remora.pc >"$prefix/lib/pkgconfig/remora.pc"
cp $package/RemoraConfig.cmake "$prefix/lib/cmake/Remora/"
fill $package/RemoraConfigVersion.cmake >"$prefix/lib/cmake/Remora/RemoraConfigVersion.cmake"
echo "installed: $prefix/lib/libremora.a, $(wc -c <"$prefix/lib/libremora.a") bytes"
