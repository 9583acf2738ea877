#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# host.sh: tests the installed C library. Installs it into an empty folder, builds the sample host of
# native/example against it with find_package, runs the host, and compares golden values through ctypes.
# Prints rows `row<TAB>name<TAB>passed<TAB>failed`; exit code 0 only if nothing failed.
#
#   host.sh             on this machine
#   host.sh --windows   also for Windows: compiled by zig and run in wine; the host must print the same text
set -uo pipefail
source "$(dirname "$0")/../setup.sh"
source "$project/packaging/check/works.sh"

out="$project/build/host"
logs="$project/build/logs/host"
golden="$project/tests/data/golden"
face="$golden/medium.dna"
run=() # prefix of commands that run a built program: empty, or wine
for_windows=
case "${1:-}" in
  "") ;;
  --windows) for_windows=yes ;;
  *) echo "host.sh: $1 is not --windows" >&2 && exit 2 ;;
esac

# install_library FOLDER [OPTION...]: builds the library and installs it into FOLDER/prefix
install_library() {
  local to=$1
  shift
  rm -rf "$to/prefix"
  # The options of preset `tests`, so that ccache has the objects.
  cmake -S "$project" -B "$to-library" -G Ninja -DCMAKE_BUILD_TYPE=Release -DRISORIUS_BUILD_BINDINGS=OFF -DCMAKE_UNITY_BUILD=ON \
    -DRISORIUS_WARNINGS_AS_ERRORS=ON -DCMAKE_CXX_COMPILER_LAUNCHER=ccache "$@" &&
    cmake --build "$to-library" -j"${RISORIUS_JOBS:-$(nproc)}" --target risorius_shared risorius_static &&
    cmake --install "$to-library" --prefix "$to/prefix"
}
# is_whole FOLDER LIST: checks that the installed files are exactly those of a list in check/host/
is_whole() {
  (cd "$1/prefix" && find . -type f -o -type l | sed 's|^\./||' | sed -E 's/\.so\.[0-9]+\.[0-9]+\.[0-9]+$/.so.VERSION/' |
    LC_ALL=C sort) | diff - "$project/packaging/check/host/$2"
}
# build_example FOLDER [OPTION...]: builds the sample host with the library installed in FOLDER/prefix
build_example() {
  local to=$1
  shift
  rm -rf "$to/example"
  cmake -S "$project/native/example" -B "$to/example" -G Ninja -DCMAKE_BUILD_TYPE=Release \
    -DCMAKE_PREFIX_PATH="$to/prefix" "$@" && cmake --build "$to/example"
}
# example_runs FOLDER [ENDING]: checks that the shared and the static host print the same text on the face
example_runs() {
  # The scalar path gives the same bits with every compiler, so the text is the same on every system.
  export RISORIUS_SIMD=scalar
  "${run[@]}" "$1/example/smile_risorius${2:-}" "$face" | tr -d '\r' > "$1/shared.txt" &&
    "${run[@]}" "$1/example/smile_static${2:-}" "$face" | tr -d '\r' > "$1/static.txt" && cat "$1/shared.txt" &&
    cmp "$1/shared.txt" "$1/static.txt" && [ "$(grep -c '^LOD' "$1/shared.txt")" -eq 4 ] &&
    grep -q 'joints: sum [1-9]' "$1/shared.txt"
  local code=$?
  unset RISORIUS_SIMD
  return $code
}
refuses() { # refuses FOLDER [ENDING]: checks that a truncated file gives one sentence and exit code 1
  local code
  head -c 3000 "$face" > "$1/cut.dna"
  "${run[@]}" "$1/example/smile_risorius${2:-}" "$1/cut.dna" 2> "$1/refused.txt"
  code=$?
  cat "$1/refused.txt" && [ $code -eq 1 ] && [ "$(wc -l < "$1/refused.txt")" -eq 1 ] &&
    grep -qE '^smile: (truncated|invalid_).* at byte [0-9]+' "$1/refused.txt"
}
# Checks that the header compiles by itself in C99 and C++11 with strict warnings.
header_compiles() {
  local header="$out/prefix/include/risorius.h"
  gcc -std=c99 -Wall -Wextra -Wstrict-prototypes -pedantic-errors -Werror -fsyntax-only -x c "$header" &&
    g++ -std=c++11 -Wall -Wextra -pedantic-errors -Werror -fsyntax-only -x c++ "$header"
}
agrees_with_golden() {
  "$python" "$project/packaging/check/host/golden.py" "$(find "$out/prefix" -name 'librisorius.so')" "$golden"
}

# The same for Windows.
windows_tools() {
  get_zig x86_64-windows-gnu && gather_headers && wine_is_ready && windows_python 3.11 > /dev/null &&
    { [ -e "$site/numpy" ] || windows_pip 3.11 "$site" --no-deps "numpy==${numpy_of[3.11]}"; }
}
windows_library() {
  local target=x86_64-windows-gnu there="$out/windows" site="$windows/site-host" toolchain run=("$wine")
  # -O0 applies to linking only. Otherwise zig would compile its C++ library again for the link step.
  toolchain=(--toolchain "$project/packaging/ship/cross/toolchain.cmake" "-DRISORIUS_TARGET=$target"
    "-DRISORIUS_TOOLS=$tools" -DCMAKE_SHARED_LINKER_FLAGS=-O0 -DCMAKE_EXE_LINKER_FLAGS=-O0)
  mkdir -p "$there"
  step "C library for Windows"
  works "C library, Windows: compiler and wine" windows-tools windows_tools &&
    works "C library, Windows: installed" windows-library install_library "$there" "${toolchain[@]}" \
      "-DRISORIUS_PREFIX=$prefix" "-DCMAKE_CXX_FLAGS=-fno-sanitize=undefined -ffile-prefix-map=$project=." || return
  works "C library, Windows: what is installed" windows-installed is_whole "$there" windows.txt
  works "sample host, Windows: built by find_package" windows-example build_example "$there" "${toolchain[@]}" \
    "-DRISORIUS_PREFIX=$there/prefix" -DCMAKE_C_FLAGS=-fno-sanitize=undefined -DCMAKE_CXX_FLAGS=-fno-sanitize=undefined || return
  cp "$there/prefix/bin/"*.dll "$there/example/" # Windows finds a DLL beside the program
  works "sample host in wine, shared and static" windows-run example_runs "$there" .exe &&
    works "sample host in wine says what it says here" windows-same cmp "$there/shared.txt" "$out/shared.txt"
  works "sample host in wine, a file cut short" windows-refused refuses "$there" .exe
  works "C library in wine through ctypes, golden values" windows-golden python_of 3.11 "$site" \
    "$project/packaging/check/host/golden.py" "Z:$there/prefix/bin/librisorius-1.dll" "Z:$golden"
}

mkdir -p "$out" "$logs"
step "tools" && install_packages ${for_windows:+wine64} && make_venv || exit 1
step "C library"
works "C library, installed" library install_library "$out" || exit 1
works "C library, what is installed" installed is_whole "$out" installed.txt
works "risorius.h in C99 and C++" header header_compiles
step "sample host"
works "sample host, built by find_package" example build_example "$out" &&
  works "sample host, shared and static" run example_runs "$out" &&
  works "sample host, a file cut short" refused refuses "$out"
works "C library through ctypes, golden values" golden agrees_with_golden
if [ -n "$for_windows" ]; then
  source "$project/packaging/ship/cross/zig.sh"
  source "$project/packaging/ship/cross/pythons.sh"
  source "$project/packaging/ship/cross/wine.sh"
  windows_library
fi
step ""
[ $failed -eq 0 ]
