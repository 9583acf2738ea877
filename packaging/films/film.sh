# SPDX-License-Identifier: MIT
# Sourced by demo.sh, performance.sh, monologue.sh, physics.sh and cast.sh. Defines the steps that all
# films share. Sets: out (folder of the film), zip (path of the extension).
source "$(dirname "${BASH_SOURCE[0]}")/../setup.sh"

# begin_film NAME: makes the folder build/NAME, installs the tools, builds the wheel and the extension
begin_film() {
  out="$project/build/$1"
  mkdir -p "$out"
  step "tools" && install_packages && make_venv
  step "wheel" && build_wheel
  step "extension"
  zip=$(build_extension)
}
# fresh_blender: gives Blender an empty folder for settings and extensions
fresh_blender() {
  export BLENDER_USER_RESOURCES="$out/blender-user"
  rm -rf "$BLENDER_USER_RESOURCES"
}
# end_film FIRST_FRAME FILM [SOUND]: encodes the frames of $out/frames, at $rate (default 24) per second
end_film() {
  local sound=()
  [ $# -lt 3 ] || sound=(-i "$3" -c:a aac -b:a 96k)
  ffmpeg -y -loglevel error -framerate "${rate:-24}" -start_number "$1" -i "$out/frames/frame_%04d.png" "${sound[@]}" \
    -c:v libx264 -crf "${crf:-20}" -pix_fmt yuv420p -movflags +faststart "$out/$2"
}
# tell FILE...: prints the total time and the paths of the results
tell() {
  step ""
  echo
  echo "$((SECONDS - _begin)) s in all. Look at:"
  for file; do echo "  $out/$file"; done
}
