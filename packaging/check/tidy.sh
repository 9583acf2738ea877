#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# tidy.sh [FILE...]: runs clang-tidy (version in quality_requirements.txt, checks in .clang-tidy) on native/ or
# on the given files. Exit code 0 only if it reports nothing. Not part of test.sh.
set -euo pipefail
source "$(dirname "$0")/../setup.sh"
cd "$project"
step "tools" && install_packages clang-14 && make_venv && quality_tools
step "compile commands"
cmake --preset tidy -DPython_EXECUTABLE="$python" > /dev/null
step "clang-tidy"
files=("$@")
[ $# -gt 0 ] || mapfile -t files < <(find native -name '*.cpp' | sort)
code=0
printf '%s\n' "${files[@]}" |
  xargs -P "$(nproc)" -n 1 "$venv/bin/clang-tidy" -p build/tidy --quiet 2> build/tidy/said.log || code=1
step ""
exit $code
