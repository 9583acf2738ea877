#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# wheels.sh: builds the released wheels for all systems on this machine, in build/wheels. zig compiles and
# links them with CMake and the toolchain of cross.sh; pip and scikit-build-core pack them. Independent
# tools inspect each wheel (cross/inspect_wheel.py). Linux wheels are also imported.
# build/wheels/facts.tsv records the results (cross/facts.py).
# Prints rows `row<TAB>name<TAB>passed<TAB>failed`; exit code 0 only if nothing failed.
#
#   wheels.sh [--twice] [--tests] [PLATFORM[=PYTHON]...]
#       PLATFORM: linux-x64, windows-x64, windows-arm64, macos-arm64, macos-x64 or sdist; default: all.
#       linux-x64=3.13 builds for this Python only. --twice: builds each wheel again in another folder
#       without a cache; the bytes must be equal. --tests: runs the Python tests of files, locks, threads and
#       commands with the Linux wheels (windows_wheels.sh does this with the Windows wheels)
set -uo pipefail
source "$(dirname "$0")/../setup.sh"
source "$project/packaging/ship/cross/zig.sh"
source "$project/packaging/ship/cross/pythons.sh"

declare -A versions=([linux-x64]="3.11 3.13 3.14" [windows-x64]="3.11 3.13" [windows-arm64]="3.11 3.13"
  [macos-arm64]="3.11 3.13" [macos-x64]="3.11")
declare -A target_of=([linux-x64]=x86_64-linux-gnu.2.28 [windows-x64]=x86_64-windows-gnu
  [windows-arm64]=aarch64-windows-gnu [macos-arm64]=aarch64-macos.11.0 [macos-x64]=x86_64-macos.11.0)
declare -A label_of=([linux-x64]=manylinux_2_28_x86_64 [windows-x64]=win_amd64 [windows-arm64]=win_arm64
  [macos-arm64]=macosx_11_0_arm64 [macos-x64]=macosx_11_0_x86_64)
all=(linux-x64 windows-x64 windows-arm64 macos-arm64 macos-x64)
wheels="$project/build/wheels"
logs="$project/build/logs/wheels"
facts="$wheels/facts.tsv"
twice=
tests=
platforms=()
for word; do
  case $word in
    --twice) twice=yes ;;
    --tests) tests=yes ;;
    sdist) platforms+=(sdist) ;;
    *)
      [[ -n "${versions[${word%=*}]:-}" && ($word != *=* || " ${versions[${word%=*}]} " == *" ${word#*=} "*) ]] || {
        echo "wheels.sh: $word is none of --twice, --tests, sdist, ${all[*]}, or of no Python of theirs" >&2 && exit 2
      }
      platforms+=("$word")
      ;;
  esac
done
[ ${#platforms[@]} -gt 0 ] || platforms=("${all[@]}" sdist)
failed=0
# Files in a wheel get the time of the commit, so that two builds give the same bytes.
export SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git -C "$project" log -1 --format=%ct)}

row() { # row NAME COMMAND...: runs the command, writes its output to a log and prints a row
  local name=$1 log="$logs/${1//[^a-zA-Z0-9.]/-}.log"
  shift
  if "$@" > "$log" 2>&1; then
    printf 'row\t%s\t1\t0\n' "$name"
  else
    failed=1
    tail -n 30 "$log"
    printf 'row\t%s\t0\t1\n' "$name"
    return 1
  fi
}
fact() { # fact PLATFORM PYTHON COLUMN TEXT: appends a line to facts.tsv; the last line of a cell counts
  printf '%s\t%s\t%s\t%s\n' "$@" >> "$facts"
}

forget() { # forget PLATFORM PYTHON: removes the lines of an older wheel from facts.tsv
  grep -vP "^$1\t$2\t" "$facts" > "$facts.new"
  mv "$facts.new" "$facts"
}

# options PLATFORM PYTHON: prints CMake's options, one per line
options() {
  local include library=
  case $1 in
    linux-* | macos-*) include=$(unix_headers "${1%%-*}" "$2") || return 1 ;;
    windows-*)
      include=$(windows_python "$2") || return 1
      library="$include/libs/python${2/./}.lib"
      if [ "$1" = windows-arm64 ]; then
        library="$pythons/$1-$2/python${2/./}.lib"
        arm64_library "$2" "$(dirname "$library")" >&2 || return 1
      fi
      include="$include/include"
      ;;
  esac
  printf '%s\n' "RISORIUS_TARGET=${target_of[$1]}" "RISORIUS_TOOLS=$tools" "RISORIUS_PREFIX=$prefix" \
    RISORIUS_WARNINGS_AS_ERRORS=ON CMAKE_UNITY_BUILD=ON CMAKE_INTERPROCEDURAL_OPTIMIZATION=OFF \
    "CMAKE_CXX_FLAGS=-fno-sanitize=undefined -ffile-prefix-map=$source=." \
    "Python_INCLUDE_DIR=$include" "pybind11_DIR=$pybind11" CMAKE_CXX_COMPILER_LAUNCHER=ccache
  [ -z "$library" ] || echo "Python_LIBRARY=$library"
}
build() { # build PLATFORM PYTHON OUT: builds a wheel from the folder $source into the folder OUT
  local tag="cp${2/./}" defines
  defines=$(options "$1" "$2" | paste -sd ';') || return 1
  mkdir -p "$3"
  # CMake's cache would keep old flags. ccache makes the new build fast.
  rm -rf "$3/build-$1-$2" "$3/risorius-"*"-$tag-$tag-${label_of[$1]}.whl"
  SETUPTOOLS_EXT_SUFFIX=$("$inspect" suffix "$tag" "${label_of[$1]}") \
    SKBUILD_CMAKE_TOOLCHAIN_FILE="$project/packaging/ship/cross/toolchain.cmake" SKBUILD_CMAKE_PYTHON_HINTS=false \
    SKBUILD_WHEEL_TAGS="$tag-$tag-${label_of[$1]}" SKBUILD_CMAKE_DEFINE="$defines" \
    SKBUILD_BUILD_DIR="$3/build-$1-$2" CMAKE_BUILD_PARALLEL_LEVEL=${RISORIUS_JOBS:-$(nproc)} \
    "$build_python" -m pip wheel -q --no-build-isolation --no-deps -w "$3" "$source"
}
wheel_of() { echo "${3:-$wheels}"/risorius-*-"cp${2/./}-cp${2/./}-${label_of[$1]}.whl"; }

# a_python VERSION: prints the path of a Python program; its symbols are those that a module may import
a_python() {
  if [ -z "${suite_of[$1]:-}" ]; then
    echo "/usr/bin/python$1"
  else
    echo "$(debian_python "$1")/usr/bin/python$1"
  fi
}
inspected() { # inspected PLATFORM PYTHON
  local program said
  program=$(a_python "$2") || return 1
  said=$("$inspect" wheel "$(wheel_of "$1" "$2")" --python "$(realpath "$program")" --zig "$zig_lib") ||
    { echo "$said" && return 1; }
  echo "$said"
  fact "$1" "$2" "tags and contents" "$(echo "$said" | paste -sd ';' | sed 's/;/; /g')"
}
faults_found() { # faults_found PLATFORM PYTHON: checks that inspect_wheel.py detects planted faults
  "$build_python" "$project/packaging/ship/cross/plant_faults.py" "$(wheel_of "$1" "$2")" \
    --python "$(realpath "$(a_python "$2")")" --zig "$zig_lib"
}
scalar_bits= # hash of the scalar path's outputs with the first imported wheel
imported() { # imported PYTHON: imports the Linux wheel in Debian's Python of this version and tests it
  local said
  said=$(linux_run "$1" "$project/packaging/ship/cross/trial.py") || return 1
  echo "$said"
  [[ "$said" == *"; $(cpu_sets); "* ]] || { echo "the processor has $(cpu_sets)" && return 1; }
  # All Python versions must compute the same bits.
  [ "${said##*scalar }" = "${scalar_bits:=${said##*scalar }}" ] ||
    { echo "scalar bits of another Python: $scalar_bits" && return 1; }
  fact linux-x64 "$1" imported "$said"
}
same() { # same PLATFORM PYTHON: builds again in another folder, with a new ccache that all Pythons share
  source=$elsewhere CCACHE_DIR="${elsewhere%/*}/ccache" CCACHE_BASEDIR=$elsewhere build "$1" "$2" "$again" &&
    cmp "$(wheel_of "$1" "$2")" "$(wheel_of "$1" "$2" "$again")" &&
    fact "$1" "$2" "built twice" "same bytes"
}
copy_elsewhere() {
  elsewhere=$(mktemp -d)/risorius again="$wheels/again"
  rm -rf "$again"
  # Copies the files that git tracks, with uncommitted changes, and the page of web.sh.
  (cd "$project" && { git ls-files -z && find build/web -maxdepth 1 -name page.html -print0; } 2> /dev/null |
    xargs -0 cp --parents -t "$(mkdir -p "$elsewhere" && echo "$elsewhere")")
}

make_platform() { # make_platform PLATFORM[=PYTHON]
  local version name of=${versions[${1%=*}]}
  [ "$1" = "${1%=*}" ] || of=${1#*=}
  set -- "${1%=*}"
  for version in $of; do
    name="$1, Python $version"
    source=$project
    forget "$1" "$version"
    row "wheel, $name" build "$1" "$version" "$wheels" || continue
    fact "$1" "$version" built "$(basename "$(wheel_of "$1" "$version")"), sha256 $(sha256sum \
      "$(wheel_of "$1" "$version")" | cut -c1-16)"
    row "inspected, $name" inspected "$1" "$version"
    [ "$version" != 3.11 ] || row "planted faults are found, $1" faults_found "$1" "$version"
    [ "$1" != linux-x64 ] || row "imported, $name" imported "$version"
    [ "$1" != linux-x64 ] || [ -z "$tests" ] || row "tests, $name" tested "$version"
    [ -z "$twice" ] || row "same bytes twice, $name" same "$1" "$version"
  done
}
make_sdist() {
  rm -f "$wheels"/risorius-*.tar.gz
  # In the project folder, scikit-build-core would look at every file of build/. With wine's files that
  # takes a quarter of an hour.
  (cd "$elsewhere" && "$build_python" -c "from scikit_build_core.build import build_sdist; build_sdist('$wheels')")
}
sdist_builds() { # checks that the wheel built from the sdist equals the project's wheel byte for byte
  local work
  work=$(mktemp -d)
  tar -xzf "$wheels"/risorius-*.tar.gz -C "$work" && source=$(echo "$work"/risorius-*) &&
    build linux-x64 3.11 "$wheels/again" && cmp "$(wheel_of linux-x64 3.11 "$wheels/again")" "$(wheel_of linux-x64 3.11)"
  local code=$?
  rm -rf "$work"
  return $code
}

# linux_pip VERSION PACKAGE...: installs wheels for glibc 2.28 or older into the folder of this Python
linux_pip() {
  local version=$1
  shift
  "$build_python" -m pip install -q --target "$cross/try-$version" --only-binary :all: --implementation cp \
    --python-version "$version" --platform manylinux_2_28_x86_64 --platform manylinux_2_17_x86_64 "$@"
}
# linux_run VERSION ARGUMENT...: runs Debian's Python of this version with NumPy and the Linux wheel
linux_run() {
  local version=$1 root folder="$cross/try-$1" program=("/usr/bin/python$1") wheel
  wheel=$(wheel_of linux-x64 "$version")
  shift
  if [ "$(cat "$folder/.wheel" 2> /dev/null)" != "$(sha256sum "$wheel")" ]; then
    rm -rf "$folder"
    build_people_wheel "$wheels" &&
      linux_pip "$version" --no-deps "numpy==${numpy_of[$version]}" "$wheel" "$wheels"/risorius_people-*.whl || return 1
    sha256sum "$wheel" > "$folder/.wheel"
  fi
  if [ -n "${suite_of[$version]:-}" ]; then
    root=$(debian_python "$version") || return 1
    program=("$root/usr/lib/x86_64-linux-gnu/ld-linux-x86-64.so.2" --library-path
      "$root/usr/lib/x86_64-linux-gnu" "$root/usr/bin/python$version")
    export PYTHONHOME="$root/usr"
  fi
  # Tests that start a Python process must start this one with its own loader, so sys.executable is set.
  printf '#!/bin/sh\nexec %s "$@"\n' "${program[*]}" > "$folder/python" && chmod +x "$folder/python"
  printf 'import sys\n\nsys.executable = "%s"\n' "$folder/python" > "$folder/sitecustomize.py"
  PYTHONPATH=$folder "$folder/python" "$@"
}
declare -A numpy_of=([3.11]=1.26.4 [3.13]=2.3.5 [3.14]=2.3.5)
tested() { # tested PYTHON: runs the tests of cross/tests_of_the_system.txt
  local log="$logs/pytest-$1.log" said
  linux_pip "$1" -c <(grep -v ^numpy "$project/packaging/requirements.txt") \
    "numpy==${numpy_of[$1]}" pytest python-osc threadpoolctl xxhash matplotlib || return 1
  # One test needs PocketSphinx, which has no wheel for 3.14.
  (cd "$project" && RISORIUS_SHARED="$cross/none" PYTHONDONTWRITEBYTECODE=1 linux_run "$1" -m pytest -q \
    -p no:cacheprovider "${tests_of_the_system[@]}" \
    --deselect tests/python/cli/test_interrupts.py::test_an_interrupt_is_a_sentence_and_leaves_the_old_file) > "$log" 2>&1
  local code=$?
  said=$(tail -n 1 "$log")
  echo "$said"
  fact linux-x64 "$1" tests "${said% in *}"
  return $code
}

mkdir -p "$wheels" "$logs"
touch "$facts"
step "tools"
install_packages && get_zig "${target_of[@]}" && gather_headers || exit 1
{ grep -hE '^(scikit-build-core|pybind11|packaging)==' "$project/packaging/requirements.txt" &&
  cat "$project/packaging/ship/cross/inspect_requirements.txt"; } > "$cross/wheels.txt" &&
  pip_venv "$cross/wheels" "$cross/wheels.txt" || exit 1
build_python="$cross/wheels/bin/python"
printf '#!/bin/sh\nexec "%s" "%s" "$@"\n' "$build_python" "$project/packaging/ship/cross/inspect_wheel.py" \
  > "$tools/inspect" && chmod +x "$tools/inspect"
inspect="$tools/inspect"
PATH="$cross/wheels/bin:$PATH"
pybind11=$("$build_python" -m pybind11 --cmakedir)
zig_lib=$("$cross/venv/bin/python" -c \
  'import pathlib, ziglang; print(pathlib.Path(ziglang.__file__).with_name("lib"))')
copy_elsewhere
for platform in "${platforms[@]}"; do
  step "$platform"
  if [ "$platform" = sdist ]; then
    row "sdist" make_sdist && row "wheel of the sdist" sdist_builds
  else
    make_platform "$platform"
  fi
done
rm -rf "${elsewhere%/*}"
step ""
[ $failed -eq 0 ]
