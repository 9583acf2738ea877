# SPDX-License-Identifier: MIT
"""Does the installed package work on this machine? Prints a report to send back.

    python selftest.py [FACE.dna]

The checks are those of the wheel, `python -m risorius.selftest`; this file only says in one
sentence what to do where the wheel cannot even be imported. Exit code 0 only if all is well.
"""

import sys
import sysconfig


def main() -> int:
    """Run the wheel's own checks."""
    try:
        from risorius.selftest.__main__ import main as checks
    except ImportError as error:
        print(
            f"FAIL the package risorius cannot be imported by Python {sys.version.split()[0]}, "
            f"{sysconfig.get_platform()}: {error}. Install the wheel made for this Python "
            "and this system."
        )
        return 1
    return checks()


if __name__ == "__main__":
    sys.exit(main())
