# SPDX-License-Identifier: MIT
"""The command line. Exit codes: 0 done, 1 the input is bad, 2 the command line is bad."""

from __future__ import annotations

import argparse
import io
import sys
from collections.abc import Sequence

from . import DnaError, __version__
from .commands import batch, bench, check, clip, convert, edit, info, live, plot, sample, speech
from .commands import eval as evaluate


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command. Args: the arguments, else those of the process. Returns: the exit code."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # names need not be text that a terminal can show
            stream.reconfigure(errors="backslashreplace")
    parser = argparse.ArgumentParser(prog="risorius", description="Face rigs from DNA files.")
    parser.add_argument("--version", action="version", version=__version__)
    subparsers = parser.add_subparsers(dest="command", required=True)
    commands = (
        info,
        check,
        convert,
        evaluate,
        sample,
        plot,
        bench,
        edit,
        clip,
        speech,
        live,
        batch,
    )
    for command in commands:
        command.add_parser(subparsers)
    args, rest = parser.parse_known_args(arguments)
    # argparse ends a list of operands at the first option: FILE --json NAME=1.
    operands: list[str] | None = getattr(args, "controls", getattr(args, "files", None))
    if any(text.startswith("-") for text in rest) or (rest and operands is None):
        parser.error(f"unrecognized arguments: {' '.join(rest)}")
    if operands is not None:
        operands += rest
    try:
        return int(args.func(args))
    except DnaError as error:
        print(f"risorius: {error}", file=sys.stderr)
        return 1
    except BrokenPipeError:
        return 0
