#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The wheel that `pip install .` makes, installed without a network and used; then `pip install .` itself.
# Not part of ctest, since making it runs the build.
. "$(dirname "$0")/common.sh"
python=/usr/bin/python3
$python -c 'import numpy, pybind11' 2>/dev/null || [ -e /usr/include/pybind11/pybind11.h ] || skip "pybind11 is not installed"
$python -c 'import numpy' 2>/dev/null || skip "NumPy is not installed"
cd "$SOURCE"
$python -c "import sys; sys.path.insert(0, 'python/build_backend'); import wheel; wheel.build_wheel('$WORK')" \
  >"$WORK/log" 2>&1 || { tail -n 30 "$WORK/log" >&2; fail "the wheel"; }
if $python -m pip --version >/dev/null 2>&1; then
  $python -m pip install --quiet --no-index --no-deps --target "$WORK/site" "$WORK"/hapsix-*.whl
else
  $python -m zipfile -e "$WORK"/hapsix-*.whl "$WORK/site"
fi
cd "$WORK"
# used FOLDER: the package in it, and no other hapsix, drives the engine.
used() {
  PYTHONPATH=$1 $python "$SOURCE/python/examples/run_scene.py" >"$WORK/said" || fail "run_scene.py"
  PYTHONPATH=$1 $python -c "import hapsix; assert hapsix.__file__.startswith('$1')" || fail "another hapsix"
  grep -E '^[0-9]+ frames, at most 0\.[0-9]+ voxels deep' "$WORK/said" >/dev/null || fail "run_scene.py says: $(cat "$WORK/said")"
}
used "$WORK/site"

# pip reads pyproject.toml and calls the backend by itself. No index, so it cannot fetch what the backend needs.
if $python -m pip --version >/dev/null 2>&1; then
  $python -m pip install --no-index --no-deps --target "$WORK/from_source" "$SOURCE" >"$WORK/log" 2>&1 ||
    { tail -n 30 "$WORK/log" >&2; fail "pip install ."; }
  used "$WORK/from_source"
else
  echo "skipped: pip is not installed (python3-pip), so pip install . was not run" >&2
fi
