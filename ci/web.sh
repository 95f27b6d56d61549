#!/usr/bin/env bash
# The page that `remora view` makes: builds it again of host/web and core/capi, compares it with the one that is
# checked in, and tests planner, page and reports under node and in Chromium. With --write it puts what was built in the
# place of the old page, and the pictures of it into docs/pictures. With --quick it plans four scenarios instead of
# twelve, and holds no time to its bar: for a machine that does other things too. REMORA_SCENARIOS=60 plans all.
# Usage: ci/web.sh [--write | --quick]
#
# The page is built by Debian's compiler, so that everybody gets the same bytes of the same version; with another
# version bytes are not compared, bits of plans are. Needs node, npm, lld, that compiler, and Chromium, which
# REMORA_CHROMIUM may name.
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/.."
# shellcheck source=ci/toolchain.sh
source ci/toolchain.sh
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target}
built=$CARGO_TARGET_DIR/web
wants_write=${1:-}
if [ "${1:-}" = --quick ]; then
    export REMORA_TIMES=0 REMORA_SCENARIOS=${REMORA_SCENARIOS:-4}
fi

for program in node npm "${REMORA_CHROMIUM:-chromium}" wasm-ld; do
    command -v "$program" >/dev/null || { echo "error: missing: $program" >&2; exit 1; }
done
debian_is_ready || { echo "error: missing: Debian's rustc-web cargo-web rust-web-src" >&2; exit 1; }

echo "--- planner as WebAssembly"
planner=$built/remora.wasm
ci/wasm.sh "$planner" --debian
maker="$(/usr/bin/rustc --version | cut -d' ' -f1,2), $(wasm-ld --version)"

echo "--- page"
npm ci --prefix host/web --ignore-scripts
node host/web/build.mjs "$planner" "$maker" "$built/page.html"
if [ "$wants_write" = --write ]; then
    cp "$built/page.html" host/web/page.html
elif grep -qF "content=\"$maker\"" host/web/page.html; then
    cmp "$built/page.html" host/web/page.html ||
        { echo 'error: host/web/page.html is stale: ci/web.sh --write' >&2; exit 1; }
    echo 'host/web/page.html: as built'
else
    echo "host/web/page.html was built by another version than $maker: bytes not compared"
fi

echo "--- tests"
# All packages' features, as `cargo run` has them: nothing is built twice.
cargo build --release --locked --bin remora --bin xtask
export REMORA_PLANNER=$planner REMORA_PROGRAM=$CARGO_TARGET_DIR/release/remora
node --test --test-timeout=600000 host/web/test/planner.mjs host/web/test/missions.mjs
# The audit's page with the part that is measured soonest.
"$CARGO_TARGET_DIR/release/xtask" audit --only loops --out "$built/audit"
REMORA_AUDIT=$built/audit/audit.html node --test host/web/test/reports.mjs
# By itself: it measures times.
node --test --test-timeout=600000 host/web/test/page.mjs
if [ "$wants_write" = --write ]; then
    node host/web/test/pictures.mjs docs/pictures
fi
