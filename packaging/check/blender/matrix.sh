#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Runs all Blender tests in every supported Blender, and prints a Markdown table: a column for each version, a
# row for each test file. The versions are the bpy modules 4.2.0, newest 4.2 LTS, 4.5 LTS and 5.0, and the
# programs made by packaging/check/blender/blenders.sh. Each installs the same zip and also tests EEVEE. Takes
# about 4 minutes for each version. Then real_window.sh tests the programs with a real pointer. Exit code 0
# only if all tests passed in all versions.
#
#   ./packaging/check/blender/matrix.sh [PREFIX] [-- PYTEST ARGUMENTS]
#       PREFIX as given to blenders.sh; BLENDER= names one more program, BPY= other bpy versions
set -uo pipefail
prefix=/opt/risorius-blender
if [ $# -gt 0 ] && [ "$1" != -- ]; then
  prefix=$1
  shift
fi
[ "${1:-}" = -- ] && shift
source "$(dirname "$0")/../../setup.sh"
cd "$project" || exit 1
install_packages >&2 && make_venv >&2 || exit 1
compgen -G "$project/build/dist/risorius-*-cp311-*.whl" > /dev/null || build_wheel >&2 || exit 1
zip=$(build_extension) || exit 1
export RISORIUS_TEST_EEVEE=${RISORIUS_TEST_EEVEE-1}
logs="$project/build/logs/matrix"
mkdir -p "$logs"
reports=()

run() { # run NAME KEY COMMAND...: runs the tests in one Blender with a new user folder
  local name=$1 key=$2 user begin=$SECONDS
  shift 2
  rm -f "$logs/$key.xml"
  user=$(mktemp -d)
  # glibc overwrites freed memory, so that code that reads it crashes reliably.
  MALLOC_PERTURB_=165 BLENDER_USER_RESOURCES="$user" limited 1800 "$@" --extension "$zip" \
    --junitxml "$logs/$key.xml" "${arguments[@]}" > "$logs/$key.log" 2>&1
  local code=$?
  rm -rf "$user"
  echo "$name: exit code $code, $((SECONDS - begin)) s" >&2
  [ "$code" -eq 0 ] || tail -n 15 "$logs/$key.log" >&2
  reports+=("$name=$logs/$key.xml")
}
arguments=("$@") windows=()

for version in ${BPY-4.2.0 4.2.23 4.5.15 5.0.1}; do
  if venv_python=$(bpy_venv "$version"); then
    run "bpy $version" "bpy-$version" "$venv_python" blender_tests/run.py --
  else
    echo "bpy $version: cannot be fetched" >&2
    reports+=("bpy $version=missing")
  fi
done
for program in "$prefix-trixie/blender.sh" "$prefix-sid/blender.sh" ${BLENDER:-}; do
  version=$(limited 60 "$program" --version 2> /dev/null |
    grep -oE '^Blender [0-9.]+' | head -n 1)
  if [ -z "$version" ]; then
    echo "$program does not start (packaging/check/blender/blenders.sh makes it)" >&2
    reports+=("$program=missing")
    continue
  fi
  windows+=("$program")
  run "$version" "$(echo "$version" | tr ' ' -)" "$program" -b --factory-startup -noaudio \
    --python-exit-code 1 --python blender_tests/run.py --
done
"$python" packaging/check/blender/matrix_table.py "${reports[@]}" | tee "$logs/table.md"
code=${PIPESTATUS[0]}
# Tests with a real pointer in the windows. Their pictures are in $logs/window.
if [ ${#windows[@]} -gt 0 ] && [ ${#arguments[@]} -eq 0 ]; then
  ZIP="$zip" packaging/check/blender/real_window.sh "$logs/window" "${windows[@]}" | tee "$logs/window.tsv"
  [ "${PIPESTATUS[0]}" -eq 0 ] || code=1
fi
exit "$code"
