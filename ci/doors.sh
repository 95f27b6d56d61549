#!/usr/bin/env bash
# Plans made again behind every door that this machine has: checksums equal, or status 1. A door that is not there is
# named in the table.
#
#     ci/doors.sh
set -euo pipefail
cd "$(dirname "$0")/.."

cargo build --quiet --release --locked --bin remora --bin xtask
built=${CARGO_TARGET_DIR:-target}/release
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

# everywhere PLAN-FLAGS...
everywhere() {
    "$built/remora" --quiet plan "$@" --out "$scratch/plan.json" --force
    "$built/xtask" replay "$scratch/plan.json" --everywhere
}

# The learned guess; then a mission and a start with hardly two numbers alike, from the heuristic.
everywhere --integrator rk4:4
everywhere --integrator euler --warm-start heuristic --mode feasible \
    --mission fixtures/doors/uneven.mission.toml --scenarios fixtures/doors/uneven.scenarios.json
