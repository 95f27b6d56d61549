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

# What is interpreted takes a thousand times as long and more: no plan, no whole solution of a program, and of a
# proptest two cases. The rules are Stacked Borrows, and Tree Borrows where nalgebra's own algorithms, with which tests
# compare, break the former.
miri() {
    local flags='-Zmiri-disable-isolation -Zmiri-permissive-provenance'
    # A processor of the other byte order, for which no line is in assembly: the portable kernels, the door.
    MIRIFLAGS=$flags PROPTEST_CASES=2 CARGO_TARGET_DIR=$build/miri cargo +nightly miri test --locked \
        --target s390x-unknown-linux-gnu "${nn[@]}" -- kernels --skip extremes
    MIRIFLAGS=$flags CARGO_TARGET_DIR=$build/miri cargo +nightly miri test --locked \
        --target s390x-unknown-linux-gnu -p remora-capi --lib --test misuse -- --skip with_a_plan --skip was_stopped
    # The vector instructions of x86-64. There libm takes roots by assembly unless it is told not to.
    local vectors='-Ctarget-feature=+avx2,+avxvnni,+avx512f,+avx512vl,+avx512vnni'
    MIRIFLAGS=$flags PROPTEST_CASES=2 RUSTFLAGS=$vectors CARGO_TARGET_DIR=$build/miri-x86 cargo +nightly miri test \
        --locked --target x86_64-unknown-linux-gnu "${nn[@]}" -- kernels --skip extremes
    MIRIFLAGS="$flags -Zmiri-tree-borrows" PROPTEST_CASES=2 RUSTFLAGS=$vectors CARGO_TARGET_DIR=$build/miri-x86 \
        cargo +nightly miri test --locked --target x86_64-unknown-linux-gnu \
        "${qp[@]}" --features libm/force-soft-floats -- dense settings
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
