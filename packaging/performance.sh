#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# One performance on two people: a voice made by espeak-ng becomes a clip, which plays on a man and,
# as a file, on a woman at a coarser level of detail; idle life, a smile and a flash of light lie over
# it. Leaves a film with sound, the clip and the .blend in build/performance.
set -euo pipefail
source "$(dirname "$0")/setup.sh"
out="$project/build/performance"
mkdir -p "$out"
text="Good morning! One voice moves both of us, and we smile while we speak. Oh! That was bright."

step "tools" && install_packages && make_venv
step "wheel" && build_wheel
step "extension"
zip=$(build_extension)
step "two people"
for person in man woman; do
  "$venv/bin/risorius" sample build --person "$person" "$out/$person.dna"
done
step "voice" && espeak-ng -v en-us -s 165 -p 45 -w "$out/voice.wav" "$text"
step "Blender: speak, smile, flinch"
export BLENDER_USER_RESOURCES="$out/blender-user"
rm -rf "$BLENDER_USER_RESOURCES"
shown "$out/blender.log" timeout -s KILL 14400 "$python" "$project/packaging/demo/performance.py" -- \
  --extension "$zip" --man "$out/man.dna" --woman "$out/woman.dna" --voice "$out/voice.wav" \
  --text "$text" --out "$out"
step "film"
ffmpeg -y -loglevel error -framerate 24 -i "$out/frames/frame_%04d.png" -i "$out/voice.wav" \
  -c:v libx264 -crf 20 -pix_fmt yuv420p -c:a aac -b:a 96k -movflags +faststart "$out/performance.mp4"
step ""
echo
echo "$((SECONDS - _begin)) s in all. Look at and listen to:"
for file in performance.mp4 performance.rzc performance.blend; do echo "  $out/$file"; done
