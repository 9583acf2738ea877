#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# candidate.sh: runs release.sh --trial with the version of pyproject.toml and the wheels of build/wheels.
# The result is for tests and must not be published.
set -euo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
version=$(sed -nE 's/^version = "([^"]+)"$/\1/p' "$here/../pyproject.toml" | head -n 1)
exec "$here/release.sh" "$version" --trial
