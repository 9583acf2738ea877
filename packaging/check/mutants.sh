#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# mutants.sh PART [--under PATH...] [--count N] [--seed N] [--list] [--programs] [--survivors]: small
# faults, drawn by a seed, in copies of the sources; which of them does a test see? PART is native,
# package or scene. The last line counts them. What lived at the last run, and why, is in
# tests/mutants/survivors.md.
set -uo pipefail
source "$(dirname "$0")/../setup.sh"
make_venv || exit 1
tool="$project/build/mutants/tool"
[ -d "$tool" ] || "$python" -m pip install -q --no-deps --target "$tool" \
  -r "$project/tests/mutants/requirements.txt" || exit 1
PYTHONPATH="$tool" exec nice "$python" "$project/tests/mutants/mutants.py" "$@"
