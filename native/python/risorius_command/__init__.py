# SPDX-License-Identifier: MIT
"""The program `risorius`: answers Ctrl-C before the package and NumPy are there.

They take half a second and more to import, in which Python itself would answer with a traceback. A
package of its own, as no line of `risorius` runs before `risorius/__init__.py` imports them.
"""

from __future__ import annotations

import os
import signal
import sys


def main() -> int:
    """Run a command. Returns: the exit code."""
    hears = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if hears:  # else whoever started it asked for no answer
        signal.signal(signal.SIGINT, _end)
    from risorius.cli import main as command

    if hears:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    code = command()
    if hears:  # the work is done: an interrupt while Python ends changes nothing any more
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    return code


def _end(_number: int, _frame: object) -> None:
    os.write(sys.stderr.fileno(), b"risorius: interrupted\n")
    os._exit(130)
