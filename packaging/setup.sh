# SPDX-License-Identifier: MIT
# Sourced by the scripts of packaging/: tools, a private venv, the wheel and
# the extension's zip. Sets: project, venv, python, step "text" (says what begins and how long the
# last step took).

project=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
venv="$project/.venv"
python="$venv/bin/python"
export PIP_DISABLE_PIP_VERSION_CHECK=1 PYTHONDONTWRITEBYTECODE=1
export CCACHE_DIR="${CCACHE_DIR:-$HOME/.cache/ccache}"
# Builds in build/*/ share their objects, though each writes the files that it compiles together itself.
export CCACHE_BASEDIR="$project"
unset PYTHONPATH

_begin=$SECONDS
_last=$SECONDS
_title=
_cpu=0
stages= # a file: where `step` writes a row `time` for each stage, if it is named
# cpu_seconds: into `_now`, of this shell and of all that it waited for. `times` speaks of the shell
# that runs it, so it cannot stand in a substitution.
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

# shown LOG COMMAND...: what the command says goes into LOG; its lines that are indented, its progress,
# are seen at once, and the end of LOG if it fails.
shown() {
  local log=$1
  shift
  if ! { "$@" 2>&1 | tee "$log" | { grep --line-buffered -E '^    ' || true; }; }; then
    tail -n 30 "$log"
    return 1
  fi
}

# limited CPU_SECONDS COMMAND...: killed when it and its children have used so much CPU, or stand still.
# What has no limit by the clock passes on a busy machine too; bpy sometimes hangs at exit.
limited() { python3 "$project/packaging/check/limits.py" "$@"; }

install_packages() { # install_packages [MORE...]: what every build needs, and more
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

mirror() { # the Debian mirror that this machine's apt already uses, or nothing: debootstrap's own
  apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 2> /dev/null |
    grep -E '/debian/?$' | head -n 1 || true
}

make_venv() {
  local stamp
  stamp="$venv/.$(sha256sum "$project/packaging/requirements.txt" | cut -c1-16)"
  [ -e "$stamp" ] && return 0
  # bpy 4.5 is made for Python 3.11, Debian bookworm's own.
  local base=python3.11
  command -v $base > /dev/null || base=python3
  "$base" -m venv "$venv"
  "$python" -m pip install -q --no-compile -r "$project/packaging/requirements.txt"
  touch "$stamp"
}

quality_tools() { # clang-tidy, coverage.py and gcovr, which test.sh does without
  local stamp
  stamp="$venv/.quality-$(sha256sum "$project/packaging/check/quality_requirements.txt" | cut -c1-16)"
  [ -e "$stamp" ] && return 0
  "$python" -m pip install -q --no-compile -r "$project/packaging/check/quality_requirements.txt" && touch "$stamp"
}

# bpy_venv VERSION [SECONDS]: prints the Python of a venv with this bpy and pytest; it is made
# unless that takes longer. The project's own venv has the bpy of requirements.txt.
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

# build_people_wheel FOLDER: the wheel of the sample people, the same for every system
build_people_wheel() {
  rm -f "$1"/risorius_people-*.whl
  "$python" -m pip wheel -q --no-build-isolation --no-deps -w "$1" "$project/native/python/risorius_people"
}

# sample_face: prints the folder of the face that each zip carries; made again when its code changed.
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

# build_extension: a zip without the sample face is better than none where its data cannot be had;
# tests and release.sh say so.
build_extension() {
  local sample
  sample=$(sample_face) || sample=
  "$python" "$project/packaging/ship/build_extension.py" --wheels "$project"/build/dist/risorius-*.whl \
    --out "$project/build/dist" ${sample:+--sample "$sample"}
}
