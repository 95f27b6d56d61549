#!/usr/bin/env bash
# Judges the crates of others: licences, versions that stand twice, sources (ci/deny.toml), and that the table of
# docs/evidence/verification.md and the bill of materials are current. Without a network, so that vulnerabilities are
# looked for only where it is asked for. Usage: ci/supply.sh [--advisories]. Needs cargo-deny
# (`cargo install cargo-deny --locked`) and Python.
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/.."
python3 ci/supply.py --check
if ! cargo deny --version >/dev/null 2>&1; then
    echo "error: needs cargo-deny: cargo install cargo-deny --locked" >&2
    exit 2
fi
checks=(bans licenses sources)
offline=(--offline)
if [ "${1:-}" = --advisories ]; then
    checks+=(advisories)
    offline=()
fi
for workspace in . host/learn/training; do
    cargo deny --manifest-path "$workspace/Cargo.toml" "${offline[@]}" --log-level error --config ci/deny.toml \
        check "${checks[@]}"
done
