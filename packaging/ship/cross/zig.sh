# SPDX-License-Identifier: MIT
# Sourced after setup.sh by the scripts that compile for other systems. Installs zig from PyPI and gathers
# the headers that native/ needs. Sets the folders cross, tools (compilers) and prefix (headers).

cross="$project/build/cross"
tools="$cross/tools"
prefix="$cross/prefix"

# pip_venv FOLDER REQUIREMENTS: makes a venv with the packages of a requirements file
pip_venv() {
  local stamp
  stamp="$1/.$(sha256sum "$2" | cut -c1-16)"
  [ -e "$stamp" ] && return 0
  python3 -m venv "$1" && "$1/bin/python" -m pip install -q -r "$2" && touch "$stamp"
}
# get_zig TARGET...: writes compilers for each target into $tools. Each is one program without arguments,
# because CMake and ccache expect that.
get_zig() {
  local zig name
  pip_venv "$cross/venv" "$project/packaging/ship/cross/requirements.txt" &&
    zig=$("$cross/venv/bin/python" -c \
      'import pathlib, ziglang; print(pathlib.Path(ziglang.__file__).with_name("zig"))') || return 1
  mkdir -p "$tools"
  for name in ar ranlib rc dlltool; do
    printf '#!/bin/sh\nexec "%s" %s "$@"\n' "$zig" $name > "$tools/$name"
  done
  for name; do
    printf '#!/bin/sh\nexec "%s" c++ -target %s "$@"\n' "$zig" "$name" > "$tools/$name-c++"
    printf '#!/bin/sh\nexec "%s" cc -target %s "$@"\n' "$zig" "$name" > "$tools/$name-cc"
  done
  chmod +x "$tools"/*
  export CCACHE_COMPILERTYPE=clang CCACHE_COMPILERCHECK
  CCACHE_COMPILERCHECK="string:$("$zig" version)"
}
# Copies the headers from this machine into $prefix, so that builds find no other file of this machine.
gather_headers() {
  mkdir -p "$prefix/include" "$prefix/lib" "$prefix/share/cmake" &&
    cp -rT /usr/include/nlohmann "$prefix/include/nlohmann" &&
    cp /usr/include/xxhash.h "$prefix/include/" &&
    cp -rT /usr/include/eigen3 "$prefix/include/eigen3" &&
    cp -rT /usr/share/eigen3 "$prefix/share/eigen3" &&
    cp -rT /usr/share/cmake/nlohmann_json "$prefix/share/cmake/nlohmann_json"
}
