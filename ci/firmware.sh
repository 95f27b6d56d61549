#!/usr/bin/env bash
# Builds the firmware images, proves that no panic can be reached in them, runs them under QEMU and
# holds their plans against the host's, bit for bit. Usage:
#
#   ci/firmware.sh [--scenarios N] [--integrator euler|rk4] [--target TARGET]... [--twice]
#                  [--kernels]
#
# N (5) scenarios of the public set are planned; --twice runs each image again and demands the same
# output, instruction counts included; --kernels runs the parts of a plan one by one besides. Prints
# a table and writes it to firmware/report.json in the target folder. What is measured, and how, is
# told in docs/firmware.md.
set -euo pipefail

# The bars: the planner's memory with its solver's everywhere, image and stack on the Cortex-M7,
# whose memories are small.
max_image_bytes=$((384 * 1024))
max_memory_bytes=$((1024 * 1024))
max_stack_bytes=$((32 * 1024))
# Longest run of an image [s].
max_run_s=1800

cd "$(dirname "${BASH_SOURCE[0]}")/.."
manifest=ci/firmware/Cargo.toml
out=${CARGO_TARGET_DIR:-$PWD/target}/firmware

# shellcheck source=ci/toolchain.sh
source ci/toolchain.sh
export CARGO_TARGET_DIR=$out

usage() {
    sed -n '2,/^set -e/s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2
    exit 2
}

scenarios=5 integrator=euler twice=no features= targets=()
while [ $# -gt 0 ]; do
    case $1 in
    --scenarios) scenarios=${2:-} && shift 2 || usage ;;
    --integrator) integrator=${2:-} && shift 2 || usage ;;
    --target) targets+=("${2:-}") && shift 2 || usage ;;
    --twice) twice=yes && shift ;;
    --kernels) features=kernels && shift ;;
    *) usage ;;
    esac
done
[[ $scenarios =~ ^[1-9][0-9]{0,3}$ && $integrator =~ ^(euler|rk4)$ ]] || usage
if [ ${#targets[@]} -eq 0 ]; then
    targets=(thumbv7em-none-eabihf aarch64-unknown-none riscv64gc-unknown-none-elf
        sparc-unknown-none-elf)
fi

# about TARGET - sets what is particular to a target.
about() {
    byte_order=little clock_hz=0 linker=lld
    case $1 in
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

# build TARGET [FEATURE] - prints the image's path.
build() {
    local target=$1 feature=${2:-} variable path flags="-C target-cpu=$cpu"
    path=$(find_linker)
    [ "$linker" = lld ] || flags+=" -C linker-flavor=ld -C link-arg=-melf32_sparc"
    variable=CARGO_TARGET_$(tr a-z- A-Z_ <<<"$target")
    (
        export "${variable}_LINKER=$path" "${variable}_RUSTFLAGS=$flags"
        cargo_for "$target" build --release --manifest-path "$manifest" \
            --features "$features,$feature" >&2
    )
    # The next build may put another image in this one's place.
    cp "$out/$target/release/remora-firmware" "$out/$target$feature.elf"
    echo "$out/$target$feature.elf"
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
# the stack apart.
sections() {
    local sum=0 size
    for size in $(readelf -SW "$1" | sed 's/^ *\[ *[0-9]*\] //' | awk -v kind="$2" \
        '$7 ~ /A/ && $1 != ".stack" && ($2 == "NOBITS") == (kind == "nobits") { print $5 }'); do
        sum=$((sum + 16#$size))
    done
    echo "$sum"
}

# execute IMAGE LOG - runs an image to its end.
execute() {
    local address word status=0
    address=$(readelf -sW "$1" | awk '$8 == "REMORA_REQUEST" { print $2 }')
    word=$((0x52 << 24 | ($([ "$integrator" = rk4 ] && echo 1 || echo 0) << 16) | scenarios))
    if [ "$byte_order" = big ]; then
        # The emulator writes the low byte first.
        word=$(((word & 0xff) << 24 | (word & 0xff00) << 8 | (word >> 8 & 0xff00) | word >> 24))
    fi
    timeout "$max_run_s" "${emulator[@]}" -display none -monitor none -serial "file:$2" \
        -icount shift=0,sleep=off -kernel "$1" \
        -device "loader,addr=0x$address,data=$word,data-len=4" \
        </dev/null || status=$?
    if [ "$status" -ne 0 ] || [ "$(tail -n 1 "$2")" != end ]; then
        echo "error: the image ended early (status $status), after:" >&2
        tail -n 3 "$2" >&2
        return 1
    fi
}

results() {
    grep -E '^(stage|plan|residual|kernel) ' "$1"
}

# expect WHAT COMMAND... - notes what does not hold.
broken=()
expect() {
    local what=$1
    shift
    "$@" || broken+=("$target: $what")
}

# check TARGET - all of it, for one target.
check() {
    local target=$1 image log=$out/$1.log equal=no
    about "$target"
    prepare_toolchain "$target"
    command -v "${emulator[0]}" >/dev/null || install_packages "${emulator[0]}" "$package"
    echo "--- $target"
    image=$(build "$target")

    local free=no
    can_panic "$image" || free=yes
    expect 'a panic can be reached' [ $free = yes ]
    echo "with a panic put in, the proof must fail on:"
    expect 'the proof does not see a panic' can_panic "$(build "$target" with-panic)"

    execute "$image" "$log"
    if diff <(results "$host_log") <(results "$log") >"$out/$target.diff"; then
        equal=yes
    else
        head -n 6 "$out/$target.diff"
    fi
    expect "results differ from the host's, see $out/$target.diff" [ $equal = yes ]
    if [ $twice = yes ]; then
        execute "$image" "$log.again"
        expect 'two runs differ' cmp "$log" "$log.again"
    fi
    cat >>"$log" <<LOG
about target=$target cpu=$cpu clock_hz=$clock_hz panic_free=$free equal=$equal
about image=$(sections "$image" bits) static=$(sections "$image" nobits)
about toolchain="$(toolchain_name "$target" | tr ' ' _)"
LOG
    bars "$log" | while read -r bar; do echo "$target: $bar"; done >>"$out/broken"
}

# bars LOG - the bars that a run broke.
bars() {
    # The parts' bench is no part of the image that flies.
    awk -v image="$([ -n "$features" ] && echo 1e9 || echo "$max_image_bytes")" \
        -v memory="$max_memory_bytes" -v stack="$max_stack_bytes" '
        { split("", v); for (i = 2; i <= NF; i++) { split($i, p, "="); v[p[1]] = p[2] } }
        function most(what, value, bar) { if (value + 0 > bar + 0) print what, value, "of", bar }
        $1 == "size" { most("memory", v["workspace"] + v["solver"], memory) }
        $1 == "stack" { used = v["used"]; if (v["used"] == v["size"]) print "the stack ran over" }
        "target" in v { small = v["target"] ~ /^thumb/; if (small) most("stack", used, stack) }
        "image" in v && small { most("image", v["image"], image) }
        $1 == "calibration" {
            error = v["counted"] - v["expected"]
            if (error < -v["resolution"] || error > v["resolution"] + 8) print "counter off by", error
        }' "$1"
}

mkdir -p "$out"
: >"$out/broken"
# The images' dependencies are those of the host's lock file; cargo drops what they do not need.
cp Cargo.lock ci/firmware/Cargo.lock
command -v readelf >/dev/null || install_packages readelf binutils

host_log=$out/host.log
cargo run --release --manifest-path "$manifest" --features "$features" -- \
    "$scenarios" "$integrator" >"$host_log"
logs=()
for target in "${targets[@]}"; do
    check "$target"
    logs+=("$out/$target.log")
done

awk -v integrator="$integrator" -v report="$out/report.json" -f ci/firmware/report.awk "${logs[@]}"
while read -r bar; do broken+=("$bar"); done <"$out/broken"
if [ ${#broken[@]} -ne 0 ]; then
    printf 'BROKEN: %s\n' "${broken[@]}" >&2
    exit 1
fi
