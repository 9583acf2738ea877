#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# faults.sh [GROUP...] [--rounds N] [--seed N]: tests the installed wheel with decompression bombs, flipped
# bits, kills, interrupts, full disks, read-only folders, parallel processes and mutated inputs of all
# commands. The groups are bombs flips kills interrupts disks folders pairs mutations. Prints a row for each
# trial. A trial prints NOT RUN if it needs root or a missing package. Exit code 0 only without a fault.
set -uo pipefail
source "$(dirname "$0")/../setup.sh"
exec "$python" "$project/tests/faults/faults.py" "$@"
