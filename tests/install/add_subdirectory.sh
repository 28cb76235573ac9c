#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# add_subdirectory and FetchContent: nothing leaks into the project around us, which may ask for fast
# math, link-time optimisation and warnings as errors. With HAPSIX_BUILD_CONSUMER=1 both are also built
# and run, with the scalar kernels only; this takes minutes, so the suite leaves it out.
. "$(dirname "$0")/common.sh"
for how in add_subdirectory FetchContent; do
  cmake -S "$SOURCE/tests/install/consumer" -B "$WORK/$how" -G Ninja -DHAPSIX="$SOURCE" -DHOW=$how \
    -DPROGRAM="$SOURCE/runtime/examples/hello.c" \
    -DCMAKE_CXX_FLAGS="-O0 -ffast-math -flto -Wconversion -Werror -DHWY_COMPILE_ONLY_SCALAR" >"$WORK/log" 2>&1 ||
    { cat "$WORK/log" >&2; fail "$how"; }
  # Only the engine is part of their build, and it does not get into their own.
  ninja -C "$WORK/$how" -t targets all | grep -E 'hapsix_io|doctest|benchmark' >/dev/null && fail "$how builds more than the engine"
  grep -A2 hello "$WORK/$how/compile_commands.json" | grep -E 'contract=off|fPIC|visibility' >/dev/null &&
    fail "$how: our flags reach the consumer"
done
[ -n "${HAPSIX_BUILD_CONSUMER:-}" ] || exit 0
for how in add_subdirectory FetchContent; do
  start=$SECONDS
  cmake --build "$WORK/$how" >"$WORK/log" 2>&1 || { tail -n 40 "$WORK/log" >&2; fail "$how: the build"; }
  grep -i warning "$WORK/log" && fail "$how: warnings"
  "$WORK/$how/consumer" | says_right "$how, the shared library"
  "$WORK/$how/consumer_static" | says_right "$how, the static library"
  echo "$how: $((SECONDS - start)) s"
done
