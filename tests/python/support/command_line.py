# SPDX-License-Identifier: MIT
"""Runs the command line inside this process, because a new process starts slowly."""

from __future__ import annotations

import contextlib
import io
import subprocess
import sys
import warnings
from unittest import mock

from risorius.cli import main


def run(*arguments: object, stdin: bytes = b"", text: bool = False) -> subprocess.CompletedProcess:
    """Run a command as a terminal would.

    Args:
        arguments: words after "risorius".
        stdin: the bytes of the standard input.
        text: True: outputs are strings; False: bytes.

    Returns:
        The same as subprocess.run. An exception that main does not catch passes through.
    """
    words = [str(argument) for argument in arguments]
    read, out, error = io.BytesIO(stdin), io.BytesIO(), io.BytesIO()
    with (
        mock.patch.object(sys, "stdin", io.TextIOWrapper(read, encoding="utf-8")),
        mock.patch.object(sys, "stdout", io.TextIOWrapper(out, encoding="utf-8")) as typed,
        mock.patch.object(sys, "stderr", io.TextIOWrapper(error, encoding="utf-8")) as said,
        warnings.catch_warnings(),
    ):
        warnings.simplefilter("default")  # pytest collects warnings, a process prints them
        warnings.showwarning = _print_warning
        try:
            code = main(words)
        except SystemExit as end:
            code = end.code
        for stream in (typed, said):
            stream.flush()
    outputs = (out.getvalue(), error.getvalue())
    if text:
        outputs = tuple(output.decode("utf-8") for output in outputs)
    return subprocess.CompletedProcess(words, int(code or 0), *outputs)


def _print_warning(message, category, filename, lineno, _file=None, line=None):
    with contextlib.suppress(OSError):
        sys.stderr.write(warnings.formatwarning(message, category, filename, lineno, line))
