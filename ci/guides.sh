#!/usr/bin/env bash
# Types the commands of README and guides as a new user does: those of each page in a shell and a copy of the checkout
# of their own, as many pages at once as there are cores. Names page and line of a command that fails.
#
#     ci/guides.sh [--long] [PAGE...]
#
# Fences of ```sh are typed, those of ```sh long with --long only. Other words after `sh` are programs or Rust targets
# that a fence needs: it is left out and named where one is missing. A command may end with N if its line ends with a
# comment on `status N`. Copies share the folder of the build and keep the files' times: nothing is built twice.
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/.."
target=$(realpath -m "${CARGO_TARGET_DIR:-target}")
# Pages name the folder by its default.
unset CARGO_TARGET_DIR
long=''
if [ "${1:-}" = --long ]; then
    long=long
    shift
fi
[ $# -gt 0 ] || set -- README.md docs/quickstart.md docs/your-spacecraft.md docs/guides/*.md
scratch=$(mktemp -d)
# A program that a page installs is gone with its copy.
export CARGO_INSTALL_ROOT=$scratch/installed PATH=$scratch/installed/bin:$PATH
trap 'rm -rf "$scratch"' EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

# is_here WORD - a program, or a target of the user's toolchain.
is_here() {
    command -v "$1" >/dev/null || [ -d "$(rustc --print sysroot)/lib/rustlib/$1" ]
}

# commands PAGE - its script, of as many lines: what is not typed is empty.
commands() {
    local line word is_typed=''
    while IFS= read -r line; do
        case $line in
        '```sh' | '```sh '*)
            is_typed=yes
            for word in ${line#'```sh'}; do
                [ "$word" = "$long" ] || is_here "$word" || is_typed=''
            done
            [ -n "$is_typed" ] || echo "left out: $1: ${line#'```'}" >&2
            line=''
            ;;
        '```'*) is_typed='' ;;
        esac
        [ -n "$is_typed" ] || line=''
        printf '%s\n' "$line"
    done <"$1"
    echo true
}

# Shell code before the commands of a page: its name is $0, its copy of the checkout $1.
prelude='page=$1/$0
fault() {
    sed -n "$2p" "$page" | grep -q "#.*status $1\$" || { echo "error: $0:$2: status $1: $3" >&2; exit 1; }
}
trap '\''fault $? $LINENO "$BASH_COMMAND"'\'' ERR
set -o pipefail -o errtrace
cd "$1"
source .commands
'

# type_page PAGE - its commands; what they print is shown where one fails.
type_page() {
    local began=$SECONDS copy=$scratch/${1//\//-}
    mkdir "$copy"
    git ls-files -z --cached --others --exclude-standard | tar c --null --ignore-failed-read -T - | tar x -C "$copy"
    ln -s "$target" "$copy/target"
    ln -s "$(git rev-parse --absolute-git-dir)" "$copy/.git"
    commands "$1" >"$copy/.commands"
    bash -c "$prelude" "$1" "$copy" </dev/null >"$copy.log" 2>&1 || {
        tail -n 30 "$copy.log" >&2
        return 1
    }
    echo "$1: $((SECONDS - began)) s"
    rm -rf "$copy"
}

failed=0
started=()
for page in "$@"; do
    while [ "$(jobs -pr | wc -l)" -ge "$(nproc)" ]; do
        wait -n || true
    done
    type_page "$page" &
    started+=($!)
done
for page in "${started[@]}"; do
    wait "$page" || failed=1
done
exit $failed
