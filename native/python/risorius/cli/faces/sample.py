# SPDX-License-Identifier: MIT
"""risorius sample: the command of the wheel with the sample people, or an error without it."""

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
    """Add a command that only raises the error about the missing wheel."""

    def say(_args: argparse.Namespace) -> int:
        raise missing

    sample = subparsers.add_parser("sample", help="free sample people (not installed)")
    sample.add_argument("rest", nargs=argparse.REMAINDER, help=argparse.SUPPRESS)
    sample.set_defaults(func=say)
