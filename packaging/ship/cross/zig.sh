# SPDX-License-Identifier: MIT
# Sourced by cross.sh and wheels.sh, after setup.sh: the compiler for other systems, of PyPI, and the
# packages of headers that native/ needs. Sets: cross (a folder), tools, prefix.

cross="$project/build/cross"
tools="$cross/tools"
prefix="$cross/prefix"

# pip_venv FOLDER REQUIREMENTS: a venv with exactly these
pip_venv() {
  local stamp
  stamp="$1/.$(sha256sum "$2" | cut -c1-16)"
  [ -e "$stamp" ] && return 0
  python3 -m venv "$1" && "$1/bin/python" -m pip install -q -r "$2" && touch "$stamp"
}
# get_zig TARGET...: compilers of each target in $tools, as CMake and ccache want them: one program each
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
# Of the machine that compiles: nothing else of it may be found.
gather_headers() {
  mkdir -p "$prefix/include" "$prefix/lib" "$prefix/share/cmake" &&
    cp -rT /usr/include/nlohmann "$prefix/include/nlohmann" &&
    cp /usr/include/xxhash.h "$prefix/include/" &&
    cp -rT /usr/include/eigen3 "$prefix/include/eigen3" &&
    cp -rT /usr/share/eigen3 "$prefix/share/eigen3" &&
    cp -rT /usr/share/cmake/nlohmann_json "$prefix/share/cmake/nlohmann_json"
}
