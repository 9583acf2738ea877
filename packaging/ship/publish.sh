#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# publish.sh: makes a draft release on GitHub from the output of release.sh, with the notes as its text:
# wheels, sdist, extensions, the repository of extensions as one archive, SBOM and checksums. A person must
# check and publish the draft. Needs `gh` and its GH_TOKEN.
#
#   publish.sh TAG [--dry-run]    TAG: v1.2.3; --dry-run checks the files and prints the command
set -euo pipefail
tag=${1:-}
project=$(cd "$(dirname "$0")/../.." && pwd)
if ! [[ "$tag" =~ ^v[0-9]+\.[0-9]+\.[0-9]+$ ]] || { [ $# -gt 1 ] && [ "$2" != --dry-run ]; }; then
  echo "publish.sh: publish.sh vVERSION [--dry-run]" >&2 && exit 2
fi
version=${tag#v}
cd "$project/build/release/$version" || { echo "publish.sh: packaging/release.sh $version comes first" >&2 && exit 1; }
sha256sum --check --quiet --strict SHA256SUMS
tar -czf "risorius-$version-repository.tar.gz" repository
files=(risorius-"$version"*.whl risorius-"$version"*.zip risorius-"$version"*.tar.gz risorius-"$version".cdx.json SHA256SUMS)
command=(gh release create "$tag" --draft --verify-tag --title "Risorius $version" --notes-file NOTES.md "${files[@]}")
if [ $# -gt 1 ]; then
  printf '%q ' "${command[@]}" && echo
else
  "${command[@]}"
fi
