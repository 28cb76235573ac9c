#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# libhapsix_io shows the contract and nothing else, so nothing of a program takes the place of what is
# inside: not a symbol of the same name, and not Eigen compiled for another machine. It bakes, records
# and steps the same bits beside both.
. "$(dirname "$0")/common.sh"
[ -e "$BUILD/io/libhapsix_io.so" ] || skip "libhapsix_io is not built"
stage
[ -z "$(nm -D --defined-only "$LIB/libhapsix_io.so" | awk '$2 != "A" && $3 !~ /^h6[A-Z][A-Za-z]*(@.*)?$/')" ] ||
  fail "the library shows more than the contract"
export LD_LIBRARY_PATH=$LIB
# says NAME: what the program NAME makes, with a cache of its own, so that it bakes.
says() { HAPSIX_CACHE=$WORK/cache.$1 "$WORK/$1" "$WORK/$1.h5"; }
flags="-std=c++17 -O1 -I $STAGE/include -I /usr/include/eigen3"
link="-L $LIB -lhapsix_io -lhapsix"
g++ $flags "$SOURCE/tests/install/io_host.cpp" -o "$WORK/without" $link
says without >"$WORK/expected"
[ "$(wc -l <"$WORK/expected")" -ge 13 ] || fail "the host computed nothing"
grep -q '^up to [1-9]' "$WORK/expected" || fail "nothing touched"

# A program with an Eigen of its own kind, whose symbols all libraries see.
g++ $flags -DHOST_EIGEN -march=native -ffast-math -DEIGEN_MAX_ALIGN_BYTES=64 -DEIGEN_INITIALIZE_MATRICES_BY_NAN \
  -c "$SOURCE/tests/install/io_host.cpp" -o "$WORK/with.o"
g++ "$WORK/with.o" -rdynamic -o "$WORK/with" $link
nm -D --defined-only "$WORK/with" | grep Eigen >/dev/null || fail "the program shows no Eigen: the test is blind"
says with | diff - "$WORK/expected" || fail "another Eigen in the program changes what libhapsix_io makes"

# A program that defines every weak symbol of ours as a trap, but for those of libraries that we share
# with it: these would fall into the traps without us.
boxes=$(find "$BUILD/io" "$BUILD/runtime" "$BUILD/kernels" "$BUILD/sched" -name 'libhapsix_*.a')
ldd "$LIB/libhapsix_io.so" | awk '$3 ~ /^\// {print $3}' | grep -v /libhapsix | xargs nm -D --defined-only |
  awk 'NF == 3 {print $3}' | sed 's/@.*//' | sort -u >"$WORK/shared_with_us"
nm $boxes 2>/dev/null | awk 'NF == 3 && $2 ~ /^[VWuvw]$/ {print $3}' | sort -u |
  comm -23 - "$WORK/shared_with_us" >"$WORK/weak"
[ "$(wc -l <"$WORK/weak")" -ge 1000 ] || fail "no weak symbols to try"
grep -q Eigen "$WORK/weak" || fail "no weak symbol of Eigen to try"
g++ $flags -c "$SOURCE/tests/install/io_host.cpp" -o "$WORK/plain.o"
nm --defined-only "$WORK/plain.o" | awk '{print $3}' | sort -u >"$WORK/own"
{ echo .text; comm -23 "$WORK/weak" "$WORK/own" | sed 's/.*/.globl "&"\n"&": ud2/'; echo '.section .note.GNU-stack'; } >"$WORK/traps.s"
gcc -c "$WORK/traps.s" -o "$WORK/traps.o"
g++ "$WORK/plain.o" "$WORK/traps.o" -rdynamic -o "$WORK/trapped" $link
says trapped | diff - "$WORK/expected" || fail "libhapsix_io falls into a trap of the program"
# Without its list of symbols the library must fall into one, or this test proves nothing.
if [ -e "$BUILD/build.ninja" ]; then
  link=$(ninja -C "$BUILD" -t commands io/libhapsix_io.so | grep -e ' -shared ' | tail -n 1)
  mkdir "$WORK/open"
  (cd "$BUILD" && sh -c "$(sed "s#-Wl,--version-script=[^ ]*##; s# -o [^ ]*# -o $WORK/open/libhapsix_io.so.0#" <<<"$link")")
  if LD_LIBRARY_PATH=$WORK/open:$LIB says trapped >/dev/null 2>&1; then fail "no library falls into the traps: the test is blind"; fi
fi
echo "the same bits beside $(wc -l <"$WORK/weak") traps and another Eigen"
