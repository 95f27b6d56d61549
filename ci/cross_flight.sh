#!/usr/bin/env bash
# The same plans with the same held forces and torques in three simulators: the truth, Pinocchio, and
# MuJoCo as Basilisk's scene. Tips within 1 mm of each other at every node, without gravity and with it.
# By hand: it installs packages from PyPI into an environment of its own. docs/lab tells what
# came of it.
#
#     ci/cross_flight.sh [FOLDER] [COUNT]
#
# FOLDER keeps the environment, the plans, the flights and the tables for the next run; by default a
# scratch one is removed at the end. COUNT drawn scenarios of seed 1, 20 by default; then a fifth as many
# for an arm of seven joints with rotors.
set -euo pipefail
cd "$(dirname "$0")/.."

if [[ $# -gt 0 ]]; then
    mkdir -p "$1"
    work=$(realpath "$1")
else
    work=$(mktemp -d)
    trap 'rm -rf "$work"' EXIT
fi

count=${2:-20}

if [[ ! -x $work/venv/bin/python ]]; then
    python3 -m venv "$work/venv"
    "$work/venv/bin/pip" install --quiet pin==4.1.0 bsk==2.12.1 scipy
fi

cargo build --quiet --release --locked -p remora-cli
cargo build --quiet --release --locked -p remora-flight --example open_loop
release=${CARGO_TARGET_DIR:-target}/release

# A rotor at every joint.
geared=$work/geared.mission.toml
awk '{ print } /^mass_kg/ { print "armature_kg_m2 = 0.05" }' fixtures/arms/seven.mission.toml > "$geared"

# flights NAME COUNT FLAGS: plans, then flies them three times.
flights() {
    local name=$1 number=$2
    shift 2
    rm -rf "${work:?}/plans-$name" "${work:?}/flights-$name"
    # Status 3 or 1: some plan is not converged, or not flyable. Here any will do.
    "$release/remora" --quiet campaign "$@" --count "$number" --seed 1 --integrator rk4 \
        --warm-start heuristic --write plans --out "$work/plans-$name" || [[ $? -ne 2 ]]
    "$release/examples/open_loop" "$work/flights-$name" "$work/plans-$name"/plans/*.plan.json > "$work/$name.log"
    "$work/venv/bin/python" ci/cross_flight.py "$work/flights-$name"/*.open-loop.json \
        --jobs "$(nproc)" --out "$work/$name.md"
}

echo "--- three joints"
flights three "$count"
echo "--- seven joints with rotors"
flights seven "$(((count + 4) / 5))" --mission "$geared"
