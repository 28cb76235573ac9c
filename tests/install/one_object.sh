#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Both libraries show the contract and nothing else, so nothing of a program can take the place of
# what is inside: not a symbol of the same name, not Eigen compiled for another machine, and on x86 not
# another Highway, which would choose our SIMD target.
. "$(dirname "$0")/common.sh"
stage
PROGRAM=$SOURCE/runtime/examples/hello.c
STATIC="$LIB/libhapsix.a $(sed -n 's/^Libs\.private: //p' "$LIB/pkgconfig/hapsix.pc")"
shown() { awk 'NF > 1 && $(NF-1) ~ /^[A-TV-Zuvwi]$/ {print $NF}' | sed 's/@.*//' | grep -vE '^(h6[A-Z][A-Za-z]*|HAPSIX_0)$' || true; }
[ -z "$(nm "$LIB/libhapsix.a" | shown)" ] || fail "the archive shows $(nm "$LIB/libhapsix.a" | shown | head -3)"
[ -z "$(nm -D --defined-only "$LIB/libhapsix.so" | shown)" ] || fail "the library shows more than the contract"
[ "$(nm -D --defined-only "$LIB/libhapsix.so" | grep -c ' T h6')" -ge 60 ] || fail "the contract is not there"

case $(uname -m) in x86_64 | i?86)
  { nm -C "$LIB/libhapsix.a"; for library in "$LIB"/libhapsix*.so; do nm -DC "$library"; done; } >"$WORK/symbols"
  grep -E ' U .*\bhwy::' "$WORK/symbols" && fail "the libraries ask the program's Highway" ;;
esac

# A program that defines every weak symbol of ours, and Highway's answer to what the machine can do, each
# as a trap. Against plain archives it must fall into one, or this test proves nothing.
boxes=$(find "$BUILD" -name libhapsix_runtime.a -o -name libhapsix_kernels.a -o -name libhapsix_sched.a -o -name libhapsix_contract.a)
nm -D --defined-only /usr/lib/*/libstdc++.so.6 | awk '{print $NF}' | sed 's/@.*//' | sort -u >"$WORK/standard"
nm $boxes | awk 'NF > 1 && $(NF-1) ~ /^[VWuvw]$/ && NF == 3 {print $NF}' | sort -u | comm -23 - "$WORK/standard" >"$WORK/weak"
[ "$(wc -l <"$WORK/weak")" -ge 100 ] || fail "no weak symbols to try"
grep -q Eigen "$WORK/weak" || fail "no weak symbol of Eigen to try"
case $(uname -m) in x86_64 | i?86) echo _ZN3hwy16SupportedTargetsEv >>"$WORK/weak" ;; esac
{ echo .text; sed 's/.*/.globl &\n&: ud2/' "$WORK/weak"; echo '.section .note.GNU-stack'; } >"$WORK/traps.s"
gcc -std=c99 -I "$STAGE/include" -c "$PROGRAM" -o "$WORK/program.o"
gcc -c "$WORK/traps.s" -o "$WORK/traps.o"
gcc "$WORK/program.o" "$WORK/traps.o" -o "$WORK/static" $STATIC
"$WORK/static" | says_right "the static library beside traps"
gcc "$WORK/program.o" "$WORK/traps.o" -rdynamic -o "$WORK/shared" -L "$LIB" -lhapsix
LD_LIBRARY_PATH=$LIB "$WORK/shared" | says_right "the shared library beside traps"
g++ "$WORK/program.o" "$WORK/traps.o" -o "$WORK/plain" -Wl,--start-group $boxes -Wl,--end-group -ltbb -lhwy -lpthread
if "$WORK/plain" >/dev/null 2>&1; then fail "plain archives do not fall into the traps: the test is blind"; fi

# A program with an Eigen of its own kind: the same numbers to the bit as a program without.
flags="-std=c++17 -O1 -I $STAGE/include -I /usr/include/eigen3"
g++ $flags "$SOURCE/tests/install/eigen_host.cpp" -o "$WORK/without" $STATIC
g++ $flags -DHOST_EIGEN -march=native -ffast-math -DEIGEN_MAX_ALIGN_BYTES=64 -DEIGEN_INITIALIZE_MATRICES_BY_NAN \
  -c "$SOURCE/tests/install/eigen_host.cpp" -o "$WORK/with.o"
g++ "$WORK/with.o" -o "$WORK/with" $STATIC
g++ "$WORK/with.o" -rdynamic -o "$WORK/with_shared" -L "$LIB" -lhapsix
"$WORK/without" >"$WORK/expected"
"$WORK/with" | diff - "$WORK/expected" || fail "another Eigen in the program changes the static library"
LD_LIBRARY_PATH=$LIB "$WORK/with_shared" | diff - "$WORK/expected" || fail "... the shared library"
[ "$(wc -l <"$WORK/expected")" -ge 8 ] || fail "the host computed nothing"
