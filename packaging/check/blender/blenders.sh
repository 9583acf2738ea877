#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Makes real Blender programs in chroots for packaging/check/blender/matrix.sh: Debian trixie's Blender 4.3.2
# (Python 3.13), and the current Blender of Debian sid (5.2.2 LTS with Python 3.14 in November 2026). Needs
# root and debootstrap on Debian. Each takes 3 minutes on an idle machine, 18 minutes on two busy cores, and
# 1.5 GB. Not part of the default tests.
#
#   ./packaging/check/blender/blenders.sh [trixie|sid|all] [PREFIX]
#       makes PREFIX-trixie, PREFIX-sid or both, and prints the paths of the programs, one per line, to
#       use as BLENDER=... Also puts a wheel for each Python into build/dist, so that the extension's zip
#       contains it, and PocketSphinx into build/speech. Default: trixie, /opt/risorius-blender
set -euo pipefail
suites=${1:-trixie}
prefix=${2:-/opt/risorius-blender}
case $suites in
  all) suites="trixie sid" ;;
  trixie | sid) ;;
  *) echo "blenders.sh: $suites is none of trixie, sid, all" >&2 && exit 2 ;;
esac
if ! command -v debootstrap > /dev/null; then
  echo "blenders.sh: debootstrap is not installed: apt-get install debootstrap (as root)" >&2
  exit 1
fi
source "$(dirname "$0")/../../setup.sh"
make_venv >&2

make_system() { # make_system SUITE ROOT
  local uri
  uri=$(mirror)
  if [ ! -e "$2/.risorius-made" ]; then
    [ -x "$2/usr/bin/apt-get" ] || debootstrap --variant=minbase "$1" "$2" $uri
    touch "$2/.risorius-made"
  fi
  mountpoint -q "$2/proc" || mount -t proc proc "$2/proc"
  mountpoint -q "$2/dev" || mount --bind /dev "$2/dev"
  # /tmp is mounted first, because the project may be below /tmp.
  for folder in /tmp "$project"; do
    mkdir -p "$2$folder"
    [ "$folder" -ef "$2$folder" ] || mount --bind "$folder" "$2$folder"
  done
}

install_blender() { # install_blender SUITE ROOT
  local more=
  [ -x "$2/usr/bin/blender" ] && return 0
  # sid's Blender needs these packages for extensions and asset libraries, but does not depend on them.
  [ "$1" = sid ] && more="python3-cattr python3-requests"
  # A mirror may be a dated snapshot whose Valid-Until has passed.
  chroot "$2" sh -ec "export DEBIAN_FRONTEND=noninteractive
    apt-get -o Acquire::Check-Valid-Until=false update -qq
    apt-get install -y -qq --no-install-recommends blender python3-dev python3-numpy $more \
      python3-venv python3-pip python3-pytest g++ cmake ninja-build nlohmann-json3-dev libxxhash-dev libeigen3-dev \
      ca-certificates xvfb imagemagick libgl1-mesa-dri libegl1 libegl-mesa0"
}

build_wheel_in() { # build_wheel_in ROOT: builds a wheel in the chroot; pip outside fetches the build tools
  local tools="$project/build/tools" tag
  "$python" -m pip download -q -d "$tools" scikit-build-core pybind11
  tag=$(chroot "$1" python3 -c 'import sys; print("cp%d%d" % sys.version_info[:2])')
  rm -f "$project"/build/dist/risorius-*-"$tag"-*.whl
  # native/ also compiles sources from PyPI. Building a wheel outside the chroot fetches them.
  [ -e "$project/build/third_party/meshoptimizer/vertexfilter.cpp" ] || build_wheel >&2
  chroot "$1" sh -ec "
    [ -e /opt/risorius-venv/bin/pip ] || python3 -m venv /opt/risorius-venv
    /opt/risorius-venv/bin/pip install -q --no-index --find-links '$tools' scikit-build-core pybind11
    cd '$project' && PATH=/opt/risorius-venv/bin:/usr/bin:/bin /opt/risorius-venv/bin/pip wheel -q \
      --no-build-isolation --no-deps --no-index -w build/dist ."
}

fetch_recogniser() { # fetch_recogniser ROOT: gets PocketSphinx for the chroot's Python: PyPI's wheel, or a wheel compiled there
  local folder="$project/build/speech" tools="$project/build/tools" version pinned
  version=$(chroot "$1" python3 -c 'import sys; print("%d.%d" % sys.version_info[:2])')
  pinned=$(grep -oE 'pocketsphinx==[0-9.]+' "$project/pyproject.toml")
  ls "$folder"/pocketsphinx-*-cp"${version/./}"-*.whl > /dev/null 2>&1 && return 0
  "$python" -m pip download -q --no-deps --only-binary :all: --platform manylinux2014_x86_64 \
    --python-version "$version" -d "$folder" "$pinned" 2> /dev/null && return 0
  "$python" -m pip download -q --no-deps --no-binary :all: --no-build-isolation -d "$tools" "$pinned"
  "$python" -m pip download -q --only-binary :all: --platform any --abi none --python-version "$version" \
    -d "$tools" cython
  chroot "$1" sh -ec "
    /opt/risorius-venv/bin/pip install -q --no-index --find-links '$tools' cython
    cd '$project' && PATH=/opt/risorius-venv/bin:/usr/bin:/bin /opt/risorius-venv/bin/pip wheel -q \
      --no-build-isolation --no-deps --no-index -w build/speech '$tools'/${pinned/==/-}.tar.gz"
}

write_launcher() { # write_launcher ROOT: writes blender.sh, which runs the chroot's Blender from outside
  cat > "$1/blender.sh" << END
#!/bin/sh
exec chroot "$1" /usr/bin/env -C "\$PWD" /usr/bin/blender "\$@"
END
  chmod +x "$1/blender.sh"
}

for suite in $suites; do
  root=$prefix-$suite
  make_system "$suite" "$root" >&2
  install_blender "$suite" "$root" >&2
  build_wheel_in "$root" >&2
  fetch_recogniser "$root" >&2 || echo "blenders.sh: no PocketSphinx for $suite: its voice is not checked" >&2
  write_launcher "$root"
  echo "$root/blender.sh"
done
