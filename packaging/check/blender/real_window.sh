#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# real_window.sh: tests the user interface with a real pointer. Starts Blender programs under Xvfb with the
# installed extension, and moves the pointer over the empty tab, sliders, layers, See Why and the import
# dialog. Compares pixels to see whether the face moved, and takes pictures below OUT. Prints rows
# `row<TAB>name<TAB>passed<TAB>failed`; exit code 0 only if nothing failed. If Xvfb, xdotool, ImageMagick or a
# program is missing, prints a line `say<TAB>NOT RUN: ...`. Takes minutes for each program on two cores,
# because it waits for states instead of fixed times.
#
#   ./packaging/check/blender/real_window.sh OUT BLENDER...     OUT: a folder below /tmp or the project; BLENDER:
#                                            programs that packaging/check/blender/blenders.sh printed
#       STEPS=slider,... runs some steps only; ZIP= names the extension; WINDOW_DISPLAY= another display;
#       DOCS=1 replaces the pictures of docs/images by those of the first program (STEPS=start,shot,board
#       makes them)
set -uo pipefail
[ $# -ge 2 ] || { echo "real_window.sh: real_window.sh OUT BLENDER..." >&2 && exit 2; }
source "$(dirname "$0")/../../setup.sh"
top=$(realpath -m "$1")
shift
for tool in Xvfb xdotool import; do
  command -v "$tool" > /dev/null && continue
  printf 'say\tNOT RUN: the real window, %s is not installed\n' "$tool"
  exit 0
done
zip=${ZIP:-$(ls "$project"/build/dist/risorius-*.zip 2> /dev/null | head -n 1)}
[ -e "$zip" ] || { printf 'say\tNOT RUN: the real window, there is no extension in build/dist\n' && exit 0; }
export DISPLAY=:${WINDOW_DISPLAY:-78}
failed=0

drive() { # drive BLENDER NAME: runs all steps in one program
  local blender=$1 out="$top/${2// /-}" user packages x
  rm -rf "$out" && mkdir -p "$out"
  user=$(mktemp -d /tmp/window.XXXXXX)
  # A program in a chroot sees /tmp, but may not see the project.
  cp "$zip" "$project/packaging/check/blender/window/inside.py" "$user/"
  espeak-ng -w "$user/voice.wav" "My father bought five big maps of Rome" 2> /dev/null || rm -f "$user/voice.wav"
  cd "$user" || return 1
  export BLENDER_USER_RESOURCES="$user" HOME="$user"
  limited 600 "$blender" --command extension install-file -r user_default -e "$user/$(basename "$zip")" > "$out/install.log" 2>&1 ||
    { printf 'row\t%s: the extension is installed\t0\t1\n' "$2" && return 1; }
  # The folder into which the extension's own button installs PocketSphinx. All wheels are unpacked; each
  # Blender loads the library for its Python.
  packages=$user/extensions/.user/user_default/risorius/packages
  for x in "$project"/build/speech/pocketsphinx-*.whl; do
    [ ! -e "$x" ] || { mkdir -p "$packages" && unzip -q -o "$x" -d "$packages"; }
  done
  unzip -q -o -j "$zip" 'sample/man.dna' -d "$user" 2> /dev/null || cp "$project/build/sample/man.dna" "$user/"
  Xvfb "$DISPLAY" -screen 0 1440x900x24 > "$out/xvfb.log" 2>&1 &
  x=$!
  trap 'kill $x 2> /dev/null' EXIT
  limited 3000 "$python" "$project/packaging/check/blender/window/drive.py" "$out" "$user" "${STEPS:-}" "$blender" \
    2> "$out/drive.log" | sed -u "s/^row\t/row\t$2: /"
  local code=${PIPESTATUS[0]}
  kill $x 2> /dev/null
  wait $x 2> /dev/null
  trap - EXIT
  cd /tmp && rm -rf "$user"
  return "$code"
}

# Rows: picture of OUT, picture of docs/images, width of the latter in pixels.
pictures="first-face first_look 1366
board-smirk board_primary 1366
animator-drag animator_drag 1080
animator-expressions animator_expressions 1080
animator-shot animator_shot 1080
landmarks anyhead_landmarks 1080"
put_pictures() { # put_pictures FOLDER
  local from to width
  while read -r from to width; do
    [ ! -e "$1/$from.png" ] || convert "$1/$from.png" -resize "$width" -quality 88 "$project/docs/images/$to.jpg"
  done <<< "$pictures"
}

cd /tmp || exit 1
for blender; do
  name=$(limited 120 "$blender" --version 2> /dev/null | grep -oE '^Blender [0-9.]+' | head -n 1)
  if [ -z "$name" ]; then
    printf 'say\tNOT RUN: the real window of %s, which does not start\n' "$blender"
    continue
  fi
  drive "$blender" "$name" || failed=1
  [ -z "${DOCS:-}" ] || put_pictures "$top/${name// /-}"
  DOCS=
done
[ $failed -eq 0 ]
