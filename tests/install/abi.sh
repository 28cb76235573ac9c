#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The contract has not changed under programs that were compiled before: the headers are compared with
# runtime/install/hapsix.abi, by abidiff. `abi.sh SOURCE BUILD --update` writes that file anew, after a
# function was added or a member took words of `reserved`; `--break`, for a version with another SONAME,
# whatever has changed.
. "$(dirname "$0")/common.sh"
command -v abidiff >/dev/null && command -v abidw >/dev/null || skip "abidiff is not installed (abigail-tools)"
DUMP=$SOURCE/runtime/install/hapsix.abi

# headers DIR: the public headers of the tree
headers() { mkdir -p "$1/hapsix"; cp "$SOURCE"/runtime/include/hapsix/{base,batch,device,device_plugin,hapsix,types}.h "$SOURCE/io/api/hapsix/io.h" "$1/hapsix/"; }
# library DIR: a library that has every function of the headers in DIR, with debug information. The real
# one has none, and its types are those of the headers.
library() {
  { for header in "$1"/hapsix/*.h; do echo "#include <hapsix/$(basename "$header")>"; done
    # A plug-in has this one, not the library: with it, the structs of plug-ins are compared, too.
    printf 'const h6DevicePluginV1 h6_device_plugin_v1;\n'
    cat "$1"/hapsix/*.h | tr '\n' ' ' | grep -oE 'H6_API [^;{}]*\([^;{}]*\);' | sed 's/;$/ { __builtin_trap(); }/'; } >"$1/all.c"
  gcc -g -std=c99 -shared -fPIC -w -I "$1" -o "$1/all.so" "$1/all.c"
}
# same DIR: nothing but additions
same() { abidiff --no-added-syms "$DUMP" "$1/all.so" >"$WORK/said" 2>&1; }
# safe DIR: a program that was compiled before goes on running: no size changed, nothing is gone
safe() { same "$1" || ! grep -qE "^ *type size changed|data member deletion|^  \[D\]|parameter [0-9]+ of type .* (changed:|was )" "$WORK/said"; }
changed() { sed -i "$3" "$1/hapsix/$2"; library "$1"; }

headers "$WORK/now"
library "$WORK/now"
if [ "${3:-}" = --update ] || [ "${3:-}" = --break ]; then
  [ "$3" = --break ] || safe "$WORK/now" || { cat "$WORK/said" >&2; fail "this breaks programs: no update"; }
  abidw --no-corpus-path --no-comp-dir-path --no-show-locs --out-file "$DUMP" "$WORK/now/all.so"
  exit
fi
same "$WORK/now" || { cat "$WORK/said" >&2; fail "the contract changed: tests/install/abi.sh SOURCE BUILD --update says whether programs go on running"; }

# The check itself: each of these is told from the others.
headers "$WORK/removed"; changed "$WORK/removed" types.h '/bool       translation_only;/d'
same "$WORK/removed" && fail "a removed member passes"
headers "$WORK/moved"; changed "$WORK/moved" types.h 's/^  double     mass;  /  float      mass;  /'
same "$WORK/moved" && fail "a member of another type passes"
headers "$WORK/unplugged"; changed "$WORK/unplugged" device_plugin.h '/  uint32_t cause;/d'
same "$WORK/unplugged" && fail "a removed member of a plug-in's struct passes"
headers "$WORK/gone"; changed "$WORK/gone" hapsix.h '/H6_API double          h6GetVoxel/d; /H6_API double *h6GetVoxel/d'
same "$WORK/gone" && fail "a removed function passes"
headers "$WORK/longer"; changed "$WORK/longer" hapsix.h 's/^} h6LoopDef;/  double more; } h6LoopDef;/'
same "$WORK/longer" && fail "a larger definition passes"
for broken in removed moved unplugged gone longer; do safe "$WORK/$broken" && fail "--update takes $broken"; done
headers "$WORK/added"; changed "$WORK/added" hapsix.h 's/^H6_API h6LoopDef h6DefaultLoopDef/H6_API int h6NewFunction(int a);\n&/'
same "$WORK/added" || { cat "$WORK/said" >&2; fail "an added function does not pass"; }
headers "$WORK/used"; changed "$WORK/used" hapsix.h '/size_t   view_contacts;/,/} h6LoopDef;/ s/^  uint64_t reserved\[8\];/  double more; uint64_t reserved[7];/'
changed "$WORK/used" batch.h 's/^  uint64_t reserved\[5\];/  double more; uint64_t reserved[4];/'  # by pointer only
same "$WORK/used" && fail "a member that takes a word of reserved is not seen"
safe "$WORK/used" || { cat "$WORK/said" >&2; fail "--update does not take a word of reserved"; }

# What the headers declare is what the libraries have.
declared() { cat "$@" | grep -v '#define' | grep -oE 'H6_API [^;{}(]*\(' | sed 's/($//' | awk '{print $NF}' | tr -d '*' | sort -u; }
have() { nm -D --defined-only "$1" | awk '$2 == "T" {print $3}' | sed 's/@.*//' | sort -u; }
diff <(declared "$SOURCE"/runtime/include/hapsix/*.h) <(have "$BUILD/runtime/install/libhapsix.so") || fail "the engine's functions are not those of its headers"
if [ -e "$BUILD/io/libhapsix_io.so" ]; then
  diff <(declared "$SOURCE/io/api/hapsix/io.h") <(have "$BUILD/io/libhapsix_io.so") || fail "the functions of io are not those of its header"
fi
