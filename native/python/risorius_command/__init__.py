# SPDX-License-Identifier: MIT
"""The program `risorius`: it handles Ctrl-C before the package and NumPy are imported.

The import takes half a second or more, and Ctrl-C during this time would print a traceback. The
program is a separate package, because any import of `risorius` first runs its `__init__.py`, which
imports NumPy.
"""

from __future__ import annotations

import os
import signal
import sys


def main() -> int:
    """Runs the command line of `risorius`. Returns: the exit code."""
    hears = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if hears:  # otherwise the parent process asked to ignore Ctrl-C
        signal.signal(signal.SIGINT, _end)
    from risorius.cli import main as command

    if hears:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    code = command()
    if hears:  # the work is done: ignore an interrupt while Python ends
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    return code


def _end(_number: int, _frame: object) -> None:
    os.write(sys.stderr.fileno(), b"risorius: interrupted\n")
    os._exit(130)
