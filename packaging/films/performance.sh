#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Renders one performance on two people. A voice made by espeak-ng becomes a clip on the man; the clip is
# saved and loaded on the woman, who has a coarser level of detail. Layers add idle life, a smile and the
# reaction to a flash. Leaves a film with sound, the clip and the .blend in build/performance.
set -euo pipefail
source "$(dirname "$0")/film.sh"
text="Good morning! One voice moves both of us, and we smile while we speak. Oh! That was bright."

begin_film performance
step "two people"
for person in man woman; do
  "$venv/bin/risorius" sample build --person "$person" "$out/$person.dna"
done
step "voice" && espeak-ng -v en-us -s 165 -p 45 -w "$out/voice.wav" "$text"
step "Blender: speak, smile, flinch"
fresh_blender
shown "$out/blender.log" limited 28800 "$python" "$project/packaging/films/performance.py" -- \
  --extension "$zip" --man "$out/man.dna" --woman "$out/woman.dna" --voice "$out/voice.wav" \
  --text "$text" --out "$out"
step "film"
end_film 1 performance.mp4 "$out/voice.wav"
tell performance.mp4 performance.rzc performance.blend
