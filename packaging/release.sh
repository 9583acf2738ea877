#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# release.sh: makes all published files of a version in build/release/VERSION: the page of
# `risorius web` (web.sh), wheels and sdist (wheels.sh), one extension for each platform and one for all
# platforms, a repository of extensions with a page, an SBOM, notes and checksums. Requires a clean tree
# whose HEAD has the tag vVERSION. Uploads and signs nothing. Downloads the data of the sample face
# (48 MB) the first time.
#
#   RISORIUS_PEOPLE="man woman ..." adds these sample people, each as a zip of its own
#
#   RISORIUS_SITE=https://... is the address of the documentation, for Blender's Online Manual
#   release.sh VERSION [--trial]   VERSION: 1.2.3, or its tag v1.2.3; --trial: go on if the tree may not
#                                  be released, print the reasons, and use the wheels already built
set -euo pipefail
source "$(dirname "$0")/setup.sh"
version=${1:-}
version=${version#v}
trial=${2:-}
if [ -z "$version" ] || { [ -n "$trial" ] && [ "$trial" != --trial ]; }; then
  echo "release.sh: release.sh VERSION [--trial]" >&2 && exit 2
fi
cd "$project"
make="packaging/ship/release/make.py"
out="$project/build/release/$version"

# shellcheck disable=SC2086
checked() { "$python" $make check "$version" >&2 || { [ -n "$trial" ] && echo "A trial: not to be published." >&2; }; }
gather_wheels() { # sets `wheels` and `sdist`: wheels.sh builds them; a trial uses those in build/wheels or build/dist
  shopt -s nullglob
  if [ -z "$trial" ]; then
    packaging/ship/web.sh # before the wheels, because they contain its page
    rm -rf "$project/build/wheels"
    packaging/ship/wheels.sh
  fi
  wheels=("$project"/build/wheels/risorius-"$version"-*.whl)
  [ ${#wheels[@]} -gt 0 ] || { [ -n "$trial" ] && wheels=("$project"/build/dist/risorius-"$version"-*.whl); }
  sdist=("$project"/build/wheels/risorius-"$version".tar*)
  shopt -u nullglob
  [ ${#wheels[@]} -gt 0 ] || { echo "release.sh: there is no wheel of $version" >&2 && return 1; }
}

step "may it be released"
install_packages && make_venv
checked
step "wheels"
compgen -G "$project/build/dist/risorius-$version-cp311-*.whl" > /dev/null || build_wheel
gather_wheels
step "sample face" # built with the released wheels, because the venv may have an older wheel
released=$(printf '%s\n' "${wheels[@]}" | grep -- '-cp311-cp311-.*linux.*x86_64' | head -n 1)
build_people_wheel "$(dirname "$released")"
people=("$(dirname "$released")/risorius_people-$version"-*.whl)
"$python" -m pip install -q --no-deps --force-reinstall "$released" "${people[@]}"
sample=$(sample_face)
step "extensions and their repository"
rm -rf "$out" && mkdir -p "$out"
cp "${wheels[@]}" "${people[@]}" "${sdist[@]}" "$out"
for person in ${RISORIUS_PEOPLE:-}; do
  mkdir "$out/$person"
  "$venv/bin/risorius" sample build "$out/$person/$person.dna" --person "$person"
  (cd "$out" && "$python" -m zipfile -c "risorius-$person-$version.zip" "$person" && rm -r "$person")
done
mapfile -t zips < <("$python" $make zips "$out" --wheels "${wheels[@]}" --sample "$sample" \
  --website "${RISORIUS_SITE:-}")
[ ${#zips[@]} -gt 1 ]
"$python" $make repository "$out/repository" "${zips[@]:1}"
step "SBOM, notes, checksums"
tools="$project/build/venv-release"
[ -e "$tools/.made" ] || { python3.11 -m venv "$tools" &&
  "$tools/bin/python" -m pip install -q -r packaging/ship/release/requirements.txt && touch "$tools/.made"; }
"$tools/bin/python" packaging/ship/release/sbom.py "$version" "$out" > "$out/risorius-$version.cdx.json"
"$python" $make notes "$version" > "$out/NOTES.md"
"$python" $make sums "$out"
step ""
ls -l "$out" "$out/repository" | awk 'NF > 8 { print $5, $9 }'
echo "$out"
