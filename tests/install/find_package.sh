#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# find_package and pkg-config, shared and static, from an installed tree; it may have been moved.
. "$(dirname "$0")/common.sh"
stage
mv "$STAGE" "$WORK/moved"
LIB=${LIB/$STAGE/$WORK/moved} STAGE=$WORK/moved
cmake -S "$SOURCE/tests/install/consumer" -B "$WORK/build" -G Ninja -DCMAKE_PREFIX_PATH="$STAGE" \
  -DPROGRAM="$SOURCE/runtime/examples/hello.c" -DHOW=find_package >"$WORK/log" 2>&1 &&
  cmake --build "$WORK/build" >>"$WORK/log" 2>&1 || { cat "$WORK/log" >&2; fail "find_package"; }
"$WORK/build/consumer" | says_right "the shared library"
"$WORK/build/consumer_static" | says_right "the static library"
readelf -d "$WORK/build/consumer" | grep 'libhapsix\.so\.0' >/dev/null || fail "the consumer does not need libhapsix.so.0"
readelf -d "$WORK/build/consumer_static" | grep libhapsix >/dev/null && fail "the static consumer needs libhapsix"

export PKG_CONFIG_PATH=$LIB/pkgconfig
gcc -std=c99 $(pkg-config --cflags hapsix) -o "$WORK/one" "$SOURCE/runtime/examples/hello.c" \
  $(pkg-config --libs hapsix)
LD_LIBRARY_PATH=$LIB "$WORK/one" | says_right "pkg-config"
gcc -std=c99 $(pkg-config --cflags hapsix) -o "$WORK/two" "$SOURCE/runtime/examples/hello.c" \
  "$LIB/libhapsix.a" $(pkg-config --libs --static hapsix | sed 's/-lhapsix//')
"$WORK/two" | says_right "pkg-config --static"

# Files and baking, where the build has them.
[ -e "$LIB/libhapsix_io.so" ] || exit 0
gcc -std=c99 $(pkg-config --cflags hapsix-io) -o "$WORK/three" "$SOURCE/io/examples/mesh_to_touch.c" \
  $(pkg-config --libs hapsix-io)
(cd "$WORK" && LD_LIBRARY_PATH=$LIB ./three) | grep 'contacts, the hand feels 0\.4' >/dev/null || fail "hapsix-io says something else"
[ -z "$(comm -12 <(nm -D --defined-only "$LIB/libhapsix.so" | awk '$2 == "T" {print $3}' | sort) \
  <(nm -D --defined-only "$LIB/libhapsix_io.so" | awk '$2 == "T" {print $3}' | sort))" ] ||
  fail "both libraries define the same function"
cmake -S "$SOURCE/tests/install/consumer" -B "$WORK/io" -G Ninja -DCMAKE_PREFIX_PATH="$STAGE" \
  -DPROGRAM="$SOURCE/io/examples/mesh_to_touch.c" -DHOW=find_package -DWITH=hapsix::io >"$WORK/log" 2>&1 &&
  cmake --build "$WORK/io" --target consumer >>"$WORK/log" 2>&1 || { cat "$WORK/log" >&2; fail "COMPONENTS io"; }
(cd "$WORK" && io/consumer) | grep 'contacts, the hand feels 0\.4' >/dev/null || fail "hapsix::io says something else"
