#!/usr/bin/env bash
# The parts of the door for C that need more than a compiler for this machine: the image in C for a Cortex-M7 under
# QEMU, and the component for F Prime with the tools of FPP. The other parts are `cargo test -p remora-capi`.
# Usage: ci/c.sh [COUNT]; so many of the first twelve public scenarios the image plans, 1 by default.
#
# Needs what `ci/install-c.sh` needs for thumbv7em-none-eabihf, Debian's gcc-arm-none-eabi and qemu-system-arm, and
# Python with `venv`: the tools come from PyPI into an environment below the build's folder.
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/.."
build=${CARGO_TARGET_DIR:-$PWD/target}
tools=$build/capi/fpp

if [ ! -x "$tools/bin/fpp-to-cpp" ]; then
    python3 -m venv "$tools"
    "$tools/bin/pip" install --quiet fprime-fpp-check==3.0.0 fprime-fpp-to-cpp==3.0.0
fi
# Two halves of the scenarios are planned at the same time.
PATH=$(cd "$tools/bin" && pwd):$PATH REMORA_IMAGE_SCENARIOS=${1:-1} \
    cargo test --locked --test image --test fprime -- --ignored --nocapture
