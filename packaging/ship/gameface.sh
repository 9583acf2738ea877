#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# gameface.sh [TAKE.csv [VOICE.wav]]: exports the sample person with `risorius export`, and tests the files
# in three.js, three-vrm and TalkingHead (npm) in Debian's chromium, with Khronos' gltf-validator (npm) and
# with a VRM reader for Blender (bpy-vrm-format, PyPI): see gameface/check*.py. TAKE.csv is a take of Live
# Link Face; VOICE.wav needs a transcript VOICE.txt. By default both come from ../shared/data/real; if a
# file is missing, its part prints NOT RUN. Prints rows `row<TAB>name<TAB>passed<TAB>failed`; exit code 0
# only if nothing failed.
set -uo pipefail
source "$(dirname "$0")/../setup.sh"
source "$project/packaging/check/works.sh"

out="$project/build/gameface"
logs="$project/build/logs/gameface"
here="$project/packaging/ship/gameface"
take="${1:-$project/../shared/data/real/livelink/rom_134s.csv}"
voice="${2:-$project/../shared/data/real/speech/austen-0870.wav}"
face="$project/build/sample/man.dna"
reader=bpy-vrm-format==4.10.2

get_tools() {
  mkdir -p "$out" && cp "$here"/package*.json "$here"/*.mjs "$here"/*.html "$here/places.js" \
    "$project/native/python/risorius/gameface/combinations.js" "$out/" &&
    (cd "$out" && npm ci --silent --no-audit --no-fund) || return 1
  [ -e "$face" ] || { face="$out/sample.dna" && "$project/.venv/bin/risorius" sample build "$face"; }
}

mkdir -p "$logs"
step "tools"
works "game face, tools" tools get_tools || exit 1
[ -e "$face" ] || face="$out/sample.dna"
step "chromium"
rm -f "$out/targets.tsv"
set --
[ -e "$take" ] && set -- "$take"
[ -e "$take" ] && [ -e "$voice" ] && set -- "$take" "$voice"
works "game face in three.js, targets and sums" check "$python" "$here/check.py" "$out" "$face" "$@"
cat "$logs/check.log"
works "game face in three-vrm" vrm "$python" "$here/check_vrm.py" "$out" "$face" "$@"
cat "$logs/vrm.log"
works "game face in TalkingHead" talk "$python" "$here/check_talk.py" "$out" "$face" "$@"
cat "$logs/talk.log"
works "game face on a body, in three-vrm" body "$python" "$here/check_body.py" "$out" "$face"
cat "$logs/body.log"
step "VRM in Blender"
if "$python" -c "import bpy, os; os._exit(0)" 2>/dev/null; then
  "$python" -m pip install -q --no-deps --target "$out/reader" "$reader" >"$logs/reader.log" 2>&1
  works "game face, VRM in Blender" blender "$python" "$here/in_blender.py" "$out/reader" \
    "$out/new.vrm" "$out/old.vrm" "$out/body_new.vrm" "$out/body_old.vrm"
  grep "expressions" "$logs/blender.log"
else
  echo "NOT RUN: no bpy"
fi
step "gltf-validator"
works "game face, gltf-validator" validator node "$out/validate.mjs" "$out"/*.glb "$out"/*.vrm
cat "$logs/validator.log"
step ""
[ $failed -eq 0 ]
