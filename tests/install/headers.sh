#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Every installed header compiles alone as C99, C11, C++17 and C++20, hapsix.hpp as C++17 and C++20,
# without a warning. So does hapsix.hpp before and after every other one, and has all its handles there.
. "$(dirname "$0")/common.sh"
stage
count=0
command -v clang >/dev/null || echo "without clang"
# compiles WHAT LANGUAGE: $WORK/one.c, by each compiler
compiles() {
  for compiler in gcc clang; do
    command -v $compiler >/dev/null || continue
    $compiler -x "${2%%[0-9]*}" -std="$2" -fsyntax-only -I "$STAGE/include" \
      -Wall -Wextra -Wpedantic -Wconversion -Werror "$WORK/one.c" || fail "$1, $compiler -std=$2"
    count=$((count + 1))
  done
}
HANDLES="Model Session Loop Workers Mesh Field Shell Scene Recorder Recording"
# together HEADER...: these in this order, and a use of every handle
together() {
  { printf '#include <%s>\n' "$@"
    for handle in $HANDLES; do echo "bool has(const hapsix::$handle& handle) { return handle.get() != nullptr; }"; done
    echo "bool has_all() { return $(printf 'has(hapsix::%s()) && ' $HANDLES) true; }"; } | sed 's/^bool/inline bool/' >"$WORK/one.c"
  for language in c++17 c++20; do compiles "$*" $language; done
}
headers=$(cd "$STAGE/include" && ls hapsix/*.h hapsix/*.hpp)
for header in $headers; do
  for language in c99 c11 c++17 c++20; do
    case "$header:$language" in *.hpp:c99 | *.hpp:c11) continue ;; esac
    echo "#include <$header>" >"$WORK/one.c"
    compiles "$header" $language
  done
  together hapsix/hapsix.hpp "$header"
  together "$header" hapsix/hapsix.hpp
done
# A handle that this list lacks.
there=$(sed -n 's/^using \([A-Z][a-z]*\) = Handle<.*/\1/p' "$STAGE/include/hapsix/hapsix.hpp" | sort)
[ "$there" = "$(printf '%s\n' $HANDLES | sort)" ] || fail "hapsix.hpp has these handles: $there"
[ "$count" -ge 40 ] || fail "only $count headers were compiled"
echo "$count times without a warning"
