# SPDX-License-Identifier: MIT
"""risorius sample: runs the command of the sample people's wheel, if it is installed."""

from __future__ import annotations

import argparse

from ...people import NoPeopleError, people


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    try:
        command = people("command")
    except NoPeopleError as missing:
        _add_sentence(subparsers, missing)
    else:
        command.add_parser(subparsers)


def _add_sentence(
    subparsers: argparse._SubParsersAction[argparse.ArgumentParser], missing: NoPeopleError
) -> None:
    """Add a `sample` command that only reports the missing wheel."""

    def say(_args: argparse.Namespace) -> int:
        raise missing

    sample = subparsers.add_parser("sample", help="free sample people (not installed)")
    sample.add_argument("rest", nargs=argparse.REMAINDER, help=argparse.SUPPRESS)
    sample.set_defaults(func=say)
