#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# fuzz.sh [TARGET] [SECONDS] - runs build/fuzz/hapsix_fuzz_* on one target, or on all in turn.
# Seeds: tests/fuzz/corpus; words of the formats: tests/fuzz/words. What it learns stays in build/fuzz/corpus; findings go to
# build/fuzz/findings and belong into tests/fuzz/findings/TARGET once they are mended.
set -euo pipefail
cd "$(dirname "$0")/../.."
all=$(ls tests/fuzz/corpus)
case "${1:-}" in ""|[0-9]*) targets=$all ;; *) targets=$1; shift ;; esac
seconds=${1:-60}
each=$((seconds / $(echo $targets | wc -w)))
[ "$each" -ge 1 ] || each=1
# fuzzer.cpp replaces new and delete, and libFuzzer frees memory of its own new with them. So a mismatch
# of the two is not reported.
export ASAN_OPTIONS=detect_leaks=0:allocator_may_return_null=1:alloc_dealloc_mismatch=0
found=0
# Small inputs find as much as large ones, and many more of them fit into a second.
most() {
  case $1 in
    hid|path|script|gz|device|bridge|plugin) echo 256 ;;
    obj|request|pick|contract|haply|http|study|udp_arm) echo 512 ;;
    stl|ply|mesh_gz|scene|shell|dae|gltf|glb|run_text) echo 1500 ;;
    field) echo 25000 ;;
    vdb|log) echo 40000 ;;
    *) echo 130000 ;;
  esac
}
printf '%-10s %12s %10s %9s %9s\n' target executions coverage features findings
for target in $targets; do
  [ -d "tests/fuzz/corpus/$target" ] || { echo "fuzz: no target '$target': $(echo $all)" >&2; exit 2; }
  learnt=build/fuzz/corpus/$target kept=build/fuzz/findings/$target log=build/fuzz/$target.log
  mkdir -p "$learnt" "$kept"
  part=readers words=()
  [ "$target" = contract ] && part=engine
  [ -f "tests/fuzz/words/$target" ] && words=(-dict="tests/fuzz/words/$target")
  HAPSIX_FUZZ=$target build/fuzz/hapsix_fuzz_$part "${words[@]}" -max_len="$(most "$target")" \
    -max_total_time="$each" -timeout=100 ${HAPSIX_FUZZ_SEED:+-seed="$HAPSIX_FUZZ_SEED"} -rss_limit_mb=4000 \
    -print_final_stats=1 -print_funcs=0 -artifact_prefix="$kept/" "$learnt" "tests/fuzz/corpus/$target" \
    >"$log" 2>&1 || true
  runs=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")
  edges=$(grep -o 'cov: [0-9]*' "$log" | tail -n 1 | cut -c6-) || true
  features=$(grep -o 'ft: [0-9]*' "$log" | tail -n 1 | cut -c5-) || true
  echo "$target ${runs:-0} ${edges:-0} ${features:-0}" >>build/fuzz/tally  # of all that was ever run
  count=$(find "$kept" -type f | wc -l)
  found=$((found + count))
  printf '%-10s %12s %10s %9s %9s\n' "$target" "${runs:-0}" "${edges:--}" "${features:--}" "$count"
  # A target that ran nothing has said why.
  [ "${runs:-0}" -gt 0 ] || { tail -n 5 "$log" >&2; found=$((found + 1)); }
done
[ "$found" = 0 ] || { echo "fuzz: findings in build/fuzz/findings, words in build/fuzz/*.log" >&2; exit 1; }
