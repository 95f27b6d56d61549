#!/usr/bin/env bash
# Builds the wheel for Python, looks at its size, installs it into a clean environment, where it is tested and
# the scripts of docs/examples/python leave their pictures: target/python/pictures.
# Usage: ci/python.sh [--build | --quick | ARGUMENT...]; --build makes the wheel alone; --quick leaves out tests that
# are slow or want a quiet machine, and runs three of the scripts; arguments are pytest's, such as `-k golden`, and
# leave the scripts out.
#
# Needs a Rust toolchain, advzip, and Python 3.10 or newer with its module venv; all else comes from the registry of
# Python's packages, in the versions of host/python/requirements.txt.
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/.."
# Flags meant for one machine would make a wheel for that machine. Tables for unwinding are a tenth of a wheel in
# which nothing unwinds.
unset CARGO_ENCODED_RUSTFLAGS CARGO_BUILD_RUSTFLAGS
export RUSTFLAGS='-C force-unwind-tables=no'
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target}
export PIP_DISABLE_PIP_VERSION_CHECK=1 PYTHONDONTWRITEBYTECODE=1
package=host/python
work=$CARGO_TARGET_DIR/python
# Wanted are 3.0 MB (docs/evidence/limitations.md); the page with its planner is 0.4 MB of what it is, both models 0.8 MB.
most_bytes=3750000

mode=''
case ${1:-} in
--build | --quick)
    mode=$1
    shift
    ;;
esac
scripts=(docs/examples/python/[0-9]*.py)
if [ "$mode" = --quick ]; then
    set -- -m 'not slow'
    scripts=(docs/examples/python/{01_plan,02_urdf,06_flight}.py)
fi

# environment NAME - a clean one.
environment() {
    python3 -m venv --clear "$work/$1"
    "$work/$1/bin/pip" install --quiet --constraint $package/requirements.txt "${@:2}"
}

command -v advzip >/dev/null || {
    echo "error: missing: advzip, of Debian's package advancecomp" >&2
    exit 1
}
mkdir -p "$work"
[ -x "$work/build/bin/maturin" ] || environment build maturin

rm -rf "$work/wheel"
"$work/build/bin/maturin" build --quiet --locked --manifest-path $package/Cargo.toml --out "$work/wheel"
wheel=("$work/wheel"/*.whl)
# Deflated as well as can be.
advzip --quiet --recompress --shrink-extra "${wheel[@]}"
bytes=$(wc -c <"${wheel[0]}")
echo "$(basename "${wheel[0]}"): $bytes bytes"
if [ ${#wheel[@]} -ne 1 ] || [[ ${wheel[0]} != *-cp310-abi3-* ]] || [ "$bytes" -gt $most_bytes ]; then
    echo "error: expected one abi3 wheel of at most $most_bytes bytes" >&2
    exit 1
fi
[ "$mode" != --build ] || exit 0

# First alone, with what it brings itself.
environment test "${wheel[0]}"
(cd "$work" && test/bin/python -c '
import remora
plan = remora.plan(remora.draw(1, seed=1)[0])
assert plan.is_verified and plan.start == "model"')
"$work/test/bin/pip" install --quiet -r $package/requirements.txt
"$work/test/bin/python" -m pytest -p no:cacheprovider -c $package/pyproject.toml "$@" $package/tests
[ $# -eq 0 ] || [ "$mode" = --quick ] || exit 0

rm -rf "$work/pictures"
mkdir "$work/pictures"
for script in "${scripts[@]}"; do
    name=$(basename "$script" .py)
    echo "--- $name"
    MPLBACKEND=agg "$work/test/bin/python" -W error "$script" "$work/pictures"
    [ -s "$work/pictures/$name.svg" ]
done
