#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# test.sh: builds everything and runs all tests: native, Python and Blender. All Blender tests run in bpy 4.5
# and in the first `blender` on PATH and in BLENDER=, if they are 4.2 or newer. A fast subset runs in bpy 4.2 and
# 5.0 if pip can fetch them. At the end, prints the duration of each stage, the results, and the parts that
# did not run with the reason. Exit code 0 only if all tests passed.
# packaging/check/blender/matrix.sh runs all Blender tests in all versions.
#
#   ./packaging/test.sh            everything; about half an hour on two idle cores
#   ./packaging/test.sh --quick    the fast tests of GoogleTest and Python, and the basic tests in bpy 4.5
#                                  (install, import, controls, frames, a rendering)
#   ./packaging/test.sh --help     this text
#
# Three lanes run in parallel, because half of the work uses one core only. Lane `native`: GoogleTest,
# sanitizers, cross compilers, fuzzers, the installed C library. Lane `python`: the wheel, style, types,
# pytest, the documentation as a site, and the Windows wheel in wine if wheels.sh has built it. Lane
# `blender`: all tests inside Blender; it waits for the extension's zip. The two lanes that end first run
# the fast subset in an older and a newer Blender.
set -uo pipefail
mode=${1:-all}
case $mode in
  all | --quick) ;;
  --help) sed -n '3,/^set /{/^set /d;s/^# \{0,1\}//;p}' "$0" && exit 0 ;;
  *) echo "test.sh: $mode is none of --quick, --help" >&2 && exit 2 ;;
esac
source "$(dirname "$0")/setup.sh"
cd "$project" || exit 1
logs="$project/build/logs"
rm -rf "$logs/rows" "$logs/extension.made" "$logs"/subset-*
mkdir -p "$logs/rows"
source packaging/check/rows.sh
# GoogleTest programs that run in the optimised build: optimisation or the machine may change their results,
# or sanitizers would change their memory and time. All other programs run under the sanitizers only, or in
# the optimised build with --quick. Tests that try every byte (every_byte) run under the sanitizers only,
# because these detect more. Long computations (long_sums) do not run under the sanitizers, because shorter
# tests cover the same lines.
optimised=(simd rig threads compile clip memory solve author)
long_sums='Correct.TheSkinInItself|Correct.WhatTwoParts|Fit.WhatIsBound|Fit.WeightsGoOn|Fit.AnotherFace|Fit.JointsLeave|Register.WhatLooks|Register.DoesNotDepend'
every_byte='EveryByte|EveryPatched|EveryChangedByte|ChangedBytes|CutAtEvery|DamagedByte|DamageUnder|Changes.*Reads'
# Python test files that --quick leaves out, because they take longest.
slow_python=(batch command_bench command_convert command_diff command_plot edit_regroup rig_nan rig_settle
  rig_thousand sample speech speech_apart)
# One thread for linear algebra, because the lanes share the cores and waiting threads would use them up.
export OPENBLAS_NUM_THREADS=1

build_preset() { # build_preset PRESET [TARGET...]
  local preset=$1 targets=()
  shift
  [ $# -eq 0 ] || targets=(--target "$@")
  { cmake --preset "$preset" -DCMAKE_CXX_COMPILER_LAUNCHER=ccache > "$logs/cmake-$preset.log" 2>&1 ||
    { tail -n 30 "$logs/cmake-$preset.log" && false; }; } &&
    { cmake --build --preset "$preset" -j"$(nproc)" "${targets[@]}" > "$logs/build-$preset.log" 2>&1 ||
      { tail -n 30 "$logs/build-$preset.log" && false; }; }
}
# google_tests NAME PRESET [EXCLUDED_TESTS_PATTERN [PROGRAM...]]: builds and runs GoogleTest programs
google_tests() {
  local name=$1 preset=$2 log="$logs/ctest-$2.log" code without=()
  # CTest has a placeholder test NOT_BUILT for each program that is not built.
  [ $# -lt 3 ] || without=(-E "$3|NOT_BUILT")
  build_preset "$preset" "${@:4}" || { note "$name: does not build" 0 1 && return; }
  rm -f "$logs/ctest-$preset.xml"
  ctest --preset "$preset" -j"$(nproc)" "${without[@]}" --output-junit "$logs/ctest-$preset.xml" > "$log" 2>&1
  code=$?
  tail -n 5 "$log"
  [ $code -eq 0 ] || grep -B2 -A30 -m3 -E '\[  FAILED  \]|\*\*\*(Failed|Exception)' "$log" | head -n 90
  note_report "$name" "$logs/ctest-$preset.xml" $code
  grep -ohE 'This CPU has no [a-z0-9]+' "$logs/cmake-$preset.log" | sort -u |
    while read -r line; do say "NOT RUN, $name: ${line,}"; done
}
run_script() { # run_script PATH [OPTION...]: runs a script of packaging/ and takes over its rows
  local script=${1##*/} log code name good bad
  log="$logs/${script%.sh}.log"
  "$project/packaging/$1" "${@:2}" > "$log" 2>&1
  code=$?
  while IFS=$'\t' read -r _ name good bad; do
    note "$name" "$good" "$bad"
  done < <(grep -P '^row\t' "$log")
  while IFS=$'\t' read -r _ name; do say "$name"; done < <(grep -P '^say\t' "$log")
  # A successful script that only prints NOT RUN adds no row.
  [ "$code" -eq 0 ] && ! grep -qP '^row\t' "$log" && grep -qP '^say\t' "$log" && return
  check "$script" [ "$code" -eq 0 ] || tail -n 40 "$log"
}
run_fuzzers() { # run_fuzzers SECONDS
  local code target executions finds
  "$project/packaging/check/fuzz.sh" --each "$1" > "$logs/fuzz.log" 2>&1
  code=$?
  # Columns of a row: target, executions, executions per second, coverage, corpus, finds.
  while read -r target executions _ _ _ finds; do
    note "fuzz $target, $executions runs" $((finds == 0)) $((finds > 0))
  done < <(grep -E '^[a-z_]+ +[0-9]+ +[0-9]+ +[0-9]+/' "$logs/fuzz.log")
  check "fuzz.sh" [ "$code" -eq 0 ] || tail -n 15 "$logs/fuzz.log"
}
# The wheel is built with the same options (build_tested_wheel), so ccache reuses these objects. The python
# lane waits for this build, and meanwhile does the work that needs no wheel.
build_libraries() {
  step "native libraries"
  check "native libraries" build_preset tests risorius_dna_file risorius_edit risorius_clip risorius_author
  flock -u 9 # lets the python lane go on
}
native_lane() {
  build_libraries
  step "GoogleTest"
  if [ "$mode" = --quick ]; then
    google_tests "GoogleTest" tests "$every_byte"
    return 0
  fi
  google_tests "GoogleTest" tests "$every_byte" "${optimised[@]/%/_test}" risorius_shared
  # The following steps can use all cores. A lower priority leaves the cores to the other lanes first.
  renice -n 5 "$BASHPID" > /dev/null
  step "GoogleTest with sanitizers"
  # Short allocation stacks, because full stacks would take a quarter of the run time.
  ASAN_OPTIONS=detect_leaks=1:malloc_context_size=6 \
    google_tests "GoogleTest, ASan, UBSan, leaks" asan-ubsan "$long_sums"
  step "one Rig under eight threads"
  google_tests "thread sanitizer, one Rig" tsan
  step "other compilers, systems and processors"
  run_script check/cross.sh
  step "fuzz targets, 5 s each"
  run_fuzzers 5
  extension_is_there || return # the next step needs the wheel, which is ready before the extension
  step "C library for other programs"
  run_script check/host.sh
  run_subsets
}
# Waits for the python lane's extension and sets `zip` to its path.
extension_is_there() {
  step "waiting for the extension" && flock "$logs/extension.lock" true
  check "extension's zip" [ -e "$logs/extension.made" ] || return
  zip=$(ls "$project"/build/dist/risorius-*.zip)
}

# run_blender NAME FILES COMMAND...: runs Blender tests; FILES are the test files that must run, separated by
# blanks
run_blender() {
  local name=$1 files=$2 log user code
  log="$logs/blender-$(echo "$name" | tr -c 'a-zA-Z0-9.\n' '-').log"
  shift 2
  rm -f "$log.xml"
  # A temporary user folder. Blender reads the variable before the tests could set it.
  user=$(mktemp -d)
  BLENDER_USER_RESOURCES="$user" limited 2400 "$@" --durations 15 --junitxml "$log.xml" \
    > "$log" 2>&1
  code=$?
  rm -rf "$user"
  [ $code -eq 0 ] && tail -n 1 "$log" || tail -n 40 "$log"
  # shellcheck disable=SC2086  # one word a file
  note_report "$name" "$log.xml" $code --files $files
}
some() { # some NAME...: the paths of these files
  local name
  for name; do printf '%s ' blender_tests/*/test_"$name".py; done
}
# Runs at the end of each lane: tests of the parts that differ most between Blender versions (installation,
# building, keys and actions, saved files). The lane that ends first runs bpy 4.2, the next one bpy 5.0.
run_subsets() {
  local subset version other
  subset=$(some extension controls frames past scenes)
  zip=$(ls "$project"/build/dist/risorius-*.zip)
  for version in 4.2.23 5.0.1; do
    mkdir "$logs/subset-$version" 2> /dev/null || continue
    step "a fast subset in bpy $version"
    if other=$(bpy_venv "$version" 90); then
      # shellcheck disable=SC2086
      run_blender "bpy $version, fast subset" "$subset" "$other" blender_tests/run.py -- --extension "$zip" $subset
    else
      say "NOT RUN: bpy $version could not be fetched"
    fi
  done
}
run_program() { # run_program BLENDER: all tests in a Blender program, unless it is older than 4.2
  local version
  version=$(limited 60 "$1" --version 2> /dev/null | grep -oE '^Blender [0-9.]+' | head -n 1)
  if [ -z "$version" ]; then
    note "$1 (does not start)" 0 1
  elif [ "$(printf '%s\n4.2\n' "${version#Blender }" | sort -V | head -n 1)" != 4.2 ]; then
    say "NOT RUN: $version at $1 is older than 4.2"
  else
    check "manifest, $version" limited 60 "$1" --factory-startup --command extension \
      validate "$zip"
    run_blender "$version" "$(find blender_tests -name 'test_*.py' | sort | paste -sd ' ')" "$1" -b --factory-startup -noaudio \
      --python-exit-code 1 --python blender_tests/run.py -- --extension "$zip"
  fi
}
run_style() {
  local name
  for name in ruff-check ruff-format clang-format; do
    check "$name" packaging/check/style.sh "$name"
  done
}
run_types() {
  local name
  for name in mypy-package mypy-logic pyright; do
    check "$name" packaging/check/style.sh "$name"
  done
}
run_pytest() {
  local code version files name slow=()
  version=$("$python" -c 'import platform; print(platform.python_version())')
  files=$(find tests -name 'test_*.py')
  if [ "$mode" = --quick ]; then
    slow=(tests/faults/test_faults.py)
    for name in "${slow_python[@]}"; do slow+=(tests/python/*/test_"$name".py); done
    files=$(echo "$files" | grep -vxF "$(printf '%s\n' "${slow[@]}")")
  fi
  rm -f "$logs/pytest.xml"
  limited 4000 "$python" -m pytest -q -rs "${slow[@]/#/--ignore=}" --durations 25 --junitxml "$logs/pytest.xml" tests > "$logs/pytest.log" 2>&1
  code=$?
  [ $code -eq 0 ] && tail -n 15 "$logs/pytest.log" || tail -n 120 "$logs/pytest.log"
  # shellcheck disable=SC2086  # one word a file
  note_report "Python $version" "$logs/pytest.xml" $code --files $files
}
# CXX is set because Python would use g++ but CMake c++, and ccache takes these for two compilers.
build_tested_wheel() { CXX=c++ SKBUILD_CMAKE_DEFINE=RISORIUS_WARNINGS_AS_ERRORS=ON build_wheel; }
python_lane() {
  step "Python's tools" && check "Python's tools" make_venv || return
  [ "$mode" = --quick ] || { step "style" && run_style; }
  step "waiting for the native libraries" && flock "$logs/libraries.lock" true
  step "wheel" && check "wheel" build_tested_wheel || return
  step "extension" && check "extension" build_extension || return
  touch "$logs/extension.made"
  flock -u 8 # lets the blender lane go on
  [ "$mode" = --quick ] || { step "types" && run_types; }
  step "Python tests"
  run_pytest
  [ "$mode" = --quick ] && return
  step "documentation as a site" && run_script ship/site.sh
  step "the Windows wheel in wine" && run_script ship/windows_wheels.sh --there
  run_subsets
}
blender_lane() {
  local version blender
  extension_is_there || return
  step "Blender tests in bpy"
  version=$("$python" -c 'import importlib.metadata as m; print(m.version("bpy"))')
  if [ "$mode" = --quick ]; then
    local door
    door=$(some extension controls vertices frames)
    # shellcheck disable=SC2086
    run_blender "bpy $version, the front door" "$door" "$python" blender_tests/run.py -- \
      --extension "$zip" $door
    say "NOT RUN: all that --quick leaves out (packaging/test.sh)"
    return 0
  fi
  run_blender "bpy $version" "$(find blender_tests -name 'test_*.py' | sort | paste -sd ' ')" "$python" blender_tests/run.py -- \
    --extension "$zip"
  run_subsets
  say "NOT RUN here: all tests in bpy 4.2, 5.0 and Blender 4.3.2, 5.2.2 (packaging/check/blender/matrix.sh)"
  for blender in $(printf '%s\n' "${BLENDER:-}" "$(command -v blender || true)" | sort -u); do
    step "Blender tests in $blender"
    run_program "$blender"
  done
}

step "packages"
install_packages clang-14 lld-14 libclang-rt-14-dev googletest g++-aarch64-linux-gnu qemu-user || exit 1
step ""
exec 9> "$logs/libraries.lock"
flock 9
run_lane native native_lane &
exec 9>&-
exec 8> "$logs/extension.lock"
flock 8
run_lane python python_lane &
exec 8>&-
run_lane blender blender_lane &
wait
results table "$logs/rows" native python blender
code=$?
echo "$((SECONDS - _begin)) s in all"
exit $code
