#!/usr/bin/env bash
# Plans made again behind every door that this machine has: checksums equal, or status 1. A door that is not there is
# named in the table.
#
#     ci/doors.sh                     two plans, every door
#     ci/doors.sh program c python    one plan, these doors
set -euo pipefail
cd "$(dirname "$0")/.."

cargo build --quiet --release --locked --bin remora --bin xtask
built=${CARGO_TARGET_DIR:-target}/release
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

doors=(--everywhere)
[ $# -eq 0 ] || mapfile -t doors < <(printf -- '--door\n%s\n' "$@")

# made_again PLAN-FLAGS...
made_again() {
    "$built/remora" --quiet plan "$@" --out "$scratch/plan.json" --force
    "$built/xtask" replay "$scratch/plan.json" "${doors[@]}"
}

# The learned guess, where all is asked for; a mission and a start with hardly two numbers alike, from the heuristic.
[ $# -gt 0 ] || made_again --integrator rk4:4
made_again --integrator euler --warm-start heuristic --mode feasible \
    --mission fixtures/doors/uneven.mission.toml --scenarios fixtures/doors/uneven.scenarios.json
