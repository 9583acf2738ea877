#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Makes a film of a face that speaks, smiles and shouts. Builds the wheel, the extension and the sample
# person, installs the extension into Blender (bpy 4.5, or BLENDER=/path/to/blender), keys the acting of
# films/acting.py and renders it.
set -euo pipefail
source "$(dirname "$0")/films/film.sh"

begin_film demo
step "sample person"
# The demo copies the man of the zip, because building him again would take one or two minutes.
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
