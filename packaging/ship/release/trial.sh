#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# trial.sh: tests a release as a user does, in real Blender programs with windows. It installs an older
# release from a repository, adds a face, updates with the face open, restarts, disables and removes the
# extension. It also tries faults: a truncated file, files for another system or Python, an unreachable
# repository, and two installed copies. A local server serves the release; no other network is used.
# Writes pictures of the screen below OUT for visual inspection. Prints rows
# `row<TAB>name<TAB>passed<TAB>failed`; exit code 0 only if nothing failed. Needs Xvfb, xdotool and
# ImageMagick; a chroot needs its own ImageMagick.
#
#   release/trial.sh RELEASE OUT BLENDER...   RELEASE: build/release/VERSION made by release.sh; OUT: a
#                                             folder below /tmp; BLENDER: programs that
#                                             packaging/check/blender/blenders.sh printed
set -uo pipefail
[ $# -ge 3 ] || { echo "trial.sh: trial.sh RELEASE OUT BLENDER..." >&2 && exit 2; }
source "$(dirname "$0")/../../setup.sh"
here="$project/packaging/ship/release"
release=$(realpath "$1")
top=$(realpath -m "$2")
shift 2
version=$(basename "$release")
zip="$release/risorius-$version-linux-x64.zip"
cd /tmp || exit 1 # a program in a chroot sees /tmp, but may not see the project
before=0.0.1
export DISPLAY=:${TRIAL_DISPLAY:-77}
port=${TRIAL_PORT:-8177}
failed=0

row() { # row NAME GOOD(0 or 1)
  [ "$2" -eq 1 ] || failed=1
  printf 'row\t%s\t%d\t%d\n' "$1" "$2" $((1 - $2))
}
repository() { # repository FOLDER ZIP...
  "$python" "$here/make.py" repository "$@" || exit 1
}
prepare() { # makes the older release, a truncated zip, and the zips for other systems and Pythons
  mkdir -p "$top/before" "$out/faults" "$out/twice"
  cp "$here/trial.py" "$out/"
  "$python" "$here/older.py" "$zip" "$before" "$top/before" > /dev/null &&
    repository "$served/risorius" "$top/before"/*.zip &&
    repository "$served/risorius-cut" "$zip" || exit 1
  truncate -s 900000 "$served/risorius-cut/$(basename "$zip")"
  for other in windows-x64 macos-arm64; do
    [ ! -e "$release/risorius-$version-$other.zip" ] || cp "$release/risorius-$version-$other.zip" "$out/faults/"
  done
  "$python" "$project/packaging/ship/build_extension.py" --out "$top/python" \
    --wheels "$release/risorius-$version-cp311-cp311-"*linux*.whl > /dev/null &&
    mv "$top/python/risorius-$version.zip" "$out/faults/other-python.zip" || exit 1
  head -c 900000 "$zip" > "$out/faults/cut-short.zip"
  cp "$zip" "$out/twice/"
}
in_blender() { # in_blender STEP,STEP,...: runs steps of trial.py in Blender with a window in Xvfb
  BLENDER_USER_RESOURCES="$user" HOME="$user/home" RISORIUS_CACHE="$user/home/cache" limited 1800 \
    "$blender" --window-geometry 0 0 1280 800 -noaudio --python "$out/trial.py" -- \
    "$1" "$out" "http://127.0.0.1:$port/risorius/index.json" > "$out/$1.log" 2>&1
}
in_blender_without_window() { # runs a step that needs no window in Blender's background mode
  BLENDER_USER_RESOURCES="$user" HOME="$user/home" limited 900 "$blender" --background -noaudio \
    --python "$out/trial.py" -- "$1" "$out" none > "$out/$1.log" 2>&1
}
# command_of_blender NAME ARGUMENT...: runs Blender's command `extension`. Appends NAME, the number of
# installed copies of Risorius and Blender's messages to faults.tsv
command_of_blender() {
  local name=$1 said
  shift
  said=$(BLENDER_USER_RESOURCES="$user" HOME="$user/home" limited 900 "$blender" --online-mode \
    --command extension "$@" 2>&1 | grep -iE 'error|warn|incompatible|not |fail' | grep -vE 'mounted|blender[._]org' | head -n 3 |
    sed "s|$top[^\" ]*/||g;s|$user[^\" ]*/||g" | paste -sd ' ')
  printf '%s\t%s\t%s\n' "$name" "$(ls -d "$user"/extensions/{user_default,cut,gone}/risorius 2> /dev/null | wc -l)" \
    "$said" >> "$out/faults.tsv"
  rm -rf "$user"/extensions/{user_default,cut,gone}/risorius # so that the next fault starts without a copy
}
make_faults() {
  local file url="http://127.0.0.1:$port"
  for file in "$out"/faults/*.zip; do
    command_of_blender "$(basename "$file")" install-file -e -r user_default "$file"
  done
  command_of_blender "-" repo-add --url "$url/risorius-cut/index.json" cut
  command_of_blender "a download that is cut short" install --sync cut.risorius
  command_of_blender "-" repo-remove cut
  command_of_blender "-" repo-add --url "http://127.0.0.1:9/index.json" gone
  command_of_blender "a repository that is gone" sync
  command_of_blender "-" repo-remove gone
  rm -rf "$user"/extensions/{cut,gone} # because Blender keeps the truncated download in its cache
}
left_behind() { find "$user" -iname '*risorius*' -not -path '*/home/*' | grep -v __pycache__ || true; }

for blender; do
  name=$(limited 120 "$blender" --version 2> /dev/null | grep -oE '^Blender [0-9.]+' | head -n 1)
  [ -n "$name" ] || { row "$blender starts" 0 && continue; }
  out="$top/${name// /-}" served="$top/served"
  rm -rf "$out" "$served"
  mkdir -p "$out" "$served"
  user=$(mktemp -d /tmp/trial.XXXXXX)
  mkdir -p "$user/home"
  prepare
  Xvfb "$DISPLAY" -screen 0 1280x800x24 > "$out/xvfb.log" 2>&1 &
  x=$!
  # Without a window manager, newer Blenders open their preferences partly above the screen.
  while sleep 1; do xdotool search --name Preferences windowmove 190 70; done > /dev/null 2>&1 &
  mover=$!
  python3 -m http.server "$port" --bind 127.0.0.1 --directory "$served" > "$out/server.log" 2>&1 &
  server=$!
  trap 'kill $x $server $mover 2> /dev/null' EXIT
  in_blender install
  repository "$served/risorius" "$zip"
  in_blender update
  make_faults
  in_blender after,twice,remove
  in_blender_without_window look
  left_behind > "$out/left.txt"
  kill $x $server $mover 2> /dev/null
  wait $x $server $mover 2> /dev/null
  trap - EXIT
  while IFS=$'\t' read -r check good; do row "$name: $check" "$good"; done \
    < <("$python" "$here/trial_results.py" "$out" "$before" "$version")
  rm -rf "$user"
done
[ $failed -eq 0 ]
