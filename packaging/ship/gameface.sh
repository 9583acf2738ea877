#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# gameface.sh [TAKE.csv]: what `risorius export` makes of the sample person, in three.js (npm) in Debian's
# chromium and under Khronos' gltf-validator (npm): see gameface/check.py. Without a take of Live Link Face,
# or ../shared/data/real, its part says NOT RUN. Prints rows `row<TAB>name<TAB>passed<TAB>failed`; exit code
# 0 only if nothing failed.
set -uo pipefail
source "$(dirname "$0")/../setup.sh"
source "$project/packaging/check/works.sh"

out="$project/build/gameface"
logs="$project/build/logs/gameface"
here="$project/packaging/ship/gameface"
take="${1:-$project/../shared/data/real/livelink/rom_134s.csv}"
face="$project/build/sample/man.dna"

get_tools() {
  mkdir -p "$out" && cp "$here"/package*.json "$here/validate.mjs" "$here/page.html" \
    "$project/native/python/risorius/gameface/combinations.js" "$out/" &&
    (cd "$out" && npm ci --silent --no-audit --no-fund) || return 1
  [ -e "$face" ] || { face="$out/sample.dna" && "$project/.venv/bin/risorius" sample build "$face"; }
}

mkdir -p "$logs"
step "tools"
works "game face, tools" tools get_tools || exit 1
[ -e "$face" ] || face="$out/sample.dna"
step "chromium"
[ -e "$take" ] && set -- "$take" || set --
works "game face in three.js, targets and sums" check "$python" "$here/check.py" "$out" "$face" "$@"
cat "$logs/check.log"
step "gltf-validator"
works "game face, gltf-validator" validator node "$out/validate.mjs" "$out"/*.glb
cat "$logs/validator.log"
step ""
[ $failed -eq 0 ]
