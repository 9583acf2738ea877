#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# From nothing to a face that speaks, smiles and shouts: builds, makes the sample person, installs the
# extension into Blender (bpy 4.5, or BLENDER=/path/to/blender), keys some acting and renders it.
set -euo pipefail
source "$(dirname "$0")/films/film.sh"

begin_film demo
step "sample person"
# It is the man whom the zip carries: to find his joints twice would take a minute or two more.
sample=$(sample_face)
cp "$sample/man.dna" "$out/sample.dna"
rm -rf "$out/sample_textures" && cp -r "$sample/man_textures" "$out/sample_textures"
step "Blender: import, act, render"
fresh_blender
arguments=(-- --extension "$zip" --dna "$out/sample.dna" --out "$out")
if [ -n "${BLENDER:-}" ]; then
  run=("$BLENDER" -b --factory-startup -noaudio --python-exit-code 1 --python
    "$project/packaging/films/demo.py")
else
  run=("$python" "$project/packaging/films/demo.py")
fi
shown "$out/blender.log" limited 14400 "${run[@]}" "${arguments[@]}"
step "contact sheet and film"
"$python" "$project/packaging/films/sheet.py" "$out/sheet" "$out/contact_sheet.png"
rate=12 crf=17 end_film 1 demo.mp4
tell contact_sheet.png demo.mp4 demo.blend sample.dna
