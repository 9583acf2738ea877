#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Renders the six sample people, each at three levels of detail, with one action. Builds the people, keys
# the demo's acting on the first face, and assigns the same action to the others. Leaves a film in
# build/cast.
set -euo pipefail
source "$(dirname "$0")/film.sh"

begin_film cast
step "six people"
faces=()
for person in man woman girl lady fighter elder; do
  faces+=("$out/$person.dna")
  [ -e "$out/$person.dna" ] || "$venv/bin/risorius" sample build --person "$person" \
    --texture-size 512 "$out/$person.dna"
done
step "Blender: one action on eighteen faces"
fresh_blender
shown "$out/blender.log" limited 28800 "$python" "$project/packaging/films/cast.py" -- \
  --extension "$zip" --out "$out" --face "${faces[@]}"
step "film"
rate=12 crf=26 end_film 1 cast.mp4
tell cast.mp4 cast.blend
