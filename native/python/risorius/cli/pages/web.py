# SPDX-License-Identifier: MIT
"""risorius web: writes a face as a page for any browser."""

from __future__ import annotations

import argparse
from pathlib import Path

import risorius

from ...baking.clips import load_performance
from ...baking.face import load_face, prepared
from ...base.given import GivenError, shown, whole_text
from ...files import fileio
from ...web import find_looks, render, render_script
from ...web.page import SOUNDS, empty_page
from ..files import CommandLineError, InputError, read_bytes, require_suffix, require_writable


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = subparsers.add_parser(
        "web",
        help="write the face as a web page",
        description="Writes one page that opens in a browser without a network: the face with "
        "sliders, LODs and a clip, evaluated by the library itself.",
    )
    parser.add_argument("file", type=Path, help="the DNA file; textures next to it are included")
    parser.add_argument(
        "-o",
        "--out",
        type=Path,
        metavar="PAGE.html",
        help="default: FILE.html; FACE.js: a script that shows <risorius-face> on your own page",
    )
    parser.add_argument(
        "--clip",
        type=Path,
        metavar="TAKE",
        help="animation to play: .rzc, or any file that eval reads",
    )
    parser.add_argument("--sound", type=Path, metavar="VOICE.wav", help="the voice of the clip")
    parser.add_argument(
        "--lods",
        metavar="A:B",
        help="LODs to keep: 0:2, or 1: for all except the finest",
    )
    parser.add_argument("--title", help="title instead of the character's name")
    parser.set_defaults(func=run)


_LAST_LOD = 65535  # limit of the format


def _lods(text: str | None) -> tuple[int, int] | None:
    if text is None:
        return None
    first, colon, last = text.partition(":")
    try:
        if text in ("", ":"):
            raise GivenError(f"found {shown(text)}")
        finest = whole_text(first or "0", 0, _LAST_LOD)
        coarsest = whole_text(last, finest, _LAST_LOD) if last else _LAST_LOD
    except GivenError as error:
        raise CommandLineError(f"--lods: two levels as in 0:2 were expected: {error}") from None
    return finest, coarsest if colon else finest


def run(args: argparse.Namespace) -> int:
    out = args.out or args.file.with_suffix(".html")
    require_suffix(out, (".html", ".htm", ".js"), "-o")
    require_writable(out)
    if args.sound is not None:
        if args.clip is None:
            raise CommandLineError("--sound: it goes with a clip: add --clip TAKE")
        require_suffix(args.sound, SOUNDS, "--sound")
    lods = _lods(args.lods)
    empty_page()  # a build without the page fails here, before it reads the file
    dna = risorius.load(args.file, lods=lods)
    clip = None
    if args.clip is not None:
        face = load_face(args.file)
        clip = load_performance(args.clip, face).clip
        clip = prepared(clip, face, None if clip.times is None else clip.rate)
    sound = None
    if args.sound is not None:
        sound = (read_bytes(str(args.sound)), args.sound.suffix, 0.0)
    title = args.title or dna.name or args.file.stem
    looks = find_looks(dna, args.file)
    try:
        if out.suffix.lower() == ".js":
            page = render_script(dna, out.stem, looks=looks, clip=clip, sound=sound)
        else:
            page = render(dna, title, looks=looks, clip=clip, sound=sound)
    except risorius.RisoriusError as error:
        raise InputError(f"{args.file}: {error}") from error
    fileio.write_bytes(out, page)
    print(f"{out}: {len(page) / 1e6:.1f} MB")
    return 0
