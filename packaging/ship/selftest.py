# SPDX-License-Identifier: MIT
"""Checks whether the installed package works on this machine. Prints a report to send back.

    python selftest.py [FACE.dna]

Runs the checks of the wheel, `python -m risorius.selftest`. If the wheel cannot be imported, this
file prints one sentence with the cause and the remedy. Exit code 0 only if all checks pass.
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
