# SPDX-License-Identifier: MIT
# Sourced by windows_wheels.sh and host.sh, after pythons.sh. Runs programs for Windows, such as Python, in
# wine. Sets: windows (a folder), wine (the program). Stops wine's services when the script ends.

windows="$project/build/windows"
export WINEPREFIX="$windows/prefix" WINEDEBUG=-all WINEDLLOVERRIDES="mscoree,mshtml=" WINEARCH=win64
wine=/usr/lib/wine/wine64 # path in Debian
trap '/usr/lib/wine/wineserver64 -k 2> /dev/null' EXIT # because wine's services would keep running
# Newer versions of NumPy use functions of the C library that wine 8 lacks.
declare -A numpy_of=([3.11]=1.26.4 [3.13]=2.1.3)

wine_is_ready() {
  [ -e "$windows/.made" ] && return 0
  rm -rf "$WINEPREFIX" && mkdir -p "$windows" && timeout -s KILL 600 "$wine" wineboot -i &&
    touch "$windows/.made"
}
windows_pip() { # windows_pip VERSION FOLDER ARGUMENT...: installs Windows wheels into FOLDER with this system's pip
  local version=$1 folder=$2
  shift 2
  "$cross/venv/bin/python" -m pip install -q --only-binary :all: --implementation cp --python-version "$version" \
    --platform win_amd64 --target "$folder" "$@"
}
# python_of VERSION FOLDER ARGUMENT...: runs Python in wine with the packages of FOLDER. Input and output
# are pipes, because Python in wine supports no other handles
python_of() {
  local version=$1 site=$2 folder
  folder=$(windows_python "$version") || return 1
  shift 2
  : | PYTHONPATH="Z:${site//\//\\}" PYTHONUTF8=0 timeout -s KILL 3600 "$wine" "$folder/python.exe" "$@" 2>&1 | cat
}
