# SPDX-License-Identifier: MIT
# Sourced by windows_wheels.sh and host.sh, after pythons.sh: programs for Windows are run by wine, Python
# among them. Sets: windows (a folder), wine; its services end with the script.

windows="$project/build/windows"
export WINEPREFIX="$windows/prefix" WINEDEBUG=-all WINEDLLOVERRIDES="mscoree,mshtml=" WINEARCH=win64
wine=/usr/lib/wine/wine64 # where Debian has it
trap '/usr/lib/wine/wineserver64 -k 2> /dev/null' EXIT # its services would outlive us
# Newer ones use functions of the C library that wine 8 lacks.
declare -A numpy_of=([3.11]=1.26.4 [3.13]=2.1.3)

wine_is_ready() {
  [ -e "$windows/.made" ] && return 0
  rm -rf "$WINEPREFIX" && mkdir -p "$windows" && timeout -s KILL 600 "$wine" wineboot -i &&
    touch "$windows/.made"
}
windows_pip() { # windows_pip VERSION FOLDER ARGUMENT...: as pip takes it for this Windows: the tags are tried so
  local version=$1 folder=$2
  shift 2
  "$cross/venv/bin/python" -m pip install -q --only-binary :all: --implementation cp --python-version "$version" \
    --platform win_amd64 --target "$folder" "$@"
}
# python_of VERSION FOLDER ARGUMENT...: Python in wine with the packages of FOLDER; it knows no handles
# but those of pipes
python_of() {
  local version=$1 site=$2 folder
  folder=$(windows_python "$version") || return 1
  shift 2
  : | PYTHONPATH="Z:${site//\//\\}" PYTHONUTF8=0 timeout -s KILL 3600 "$wine" "$folder/python.exe" "$@" 2>&1 | cat
}
