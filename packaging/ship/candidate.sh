#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# candidate.sh: what release.sh makes of a version, from a tree that is not released yet: the version is that
# of pyproject.toml, the wheels are those of build/wheels. It is there to be tried, not to be published.
set -euo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
version=$(sed -nE 's/^version = "([^"]+)"$/\1/p' "$here/../pyproject.toml" | head -n 1)
exec "$here/release.sh" "$version" --trial
