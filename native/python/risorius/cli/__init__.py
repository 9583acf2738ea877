# SPDX-License-Identifier: MIT
"""The command line. This module prints the error that ends a command, as one sentence on the
standard error.

Exit codes: 0 success; 1 bad input, or a command found errors, differences, failed jobs or missing
controls and reported them; 2 bad command line; 130 interrupted.
"""

from __future__ import annotations

import argparse
import contextlib
import errno
import io
import os
import sys
from collections.abc import Sequence
from typing import NoReturn

import numpy as np

from .. import __version__
from ..base.errors import RisoriusError, sentence
from . import (
    batch,
    bench,
    check,
    clip,
    convert,
    edit,
    info,
    live,
    speech,
)
from . import eval as evaluate
from .faces import author, mix, sample, solve
from .files import CommandLineError
from .pages import export, plot, web
from .terminal import obeyed_by_nobody

INTERRUPTED = 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command. Returns the exit code.

    Args: arguments  words of the command line; None: the words with which the program was started.
    """
    for stream in (sys.stdout, sys.stderr):
        # Prints characters that the terminal's encoding lacks as escapes, without an exception.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    # The calculation modules check the range of values themselves; NumPy's warnings would name a
    # line of our code and no file.
    with obeyed_by_nobody(), np.errstate(all="ignore"):
        return _run(arguments)


def _run(arguments: Sequence[str] | None) -> int:
    try:
        args = parse(arguments)
        code = int(args.func(args))
        sys.stdout.flush()
    except BrokenPipeError:  # the reader of the pipe has closed it
        _drop_output()
        return 0
    except KeyboardInterrupt as interrupt:
        return _say(str(interrupt) or "interrupted", INTERRUPTED)
    except (RisoriusError, OSError, MemoryError) as error:
        place = ""
        if isinstance(error, OSError) and error.filename is None and error.errno == errno.ENOSPC:
            place = "<stdout>: "  # other errors already contain the name of their file
            _drop_output()
        return _say(place + sentence(error), 2 if isinstance(error, CommandLineError) else 1)
    return code


def _say(text: str, code: int) -> int:
    with contextlib.suppress(OSError):  # the standard error may be closed
        print(f"risorius: {text}", file=sys.stderr, flush=True)
    return code


def _drop_output() -> None:
    """Discard buffered output, because flushing it at exit would fail and print a second error."""
    with contextlib.suppress(OSError, ValueError):  # sys.stdout may have no file descriptor
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


class _Parser(argparse.ArgumentParser):
    """A parser that raises CommandLineError for invalid option values; `main` prints the error."""

    def error(self, message: str) -> NoReturn:
        if message.startswith("argument "):
            raise CommandLineError(message.removeprefix("argument "))
        super().error(message)


def parse(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """Parse the command line; `func` of the result is the function of the command.

    Raises:
        CommandLineError: an option has an invalid value.
        SystemExit: the command line as a whole is invalid, or it asks for help or the version; the
            text was printed.
    """
    parser = _Parser(prog="risorius", description="Face rigs from DNA files.")
    parser.add_argument("--version", action="version", version=__version__)
    subparsers = parser.add_subparsers(dest="command", required=True)
    commands = (
        info,
        check,
        convert,
        evaluate,
        sample,
        plot,
        web,
        export,
        bench,
        edit,
        author,
        mix,
        clip,
        speech,
        solve,
        live,
        batch,
    )
    for command in commands:
        command.add_parser(subparsers)
    args, rest = parser.parse_known_args(arguments)
    # argparse ends a list of operands at the first option, so NAME=1 after --json is added here.
    operands: list[str] | None = getattr(args, "controls", getattr(args, "files", None))
    if any(text.startswith("-") for text in rest) or (rest and operands is None):
        parser.error(f"unrecognized arguments: {' '.join(rest)}")
    if operands is not None:
        operands += rest
    return args
