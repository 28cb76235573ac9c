#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# `cmake --install` without a component puts the whole program in place: it runs from there, and its man
# page, its completions and its Python package stand where they are looked for.
. "$(dirname "$0")/common.sh"
[ -x "$BUILD/hapsix" ] || skip "the program is not built"
cmake --install "$BUILD" --prefix "$STAGE" >"$WORK/install.log" 2>&1 ||
  { tail -n 20 "$WORK/install.log" >&2; fail "cmake --install"; }
"$STAGE/bin/hapsix" --version >"$WORK/version" || fail "bin/hapsix does not run"
"$BUILD/hapsix" --version | diff - "$WORK/version" || fail "bin/hapsix names another version"
grep -E '^hapsix [0-9]+\.[0-9]+\.[0-9]+, .*SIMD ' "$WORK/version" >/dev/null || fail "--version says: $(cat "$WORK/version")"
(cd "$WORK" && HAPSIX_CACHE=$WORK/cache "$STAGE/bin/hapsix" run box-on-wall --virtual-time --json >"$WORK/run") ||
  fail "bin/hapsix does not run a scene"

# with FILE WORDS: it was installed and has these words
with() { [ -s "$1" ] || fail "there is no $1"; grep -F -- "$2" "$1" >/dev/null || fail "$1 lacks '$2'"; }
man=$(ls "$STAGE"/share/man/man1/hapsix.1* 2>/dev/null) || fail "there is no man page"
case $man in *.gz) gzip -dc "$man" ;; *) cat "$man" ;; esac >"$WORK/man"
with "$WORK/man" ".TH HAPSIX 1"
with "$STAGE/share/bash-completion/completions/hapsix" "-F _hapsix hapsix"
with "$STAGE/share/zsh/vendor-completions/_hapsix" "#compdef hapsix"
with "$STAGE/share/fish/vendor_completions.d/hapsix.fish" "complete -c hapsix"

# The package beside the installed libraries, not the ones of the build.
folder=$(sed -n 's/^HAPSIX_PYTHON_DIR:[A-Z]*=//p' "$BUILD/CMakeCache.txt")
[ -n "$folder" ] || { echo "without the Python package, which was not built"; exit 0; }
python=$(sed -n 's/^_\{0,1\}Python3_EXECUTABLE:[A-Z]*=//p' "$BUILD/CMakeCache.txt" | head -1)
cd "$WORK"
"${python:=/usr/bin/python3}" -c 'import numpy' 2>/dev/null || skip "NumPy is not installed; all but the Python package is right"
LD_LIBRARY_PATH=$LIB PYTHONPATH=$STAGE/$folder "$python" - "$STAGE" <<'PROGRAM' || fail "the installed Python package"
import sys
import hapsix
stage = sys.argv[1]
assert hapsix.__file__.startswith(stage), hapsix.__file__
loaded = {line.split()[-1] for line in open("/proc/self/maps") if "hapsix" in line}
libraries = [path for path in loaded if "libhapsix" in path]
assert libraries and all(path.startswith(stage) for path in libraries), libraries
PROGRAM
