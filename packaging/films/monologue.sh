#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Renders a film of twenty seconds in which one person reads a letter. The acting uses the extension's
# operators: expressions, three lines of speech by espeak-ng, a gaze that follows an Empty, blinks, a
# dragged smirk, idle life. Leaves a film with sound and the .blend in build/monologue.
#
#   ./packaging/films/monologue.sh [--size PIXELS] [--only [FRAME...]]      --only: stills, no film
set -euo pipefail
source "$(dirname "$0")/film.sh"

begin_film monologue
step "the man"
person="$(sample_face)/man.dna"
step "voices"
voices=() sounds=() delays= labels=
while IFS=$'\t' read -r start speed text; do
  i=${#voices[@]}
  voices+=("$out/line$i.wav")
  espeak-ng -v en-us -s "$speed" -p 40 -w "$out/line$i.wav" "$text"
  sounds+=(-i "$out/line$i.wav")
  delays+="[$i]adelay=$start[s$i];"
  labels+="[s$i]"
done < <("$python" "$project/packaging/films/monologue_acting.py")
ffmpeg -y -loglevel error "${sounds[@]}" -filter_complex "$delays${labels}amix=inputs=${#voices[@]}:normalize=0,apad" -t 20 "$out/voice.wav"
step "Blender: read, hope, rejoice, remember"
fresh_blender
shown "$out/blender.log" limited 28800 "$python" "$project/packaging/films/monologue.py" -- \
  --extension "$zip" --dna "$person" --voices "${voices[@]}" --out "$out" "$@"
case " $* " in *" --only "*) exit 0 ;; esac
step "film"
end_film 1 monologue.mp4 "$out/voice.wav"
tell monologue.mp4 monologue.blend
