#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# coverage.sh: the lines that no test runs, file by file: of native/ (gcovr) in GoogleTest and in the
# Python tests, of the package and of the add-on (coverage.py) in those and in the Blender tests of
# bpy 4.5. No part of test.sh. Leaves build/coverage/native.txt and build/coverage/python.txt.
set -euo pipefail
source "$(dirname "$0")/setup.sh"
cd "$project"
out="$project/build/coverage"
step "tools" && install_packages && make_venv && quality_tools
step "build"
cmake --preset coverage -DPython_EXECUTABLE="$python" -DCMAKE_CXX_COMPILER_LAUNCHER=ccache > /dev/null
cmake --build --preset coverage -j"$(nproc)" > "$out/build.log"
find "$out" -name '*.gcda' -delete
rm -rf "$out/data" "$out/python"
mkdir -p "$out/data" "$out/python"
# The package as it lies in the tree, with the module that counts.
cp -r native/python/risorius "$out/python/"
cp "$(find "$out/native" -name '_native*.so')" "$out/python/risorius/"
step "GoogleTest"
ctest --preset coverage -j"$(nproc)" > "$out/ctest.log" || tail -n 20 "$out/ctest.log"
step "Python tests"
counted=(env COVERAGE_RCFILE="$project/packaging/coverage.ini" PYTHONPATH="$out/python"
  RISORIUS_TEST_PATH="$out/python" "$python" -m coverage run --rcfile packaging/coverage.ini)
"${counted[@]}" -m pytest -q tests > "$out/pytest.log" || tail -n 20 "$out/pytest.log"
step "Blender tests"
timeout -s KILL 5400 "${counted[@]}" blender_tests/run.py > "$out/blender.log" ||
  tail -n 20 "$out/blender.log"
step "report"
"$python" -m coverage combine -q --rcfile packaging/coverage.ini
"$python" -m coverage report --rcfile packaging/coverage.ini > "$out/python.txt"
"$venv/bin/gcovr" --root "$project" --object-directory "$out" --filter native/ \
  --exclude-throw-branches --txt "$out/native.txt"
step ""
tail -n 1 "$out/python.txt"
tail -n 3 "$out/native.txt"
