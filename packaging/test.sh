#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Every test: native, Python, Blender (all in bpy 4.5 and in each `blender` of 4.2 or newer that is
# found on PATH or named by BLENDER=; a fast subset in bpy 4.2 and 5.0, where they can be fetched).
# Says at the end what ran where; packaging/matrix.sh runs all in all versions. Exit code 0 only if
# all passed.
#
# Two lanes side by side, because half of the work keeps one core busy only: `native` is GoogleTest,
# sanitizers, cross compilers and fuzzers; `python` is the wheel, style, pytest and Blender.
set -uo pipefail
source "$(dirname "$0")/setup.sh"
cd "$project" || exit 1
logs="$project/build/logs"
rm -rf "$logs/rows"
mkdir -p "$logs/rows"
lane=tools # whose rows `note` and `say` write

# note NAME PASSED FAILED NOT_RUN; no test at all is a failure
note() {
  local p=${2:-0} f=${3:-0} s=${4:-0}
  if [ $((p + f)) -eq 0 ]; then f=1; fi
  printf '%s\t%d\t%d\t%d\n' "$1" "$p" "$f" "$s" >> "$logs/rows/$lane"
}
say() { printf '%s\n' "$1" >> "$logs/rows/$lane"; } # a line without numbers: what did not run
count() { grep -oE "[0-9]+ $2" "$1" | tail -n 1 | grep -oE '^[0-9]+' || echo 0; }
# note_pytest NAME LOG EXIT: pytest's closing line; a crash without one is a failure
note_pytest() {
  local line
  line=$(mktemp)
  grep -E '[0-9]+ (passed|failed|errors?).* in [0-9.]+s' "$2" | tail -n 1 > "$line"
  local f=$(($(count "$line" failed) + $(count "$line" error)))
  if [ "$3" -ne 0 ] && [ "$f" -eq 0 ]; then f=1; fi
  note "$1" "$(count "$line" passed)" "$f" "$(count "$line" skipped)"
  rm -f "$line"
}
check() { # check NAME COMMAND...: a tool that passes or fails as a whole
  local name=$1
  shift
  if "$@"; then
    note "$name" 1 0
  else
    note "$name" 0 1
    return 1
  fi
}

google_tests() { # google_tests NAME PRESET [CMAKE OPTION...]
  local name=$1 preset=$2 log="$logs/ctest-$2.log" total bad skipped
  shift 2
  cmake --preset "$preset" -DCMAKE_CXX_COMPILER_LAUNCHER=ccache -DRISORIUS_BUILD_BINDINGS=OFF "$@" \
    > "$logs/cmake-$preset.log" 2>&1 &&
    cmake --build --preset "$preset" -j"$(nproc)" > "$logs/build-$preset.log" 2>&1 ||
    { tail -n 30 "$logs/build-$preset.log" && note "$name: does not build" 0 1 && return; }
  ctest --preset "$preset" -j"$(nproc)" > "$log" 2>&1
  tail -n 25 "$log"
  total=$(grep -oE 'out of [0-9]+' "$log" | tail -n 1 | grep -oE '[0-9]+' || echo 0)
  bad=$(grep -oE '[0-9]+ tests failed' "$log" | grep -oE '^[0-9]+' || echo 0)
  # CTest counts what skipped itself among those that passed.
  skipped=$(grep -c '\*\*\*Skipped' "$log")
  note "$name" $((total - bad - skipped)) "$bad" "$skipped"
  grep -oE 'This CPU has no [a-z0-9]+' "$logs/cmake-$preset.log" | sort -u |
    while read -r line; do say "$name: $line: NOT RUN"; done
}
run_cross() {
  local code name good bad
  "$project/packaging/cross.sh" > "$logs/cross.log" 2>&1
  code=$?
  while IFS=$'\t' read -r _ name good bad; do
    note "$name" "$good" "$bad"
  done < <(grep -P '^row\t' "$logs/cross.log")
  check "cross.sh" [ "$code" -eq 0 ] || tail -n 40 "$logs/cross.log"
}
run_fuzzers() { # run_fuzzers SECONDS
  local code target executions finds
  "$project/packaging/fuzz.sh" --each "$1" > "$logs/fuzz.log" 2>&1
  code=$?
  # A row: target, executions, each second, coverage, corpus, finds.
  while read -r target executions _ _ _ finds; do
    note "fuzz $target, $executions runs" $((finds == 0)) $((finds > 0))
  done < <(grep -E '^[a-z_]+ +[0-9]+ +[0-9]+ +[0-9]+/' "$logs/fuzz.log")
  check "fuzz.sh" [ "$code" -eq 0 ] || tail -n 15 "$logs/fuzz.log"
}
native_lane() {
  lane=native
  step "GoogleTest"
  google_tests "GoogleTest" dev -DPython_EXECUTABLE="$python"
  step "GoogleTest with sanitizers"
  ASAN_OPTIONS=detect_leaks=1 google_tests "GoogleTest, ASan, UBSan, leaks" asan-ubsan
  step "one Rig under eight threads"
  google_tests "thread sanitizer, one Rig" tsan
  step "other compilers, systems and processors"
  run_cross
  step "fuzz targets, 20 s each"
  run_fuzzers 20
  step ""
}

run_blender() { # run_blender NAME COMMAND...
  local name=$1 log user code
  log="$logs/blender-$(echo "$name" | tr -c 'a-zA-Z0-9.\n' '-').log"
  shift
  # A throw-away user folder: a Blender program reads it before the tests could set it.
  user=$(mktemp -d)
  BLENDER_USER_RESOURCES="$user" timeout -s KILL 2400 "$@" > "$log" 2>&1
  code=$?
  rm -rf "$user"
  tail -n 12 "$log"
  note_pytest "$name" "$log" "$code"
}
run_subsets() { # what differs most between versions: installing, building, keys and actions, odd files
  local subset=() group version other
  for group in extension vertices controls frames failures animation_import bake past; do
    subset+=("blender_tests/test_$group.py")
  done
  for version in 4.2.23 5.0.1; do
    step "a fast subset in bpy $version"
    if other=$(bpy_venv "$version" 90); then
      run_blender "bpy $version, fast subset" "$other" blender_tests/run.py -- --extension "$zip" \
        "${subset[@]}"
    else
      say "bpy $version could not be fetched: NOT RUN"
    fi
  done
  say "NOT RUN here: all tests in bpy 4.2, 5.0 and Blender 4.3.2, 5.2.2 (packaging/matrix.sh)"
}
run_program() { # run_program BLENDER: a program of 4.2 or newer
  local version
  version=$(timeout -s KILL 60 "$1" --version 2> /dev/null | grep -oE '^Blender [0-9.]+' | head -n 1)
  if [ -z "$version" ]; then
    note "$1 (does not start)" 0 1
  elif [ "$(printf '%s\n4.2\n' "${version#Blender }" | sort -V | head -n 1)" != 4.2 ]; then
    say "$version at $1 is older than 4.2: NOT RUN"
  else
    check "manifest, $version" timeout -s KILL 60 "$1" --factory-startup --command extension \
      validate "$zip"
    run_blender "$version" "$1" -b --factory-startup -noaudio --python-exit-code 1 \
      --python blender_tests/run.py -- --extension "$zip"
  fi
}
run_style() {
  check "ruff check" "$venv/bin/ruff" check native addon tests blender_tests packaging
  check "ruff format" "$venv/bin/ruff" format --check -q native addon tests blender_tests packaging
  check "clang-format" sh -c \
    "find native tests -name '*.h' -o -name '*.cpp' | xargs '$venv/bin/clang-format' --dry-run -Werror"
  check "mypy of the package" "$venv/bin/mypy" --no-error-summary -p risorius
  check "mypy of addon/logic" "$venv/bin/mypy" --no-error-summary --explicit-package-bases \
    --follow-imports=silent addon/risorius/logic
  check "pyright of the add-on" "$venv/bin/pyright"
}
python_lane() {
  local version blender
  lane=python
  step "wheel" && check "wheel" build_wheel || return
  step "extension" && check "extension" build_extension || return
  zip=$(ls "$project"/build/dist/risorius-*.zip)
  step "style"
  run_style
  step "Python tests"
  "$python" -m pytest -q -rs tests > "$logs/pytest.log" 2>&1
  note_pytest "Python $("$python" -c 'import platform; print(platform.python_version())')" \
    "$logs/pytest.log" $?
  tail -n 15 "$logs/pytest.log"
  step "Blender tests in bpy"
  version=$("$python" -c 'import importlib.metadata as m; print(m.version("bpy"))')
  run_blender "bpy $version" "$python" blender_tests/run.py -- --extension "$zip"
  run_subsets
  for blender in $(printf '%s\n' "${BLENDER:-}" "$(command -v blender || true)" | sort -u); do
    step "Blender tests in $blender"
    run_program "$blender"
  done
  step ""
}

step "tools" && install_packages clang-14 libclang-rt-14-dev googletest g++-aarch64-linux-gnu qemu-user &&
  make_venv || exit 1
step ""
# What a lane says comes with its name in front.
native_lane 2>&1 | sed -u 's/^/native: /' &
python_lane 2>&1 | sed -u 's/^/python: /' &
wait

echo
echo "What ran where:"
awk -F'\t' '
  NF == 4 { printf "  %-34s %6d passed %4d failed %4d not run\n", $1, $2, $3, $4; p += $2; f += $3; next }
  { print "  " $0 }
  END { print p + 0, f + 0 > totals }
' totals="$logs/rows/totals" "$logs"/rows/*
grep -h 'EXTRA NOT RUN' "$logs"/*.log | sort -u | sed 's/^/  /' || true
read -r passed failed < "$logs/rows/totals"
for lane in native python; do # a lane that ended before its first row
  [ -s "$logs/rows/$lane" ] || { echo "  the lane $lane did not run" && failed=$((failed + 1)); }
done
echo
echo "$((SECONDS - _begin)) s in all"
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
