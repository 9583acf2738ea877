# SPDX-License-Identifier: MIT
"""risorius eval CLIP DNA -o OUT: evaluates a face for every frame of a clip."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from risorius import importing
from risorius.baking.bake import DEFAULT_PARTS, bake
from risorius.baking.clips import load_performance
from risorius.baking.face import PARTS, load_face, prepared
from risorius.baking.progress import Progress
from risorius.base.errors import ArgumentError
from risorius.base.given import finite_text, shown, whole_text
from risorius.files import fileio

from ..base.words import counted
from .files import CommandLineError, refuse_same_file, require_writable

OPTIONS = ("mapping", "rate", "frames", "what", "quaternions", "compress")
SUFFIXES = {".npz": "npz", ".csv": "csv"}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options for CLIP DNA -o OUT, except --lod and --json."""
    group = parser.add_argument_group("every frame of a clip: CLIP DNA -o OUT")
    group.add_argument(
        "-o",
        dest="out",
        type=Path,
        metavar="OUT",
        help="OUT.npz: joints, blend_shapes, animated_maps, controls as float32[frames, ...] with "
        "names, times in seconds and units; OUT.csv: a row per frame with its time and the "
        "numbers that leave rest in some frame",
    )
    group.add_argument(
        "--mapping",
        metavar="NAME|FILE.toml",
        help="mapping of the clip's curves to raw controls (default: the best fit; .rzc: none)",
    )
    group.add_argument("--rate", metavar="R", help="resample to R frames per second first")
    group.add_argument(
        "--frames",
        metavar="A:B",
        help="only frames A to B - 1, counted from 0 after --rate; A: and :B go to the ends",
    )
    group.add_argument(
        "--what",
        metavar="LIST",
        help=f"parts to write: {','.join(PARTS)} (default {','.join(DEFAULT_PARTS)})",
    )
    group.add_argument(
        "--quaternions", action="store_true", help="joint rotations as qx qy qz qw, not as angles"
    )
    group.add_argument(
        "--compress", action="store_true", help="a smaller .npz, written several times slower"
    )


def parse_frames(text: str) -> tuple[int | None, int | None]:
    """Parse a frame range "A:B" to (A, B); an empty side gives None. Raises: ValueError."""
    first, colon, end = text.partition(":")
    if not colon:
        raise ArgumentError(f"A:B was expected, e.g. 0:240, found {shown(text)}")
    begin = whole_text(first, 0) if first else None
    last = whole_text(end, 0) if end else None
    if last is not None and (begin or 0) >= last:
        raise ArgumentError(f"A:B with A below B was expected, found {shown(text)}")
    return begin, last


def parse_parts(texts: list[str]) -> tuple[str, ...]:
    """Check the names of the pose parts that are to be written, and sort them in the order joints,
    shapes, maps, controls.

    Raises: ValueError: a part is unknown or repeated, or no part is named.
    """
    for text in texts:
        if text not in PARTS:
            raise ArgumentError(f"some of {', '.join(PARTS)} were expected, found {text!r}")
    if not texts or len(set(texts)) != len(texts):
        raise ArgumentError(f"some of {', '.join(PARTS)} were expected, each once")
    return tuple(part for part in PARTS if part in texts)


def parse_rate(text: str) -> float:
    """Parse a rate in frames per second. Raises: ValueError."""
    return finite_text(text, 0.01, 1e6)


def _option(name: str, parse: Any, text: str | None, default: Any) -> Any:
    if text is None:
        return default
    try:
        return parse(text)
    except ValueError as error:
        raise CommandLineError(f"--{name}: {error}") from None


def _target(args: argparse.Namespace) -> tuple[str, Path]:
    """Kind and path of the output file. Raises: CommandLineError: invalid options."""
    kind = SUFFIXES.get(args.out.suffix.lower())
    if kind is None:
        raise CommandLineError(f"-o: a name ending in .npz or .csv was expected, found {args.out}")
    if args.compress and kind != "npz":
        raise CommandLineError("--compress is only for .npz output")
    if len(args.controls) != 1:
        raise CommandLineError(
            f"-o writes the frames of a clip: CLIP DNA were expected, found {args.file} and "
            f"{counted(len(args.controls), 'more operand')}"
        )
    for source in (str(args.file), args.controls[0]):
        refuse_same_file(source, str(args.out))
    return kind, args.out


def page(facts: dict[str, Any]) -> str:
    """The facts about an evaluated clip as one line of text."""
    move = f"{facts['largest_move']:.4g} {facts['translation_unit']}"
    joint = facts["largest_move_joint"]
    where = f" ({joint}, frame {facts['largest_move_frame']})" if joint else ""
    return (
        f"{facts['output']}: {counted(facts['frames'], 'frame')}, {facts['seconds']:.3f} s; "
        f"largest joint move {move}{where}; {facts['correctives_fired']:,} of "
        f"{counted(facts['correctives'], 'corrective')} at work"
    )


def complaints(facts: dict[str, Any]) -> list[str]:
    """Warnings about the clip on this character, one sentence each."""
    out = []
    for key, kind, what in (
        ("unmapped_curves", "curve", "of the clip that is no control and not mapped"),
        ("missing_controls", "control", "of the clip that the character does not have"),
        ("out_of_range", "control", "outside 0 to 1 in some frame"),
    ):
        names = facts[key]
        if names:
            more = f" and {len(names) - 8:,} more" if len(names) > 8 else ""
            out.append(f"{counted(len(names), kind)} {what}: {', '.join(names[:8])}{more}")
    if facts["not_finite"]:
        out.append(f"{counted(facts['not_finite'], 'value')} of the clip that is no finite number")
    if facts["ignored_layers"]:
        out.append(f"not evaluated by this version: {', '.join(facts['ignored_layers'])}")
    return out


def run(args: argparse.Namespace) -> int:
    """Evaluate a clip on a face and write the result. Raises: CommandLineError."""
    rate = _option("rate", parse_rate, args.rate, None)
    frames = _option("frames", parse_frames, args.frames, (None, None))
    parts = _option("what", lambda text: parse_parts(text.split(",")), args.what, DEFAULT_PARTS)
    _option("mapping", importing.load_mapping, args.mapping, None)
    kind, out = _target(args)
    require_writable(out, parents=True)
    face = load_face(Path(args.controls[0]), quaternions=args.quaternions)
    performance = load_performance(args.file, face, args.mapping)
    clip = prepared(performance.clip, face, rate, frames)
    try:
        face.check_lod(args.lod)
    except ArgumentError as error:
        raise CommandLineError(f"--lod: {error}") from None
    progress = Progress(clip.frame_count, "frames")
    facts = bake(
        clip, face, args.lod, {kind: out}, parts=parts, compress=args.compress, threads=0,
        progress=lambda done: progress.update(done, done),
    )  # fmt: skip
    fileio.sweep([out.parent])
    progress.close()
    facts["mapping"] = performance.mapping
    facts["unmapped_curves"] = list(performance.unmapped)
    facts["output"] = str(out)
    for text in complaints(facts):
        print(f"risorius: {text}", file=sys.stderr)
    print(json.dumps(facts, indent=2) if args.json else page(facts))
    return 0
