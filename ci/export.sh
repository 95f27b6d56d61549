#!/usr/bin/env bash
# Plans, exports, and reads the files back by other people's readers, which hold them to the plan's own numbers:
# `oem` and `ccsds-ndm` for ephemerides, `mcap` for recordings, all of PyPI. They are installed into an environment
# in the target folder, once.
#
#     ci/export.sh                  four plans
#     ci/export.sh three seven      these of them: three, leap, seven, euler
set -euo pipefail
cd "$(dirname "$0")/.."

target=${CARGO_TARGET_DIR:-target}
work=$target/export
venv=$work/venv
packages=ci/export.requirements.txt
mkdir -p "$work"
if ! cmp --silent "$packages" "$venv/installed.txt"; then
    rm -rf "$venv"
    python3 -m venv "$venv"
    "$venv/bin/pip" install --quiet --disable-pip-version-check --requirement "$packages"
    cp "$packages" "$venv/installed.txt"
fi
# All packages' features, as `cargo run` has them: nothing is built twice.
cargo build --quiet --release --locked --bin remora
remora=$target/release/remora

wanted=("$@")
made=0
# exported NAME CHIEF EPOCH PLAN-FLAGS...: makes a plan and its files, and checks them, where it is wanted.
exported() {
    local name=$1 chief=$2 epoch=$3 folder=$work/$1
    shift 3
    [ ${#wanted[@]} -eq 0 ] || [[ " ${wanted[*]} " = *" $name "* ]] || return 0
    made=$((made + 1))
    rm -rf "$folder"
    mkdir -p "$folder"
    "$remora" --quiet plan "$@" --out "$folder/plan.json"
    "$remora" export "$folder/plan.json" --format oem --format aem --format mcap \
        --epoch "$epoch" --chief "$chief" --out "$folder"
    echo "--- $name"
    "$venv/bin/python" ci/export_read_back.py "$folder" --plan "$folder/plan.json" \
        --epoch "$epoch" --chief "$chief"
}

# A circle, and an ellipse given as a state; three joints and seven; with rows between nodes and without; over the
# end of a year without a leap second and with one.
year=2026-12-31T23:50:00.25
exported three fixtures/chiefs/dawn.chief.toml $year --id pub-000
exported leap fixtures/chiefs/dawn.chief.toml 2016-12-31T23:50:00 --id pub-000
exported seven fixtures/chiefs/state.chief.toml $year --mission fixtures/arms/seven.mission.toml --id pub-003 \
    --warm-start heuristic
exported euler fixtures/chiefs/dawn.chief.toml $year --id pub-000 --integrator euler
if [ $made -lt ${#wanted[@]} ]; then
    echo "error: $*: three, leap, seven and euler are exported" >&2
    exit 2
fi
