#!/usr/bin/env bash
# Looks for memory misused where there is unsafe code: the kernels of remora-nn and remora-qp, and the door for C.
# Usage: ci/memory.sh [miri|address|valgrind|exhaustive]...; by default all that this machine has.
#
#   miri        an interpreter that knows the rules of the language: needs a nightly toolchain with the component miri
#   address     the address sanitizer that comes with rustc: reads and writes beyond memory, use after free
#   valgrind    the same on the programs as they are, and what depends on memory that nobody has written
#   exhaustive  integer arithmetic over all of its values, the part that takes minutes
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/.."
build=${CARGO_TARGET_DIR:-$PWD/target}/memory
host=$(rustc -vV | sed -n 's/^host: //p')
# The tests of what is unsafe, and of what leads there.
nn=(-p remora-nn --lib)
qp=(-p remora-qp --lib)
door=(-p remora-capi --lib --test door --test misuse)

has_miri() { cargo +nightly miri --version >/dev/null 2>&1; }

# What is interpreted takes ten thousand times as long and more: plans on a few nodes only, which take minutes each, no
# other solution of a program, and of a proptest two cases. Usage: interpret TARGET RUSTFLAGS RULES ARGUMENTS...
interpret() {
    local target=$1 rustflags=$2 rules=$3
    MIRIFLAGS="-Zmiri-disable-isolation -Zmiri-permissive-provenance $rules" PROPTEST_CASES=2 RUSTFLAGS=$rustflags \
        CARGO_TARGET_DIR=$build/miri cargo +nightly miri test --locked --target "$target" "${@:4}"
}

miri() {
    # A processor of the other byte order, for which no line is in assembly: the portable kernels, the door.
    local portable=s390x-unknown-linux-gnu
    interpret $portable '' '' "${nn[@]}" -- kernels --skip extremes
    interpret $portable '' '' -p remora-capi --lib --test misuse
    # The vector instructions of x86-64. There libm takes roots by assembly unless it is told not to; and nalgebra's own
    # algorithms, with which tests compare, break Stacked Borrows, but not Tree Borrows.
    local x86=x86_64-unknown-linux-gnu vectors='-Ctarget-feature=+avx2,+avxvnni,+avx512f,+avx512vl,+avx512vnni'
    interpret $x86 "$vectors" '' "${nn[@]}" -- kernels --skip extremes
    interpret $x86 "$vectors" -Zmiri-tree-borrows "${qp[@]}" --features libm/force-soft-floats -- dense settings
}

address() {
    local tests
    for tests in nn qp door; do
        local -n arguments=$tests
        # What it keeps beside each value on the stack is more than a test's thread has room for.
        RUST_MIN_STACK=134217728 RUSTC_BOOTSTRAP=1 RUSTFLAGS=-Zsanitizer=address RUSTDOCFLAGS=-Zsanitizer=address \
            CARGO_TARGET_DIR=$build/address cargo test --locked --target "$host" "${arguments[@]}"
    done
}

# The binaries of ordinary tests. Valgrind knows no AVX-512: the kernels for it are the sanitizer's.
valgrind_() {
    local tests program
    for tests in nn qp door; do
        local -n arguments=$tests
        cargo test --locked --no-run --message-format json "${arguments[@]}" 2>/dev/null |
            sed -n 's/.*"executable":"\([^"]*\)".*/\1/p' | while read -r program; do
            echo "--- $program"
            PROPTEST_CASES=4 valgrind --quiet --error-exitcode=1 --main-stacksize=67108864 \
                --max-stackframe=16777216 "$program" --test-threads 1 --skip exhaustive --skip random </dev/null
        done
    done
}

exhaustive() {
    cargo test --locked "${nn[@]}" -- --ignored exhaustive
}

asked=("$@")
if [ ${#asked[@]} -eq 0 ]; then
    asked=(address exhaustive)
    ! has_miri || asked+=(miri)
    ! command -v valgrind >/dev/null || asked+=(valgrind)
fi
for one in "${asked[@]}"; do
    echo "=== $one"
    case $one in
    miri)
        if ! has_miri; then
            echo "error: needs the component miri: rustup +nightly component add miri rust-src" >&2
            exit 2
        fi
        miri
        ;;
    address) address ;;
    valgrind) valgrind_ ;;
    exhaustive) exhaustive ;;
    *)
        echo "error: unknown: $one" >&2
        exit 2
        ;;
    esac
done
