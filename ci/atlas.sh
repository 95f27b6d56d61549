#!/usr/bin/env bash
# The atlas: many Euler plans from the learned start, made in parts, gathered, a sample planned again, and a page of
# what they show, with pictures: a dated note in docs/lab. Interrupted at any time, the same command goes on where it stopped.
#
#     ci/atlas.sh --jobs 2                          the million, some hours
#     ci/atlas.sh --count 2000 --parts 4            a small one, in a minute
#
# Options: --jobs J parts at once (2), --count N (1000000), --parts N (250), --seed S (9), --recompute N (1000, of all
# at most), --work DIR (target/atlas), --out DIR for atlas.md and its pictures (with the million a folder of today in
# docs/lab, else --work).
# Needs a Rust toolchain and Python 3.10 or newer with its module venv; DuckDB and Matplotlib come from PyPI.
set -euo pipefail
cd "$(dirname "$0")/.."

jobs=2 count=1000000 parts=250 seed=9 recompute=1000 work='' out=''
while [ $# -gt 0 ]; do
    case $1 in
    --jobs) jobs=$2 ;;
    --count) count=$2 ;;
    --parts) parts=$2 ;;
    --seed) seed=$2 ;;
    --recompute) recompute=$2 ;;
    --work) work=$2 ;;
    --out) out=$2 ;;
    *)
        echo "error: $1: see the head of $0" >&2
        exit 2
        ;;
    esac
    shift 2
done
target=${CARGO_TARGET_DIR:-target}
work=${work:-$target/atlas/$seed-$count-$parts}
[ -n "$out" ] || { [ "$count" -eq 1000000 ] && out=docs/lab/$(date +%F)-atlas || out=$work; }
venv=$target/atlas/venv
wanted=ci/atlas.requirements.txt
mkdir -p "$work" "$out"
if ! cmp --silent "$wanted" "$venv/installed.txt"; then
    rm -rf "$venv"
    python3 -m venv "$venv"
    "$venv/bin/pip" install --quiet --disable-pip-version-check --requirement "$wanted"
    cp "$wanted" "$venv/installed.txt"
fi

# All parts come of one program, whatever is built while they are made.
remora=$work/remora
if [ ! -x "$remora" ]; then
    cargo build --quiet --release --locked --bin remora
    cp "$target/release/remora" "$remora.partial"
    mv "$remora.partial" "$remora"
fi

# A part on each of --jobs cores. What is there is looked at and left.
began=$SECONDS
campaign=(campaign --count "$count" --seed "$seed" --integrator euler --warm-start model)
seq "$parts" | xargs -P "$jobs" -I '{}' \
    "$remora" --quiet "${campaign[@]}" --jobs 1 --part "{}/$parts" --out "$work"
echo "parts: $((SECONDS - began)) s in this run"

"$remora" campaign gather "$work" --recompute "$recompute" --jobs "$jobs" --json >"$work/gathered.json"

# The hardest and those that failed, again from the heuristic start: what was the start's fault, what the problem's.
"$venv/bin/python" ci/atlas.py hard "$work" >"$work/hard.txt"
"$remora" --quiet draw --count "$count" --seed "$seed" --indices "$(cat "$work/hard.txt")" \
    --out "$work/hard.scenarios.json" --force
rm -rf "$work/again"
# A status of 1 or 3 is what it is about.
"$remora" --quiet campaign --scenarios "$work/hard.scenarios.json" --integrator euler --warm-start heuristic \
    --jobs "$jobs" --out "$work/again" || [ $? -ne 2 ]
"$venv/bin/python" ci/atlas.py page "$work" --out "$out"
echo "written: $out/atlas.md"
