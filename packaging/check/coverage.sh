#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# coverage.sh: lists the lines that no test runs, by file and function. gcovr counts native/ in GoogleTest and
# the Python tests. coverage.py counts the package and the add-on in the Python tests and in the Blender tests
# of bpy 4.5. Prints the list and writes it to build/coverage/never_run.txt; docs/development.md gives the
# reasons. A failed test is shown, and its lines count. Not part of test.sh.
set -euo pipefail
source "$(dirname "$0")/../setup.sh"
cd "$project"
out="$project/build/coverage"
mkdir -p "$out"
# Left out, because they run the same few lines for minutes without optimisation.
slow=(tests/python/rigs/test_rig_behavior.py tests/python/rigs/test_rig_golden.py
  tests/python/rigs/test_rig_thousand.py tests/faults tests/mutants
  blender_tests/extension/test_hostile.py blender_tests/extension/test_soak.py)
changed_bytes='EveryByte|EveryPatched|EveryChangedByte|ChangedBytes|CutAtEvery|Changes.*Reads'

# counted FOLDER ARGUMENT...: runs Python with the package in FOLDER; coverage.py counts its lines
counted() {
  local folder=$1
  shift
  COVERAGE_RCFILE="$project/packaging/check/coverage.ini" PYTHONPATH="$folder" RISORIUS_TEST_PATH="$folder" \
    limited 5400 "$python" -m coverage run --rcfile packaging/check/coverage.ini "$@" \
    "${slow[@]/#/--ignore=}"
}

step "tools" && install_packages && make_venv && quality_tools
step "build"
cmake --preset coverage -DPython_EXECUTABLE="$python" -DCMAKE_CXX_COMPILER_LAUNCHER=ccache \
  > "$out/cmake.log"
cmake --build --preset coverage -j"$(nproc)" > "$out/build.log" ||
  { tail -n 30 "$out/build.log" && exit 1; }
build_wheel
find "$out" -name '*.gcda' -delete
rm -rf "$out/data" "$out/native_counts" "$out/quick"
mkdir -p "$out/data" "$out/native_counts" "$out/quick"
# Two copies of the package: with the instrumented module, and with the wheel's module for Blender. Blender's
# tests end with os._exit, so native lines cannot be counted in them.
cp -r native/python/risorius native/python/risorius_people "$out/native_counts/"
cp "$(find "$out/native" -name '_native*.so')" "$out/native_counts/risorius/"
cp -r native/python/risorius native/python/risorius_people "$out/quick/"
cp "$venv"/lib/python*/site-packages/risorius/_native*.so "$out/quick/risorius/"
step "GoogleTest"
timeout 3600 ctest --preset coverage -j"$(nproc)" -E "$changed_bytes" > "$out/ctest.log" || tail -n 20 "$out/ctest.log"
step "Python tests"
counted "$out/native_counts" -m pytest -q tests > "$out/pytest.log" 2>&1 || tail -n 20 "$out/pytest.log"
step "Blender tests"
counted "$out/quick" blender_tests/run.py > "$out/blender.log" 2>&1 || tail -n 20 "$out/blender.log"
step "report"
"$python" -m coverage combine -q --rcfile packaging/check/coverage.ini
"$python" -m coverage json -q --rcfile packaging/check/coverage.ini -o "$out/python.json"
"$venv/bin/gcovr" --root "$project" --object-directory "$out" --filter native/ -j "$(nproc)" \
  --merge-mode-functions separate --json "$out/native.json" "$out/native" "$out/tests" \
  > "$out/gcovr.log" 2>&1 || { tail -n 20 "$out/gcovr.log" && exit 1; }
"$python" packaging/check/never_run.py "$out/native.json" "$out/python.json" | tee "$out/never_run.txt"
step ""
