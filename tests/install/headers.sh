#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Every installed header compiles alone as C99, C11, C++17 and C++20, hapsix.hpp as C++17 and C++20,
# without a warning.
. "$(dirname "$0")/common.sh"
stage
count=0
command -v clang >/dev/null || echo "without clang"
for header in $(cd "$STAGE/include" && ls hapsix/*.h hapsix/*.hpp 2>/dev/null); do
  for compiler in gcc clang; do
    command -v $compiler >/dev/null || continue
    for language in c99 c11 c++17 c++20; do
      case "$header:$language" in *.hpp:c99 | *.hpp:c11) continue ;; esac
      echo "#include <$header>" >"$WORK/one.c"
      $compiler -x "${language%%[0-9]*}" -std=$language -fsyntax-only -I "$STAGE/include" \
        -Wall -Wextra -Wpedantic -Wconversion -Werror "$WORK/one.c" || fail "$header, $compiler -std=$language"
      count=$((count + 1))
    done
  done
done
[ "$count" -ge 20 ] || fail "only $count headers were compiled"
echo "$count times without a warning"
