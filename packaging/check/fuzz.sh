#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# fuzz.sh MINUTES: runs all fuzz targets of tests/fuzz for this total time, one per core in parallel.
# fuzz.sh --each SECONDS: runs each target for this time. Exit code 0 only if no target found a fault.
# build/fuzz-corpus keeps the corpus for the next run.
set -uo pipefail
source "$(dirname "$0")/../setup.sh"

targets=(parse filter round_trip json evaluate coordinates rig clip packed)
programs="$project/build/asan-ubsan/tests/fuzz"
corpora="$project/build/fuzz-corpus"
finds="$project/build/fuzz-finds"
logs="$project/build/logs/fuzz"
at_a_time=$(nproc)

case "${1:-}" in
  --each) each=${2:?SECONDS} ;;
  [0-9]*) each=$(awk "BEGIN { print int($1 * 60 * $at_a_time / ${#targets[@]}) }") ;;
  *) echo "fuzz.sh MINUTES, or fuzz.sh --each SECONDS" >&2 && exit 2 ;;
esac

build_targets() {
  (cd "$project" && cmake --preset asan-ubsan -DCMAKE_CXX_COMPILER_LAUNCHER=ccache &&
    cmake --build --preset asan-ubsan -j"$(nproc)" --target make_seeds planted_fuzz greedy_fuzz \
      "${targets[@]/%/_fuzz}") > "$logs/build.log" 2>&1 ||
    { tail -n 30 "$logs/build.log" && return 1; }
}

# run_target TARGET SECONDS: runs a target; its log has the numbers of the table. Allocation stacks are short,
# because full stacks take a quarter of the time, and a find is run again anyway.
run_target() {
  local longest=4400
  case $1 in json) longest=8192 ;; rig) longest=14000 ;; esac
  mkdir -p "$corpora/$1" "$corpora/seeds/$1"
  ASAN_OPTIONS=malloc_context_size=4:quarantine_size_mb=32 limited $(($2 + 60)) "$programs/$1_fuzz" \
    -max_total_time="$2" -timeout=60 -rss_limit_mb=2048 -max_len=$longest -print_final_stats=1 \
    -dict="$project/tests/fuzz/dna.dict" -artifact_prefix="$finds/$1-" \
    "$corpora/$1" "$corpora/seeds/$1" > "$logs/$1.log" 2>&1
}

# find_planted TARGET WORDS: checks that fuzzing finds the fault in a target with a planted fault. Otherwise no
# finds in the other targets would prove nothing.
find_planted() {
  rm -f "$finds/$1"-*
  ! run_target "$1" 60 && [ -n "$(ls "$finds/$1"-* 2> /dev/null)" ] &&
    grep -q "broken promise: $2" "$logs/$1.log" && rm -f "$finds/$1"-*
}

# Runs files whose lists multiply each other once each. They are too slow for mutation.
run_bombs() {
  limited 300 "$programs/evaluate_fuzz" -timeout=600 -rss_limit_mb=2048 -artifact_prefix="$finds/bombs-" \
    "$corpora/seeds/bombs"/* > "$logs/bombs.log" 2>&1
}

number() { grep -oE "stat::$2: +[0-9]+" "$logs/$1.log" | grep -oE '[0-9]+$' || echo 0; }
print_row() { # print_row TARGET: prints a row; fails if the target found a fault or did not run
  local found runs coverage
  found=$(ls "$finds/$1"-* 2> /dev/null | wc -l)
  runs=$(number "$1" number_of_executed_units)
  coverage=$(grep -oE 'cov: [0-9]+ ft: [0-9]+' "$logs/$1.log" | tail -n 1 | tr -dc '0-9 ')
  printf '%-12s %12d %8d %14s %8d %6d\n' "$1" "$runs" "$(number "$1" average_exec_per_sec)" \
    "$(echo $coverage | tr ' ' /)" "$(ls "$corpora/$1" | wc -l)" "$found"
  [ "$found" -eq 0 ] && [ "$runs" -gt 0 ]
}

mkdir -p "$logs" "$finds" "$corpora"
step "tools" && install_packages clang-14 lld-14 libclang-rt-14-dev || exit 1
step "fuzz targets" && build_targets || exit 1
rm -rf "$corpora/seeds"
"$programs/make_seeds" "$corpora/seeds" "$project"/tests/data/golden/*.dna || exit 1
step "self-test"
for planted in "planted planted" "greedy [0-9]* bytes take [0-9]* bytes of the heap"; do
  find_planted "${planted%% *}" "${planted#* }" && continue
  echo "the planted mistake was not found: $logs/${planted%% *}.log" >&2 && exit 1
done
step "bombs"
run_bombs || { tail -n 15 "$logs/bombs.log" && echo "a face takes too much: $logs/bombs.log" >&2 && exit 1; }
step "${#targets[@]} targets, $each s each, $at_a_time at a time"
for target in "${targets[@]}"; do
  while [ "$(jobs -rp | wc -l)" -ge "$at_a_time" ]; do wait -n; done
  run_target "$target" "$each" &
done
wait
step ""

found=0
printf '%-12s %12s %8s %14s %8s %6s\n' target executions each/s coverage corpus finds
for target in "${targets[@]}"; do print_row "$target" || found=1; done
[ $found -eq 0 ] && exit 0
cat << END
Finds lie in $finds; the last lines of $logs/<target>.log say what broke.
Make one small, keep it, and name it in a test:
  $programs/<target>_fuzz -minimize_crash=1 -runs=100000 -exact_artifact_path=small FIND
  cut what the target takes for options off its beginning (8 bytes: filter, coordinates; 4: evaluate, rig, clip)
  cp small tests/data/fuzz/NNN-short-name.dna       # the next number
  and a TEST of that name in tests/dna/regressions_test.cpp
END
exit 1
