#!/usr/bin/env bash
# Builds the firmware images, proves that no panic can be reached in them, runs them under QEMU and
# holds their plans against the host's, bit for bit. Usage:
#
#   ci/firmware.sh [--scenarios N] [--start heuristic|model] [--integrator euler|rk4]
#                  [--target TARGET]... [--twice] [--kernels]
#   ci/firmware.sh --corpus|--full-corpus [--target TARGET]... [--twice] [--kernels]
#
# The first N (4) scenarios of the audit's set are planned, with Euler and from both starts where
# nothing else is asked for. --corpus plans what the audit reports: both integrators from both
# starts, typical and hard scenarios, on all targets but LEON3; --full-corpus all of the audit's set
# so, which takes some three times as long. --twice runs each image again and demands the same output,
# instruction counts included; --kernels prints what the parts of a plan take besides. Prints tables
# and writes firmware/report.json in the target folder, beside the images with their symbols and
# relocations (TARGET.elf) and the compiler's remarks on their stack frames (TARGET.remarks). What
# is measured, and how, is told in docs/firmware.md.
set -euo pipefail
# Each job is a process group of its own, so that it can be ended with all that it started.
set -m

# The bars: the planner's memory with its solver's and its network's everywhere, image and stack on
# the Cortex-M7, whose memories are small. Models are no part of the image: data of their own. The
# image's was 384 KiB before clearances, refusals and the verifier's own truth came into it, which were
# allowed a quarter more than the 370,912 bytes before them.
max_image_bytes=$((452 * 1024))
max_memory_bytes=$((1024 * 1024))
max_stack_bytes=$((32 * 1024))
# Longest run of an image [s].
max_run_s=1800
# What --corpus plans: integrator, start, scenarios of the audit's set by their index. A typical one
# or two, and those that are hardest with this integrator and start: with RK4, where one of these
# takes an emulator half a minute, the hardest.
corpus=("euler heuristic 0 1 4 5" "euler model 0 1 6 7" "rk4 heuristic 0 10" "rk4 model 0 1 10")
everything="0 1 2 3 4 5 6 7 8 9 10 11"
full_corpus=("euler heuristic $everything" "euler model $everything" "rk4 heuristic $everything"
    "rk4 model $everything")

cd "$(dirname "${BASH_SOURCE[0]}")/.."
manifest=ci/firmware/Cargo.toml
out=${CARGO_TARGET_DIR:-$PWD/target}/firmware

# shellcheck source=ci/toolchain.sh
source ci/toolchain.sh

usage() {
    sed -n '2,/^set -e/{/^set -e/d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" >&2
    exit 2
}

scenarios=4 integrator=euler starts=(heuristic model) twice=no kernels=no
chosen=() targets=() runs=()
while [ $# -gt 0 ]; do
    case $1 in
    --scenarios) scenarios=${2:-} && shift 2 || usage ;;
    --integrator) integrator=${2:-} && shift 2 || usage ;;
    --start) starts=("${2:-}") && shift 2 || usage ;;
    --target) targets+=("${2:-}") && shift 2 || usage ;;
    --corpus) chosen=("${corpus[@]}") && shift ;;
    --full-corpus) chosen=("${full_corpus[@]}") && shift ;;
    --twice) twice=yes && shift ;;
    --kernels) kernels=yes && shift ;;
    *) usage ;;
    esac
done
[[ $scenarios =~ ^([1-9]|1[0-2])$ && $integrator =~ ^(euler|rk4)$ ]] || usage
[[ ${starts[0]} =~ ^(heuristic|model)$ ]] || usage
if [ ${#targets[@]} -eq 0 ]; then
    targets=(thumbv7em-none-eabihf aarch64-unknown-none riscv64gc-unknown-none-elf)
    [ ${#chosen[@]} -ne 0 ] || targets+=(sparc-unknown-none-elf)
fi
if [ ${#chosen[@]} -eq 0 ]; then
    for start in "${starts[@]}"; do
        chosen+=("$integrator $start $(seq -s ' ' 0 $((scenarios - 1)))")
    done
fi
# In an image's request the scenarios are a bit each.
for words in "${chosen[@]}"; do
    read -r integrator start indices <<<"$words"
    mask=0
    for index in $indices; do mask=$((mask | 1 << index)); done
    runs+=("$integrator $start $mask")
done

# about TARGET - sets what is particular to a target.
about() {
    byte_order=little clock_hz=0 linker=lld cpu='' emulator=()
    case $1 in
    host) ;;
    thumbv7em-none-eabihf)
        cpu=cortex-m7 clock_hz=300000000 package=qemu-system-arm
        emulator=(qemu-system-arm -M mps2-an500 -semihosting-config enable=on,target=native)
        ;;
    aarch64-unknown-none)
        cpu=cortex-a53 clock_hz=1200000000 package=qemu-system-arm
        # The emulator would look for the firmware of a network card.
        emulator=(qemu-system-aarch64 -M virt -cpu cortex-a53 -nic none
            -semihosting-config "enable=on,target=native")
        ;;
    riscv64gc-unknown-none-elf)
        cpu=generic-rv64 package=qemu-system-misc
        emulator=(qemu-system-riscv64 -M virt -bios none)
        ;;
    sparc-unknown-none-elf)
        cpu=leon3 package=qemu-system-sparc linker=sparc64-linux-gnu-ld byte_order=big
        emulator=(qemu-system-sparc -M leon3_generic)
        ;;
    *)
        echo "error: no board for target $1" >&2
        return 1
        ;;
    esac
}

# The linker that comes with the user's toolchain, or Debian's.
find_linker() {
    local sysroot
    if [ "$linker" = lld ] && sysroot=$(rustc --print sysroot 2>/dev/null); then
        for file in "$sysroot"/lib/rustlib/*/bin/rust-lld; do
            if [ -x "$file" ]; then
                echo "$file"
                return
            fi
        done
    fi
    if ! command -v "$linker"; then
        local package=lld
        [ "$linker" = lld ] || package=binutils-sparc64-linux-gnu
        install_packages "the linker $linker" "$package" && command -v "$linker"
    fi
}

# build TARGET KIND - the image (KIND image), or with the tests and a panic in it (KIND tests).
#
# Relocations (who refers to whom) and the compiler's remarks on stack frames are for whoever bounds
# the stack; neither changes a byte that is loaded. Told everything (-vv), cargo repeats remarks on
# what it had not to build again, too.
build() {
    local target=$1 kind=$2 features='' variable name file=$out/$1.elf
    local flags="-C remark=prologepilog"
    if [ "$kind" = tests ]; then
        features=kernels,with-panic file=$out/$target.tests.elf
    fi
    name=$target
    if [ "$target" = host ]; then
        name=$(rustc -vV | sed -n 's/^host: //p')
        # Names that tell the modules of generic code, as the other compiler's do.
        flags+=" -C symbol-mangling-version=v0 -C link-arg=-Wl,--emit-relocs"
    else
        flags+=" -C target-cpu=$cpu -C link-arg=--emit-relocs"
    fi
    [ "$linker" = lld ] || flags+=" -C linker-flavor=ld -C link-arg=-melf32_sparc"
    variable=CARGO_TARGET_$(tr a-z- A-Z_ <<<"$name")
    (
        [ "$target" = host ] || export "${variable}_LINKER=$(find_linker)"
        # A folder each: cargo lets one build at a time into one.
        export "${variable}_RUSTFLAGS=$flags" CARGO_TARGET_DIR=$out/$target
        cargo_for "$name" build -vv --release --manifest-path "$manifest" \
            --features "$features" >"$file.build" 2>&1 ||
            { grep -E '^error|^  *-->' "$file.build" >&2 && exit 1; }
    )
    # The next build puts another image in this one's place.
    cp "$out/$target/$name/release/remora-firmware" "$file"
    if [ "$kind" = image ]; then
        grep 'stack bytes in function' "$file.build" | sort -u >"$out/$target.remarks"
    fi
}

# A panic ends in the panic handler, which refers to the section of `remora_panic_reachable`; the
# linker keeps a section where something kept refers to it, from the entry on, and no other.
can_panic() {
    local symbols
    symbols=$(readelf -sW "$1")
    if ! grep -q ' remora_main$' <<<"$symbols"; then
        echo "error: $1 has no symbols to judge by" >&2
        return 0
    fi
    grep -E ' remora_panic_reachable$|9panicking|rust_begin_unwind|panic_fmt' <<<"$symbols" |
        awk '{ print "  " $8 }' >&2
    [ "${PIPESTATUS[0]}" -eq 0 ]
}

# sections FILE KIND - bytes of the sections in memory that the file holds (bits) or not (nobits),
# or of the models (model), which are no part of the others; the stack apart.
sections() {
    local sum=0 size
    for size in $(readelf -SW "$1" | sed 's/^ *\[ *[0-9]*\] //' | awk -v kind="$2" '
        { is = $1 == ".model" ? "model" : $2 == "NOBITS" ? "nobits" : "bits" }
        $7 ~ /A/ && $1 != ".stack" && is == kind { print $5 }'); do
        sum=$((sum + 16#$size))
    done
    echo "$sum"
}

# execute IMAGE LOG INTEGRATOR START MASK - runs an image to its end.
execute() {
    local address word status=0 flags=0
    [ "$3" = euler ] || flags=$((flags | 1))
    [ "$4" = heuristic ] || flags=$((flags | 2))
    address=$(readelf -sW "$1" | awk '$8 == "REMORA_REQUEST" { print $2 }')
    word=$((0x52 << 24 | flags << 16 | $5))
    if [ "$byte_order" = big ]; then
        # The emulator writes the low byte first.
        word=$(((word & 0xff) << 24 | (word & 0xff00) << 8 | (word >> 8 & 0xff00) | word >> 24))
    fi
    timeout --foreground "$max_run_s" "${emulator[@]}" -display none -monitor none \
        -serial "file:$2" -icount shift=0,sleep=off -kernel "$1" \
        -device "loader,addr=0x$address,data=$word,data-len=4" \
        </dev/null || status=$?
    if [ "$status" -ne 0 ] || [ "$(tail -n 1 "$2")" != end ]; then
        echo "error: the image ended early (status $status), after:" >&2
        tail -n 3 "$2" >&2
        return 1
    fi
}

results() {
    grep -E '^(stage|plan|residual|verified|kernel) ' "$1"
}

# expect WHAT COMMAND... - notes what does not hold.
expect() {
    local what=$1
    shift
    "$@" || echo "$target: $what" >>"$out/broken"
}

# in_parallel JOB... - runs jobs, each a function with its arguments, as many at a time as there are
# processors; notes those that fail.
in_parallel() {
    local job place=0
    for job in "$@"; do
        place=$((place + 1))
        while [ "$(jobs -rp | wc -l)" -ge "$(nproc)" ]; do wait -n || true; done
        (
            trap '[ $? -eq 0 ] || echo "$job failed" >>"$out/broken"' EXIT
            began=$SECONDS
            $job
            echo "[$place of $#] $job: $((SECONDS - began)) s"
        ) &
    done
    wait
}

# make_images TARGET - builds its images, and looks at them.
make_images() {
    local target=$1 image=$out/$1.elf free=no
    about "$target"
    build "$target" image
    build "$target" tests
    [ "$target" != host ] || return 0
    can_panic "$image" || free=yes
    expect 'a panic can be reached' [ $free = yes ]
    expect 'the proof does not see a panic' can_panic "$out/$target.tests.elf" 2>/dev/null
    cat >"$out/$target.about" <<LOG
about target=$target cpu=$cpu clock_hz=$clock_hz panic_free=$free
about image=$(sections "$image" bits) model=$(sections "$image" model)
about static=$(sections "$image" nobits) toolchain=$(toolchain_name "$target" | tr ' ' _)
LOG
}

# plan TARGET INTEGRATOR START MASK - plans in the emulator, and holds results against the host's.
plan() {
    local target=$1 image=$out/$1.elf log=$out/$1.$3.$2.log equal=no repeated=unknown
    about "$target"
    if [ "$target" = host ]; then
        "$image" "${@:2}" >"$log"
        return
    fi
    execute "$image" "$log" "${@:2}"
    if diff <(results "$out/host.$3.$2.log") <(results "$log") >"$log.diff"; then
        equal=yes
    else
        head -n 6 "$log.diff"
    fi
    expect "$3 start, $2: results differ from the host's, see $log.diff" [ $equal = yes ]
    if [ $twice = yes ]; then
        execute "$image" "$log.again" "${@:2}"
        repeated=no
        ! cmp "$log" "$log.again" || repeated=yes
        expect "$3 start, $2: two runs differ" [ $repeated = yes ]
    fi
    bars "$out/$target.about" "$log" | while read -r bar; do echo "$target: $bar"; done >>"$out/broken"
    echo "run integrator=$2 start=$3 equal=$equal repeated=$repeated" >>"$log"
}

# try_parts TARGET - runs the tests in the emulator, and holds what they compute against the host's.
try_parts() {
    local target=$1 image=$out/$1.tests.elf log=$out/$1.tests.log
    about "$target"
    if [ "$target" = host ]; then
        "$image" euler heuristic 0 >"$log"
        return
    fi
    execute "$image" "$log" euler heuristic 0
    expect "tests differ from the host's" diff <(results "$out/host.tests.log") <(results "$log")
    echo "run tests=yes" >>"$log"
}

# bars LOG... - the bars that a run broke.
bars() {
    awk -v image="$max_image_bytes" -v memory="$max_memory_bytes" -v stack="$max_stack_bytes" '
        { split("", v); for (i = 2; i <= NF; i++) { split($i, p, "="); v[p[1]] = p[2] } }
        function most(what, value, bar) { if (value + 0 > bar + 0) print what, value, "of", bar }
        "target" in v { small = v["target"] ~ /^thumb/ }
        "image" in v && small { most("image", v["image"], image) }
        $1 == "size" { most("memory", v["workspace"] + v["solver"] + v["network"], memory) }
        $1 == "stack" && v["used"] == v["size"] { print "the stack ran over" }
        $1 == "stack" && v["used"] + 0 > used { used = v["used"] + 0 }
        $1 == "calibration" {
            error = v["counted"] - v["expected"]
            if (error < -v["resolution"] || error > v["resolution"] + 8) print "counter off by", error
        }
        END { if (small) most("stack", used, stack) }' "$@"
}

# Ends what still runs, with all that it started.
end_jobs() {
    local group
    for group in $(jobs -p); do kill -- "-$group" 2>/dev/null || true; done
}
trap end_jobs EXIT
mkdir -p "$out"
: >"$out/broken"
# The images' dependencies are those of the host's lock file; cargo drops what they do not need,
# here once for all builds.
cp Cargo.lock ci/firmware/Cargo.lock
cargo metadata --format-version 1 --manifest-path "$manifest" >/dev/null
command -v readelf >/dev/null || install_packages readelf binutils
for target in "${targets[@]}"; do
    about "$target"
    prepare_toolchain "$target"
    find_linker >/dev/null
    command -v "${emulator[0]}" >/dev/null || install_packages "${emulator[0]}" "$package"
done

jobs=()
for target in host "${targets[@]}"; do jobs+=("make_images $target"); done
in_parallel "${jobs[@]}"
[ ! -s "$out/broken" ] || ! grep ' failed$' "$out/broken" >&2 || exit 1

jobs=("try_parts host")
for run in "${runs[@]}"; do jobs+=("plan host $run"); done
in_parallel "${jobs[@]}"
jobs=() logs=()
for run in "${runs[@]}"; do
    # The last take longest, and begin first, so that all end together.
    for target in "${targets[@]}"; do jobs=("plan $target $run" "${jobs[@]}"); done
done
for target in "${targets[@]}"; do
    jobs+=("try_parts $target")
    logs+=("$out/$target.about" "$out/$target.tests.log")
    for run in "${runs[@]}"; do
        read -r integrator start _ <<<"$run"
        logs+=("$out/$target.$start.$integrator.log")
    done
done
in_parallel "${jobs[@]}"
[ ! -s "$out/broken" ] || ! grep ' failed$' "$out/broken" >&2 || exit 1

awk -v kernels="$kernels" -v report="$out/report.json" -f ci/firmware/report.awk "${logs[@]}"
if [ -s "$out/broken" ]; then
    sed 's/^/BROKEN: /' "$out/broken" >&2
    exit 1
fi
