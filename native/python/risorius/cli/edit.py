# SPDX-License-Identifier: MIT
"""risorius edit: a DNA file made into another one."""

from __future__ import annotations

import argparse

from . import edit_regroup


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    edit = subparsers.add_parser("edit", help="make a DNA file into another one")
    kinds = edit.add_subparsers(dest="kind", required=True)
    edit_regroup.add_parser(kinds)
