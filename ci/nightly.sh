#!/usr/bin/env bash
# All that is random, takes long, or wants a quiet machine, and all that `.ci/run` checks, on every target: a night on
# two cores. Goes on behind a part that fails, and names all that failed at its end, and all that was left out because
# a tool is not there. Random tests draw other cases in every run: the seed is printed, and PROPTEST_RNG_SEED=SEED
# draws them again.
#
#     ci/nightly.sh                    everything; status 1 where something failed
#     ci/nightly.sh python page        these parts; each is a function below
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/.."
exec </dev/null
export CARGO_TERM_COLOR=${CARGO_TERM_COLOR:-never} DEBIAN_FRONTEND=noninteractive
export CARGO_INCREMENTAL=${CARGO_INCREMENTAL:-0}
export PROPTEST_RNG_SEED=${PROPTEST_RNG_SEED:-$(od -An -N4 -tu4 /dev/urandom | tr -d ' ')}
target=${CARGO_TARGET_DIR:-$PWD/target}
seed=$PROPTEST_RNG_SEED
targets=(thumbv7em-none-eabihf aarch64-unknown-none riscv64gc-unknown-none-elf sparc-unknown-none-elf)
parts=(quick tests training cross firmware audit upsets campaigns page exports python doors guides c memory fuzz slurm
    peers supply mutants)
# Status of a part that was left out.
left_out=77
# shellcheck source=ci/checks.sh
source ci/checks.sh

leave_out() {
    echo "left out: $*"
    exit $left_out
}

# needs SUBCOMMAND - leaves the part out where cargo has it not.
needs() {
    cargo "$1" --version >/dev/null 2>&1 || leave_out "no cargo-$1: cargo install cargo-$1 --locked"
}

xtask() {
    cargo run --release --locked --bin xtask -- "$@"
}

# What is pushed is checked so; here with other cases.
quick() {
    .ci/run
}

# The tests that are ignored, too, but for those that other parts run, and one for files of the environment.
tests() {
    cargo test --release --locked --tests -- --include-ignored \
        --skip a_file_of_the_environment_is_pinocchios \
        --skip the_image_in_c_plans_guides_and_plans_again \
        --skip the_component_runs_clean_and_plans --skip the_component_runs_where_the_host_traps
    cargo test --release --locked --doc
}

# A workspace of its own.
training() {
    local manifest=host/learn/training/Cargo.toml
    cargo fmt --check --manifest-path $manifest
    export CARGO_TARGET_DIR=$target/training
    cargo clippy --all-targets --locked --manifest-path $manifest -- -D warnings
    cargo test --locked --manifest-path $manifest
}

cross() {
    ci/cross.sh
}

firmware() {
    xtask firmware --twice
    local of
    for of in "${targets[@]}"; do
        ci/upsets.py --ends --target "$of"
    done
}

# Looks at the images that the firmware's part left.
audit() {
    xtask audit --check
}

# Bits struck in registers and on stacks.
upsets() {
    local of start
    for of in "${targets[@]}"; do
        for start in heuristic model; do
            echo "--- $of, $start"
            ci/upsets.py --target "$of" --start $start --cases 50 --seed "$seed"
        done
    done
}

# planned ARGUMENT... - a campaign, of which some plans may be not converged or not flyable.
planned() {
    local status=0
    "$target/release/remora" --quiet campaign "$@" || status=$?
    [ $status -eq 0 ] || [ $status -eq 1 ] || [ $status -eq 3 ]
}

campaigns() {
    cargo build --release --locked --bin remora
    local integrator
    for integrator in euler rk4; do
        planned --count 1000 --seed "$seed" --integrator $integrator --out "$scratch/$integrator"
    done
    ci/atlas.sh --count 2000 --parts 4 --jobs "$(nproc)" --work "$scratch/atlas"
    REMORA=$target/release/remora ci/flights.py "$scratch/flights"
    xtask inject --seed "$seed"
}

# All scenarios, and times held to their bars.
page() {
    REMORA_SCENARIOS=60 ci/web.sh
}

exports() {
    ci/export.sh
}

# All tests, all scripts; then what the door costs.
python() {
    ci/python.sh
    cargo build --release --locked --bin remora
    "$target/python/test/bin/python" ci/python_speed.py "$target/release/remora"
}

# With the wheel that Python's part has installed.
doors() {
    PATH=$target/python/test/bin:$PATH ci/doors.sh
}

# Those commands of the guides, too, that take long.
guides() {
    install_missing <<'NEEDED' || true
parallel parallel
NEEDED
    ci/guides.sh --long
}

c() {
    ci/c.sh 12
}

memory() {
    ci/memory.sh
}

# An hour, shared by all readers.
fuzz() {
    needs fuzz
    local readers=(ci/fuzz/fuzz_targets/*.rs)
    ci/fuzz.sh $((3600 / ${#readers[@]}))
}

slurm() {
    [ "$(id -u)" -eq 0 ] || leave_out 'not root: daemons are started'
    install_missing <<'NEEDED' || leave_out 'no Slurm'
slurmctld slurmctld
slurmd slurmd
sbatch slurm-client
munged munge
NEEDED
    ci/slurm.sh
}

peers() {
    python3 -m venv "$scratch/peers"
    "$scratch/peers/bin/pip" install --quiet numpy scipy piqp==0.7.0 qoco==0.3.2 clarabel==0.11.1 osqp==1.1.3 \
        proxsuite==0.8.0
    "$scratch/peers/bin/python" ci/peers.py --out "$scratch/peers.json"
}

supply() {
    needs deny
    ci/supply.sh
}

# sample NAME PACKAGE [GLOB] - about a hundred mutants of it, drawn with the seed, by the package's own tests; fails
# where fewer than 85 % are caught.
sample() {
    local of=(--package "$2") out=$target/mutants/$1 count shards caught missed status=0
    [ $# -lt 3 ] || of+=(--file "$3")
    mkdir -p "$out"
    count=$(cargo mutants --list "${of[@]}" | wc -l)
    shards=$(((count + 99) / 100))
    cargo mutants "${of[@]}" --shard "$((seed % shards))/$shards" --output "$out" || status=$?
    # Those that are missed, or whose tests do not end, are told by it as 2 and 3.
    [ $status -eq 0 ] || [ $status -eq 2 ] || [ $status -eq 3 ] || return $status
    caught=$(cat "$out"/mutants.out/{caught,timeout}.txt | wc -l)
    missed=$(wc -l <"$out/mutants.out/missed.txt")
    echo "$1: $caught of $((caught + missed)) mutants caught"
    [ $((100 * caught)) -ge $((85 * (caught + missed))) ] || weak+=("$1")
}

mutants() {
    needs mutants
    local weak=()
    sample qp remora-qp
    sample nn remora-nn
    sample verifier remora-core 'core/src/stages/verifier/**'
    sample guidance remora-core 'core/src/guidance/**'
    [ ${#weak[@]} -eq 0 ] || {
        echo "error: fewer than 85 % caught: ${weak[*]}" >&2
        exit 1
    }
}

prepare() {
    find_cargo
    # Where it cannot be installed, the part that needs it says so.
    install_missing <<'NEEDED' || true
lld lld
sparc64-linux-gnu-ld binutils-sparc64-linux-gnu
qemu-system-arm qemu-system-arm
qemu-system-aarch64 qemu-system-arm
qemu-system-riscv64 qemu-system-misc
qemu-system-sparc qemu-system-sparc
NEEDED
}

for part in "$@"; do
    [[ " ${parts[*]} " = *" $part "* ]] || {
        echo "error: $part: parts are ${parts[*]}" >&2
        exit 2
    }
done
trap 'exit 130' INT
trap 'exit 143' TERM

# One part is done here.
if [ $# -eq 1 ]; then
    scratch=$(mktemp -d)
    trap 'rm -rf "$scratch"' EXIT
    prepare
    echo "PROPTEST_RNG_SEED=$seed"
    "$1"
    exit
fi

# Several are done by a process each, so that none ends the others.
[ $# -gt 0 ] || set -- "${parts[@]}"
failed=() absent=() started=$SECONDS
for part in "$@"; do
    echo
    echo "=== $part"
    began=$SECONDS status=0
    ci/nightly.sh "$part" || status=$?
    echo "=== $part: status $status, $((SECONDS - began)) s"
    case $status in
    0) ;;
    "$left_out") absent+=("$part") ;;
    *) failed+=("$part") ;;
    esac
done
echo
echo "=== $((SECONDS - started)) s in all, PROPTEST_RNG_SEED=$seed"
[ ${#absent[@]} -eq 0 ] || echo "=== left out: ${absent[*]}"
[ ${#failed[@]} -eq 0 ] || {
    echo "=== FAILED: ${failed[*]}" >&2
    exit 1
}
echo "=== all parts passed"
