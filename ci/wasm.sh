#!/usr/bin/env bash
# The archive for C as WebAssembly: the functions of remora.h, for browsers and node. It imports nothing.
# Usage: ci/wasm.sh FILE.wasm
#
# Which compiler builds it is `ci/toolchain.sh`'s choice.
set -euo pipefail

if [ $# -ne 1 ]; then
    echo 'usage: ci/wasm.sh FILE.wasm' >&2
    exit 2
fi
mkdir -p "$(dirname "$1")"
file=$(realpath "$1")
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# shellcheck source=ci/toolchain.sh
source ci/toolchain.sh
target=wasm32-unknown-unknown
require_toolchain $target
# Debian's compiler brings no linker.
own_toolchain_has $target || export CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER=wasm-ld
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target}/capi
cargo_for $target rustc --locked -p remora-capi --lib --crate-type cdylib --profile archive
cp "$CARGO_TARGET_DIR/$target/archive/remora_capi.wasm" "$file"
echo "written: $file, $(wc -c <"$file") bytes"
