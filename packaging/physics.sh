#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# The demo's acting with a scarf and a lock of hair that Blender simulates on the face: shows that
# simulations see the face of their own frame. Leaves a film and the .blend in build/physics.
set -euo pipefail
source "$(dirname "$0")/setup.sh"
out="$project/build/physics"
mkdir -p "$out"

step "tools" && install_packages && make_venv
step "wheel" && build_wheel
step "extension"
zip=$(build_extension)
step "sample person" && "$venv/bin/risorius" sample build "$out/sample.dna"
step "Blender: act, simulate, render"
export BLENDER_USER_RESOURCES="$out/blender-user"
rm -rf "$BLENDER_USER_RESOURCES"
shown "$out/blender.log" timeout -s KILL 7200 "$python" "$project/packaging/demo/physics.py" -- \
  --extension "$zip" --dna "$out/sample.dna" --out "$out"
step "film"
ffmpeg -y -loglevel error -framerate 24 -start_number 31 -i "$out/frames/frame_%04d.png" -c:v libx264 -crf 20 \
  -pix_fmt yuv420p -movflags +faststart "$out/physics.mp4"
step ""
echo
echo "$((SECONDS - _begin)) s in all. Look at:"
for file in physics.mp4 physics.blend; do echo "  $out/$file"; done
