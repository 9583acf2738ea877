# SPDX-License-Identifier: MIT
"""python -m risorius.selftest [FACE.dna]: prints the report; exits with 0 if all checks pass."""

import sys

from . import failed, run, text


def main() -> int:
    """Runs the checks; a face named as argument is used for the timing."""
    rows = run(sys.argv[1] if len(sys.argv) > 1 else None)
    print(text(rows))
    return 1 if failed(rows) else 0


if __name__ == "__main__":
    sys.exit(main())
