#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# hooks.sh: makes .venv if it is missing, and installs the hooks of .pre-commit-config.yaml into this clone, so
# that git commit runs the checks of style.sh. The hooks download nothing, because they use the tools of .venv.
#
#   hooks.sh            installs the hooks
#   hooks.sh --all      runs all hooks on all files, like the workflow; first installs missing Debian packages
set -euo pipefail
source "$(dirname "$0")/../setup.sh"
cd "$project"
case "${1:-}" in
  "" | --all) ;;
  *) echo "hooks.sh: $1 is not --all" >&2 && exit 2 ;;
esac
wanted="$project/packaging/check/hooks_requirements.txt"
[ "${1:-}" != --all ] || install_packages
make_venv
stamp="$venv/.hooks-$(sha256sum "$wanted" | cut -c1-16)"
[ -e "$stamp" ] || { "$python" -m pip install -q --no-compile -r "$wanted" && touch "$stamp"; }
if [ "${1:-}" = --all ]; then
  "$python" -m pre_commit run --all-files --show-diff-on-failure
else
  "$python" -m pre_commit install
fi
