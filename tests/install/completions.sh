#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The man page names every command and option that --help shows, and bash completes them.
. "$(dirname "$0")/common.sh"
PROGRAM=$BUILD/hapsix
[ -x "$PROGRAM" ] || skip "the program is not built"
"$PROGRAM" --generate man >"$WORK/hapsix.1"
"$PROGRAM" --generate bash >"$WORK/hapsix.bash"
grep -q '^\.TH HAPSIX 1' "$WORK/hapsix.1" || fail "no man page"
if command -v man >/dev/null && [ -n "$(command -v groff || true)" ]; then
  said=$(LC_ALL=C.UTF-8 MANROFFSEQ= man --warnings -E UTF-8 -l -Tutf8 -Z "$WORK/hapsix.1" 2>&1 >/dev/null)
  [ -z "$said" ] || fail "the man page: $said"
fi
count=0
for command in "" new bake "bake field" "bake shell" "bake deformable" check run report export replay info devices scene "scene list" \
  "scene export" demo experiments map study; do
  for option in $("$PROGRAM" $command --help | grep -oE '^ +(-[a-zA-Z],)?--[a-z-]+' | grep -oE -- '--[a-z-]+'); do
    grep -qF -- "$(sed 's/-/\\-/g' <<<"$option")" "$WORK/hapsix.1" || fail "the man page lacks $option of '$command'"
    count=$((count + 1))
  done
done
[ "$count" -ge 80 ] || fail "only $count options were looked for"

complete_words() { # the line up to the cursor
  bash -c '. "$1"; shift; COMP_WORDS=(hapsix "$@"); COMP_CWORD=$#; _hapsix; echo "${COMPREPLY[*]}"' - "$WORK/hapsix.bash" "$@"
}
expect() { # what it must be, then the words
  local wanted=$1; shift
  local got; got=$(complete_words "$@")
  [ "$got" = "$wanted" ] || fail "hapsix $*: '$got' and not '$wanted'"
}
expect "bake" ba
expect "field shell deformable" bake ""
expect "--voxels --voxel-size" bake field bay.stl --vox
expect "list export" scene ""
expect "--virtual-time --view" run --v
expect "" bake field ""
# Into files first: see common.sh on grep -q.
for shell in zsh fish; do
  "$PROGRAM" --generate $shell >"$WORK/$shell"
  command -v $shell >/dev/null || continue
  $shell -n "$WORK/$shell" || fail "$shell does not read its completion"
done
grep -q '^#compdef hapsix' "$WORK/zsh" || fail "no zsh completion"
grep -q "complete -c hapsix -n \"__hapsix_at 'run'\" -l method -r" "$WORK/fish" || fail "no fish completion"
