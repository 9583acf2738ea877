#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# mutants.sh PART [--under PATH...] [--count N] [--seed N] [--list] [--programs] [--survivors]: mutation tests.
# Plants small random faults into copies of the sources, and checks for each whether a test fails. PART is
# native, package or scene. The last line gives the counts. tests/mutants/survivors.md lists the mutants that
# survived the last run, with the reasons.
set -uo pipefail
source "$(dirname "$0")/../setup.sh"
make_venv || exit 1
tool="$project/build/mutants/tool"
[ -d "$tool" ] || "$python" -m pip install -q --no-deps --target "$tool" \
  -r "$project/tests/mutants/requirements.txt" || exit 1
PYTHONPATH="$tool" exec nice "$python" "$project/tests/mutants/mutants.py" "$@"
