#!/usr/bin/env bash
# Gives every reader what a fuzzer thinks of, and prints a row a target: executions, what they reached, the most
# memory. Ends with 1 where a reader panics, hangs, or takes more than 1 GiB; what it was given then stands in
# ci/fuzz/artifacts. Starts from the checked-in corpora (docs/evidence/verification.md), and what it finds to be new
# goes below the build's folder. Usage: ci/fuzz.sh [SECONDS [TARGET...]]; 60 seconds each of all by default.
# MINIMISE=1 puts a small corpus of equal reach in the place of the checked-in one.
#
# Needs cargo-fuzz (`cargo install cargo-fuzz --locked`) and a C++ compiler; no nightly toolchain.
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/.."
seconds=${1:-60}
shift || true
build=${CARGO_TARGET_DIR:-$PWD/target}/fuzz
# Address sanitizer where SANITIZER says so: the runtime comes with rustc.
sanitizer=${SANITIZER:-none}
export RUSTC_BOOTSTRAP=1 CARGO_TARGET_DIR=$build CARGO_TERM_COLOR=never

if ! cargo fuzz --version >/dev/null 2>&1; then
    echo "error: needs cargo-fuzz: cargo install cargo-fuzz --locked" >&2
    exit 2
fi
cd ci/fuzz
cp ../../Cargo.lock .
targets=("$@")
[ ${#targets[@]} -gt 0 ] || mapfile -t targets < <(cargo fuzz list --fuzz-dir .)
options=(--fuzz-dir . --features targets --sanitizer "$sanitizer")

cargo fuzz build "${options[@]}"
failed=0
printf '%-10s %12s %10s %10s %8s %8s\n' target executions 'a second' features corpus MiB
for target in "${targets[@]}"; do
    work=$build/corpus/$target log=$build/$target.log
    mkdir -p "$work" "corpus/$target" "artifacts/$target"
    status=0
    cargo fuzz run "${options[@]}" "$target" "$work" "corpus/$target" -- -max_total_time="$seconds" \
        -rss_limit_mb=1024 -timeout=10 -max_len=65536 -print_final_stats=1 >"$log" 2>&1 || status=$?
    value() { sed -n "s/^stat::$1: *//p" "$log" | tail -n 1; }
    features=$(grep -o 'ft: [0-9]*' "$log" | tail -n 1 | cut -d' ' -f2 || true)
    printf '%-10s %12s %10s %10s %8s %8s\n' "$target" "$(value number_of_executed_units)" \
        "$(value average_exec_per_sec)" "$features" "$(find "$work" -type f | wc -l)" "$(value peak_rss_mb)"
    if [ "$status" -ne 0 ]; then
        failed=1
        echo "error: $target: $(grep -m 1 -E 'panicked|ERROR|SUMMARY' "$log" || tail -n 1 "$log")" >&2
    fi
    if [ -n "${MINIMISE:-}" ] && [ "$status" -eq 0 ]; then
        small=$(mktemp -d)
        cargo fuzz run "${options[@]}" "$target" "$small" "$work" "corpus/$target" -- -merge=1 \
            -max_len="${MINIMISE_LEN:-4096}" >"$log" 2>&1
        # The seeds stay, whatever their size.
        find "corpus/$target" -type f ! -name 'seed-*' -delete
        cp "$small"/* "corpus/$target"
        rm -rf "$small"
    fi
done
exit "$failed"
