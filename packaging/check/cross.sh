#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# cross.sh: compiles native/ for other systems and processors: libraries for macOS and Windows, and
# GoogleTest programs for aarch64 Linux, which an emulator runs with each instruction set. Also compares the
# bits of the scalar path between compilers, optimisation levels and processors. Warnings are errors.
# Prints rows `row<TAB>name<TAB>passed<TAB>failed`; exit code 0 only if nothing failed.
#
#   cross.sh         only code that may depend on the processor or system; tests/layers/test_processors.py
#                    checks that the other folders do not
#   cross.sh --all   all libraries for macOS too, and all fast GoogleTests on aarch64
set -uo pipefail
source "$(dirname "$0")/../setup.sh"
source "$project/packaging/ship/cross/zig.sh"

out=$cross
logs="$project/build/logs/cross"
jobs=$(nproc)
# Tests of code that depends on the processor. Linux itself is tested elsewhere. The sanitizers' build tests
# that char may be unsigned, as on aarch64. hostile_test is left out, because it takes minutes in the emulator
# and its bytes have the same meaning on every processor.
programs=(byte_order_test simd_test rig_test)
of_macos=(risorius_core risorius_simd risorius_bytes)
case "${1:-}" in
  "") ;;
  --all) programs+=(core_test bytes_test threads_test compile_test dna_test dna_partial_test clip_test) of_macos=() ;;
  *) echo "cross.sh: $1 is not --all" >&2 && exit 2 ;;
esac
failed=0

row() { # row NAME PASSED FAILED: prints a row; zero tests count as a failure
  local bad=$3
  if [ $(($2 + $3)) -eq 0 ]; then bad=1; fi
  [ "$bad" -eq 0 ] || failed=1
  printf 'row\t%s\t%d\t%d\n' "$1" "$2" "$bad"
}
works() { # works NAME LOG COMMAND...: runs the command with its output in LOG, and prints a row
  local name=$1 log="$logs/$2.log"
  shift 2
  if "$@" > "$log" 2>&1; then
    row "$name" 1 0
  else
    tail -n 30 "$log"
    row "$name" 0 1
    return 1
  fi
}

google=/usr/src/googletest/googletest
build_google_test() {
  local name
  cp -rT "$google/include/gtest" "$prefix/include/gtest" || return 1
  for name in gtest gtest_main; do
    local source=$name
    [ $name = gtest ] && source=gtest-all
    ccache aarch64-linux-gnu-g++ -std=c++20 -O1 -I"$prefix/include" -I$google \
      -c "$google/src/$source.cc" -o "$out/$name.o" &&
      rm -f "$prefix/lib/lib$name.a" && ar qc "$prefix/lib/lib$name.a" "$out/$name.o" || return 1
  done
}

configure() { # configure TARGET FLAGS [OPTION...]
  local target=$1 flags=$2
  shift 2
  cmake -S "$project" -B "$out/$target" -G Ninja --toolchain "$project/packaging/ship/cross/toolchain.cmake" \
    -DRISORIUS_TARGET="$target" -DRISORIUS_TOOLS="$tools" -DRISORIUS_PREFIX="$prefix" \
    -DRISORIUS_BUILD_BINDINGS=OFF -DRISORIUS_BUILD_LIBRARY=OFF -DRISORIUS_WARNINGS_AS_ERRORS=ON -DCMAKE_BUILD_TYPE=None \
    -DCMAKE_CXX_FLAGS="$flags" -DCMAKE_CXX_COMPILER_LAUNCHER=ccache -DCMAKE_UNITY_BUILD=ON "$@"
}
# build_libraries TARGET [LIBRARY...]: compiles without optimisation, debug information and zig's checks of
# undefined behaviour, because only the warnings count. -c also applies to CMake's test program, which would
# take minutes to link.
build_libraries() {
  local target=$1
  shift
  configure "$target" "-c -O0 -g0 -fno-sanitize=undefined" &&
    cmake --build "$out/$target" -j"$jobs" ${1:+--target "$@"}
}
build_programs() {
  build_google_test &&
    configure aarch64-linux-gnu "-O1 -Wno-psabi -DRISORIUS_STRIDE=40" -DRISORIUS_BUILD_TESTS=ON -DRISORIUS_QUICK_BUILD_TESTS=ON &&
    cmake --build "$out/aarch64-linux-gnu" -j"$jobs" --target "${programs[@]}" scalar_bits
}
run_programs() {
  local log="$logs/ctest.log" total bad neon
  # Left out: the placeholder tests of programs that are not built, and a test that takes a minute here.
  ctest --test-dir "$out/aarch64-linux-gnu" -j"$jobs" -E 'NOT_BUILT|EveryPatchedByte' \
    --output-on-failure > "$log" 2>&1
  total=$(grep -oE 'out of [0-9]+' "$log" | grep -oE '[0-9]+' || echo 0)
  bad=$(grep -oE '[0-9]+ tests failed' "$log" | grep -oE '^[0-9]+' || echo 0)
  [ "$bad" -eq 0 ] || tail -n 40 "$log"
  row "GoogleTest, aarch64 in qemu" $((total - bad)) "$bad"
  # The test passes only if the rig reports the forced instruction set NEON.
  neon=$(grep -cE 'neon\.ForcedSimd\.EnvironmentReachesTheRig \.+ +Passed' "$log")
  row "NEON was executed" "$neon" 0
}

# scalar_bits NAME COMPILER FLAGS...: compiles `sources`, the arithmetic of the scalar path, with these flags,
# links them with the libraries of preset `tests`, and writes the program's hash to a file. Each folder of
# native/ is one unit.
sources=("$out/rig.cpp" "$out/compile.cpp" "$project"/native/simd/kernels_scalar.cpp
  "$project"/tests/rig/scalar_bits.cpp)
scalar_bits() {
  local folder="$out/bits-$1" compiler=$2
  shift 2
  rm -rf "$folder" && mkdir -p "$folder"
  printf '%s\n' "${sources[@]}" | xargs -P "$jobs" -I{} sh -c '
    folder=$1; file=$2; shift 2
    ccache "$@" -c "$file" -o "$folder/$(basename "$file" .cpp).o"' \
    sh "$folder" {} "$compiler" -std=c++20 -ffp-contract=off -I"$project/native" "$@" &&
    "$compiler" "$folder"/*.o $built/librisorius_{compile,rig,dna,bytes,simd,core}.a -pthread \
      -o "$folder/program" &&
    "$folder/program" > "$folder/hash"
}
built="$project/build/tests/native"
build_rest() {
  local folder
  for folder in rig compile; do
    find "$project/native/$folder" -name '*.cpp' | sort | sed 's/.*/#include "&"/' > "$out/$folder.cpp"
  done
  (cd "$project" && cmake --preset tests -DCMAKE_CXX_COMPILER_LAUNCHER=ccache &&
    cmake --build --preset tests -j"$jobs" --target risorius_compile)
}
same_bits() {
  local way wanted hash
  scalar_bits gcc-O0 g++ -O0 && scalar_bits gcc-O3 g++ -O3 -march=x86-64-v3 &&
    scalar_bits clang-O2 clang++-14 -O2 -march=x86-64-v3 && "$emulator" "$aarch64" > "$out/bits-aarch64" ||
    return 1
  wanted=$(cat "$out/bits-gcc-O0/hash")
  for way in gcc-O3/hash clang-O2/hash aarch64; do
    hash=$(cat "$out/bits-$way")
    echo "$way $hash, gcc-O0 $wanted"
    [ -n "$hash" ] && [ "$hash" = "$wanted" ] || return 1
  done
}
emulator=qemu-aarch64
aarch64="$out/aarch64-linux-gnu/tests/rig/scalar_bits"
# Checks that fused multiply-add changes the bits. Otherwise the equality above would prove nothing.
other_bits() {
  sources=("$project"/native/simd/kernels_scalar.cpp "$project"/tests/rig/scalar_bits.cpp)
  scalar_bits fused g++ -O2 -mfma -ffp-contract=fast &&
    ! cmp "$out/bits-fused/hash" "$out/bits-gcc-O0/hash"
}

mkdir -p "$out" "$logs"
step "tools" && install_packages clang-14 googletest g++-aarch64-linux-gnu qemu-user &&
  get_zig x86_64-windows-gnu aarch64-macos x86_64-macos && gather_headers || exit 1
step "x86_64-windows-gnu"
works "libraries, x86_64-windows-gnu" x86_64-windows-gnu build_libraries x86_64-windows-gnu
# The other folders depend on no system and no processor (tests/layers/test_processors.py), and zig has the
# same standard library for Windows and macOS.
step "aarch64-macos"
works "libraries, aarch64-macos" aarch64-macos build_libraries aarch64-macos "${of_macos[@]}"
step "x86_64-macos"
works "SIMD, x86_64-macos" x86_64-macos build_libraries x86_64-macos risorius_simd
unset CCACHE_COMPILERCHECK CCACHE_COMPILERTYPE
step "aarch64-linux-gnu"
works "GoogleTest for aarch64 builds" aarch64 build_programs && step "emulator" && run_programs
step "scalar bits"
works "scalar library" rest build_rest
works "scalar bits: gcc -O0 -O3, clang, aarch64" bits same_bits
works "scalar bits differ when fused" fused other_bits
step ""
[ $failed -eq 0 ]
