#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# faults.sh [GROUP...] [--rounds N] [--seed N]: bombs, flipped bits, kills, interrupts, full disks,
# folders that cannot be written, several processes at once and mutants of every command's inputs,
# against the installed wheel. The groups are bombs flips kills interrupts disks folders pairs
# mutations. Prints a row for each trial; what needs root or a package that is not there says NOT RUN.
# Exit code 0 only if there was no fault.
set -uo pipefail
source "$(dirname "$0")/../setup.sh"
exec "$python" "$project/tests/faults/faults.py" "$@"
