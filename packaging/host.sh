#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# host.sh: the C library as other programs have it. It is installed into an empty folder; the sample
# host of native/example is built from there with find_package, and run; golden values are compared
# through ctypes.
# Prints rows `row<TAB>name<TAB>passed<TAB>failed`; exit code 0 only if nothing failed.
set -uo pipefail
source "$(dirname "$0")/setup.sh"
source "$project/packaging/works.sh"

out="$project/build/host"
logs="$project/build/logs/host"
golden="$project/tests/data/golden"
face="$golden/medium.dna"

# install_library FOLDER [OPTION...]: into FOLDER/prefix
install_library() {
  local to=$1
  shift
  rm -rf "$to/prefix"
  # As preset tests: ccache has these objects.
  cmake -S "$project" -B "$to-library" -G Ninja -DCMAKE_BUILD_TYPE=Release -DRISORIUS_BUILD_BINDINGS=OFF -DCMAKE_UNITY_BUILD=ON \
    -DRISORIUS_WARNINGS_AS_ERRORS=ON -DCMAKE_CXX_COMPILER_LAUNCHER=ccache "$@" &&
    cmake --build "$to-library" -j"$(nproc)" --target risorius_shared risorius_static && cmake --install "$to-library" --prefix "$to/prefix"
}
# What a packager would miss: a file more or less. The version of the files is the project's.
is_whole() {
  (cd "$out/prefix" && find . -type f -o -type l | sed 's|^\./||' | sed -E 's/\.so\.[0-9]+\.[0-9]+\.[0-9]+$/.so.VERSION/' |
    LC_ALL=C sort) | diff - "$project/packaging/host/installed.txt"
}
# build_example FOLDER [OPTION...]: of what FOLDER/prefix has, and of nothing else
build_example() {
  local to=$1
  shift
  rm -rf "$to/example"
  cmake -S "$project/native/example" -B "$to/example" -G Ninja -DCMAKE_BUILD_TYPE=Release \
    -DCMAKE_PREFIX_PATH="$to/prefix" "$@" && cmake --build "$to/example"
}
# Both ways of linking say the same, and it is the face of the file.
example_runs() {
  "$out/example/smile_risorius" "$face" > "$out/shared.txt" &&
    "$out/example/smile_static" "$face" > "$out/static.txt" && cat "$out/shared.txt" &&
    cmp "$out/shared.txt" "$out/static.txt" && [ "$(grep -c '^LOD' "$out/shared.txt")" -eq 4 ] &&
    grep -q 'joints: sum [1-9]' "$out/shared.txt"
}
refuses() { # refuses COMMAND...: a file that is cut short, in one sentence and with exit code 1
  head -c 3000 "$face" > "$out/cut.dna"
  "$@" "$out/cut.dna" 2> "$out/refused.txt"
  [ $? -eq 1 ] && cat "$out/refused.txt" && [ "$(wc -l < "$out/refused.txt")" -eq 1 ] &&
    grep -qE '^smile: (truncated|invalid_).* at byte [0-9]+' "$out/refused.txt"
}
# The header alone, in C99 and in C++, as strict as compilers are.
header_compiles() {
  local header="$out/prefix/include/risorius.h"
  gcc -std=c99 -Wall -Wextra -Wstrict-prototypes -pedantic-errors -Werror -fsyntax-only -x c "$header" &&
    g++ -std=c++11 -Wall -Wextra -pedantic-errors -Werror -fsyntax-only -x c++ "$header"
}
agrees_with_golden() {
  "$python" "$project/packaging/host/golden.py" "$(find "$out/prefix" -name 'librisorius.so')" "$golden"
}

mkdir -p "$out" "$logs"
step "tools" && install_packages && make_venv || exit 1
step "C library"
works "C library, installed" library install_library "$out" || exit 1
works "C library, what is installed" installed is_whole
works "risorius.h in C99 and C++" header header_compiles
step "sample host"
works "sample host, built by find_package" example build_example "$out" &&
  works "sample host, shared and static" run example_runs &&
  works "sample host, a file cut short" refused refuses "$out/example/smile_risorius"
works "C library through ctypes, golden values" golden agrees_with_golden
step ""
[ $failed -eq 0 ]
