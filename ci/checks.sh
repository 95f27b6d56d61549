# shellcheck shell=bash
# Tools that .ci/run and ci/nightly.sh need, installed where that is possible; sourced by both. Nothing else
# installs anything.

# install_packages [OPTION...] PACKAGE... - Debian's, as root only.
install_packages() {
    if [ "$(id -u)" -ne 0 ] || ! command -v apt-get >/dev/null; then
        echo "error: missing, install by hand: $*" >&2
        return 1
    fi
    apt-get update
    # One after another where not all at once: apt takes back what is too new for them only for one by itself.
    apt-get install --yes "$@" || for package in "$@"; do apt-get install --yes "$package"; done
}

# install_missing - what is not there of the lines of standard input, in one go: each a program or folder, and the
# packages that have it.
install_missing() {
    local found packages missing=()
    while read -r found packages; do
        # shellcheck disable=SC2206 # Several packages in a line are several words.
        command -v "$found" >/dev/null || [ -d "$found" ] || missing+=($packages)
    done
    [ ${#missing[@]} -eq 0 ] || install_packages "${missing[@]}" </dev/null
}

# component NAME SUBCOMMAND
component() {
    if cargo "$2" --version >/dev/null 2>&1; then
        return
    fi
    if command -v rustup >/dev/null; then
        rustup component add "$1"
    fi
    if ! cargo "$2" --version >/dev/null 2>&1; then
        echo "error: needs 'cargo $2': with rustup, 'rustup component add $1'" >&2
        return 1
    fi
}

# find_cargo - in rustup's default place too, which a non-interactive shell may not have on its path.
find_cargo() {
    if ! command -v cargo >/dev/null && [ -x "${CARGO_HOME:-${HOME:-}/.cargo}/bin/cargo" ]; then
        PATH="${CARGO_HOME:-$HOME/.cargo}/bin:$PATH"
    fi
    if ! command -v cargo >/dev/null; then
        echo "error: no Rust toolchain: install one, as https://rustup.rs says" >&2
        return 1
    fi
}
