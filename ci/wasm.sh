#!/usr/bin/env bash
# The archive for C as WebAssembly: the functions of remora.h, for browsers and node. It imports nothing.
# Usage: ci/wasm.sh FILE.wasm [--debian]
#
# Which compiler builds it is `ci/toolchain.sh`'s choice; with --debian it is Debian's, whose bytes are the same
# everywhere.
set -euo pipefail

if [ $# -lt 1 ] || [ "${2:---debian}" != --debian ]; then
    echo 'usage: ci/wasm.sh FILE.wasm [--debian]' >&2
    exit 2
fi
mkdir -p "$(dirname "$1")"
file=$(realpath "$1")
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# shellcheck source=ci/toolchain.sh
source ci/toolchain.sh
target=wasm32-unknown-unknown
compile=debian_cargo_for
if [ $# -eq 1 ]; then
    require_toolchain $target
    compile=cargo_for
fi
# Debian's compiler brings no linker.
[ $compile = cargo_for ] && own_toolchain_has $target ||
    export CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER=wasm-ld
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target}/capi
$compile $target rustc --locked -p remora-capi --lib --crate-type cdylib --profile archive -- -C strip=symbols
cp "$CARGO_TARGET_DIR/$target/archive/remora_capi.wasm" "$file"
echo "written: $file, $(wc -c <"$file") bytes"
