#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Every test: native, Python, Blender (all in bpy 4.5 and in each `blender` of 4.2 or newer that is
# found on PATH or named by BLENDER=; a fast subset in bpy 4.2 and 5.0, where they can be fetched).
# Says at the end what ran where; packaging/matrix.sh runs all in all versions. Exit code 0 only if
# all passed.
set -uo pipefail
source "$(dirname "$0")/setup.sh"

table=()
passed=0
failed=0
# note NAME PASSED FAILED SKIPPED; no test at all is a failure
note() {
  local p=${2:-0} f=${3:-0} s=${4:-0}
  if [ $((p + f)) -eq 0 ]; then f=1; fi
  passed=$((passed + p))
  failed=$((failed + f))
  table+=("$(printf '%-34s %6d passed %4d failed %4d not run' "$1" "$p" "$f" "$s")")
}
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
logs="$project/build/logs"
mkdir -p "$logs"

step "tools" && install_packages && make_venv || exit 1
step "wheel" && build_wheel || exit 1
step "extension" && build_extension || exit 1

step "GoogleTest"
cd "$project"
google_tests() { # google_tests NAME PRESET [CMAKE OPTION...]
  local name=$1 preset=$2 total bad
  shift 2
  cmake --preset "$preset" -DCMAKE_CXX_COMPILER_LAUNCHER=ccache -DRISORIUS_BUILD_BINDINGS=OFF "$@" \
    > "$logs/cmake-$preset.log" 2>&1 &&
    cmake --build --preset "$preset" -j"$(nproc)" > "$logs/build-$preset.log" 2>&1 ||
    { tail -n 30 "$logs/build-$preset.log" && note "$name: does not build" 0 1 && return; }
  ctest --preset "$preset" -j"$(nproc)" > "$logs/ctest-$preset.log" 2>&1
  tail -n 25 "$logs/ctest-$preset.log"
  total=$(grep -oE 'out of [0-9]+' "$logs/ctest-$preset.log" | tail -n 1 | grep -oE '[0-9]+' || echo 0)
  bad=$(grep -oE '[0-9]+ tests failed' "$logs/ctest-$preset.log" | grep -oE '^[0-9]+' || echo 0)
  note "$name" $((total - bad)) "$bad"
}
google_tests "GoogleTest" dev -DPython_EXECUTABLE="$python"
step "GoogleTest with sanitizers"
ASAN_OPTIONS=detect_leaks=1 google_tests "GoogleTest, ASan, UBSan, leaks" asan-ubsan
step "one Rig under eight threads"
google_tests "thread sanitizer, one Rig" tsan

step "other compilers, systems and processors"
"$project/packaging/cross.sh" > "$logs/cross.log" 2>&1 && cross_exit=0 || cross_exit=$?
while IFS=$'\t' read -r _ name good bad; do
  note "$name" "$good" "$bad"
done < <(grep -P '^row\t' "$logs/cross.log")
check "cross.sh" [ "$cross_exit" -eq 0 ] || tail -n 40 "$logs/cross.log"

step "fuzz targets, 30 s each"
"$project/packaging/fuzz.sh" --each 30 > "$logs/fuzz.log" 2>&1 && fuzz_exit=0 || fuzz_exit=$?
# A row: target, executions, each second, coverage, corpus, finds.
rows=$(grep -E '^[a-z_]+ +[0-9]+ +[0-9]+ +[0-9]+/' "$logs/fuzz.log")
while read -r target executions _ _ _ finds; do
  [ -n "$target" ] || continue
  note "fuzz $target, $executions runs" $((finds == 0)) $((finds > 0))
done <<< "$rows"
check "fuzz.sh" [ "$fuzz_exit" -eq 0 ] || tail -n 15 "$logs/fuzz.log"

step "style"
check "ruff check" "$venv/bin/ruff" check native addon tests blender_tests packaging
check "ruff format" "$venv/bin/ruff" format --check -q native addon tests blender_tests packaging
check "clang-format" sh -c \
  "find native tests -name '*.h' -o -name '*.cpp' | xargs '$venv/bin/clang-format' --dry-run -Werror"
check "mypy of the package" "$venv/bin/mypy" --no-error-summary -p risorius
check "mypy of addon/logic" "$venv/bin/mypy" --no-error-summary --explicit-package-bases \
  --follow-imports=silent addon/risorius/logic

step "Python tests"
"$python" -m pytest -q -rs tests 2>&1 | tee "$logs/pytest.log" | tail -n 15
note_pytest "Python $("$python" -c 'import platform; print(platform.python_version())')" \
  "$logs/pytest.log" "${PIPESTATUS[0]}"

zip=$(ls "$project"/build/dist/risorius-*.zip)
run_blender() { # run_blender NAME COMMAND...
  local name=$1 log
  log="$logs/blender-$(echo "$name" | tr -c 'a-zA-Z0-9.\n' '-').log"
  shift
  # A throw-away user folder: a Blender program reads it before the tests could set it.
  local user code
  user=$(mktemp -d)
  BLENDER_USER_RESOURCES="$user" timeout -s KILL 900 "$@" > "$log" 2>&1
  code=$?
  rm -rf "$user"
  tail -n 12 "$log"
  note_pytest "$name" "$log" "$code"
}
step "Blender tests in bpy"
version=$("$python" -c 'import importlib.metadata as m; print(m.version("bpy"))')
run_blender "bpy $version" "$python" blender_tests/run.py -- --extension "$zip"

# What differs most between versions: installing, building, keys and actions, odd files.
subset=()
for group in extension vertices controls frames failures animation_import bake; do
  subset+=("blender_tests/test_$group.py")
done
for version in 4.2.23 5.0.1; do
  step "a fast subset in bpy $version"
  if other=$(bpy_venv "$version" 90); then
    run_blender "bpy $version, fast subset" "$other" blender_tests/run.py -- --extension "$zip" \
      "${subset[@]}"
  else
    table+=("bpy $version could not be fetched: not run")
  fi
done
table+=("not run here: all tests in bpy 4.2, 5.0 and Blender 4.3.2, 5.2.2 (packaging/matrix.sh)")

for blender in $(printf '%s\n' "${BLENDER:-}" "$(command -v blender || true)" | sort -u); do
  step "Blender tests in $blender"
  version=$(timeout -s KILL 60 "$blender" --version 2>/dev/null | grep -oE '^Blender [0-9.]+' | head -n 1)
  if [ -z "$version" ]; then
    note "$blender (does not start)" 0 1
  elif [ "$(printf '%s\n4.2\n' "${version#Blender }" | sort -V | head -n 1)" != 4.2 ]; then
    table+=("$version at $blender is older than 4.2: not run")
  else
    check "manifest, $version" timeout -s KILL 60 "$blender" --factory-startup --command extension \
      validate "$zip"
    run_blender "$version" "$blender" -b --factory-startup -noaudio --python-exit-code 1 \
      --python blender_tests/run.py -- --extension "$zip"
  fi
done

step ""
echo
echo "What ran where:"
printf '  %s\n' "${table[@]}"
grep -h 'EXTRA NOT RUN' "$logs"/*.log | sort -u | sed 's/^/  /' || true
echo
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
