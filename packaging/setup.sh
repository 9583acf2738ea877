# SPDX-License-Identifier: MIT
# Sourced by the scripts of packaging/. Sets the variables project (the clone's folder), venv and
# python, and defines functions that install packages and build the wheel and the extension's zip.
# `step TITLE` prints the title of the step that begins and the duration of the step before.

project=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
venv="$project/.venv"
python="$venv/bin/python"
export PIP_DISABLE_PIP_VERSION_CHECK=1 PYTHONDONTWRITEBYTECODE=1
export CCACHE_DIR="${CCACHE_DIR:-$HOME/.cache/ccache}"
# With a base folder, ccache shares compiled objects between the build folders build/*/. The sources of
# unity builds are written by each build folder itself, so they do not keep the objects apart.
export CCACHE_BASEDIR="$project"
unset PYTHONPATH

_begin=$SECONDS
_last=$SECONDS
_title=
_cpu=0
stages= # path of a file; if set, `step` appends a row `time TITLE SECONDS CPU_SECONDS` for each step
# cpu_seconds: sets `_now` to the CPU seconds of this shell and of the children that it waited for.
# `times` reports the shell that runs it, so it must not run in a command substitution.
cpu_seconds() {
  local file
  file=$(mktemp)
  times > "$file"
  _now=$(tr 'ms' '  ' < "$file" | awk '{ t += $1 * 60 + $2 + $3 * 60 + $4 } END { print int(t) }')
  rm -f "$file"
}
step() {
  cpu_seconds
  if [ -n "$_title" ]; then
    echo "--- $_title: $((SECONDS - _last)) s"
    [ -z "$stages" ] ||
      printf 'time\t%s\t%d\t%d\n' "$_title" $((SECONDS - _last)) $((_now - _cpu)) >> "$stages"
  fi
  _last=$SECONDS
  _cpu=$_now
  _title=$1
  [ -n "$1" ] && echo "=== $1 (at $((SECONDS - _begin)) s)"
  return 0
}

# shown LOG COMMAND...: writes the output of the command to LOG. Prints indented lines at once, because
# they report progress. Prints the last 30 lines of LOG if the command fails.
shown() {
  local log=$1
  shift
  if ! { "$@" 2>&1 | tee "$log" | { grep --line-buffered -E '^    ' || true; }; }; then
    tail -n 30 "$log"
    return 1
  fi
}

# limited CPU_SECONDS COMMAND...: kills the command if it and its children use more CPU than that, or
# if they use none for a while, because bpy sometimes hangs at exit. A limit of CPU time instead of
# wall time lets the command pass on a busy machine too.
limited() { python3 "$project/packaging/check/limits.py" "$@"; }

install_packages() { # install_packages [MORE...]: the Debian packages that every build needs, and MORE
  local missing=()
  for package in python3-venv python3-dev g++ cmake ninja-build ccache libgtest-dev libgmock-dev libbenchmark-dev \
    nlohmann-json3-dev libxxhash-dev libeigen3-dev espeak-ng ffmpeg libxrender1 libxi6 libxkbcommon0 libsm6 libgl1 libegl1 libxxf86vm1 \
    libxfixes3 assimp-utils "$@"; do
    dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed' ||
      missing+=("$package")
  done
  [ ${#missing[@]} -eq 0 ] && return 0
  if ! command -v apt-get > /dev/null || [ "$(id -u)" != 0 ]; then
    echo "please install: ${missing[*]}" >&2
    return 1
  fi
  apt-get update -qq
  DEBIAN_FRONTEND=noninteractive apt-get install -y -qq "${missing[@]}" > /dev/null
}

mirror() { # prints the Debian mirror of this machine's apt, or nothing: debootstrap then uses its default
  apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 2> /dev/null |
    grep -E '/debian/?$' | head -n 1 || true
}

make_venv() {
  local stamp
  stamp="$venv/.$(sha256sum "$project/packaging/requirements.txt" | cut -c1-16)"
  [ -e "$stamp" ] && return 0
  # bpy 4.5 needs Python 3.11, the Python of Debian bookworm.
  local base=python3.11
  command -v $base > /dev/null || base=python3
  "$base" -m venv "$venv"
  "$python" -m pip install -q --no-compile -r "$project/packaging/requirements.txt"
  touch "$stamp"
}

quality_tools() { # installs clang-tidy, coverage.py and gcovr, which test.sh does not need
  local stamp
  stamp="$venv/.quality-$(sha256sum "$project/packaging/check/quality_requirements.txt" | cut -c1-16)"
  [ -e "$stamp" ] && return 0
  "$python" -m pip install -q --no-compile -r "$project/packaging/check/quality_requirements.txt" && touch "$stamp"
}

# bpy_venv VERSION [SECONDS]: prints the Python of a venv with this version of bpy and with pytest.
# Makes the venv if it is missing, and fails if pip takes longer than SECONDS (default 600). If
# requirements.txt has the same version of bpy, this is the project's own venv.
bpy_venv() {
  local folder="$project/build/venv-bpy-$1" pytest
  grep -qx "bpy==$1" "$project/packaging/requirements.txt" && echo "$python" && return 0
  pytest=$(grep '^pytest==' "$project/packaging/requirements.txt")
  if [ ! -e "$folder/.made" ]; then
    python3.11 -m venv "$folder" >&2 &&
      timeout "${2:-600}" "$folder/bin/python" -m pip install -q --no-compile "bpy==$1" "$pytest" >&2 &&
      touch "$folder/.made" || return 1
  fi
  echo "$folder/bin/python"
}

build_wheel() {
  mkdir -p "$project/build/dist"
  rm -f "$project"/build/dist/risorius-*-cp311-*.whl
  build_people_wheel "$project/build/dist"
  CMAKE_CXX_COMPILER_LAUNCHER=ccache "$python" -m pip wheel -q --no-build-isolation --no-deps \
    -C cmake.define.RISORIUS_BUILD_RIG_BENCH=ON -w "$project/build/dist" "$project"
  "$python" -m pip install -q --no-deps --force-reinstall "$project"/build/dist/risorius-*-cp311-*.whl \
    "$project"/build/dist/risorius_people-*.whl &&
    cp "$project"/build/wheel-cp311-*/tests/bench/rig_bench "$venv/bin/"
}

# build_people_wheel FOLDER: builds the wheel of the sample people, one for all systems, into FOLDER
build_people_wheel() {
  rm -f "$1"/risorius_people-*.whl
  "$python" -m pip wheel -q --no-build-isolation --no-deps -w "$1" "$project/native/python/risorius_people"
}

# sample_face: prints the folder with the sample face that every extension zip contains. Builds the
# face again if the hash of its code changed.
sample_face() {
  local folder="$project/build/sample" code stamp
  code=$(cat "$project"/native/python/{risorius_people,risorius/author}/{,*/}*.{py,toml,npz} \
    "$project"/native/author/*{,/*}.{h,cpp} 2>/dev/null | sha256sum | cut -c1-16)
  stamp="$folder/.$code"
  if [ ! -e "$stamp" ]; then
    rm -rf "$folder" && mkdir -p "$folder" &&
      "$venv/bin/risorius" sample build "$folder/man.dna" --texture-size 1024 >&2 && touch "$stamp" || return 1
  fi
  echo "$folder"
}

# build_extension: builds the zip without the sample face if the data of the face cannot be downloaded,
# because such a zip still serves development. release.sh fails without the sample face.
build_extension() {
  local sample
  sample=$(sample_face) || sample=
  "$python" "$project/packaging/ship/build_extension.py" --wheels "$project"/build/dist/risorius-*.whl \
    --out "$project/build/dist" ${sample:+--sample "$sample"}
}
