#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Renders the demo's acting with a scarf and a lock of hair that Blender simulates. The film shows that a
# simulation gets the face of the simulated frame. Leaves a film and the .blend in build/physics.
set -euo pipefail
source "$(dirname "$0")/film.sh"

begin_film physics
step "sample person" && "$venv/bin/risorius" sample build "$out/sample.dna"
step "Blender: act, simulate, render"
fresh_blender
shown "$out/blender.log" limited 14400 "$python" "$project/packaging/films/physics.py" -- \
  --extension "$zip" --dna "$out/sample.dna" --out "$out"
step "film"
end_film 1 physics.mp4
tell physics.mp4 physics.blend
