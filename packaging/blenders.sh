#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Makes a real Blender 4.3.2 (Python 3.13) from Debian trixie in a chroot, for the version matrix.
# Needs root and debootstrap on Debian; about 3 minutes and 1.5 GB. Not part of the default tests.
#
#   ./packaging/blenders.sh [FOLDER]      makes it and prints the path of a `blender` to use as
#                                         BLENDER=...; puts a wheel for its Python into build/dist,
#                                         which the extension's zip then holds too
set -euo pipefail
root=${1:-/opt/risorius-blender-trixie}
source "$(dirname "$0")/setup.sh"
make_venv >&2

if [ ! -e "$root/usr/bin/apt-get" ]; then
  debootstrap --variant=minbase trixie "$root" >&2
fi
mountpoint -q "$root/proc" || mount -t proc proc "$root/proc"
mountpoint -q "$root/dev" || mount --bind /dev "$root/dev"
for folder in "$project" /tmp; do
  mkdir -p "$root$folder"
  mountpoint -q "$root$folder" || mount --bind "$folder" "$root$folder"
done
if [ ! -x "$root/usr/bin/blender" ]; then
  chroot "$root" sh -c 'apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq \
    --no-install-recommends blender python3-dev python3-numpy python3-venv python3-pip python3-pytest \
    g++ cmake ninja-build nlohmann-json3-dev ca-certificates xvfb imagemagick libgl1-mesa-dri' >&2
fi

# The wheel: its build tools are plain Python, so they are fetched here, where pip is set up.
tools="$project/build/tools"
"$python" -m pip download -q -d "$tools" scikit-build-core pybind11 >&2
rm -f "$project"/build/dist/risorius-*-cp313-*.whl
chroot "$root" sh -ec "
  [ -e /opt/risorius-venv/bin/pip ] || python3 -m venv /opt/risorius-venv
  /opt/risorius-venv/bin/pip install -q --no-index --find-links '$tools' scikit-build-core pybind11
  cd '$project' && PATH=/opt/risorius-venv/bin:/usr/bin:/bin /opt/risorius-venv/bin/pip wheel -q \
    --no-build-isolation --no-deps --no-index -w build/dist ." >&2

launcher="$root/blender.sh"
cat > "$launcher" <<EOF
#!/bin/sh
exec chroot "$root" /usr/bin/env -C "\$PWD" /usr/bin/blender "\$@"
EOF
chmod +x "$launcher"
echo "$launcher"
