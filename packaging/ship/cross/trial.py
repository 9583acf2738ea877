# SPDX-License-Identifier: MIT
"""Runs the self-test of the installed wheel in this Python, and prints the result in one line."""

import platform
import sys

import risorius
from risorius import selftest
from risorius.selftest.checks import scalar_hash


def main() -> int:
    rows = selftest.run()
    if selftest.failed(rows):
        print(selftest.text(rows))
        return 1
    system = " ".join(filter(None, [sys.platform, *platform.libc_ver()]))
    about = f"{len(rows)} checks of its own, scalar {scalar_hash()[:16]}"
    print(f"Python {platform.python_version()}, {system}; {risorius.available_simd()}; {about}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
