# SPDX-License-Identifier: MIT
"""risorius plot: draws a rig as pictures, in HTML or PNG."""

from __future__ import annotations

import argparse
from pathlib import Path

import risorius

from ...files import fileio
from ..files import (
    CommandLineError,
    InputError,
    read_bytes,
    require_suffix,
    require_writable,
    whole_number,
)

_NEEDS = "plot draws with Matplotlib, which is not installed: pip install risorius[plot]"


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = subparsers.add_parser(
        "plot",
        help="the rig as pictures",
        description="Draws the face with its joints, the joint matrix, the levels of detail and "
        "the sizes of the layers: a page that needs nothing but itself, or one sheet.",
    )
    parser.add_argument("file", type=Path)
    parser.add_argument(
        "-o", "--out", type=Path, required=True, metavar="OUT", help="page.html or picture.png"
    )
    parser.add_argument(
        "--lod",
        type=whole_number(0, 65_535),
        default=0,
        metavar="N",
        help="of the face (default 0)",
    )
    parser.add_argument(
        "--dpi", type=whole_number(40, 600), default=150, help="of the images, 40 to 600"
    )
    parser.add_argument("--title", help="in place of the character's name")
    parser.set_defaults(func=run)


def complain(args: argparse.Namespace) -> None:
    """Check the options before the file is opened. Raises: CommandLineError; InputError if the
    output cannot be written."""
    require_suffix(args.out, (".html", ".png"), "-o")
    require_writable(args.out)


def run(args: argparse.Namespace) -> int:
    complain(args)
    try:
        from ...plot import page, sheet
    except ImportError as error:
        if (error.name or "").partition(".")[0] != "matplotlib":
            raise
        raise InputError(_NEEDS) from error
    from ...plot.content.facts import gather

    data = read_bytes(str(args.file))
    dna = risorius.load(data)
    if not 0 <= args.lod < max(1, dna.lod_count):
        last = max(1, dna.lod_count) - 1
        raise CommandLineError(f"--lod: 0 to {last} was expected, found {args.lod}")
    facts = gather(dna, data, args.file.name, args.title)
    kind = page if args.out.suffix.lower() == ".html" else sheet
    fileio.write_bytes(args.out, kind.render(facts, args.lod, args.dpi))
    print(f"{args.out}: {args.out.stat().st_size / 1e6:.1f} MB")
    return 0
