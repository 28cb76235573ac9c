# SPDX-License-Identifier: Apache-2.0
# common.sh - for the tests of the installed library: SOURCE and BUILD are the trees; STAGE is a
# prefix into which everything for other programs was installed.
set -euo pipefail # so a pipe never ends in grep -q: it leaves early and breaks the pipe of the program
SOURCE=$1 BUILD=$2
WORK=$(mktemp -d)
trap 'rm -rf "$WORK"' EXIT
STAGE=$WORK/stage
LIB=$STAGE/$(sed -n 's/^CMAKE_INSTALL_LIBDIR:[A-Z]*=//p' "$BUILD/CMakeCache.txt")
fail() { echo "FAILED: $*" >&2; exit 1; }
skip() { echo "skipped: $*" >&2; exit 77; }
stage() {
  for component in libhapsix0 libhapsix-io0 libhapsix-dev; do
    cmake --install "$BUILD" --prefix "$STAGE" --component $component >"$WORK/install.log" 2>&1 ||
      { cat "$WORK/install.log" >&2; fail "cmake --install $component"; }
  done
}
# What README.md's program says.
says_right() { grep 'feels 0\.945 N, the tip stands at 3\.945 mm' >/dev/null || fail "$1 says something else"; }
