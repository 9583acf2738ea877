# SPDX-License-Identifier: MIT
# Sourced by demo.sh, performance.sh, monologue.sh, physics.sh and cast.sh: what comes before and after each film. Sets: out, zip.
source "$(dirname "${BASH_SOURCE[0]}")/../setup.sh"

# begin_film NAME: the folder build/NAME, and what is built from nothing
begin_film() {
  out="$project/build/$1"
  mkdir -p "$out"
  step "tools" && install_packages && make_venv
  step "wheel" && build_wheel
  step "extension"
  zip=$(build_extension)
}
# fresh_blender: Blender without anything that was installed before
fresh_blender() {
  export BLENDER_USER_RESOURCES="$out/blender-user"
  rm -rf "$BLENDER_USER_RESOURCES"
}
# end_film FIRST_FRAME FILM [SOUND]: the rendered frames as a film
end_film() {
  local sound=()
  [ $# -lt 3 ] || sound=(-i "$3" -c:a aac -b:a 96k)
  ffmpeg -y -loglevel error -framerate "${rate:-24}" -start_number "$1" -i "$out/frames/frame_%04d.png" "${sound[@]}" \
    -c:v libx264 -crf "${crf:-20}" -pix_fmt yuv420p -movflags +faststart "$out/$2"
}
# tell FILE...: how long it took, and what to look at
tell() {
  step ""
  echo
  echo "$((SECONDS - _begin)) s in all. Look at:"
  for file; do echo "  $out/$file"; done
}
