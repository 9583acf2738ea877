#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# From nothing to a face that speaks, smiles and shouts: builds, makes the sample person, installs the
# extension into Blender (bpy 4.5, or BLENDER=/path/to/blender), keys some acting and renders it.
set -euo pipefail
source "$(dirname "$0")/setup.sh"
out="$project/build/demo"
mkdir -p "$out"

step "tools" && install_packages && make_venv
step "wheel" && build_wheel
step "extension"
zip=$(build_extension)
step "sample person" && "$venv/bin/risorius" sample build "$out/sample.dna"
step "Blender: import, act, render"
export BLENDER_USER_RESOURCES="$out/blender-user"
rm -rf "$BLENDER_USER_RESOURCES"
arguments=(-- --extension "$zip" --dna "$out/sample.dna" --out "$out")
if [ -n "${BLENDER:-}" ]; then
  run=("$BLENDER" -b --factory-startup -noaudio --python-exit-code 1 --python
    "$project/packaging/demo/demo.py")
else
  run=("$python" "$project/packaging/demo/demo.py")
fi
shown "$out/blender.log" timeout -s KILL 7200 "${run[@]}" "${arguments[@]}"
step "contact sheet and film"
"$python" "$project/packaging/demo/sheet.py" "$out/sheet" "$out/contact_sheet.png"
ffmpeg -y -loglevel error -framerate 24 -i "$out/frames/frame_%04d.png" -c:v libx264 -crf 17 \
  -pix_fmt yuv420p -movflags +faststart "$out/demo.mp4"
step ""
echo
echo "$((SECONDS - _begin)) s in all. Look at:"
for file in contact_sheet.png demo.mp4 demo.blend sample.dna; do echo "  $out/$file"; done
