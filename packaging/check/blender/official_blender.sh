#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# official_blender.sh: installs the libraries that Blender needs on Debian, and runs official_blender.py. Other
# systems need no libraries, because Blender contains them. Needs Python 3.11 or newer.
#
#   official_blender.sh VERSION EXTENSIONS [--program PROGRAM] [-- PYTEST ARGUMENTS]
set -euo pipefail
source "$(dirname "$0")/../../setup.sh"
if [ "$(uname -s)" = Linux ] && [ "$(id -u)" = 0 ]; then
  install_packages python3-pip ca-certificates
fi
run=python3
command -v $run > /dev/null || run=python # Windows
exec $run "$project/packaging/check/blender/official_blender.py" "$@"
